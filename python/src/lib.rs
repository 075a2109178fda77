//! The extension module `scram._scram`: the engine behind the Python package `scram`.
//!
//! Everything that Python sees is re-exported by `scram/__init__.py` and typed in `scram/_scram.pyi`.

mod arguments;
mod batch;
mod bodies;
mod controller;
mod diagnose;
mod errors;
mod identify;
mod interrupt;
mod peer;
mod recording;
mod robot;
mod shared;
mod simulate;
mod sweep;

/// The engine of the package `scram`, which re-exports what is public.
#[pyo3::pymodule]
mod _scram {
    #[pymodule_export]
    use super::batch::simulate_batch;
    #[pymodule_export]
    use super::bodies::{Environments, environment_defaults};
    #[pymodule_export]
    use super::controller::{Actuation, Controller};
    #[pymodule_export]
    use super::diagnose::{diagnose, diagnose_walk};
    #[pymodule_export]
    use super::identify::{captured_speeds, identify_backbone, identify_motor, identify_potentiometer, identify_robot};
    #[pymodule_export]
    use super::peer::{peer_batch, peer_walk};
    #[pymodule_export]
    use super::recording::{Recording, read};
    #[pymodule_export]
    use super::robot::{Quantity, Robot};
    #[pymodule_export]
    use super::simulate::simulate;
    #[pymodule_export]
    use super::sweep::Sweep;
}
