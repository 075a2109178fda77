//! Why the controller refuses a parameter.

/// Why a set of parameters is refused. A name that begins with `controller.` is a path in robot.toml, and its values have
/// the unit that the name ends with; any other is a field of [`Parameters`](crate::Parameters), in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterError {
    /// Not a finite number.
    NonFinite {
        /// The parameter.
        name: &'static str,
    },
    /// Must be greater than zero.
    NonPositive {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f32,
    },
    /// Must lie within bounds.
    OutOfRange {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f32,
        /// Lowest allowed value.
        low: f32,
        /// Highest allowed value.
        high: f32,
    },
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NonFinite { name } => write!(f, "{name} must be a finite number"),
            Self::NonPositive { name, value } => write!(f, "{name} must be positive, not {value}"),
            Self::OutOfRange { name, value, low, high } => {
                write!(f, "{name} must be from {low} to {high}, not {value}")
            }
        }
    }
}

impl core::error::Error for ParameterError {}
