//! Settings of MuJoCo by MuJoCo's own words.

use clap::ValueEnum;

/// Method of integration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Integrator {
    /// Semi-implicit Euler, joint damping implicit.
    #[value(name = "Euler")]
    Euler,
    /// Implicit in every velocity.
    #[value(name = "implicit")]
    Implicit,
    /// Implicit in every velocity but Coriolis' and the centrifugal forces'.
    #[value(name = "implicitfast")]
    ImplicitFast,
    /// Runge and Kutta's of order four.
    #[value(name = "RK4")]
    RungeKutta,
}

/// Friction cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Cone {
    /// Four-sided: faster.
    #[value(name = "pyramidal")]
    Pyramidal,
    /// Elliptic cone: Coulomb's law.
    #[value(name = "elliptic")]
    Elliptic,
}

/// What solves the contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Solver {
    /// Projected Gauss–Seidel.
    #[value(name = "PGS")]
    ProjectedGaussSeidel,
    /// Conjugate gradient.
    #[value(name = "CG")]
    ConjugateGradient,
    /// Newton's method.
    #[value(name = "Newton")]
    Newton,
}

/// MuJoCo's word for a setting.
pub(super) fn word(setting: impl ValueEnum) -> String {
    setting.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}
