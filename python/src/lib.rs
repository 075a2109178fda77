//! The extension module `scram._scram`: the engine behind the Python package `scram`.
//!
//! Everything that Python sees is re-exported by `scram/__init__.py` and typed in `scram/_scram.pyi`.

mod bodies;
mod errors;
mod robot;

/// The engine of the package `scram`, which re-exports what is public.
#[pyo3::pymodule]
mod _scram {
    #[pymodule_export]
    use super::bodies::{Environments, environment_defaults};
    #[pymodule_export]
    use super::robot::Robot;
}
