//! The learning file: what is to be learned and how, learn.toml.

mod design;
mod maze;
mod straight;
mod terrain;
mod turn;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tasks::{DriveKind, Part};

use super::Hyperparameters;

pub use design::DesignSettings;
pub use maze::MazeSettings;
pub use straight::Straightness;
pub use terrain::TerrainSettings;
pub use turn::Turning;

/// Which way to turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Counter-clockwise seen from above.
    Left,
    /// Clockwise.
    Right,
}

impl Direction {
    /// 1 for counter-clockwise, −1 for clockwise.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }

    /// `left` or `right`.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// A part of what is observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Observed {
    /// [`Part::Pose`], the thesis's.
    Pose,
    /// [`Part::Velocity`].
    Velocity,
    /// [`Part::Shaft`].
    Shaft,
}

impl From<Observed> for Part {
    fn from(observed: Observed) -> Self {
        match observed {
            Observed::Pose => Self::Pose,
            Observed::Velocity => Self::Velocity,
            Observed::Shaft => Self::Shaft,
        }
    }
}

/// What turns the eccentric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Drive {
    /// [`DriveKind::Exact`], the thesis's.
    Exact,
    /// [`DriveKind::Motor`].
    Motor,
}

impl From<Drive> for DriveKind {
    fn from(drive: Drive) -> Self {
        match drive {
            Drive::Exact => Self::Exact,
            Drive::Motor => Self::Motor,
        }
    }
}

/// A learning file. What it does not say has the thesis's value, or where the thesis is silent one that was chosen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Turning in place.
    pub turn: Turning,
    /// Walking straight.
    pub straight: Straightness,
    /// Finding the way through a maze.
    pub maze: MazeSettings,
    /// Walking over slopes, steps and patches.
    pub terrain: TerrainSettings,
    /// Which robot turns and walks best.
    pub design: DesignSettings,
    /// The hyperparameters of proximal policy optimisation.
    pub ppo: Hyperparameters,
}

fn key(name: &'static str, is_right: bool, expected: &str) -> Result<(), super::LearnError> {
    if is_right {
        return Ok(());
    }
    Err(super::LearnError::Setting { name, expected: expected.to_owned() })
}

fn positive(name: &'static str, value: f64) -> Result<(), super::LearnError> {
    key(name, value.is_finite() && value > 0.0, "a number above 0")
}

/// Why a learning file is not read.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SettingsError {
    /// It cannot be read.
    #[error("{path}: {cause}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's words.
        cause: std::io::Error,
    },
    /// It is not what it should be.
    #[error("{path}: {message}")]
    #[diagnostic(help("docs/learning.md lists every key; what is left out has its default"))]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, key and what is wrong.
        message: String,
    },
}

impl Settings {
    /// Reads a learning file.
    ///
    /// # Errors
    /// It cannot be read, or has a key that does not exist or a value of another kind: with file and line.
    pub fn load(path: &Path) -> Result<Self, SettingsError> {
        let text =
            std::fs::read_to_string(path).map_err(|cause| SettingsError::Read { path: path.to_owned(), cause })?;
        toml::from_str(&text).map_err(|error| SettingsError::Parse {
            path: path.to_owned(),
            message: error.to_string().trim_end().to_owned(),
        })
    }

    /// As a learning file.
    #[must_use]
    pub fn text(&self) -> String {
        // Numbers and lists of numbers: there is nothing that cannot be written.
        toml::to_string(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use tasks::Task;

    use super::*;

    fn load(text: &str) -> Result<Settings, String> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("learn.toml");
        std::fs::write(&path, text).unwrap();
        Settings::load(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_left_out_is_the_thesis_s() {
        let settings = load("[turn]\nk_pos = 50.0\n").unwrap();
        assert_eq!(settings, Settings { turn: Turning { k_pos: 50.0, ..Turning::default() }, ..Settings::default() });
        let Hyperparameters { learning_rate, steps, batch_size, discount, gae_lambda, .. } = settings.ppo;
        assert_eq!((learning_rate, steps, batch_size, discount, gae_lambda), (3e-4, 2048, 64, 0.99, 0.95));
        assert_eq!(load(&settings.text()).unwrap(), settings);
    }

    #[test]
    fn the_example_differs_from_the_thesis_in_observation_and_entropy_alone() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/learn-turn.toml");
        let Settings { turn, ppo, .. } = Settings::load(path.as_ref()).unwrap();
        assert_eq!(turn.observe, [Observed::Pose, Observed::Velocity, Observed::Shaft]);
        assert_eq!(ppo.entropy_coefficient, 0.01);
        let thesis = Turning { observe: vec![Observed::Pose], ..turn };
        let table = Hyperparameters { entropy_coefficient: 0.2, ..ppo };
        assert_eq!((thesis, table), Default::default());
    }

    #[test]
    fn the_example_with_a_motor_describes_environments() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/learn-turn-motor.toml");
        let definition = Settings::load(path.as_ref()).unwrap().turn.definition(Direction::Right);
        definition.check().unwrap();
        // Every swing has its mirror image: neither direction is favoured.
        let known = &definition.oscillations_deg;
        assert!(known.iter().all(|[from, to]| known.contains(&[-to, -from])), "{known:?}");
    }

    #[test]
    fn turning_is_what_it_is_in_gymnasium() {
        let task = Task::Turn(tasks::Turn::default());
        assert_eq!(Turning::default().definition(Direction::Left), tasks::Definition::new(task));
    }

    #[test]
    fn a_key_that_does_not_exist_is_named_with_its_line() {
        let error = load("[turn]\nk_pos = 50.0\n[ppo]\nlearning_speed = 1\n").unwrap_err();
        assert!(error.contains("line 4") && error.contains("learning_speed"), "{error}");
    }

    #[test]
    fn to_the_right_is_clockwise() {
        let desired = |direction| match Turning::default().definition(direction).task {
            Task::Turn(turn) => turn.desired_rad_per_s,
            _ => unreachable!("it turns"),
        };
        assert!(desired(Direction::Left) > 0.0);
        assert_eq!(desired(Direction::Right), -desired(Direction::Left));
    }
}
