//! What a robot file says to the robot.

use control::protocol::radio::NAME;
use control::{ParameterError, Parameters};
use heapless::String;
use serde::{Deserialize, Serialize};

use super::MOST_CONVERSIONS;

/// Built into the firmware from a robot file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Name from the robot file, at most 32 bytes.
    pub name: String<NAME>,
    /// Factory parameters of the controller.
    pub parameters: Parameters,
    /// Conversions of the wiper in a tick, of which the median is taken.
    pub conversions: u8,
    /// A conversion farther than this from the median is counted as an outlier, LSB.
    pub outlier_lsb: u16,
}

/// Why settings are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingsError {
    /// The controller refuses its parameters.
    Parameters(ParameterError),
    /// No conversion, or more than [`MOST_CONVERSIONS`].
    Conversions(u8),
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Parameters(error) => error.fmt(f),
            Self::Conversions(given) => write!(f, "conversions must be from 1 to {MOST_CONVERSIONS}, not {given}"),
        }
    }
}

impl core::error::Error for SettingsError {}

impl Settings {
    /// Refuses what the robot cannot run on.
    ///
    /// # Errors
    /// The first setting that is wrong.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.parameters.check().map_err(SettingsError::Parameters)?;
        match usize::from(self.conversions) {
            1..=MOST_CONVERSIONS => Ok(()),
            _ => Err(SettingsError::Conversions(self.conversions)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::string::ToString;

    #[test]
    fn what_the_robot_cannot_run_on_is_refused() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
        let robot = robot_file::robot::Robot::load(&file).expect("robot.toml is sound");
        let parameters = robot_file::design::design(&robot).expect("a controller").parameters;
        let settings = |conversions| Settings { name: String::new(), parameters, conversions, outlier_lsb: 100 };
        for conversions in [1, 64] {
            assert_eq!(settings(conversions).check(), Ok(()));
        }
        for conversions in [0, 65] {
            let error = settings(conversions).check().expect_err("refused");
            assert_eq!(error.to_string(), std::format!("conversions must be from 1 to 64, not {conversions}"));
        }
        let mut broken = settings(1);
        broken.parameters.tick = f32::NAN;
        assert!(matches!(broken.check(), Err(SettingsError::Parameters(_))));
    }
}
