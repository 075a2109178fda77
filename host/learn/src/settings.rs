//! The learning file: what is to be learned and how, learn.toml.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tasks::{Definition, Maze, Part, Task, Turn, thesis_frequencies_hz};

use super::Hyperparameters;

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
    /// The hyperparameters of proximal policy optimisation.
    pub ppo: Hyperparameters,
}

/// What turning in place is (thesis 5.3.2), and how long it is learned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Turning {
    /// Size of ω_desired of (5.5), degrees a second.
    pub rate_deg_per_s: f64,
    /// k_rot of (5.5), s².
    pub k_rot: f64,
    /// k_pos of (5.5), 1/m².
    pub k_pos: f64,
    /// The actions, Hz, clockwise positive.
    pub frequencies_hz: Vec<f64>,
    /// What is observed: `pose`, `velocity`, `shaft`, in this order.
    pub observe: Vec<Observed>,
    /// Δt, s.
    pub interval_s: f64,
    /// Length of an episode, s.
    pub episode_s: f64,
    /// α of the robot, degrees; the robot file's own where it is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha_deg: Option<f64>,
    /// Share of the robot file's spreads from which every episode's robot is drawn: 0 is the file's robot.
    pub randomize: f64,
    /// Robots that act side by side.
    pub environments: usize,
    /// Updates of the policy.
    pub updates: usize,
}

impl Default for Turning {
    fn default() -> Self {
        let task = Turn::default();
        let definition = Definition::new(Task::Turn(task));
        Self {
            rate_deg_per_s: task.desired_rad_per_s.abs().to_degrees(),
            k_rot: task.k_rot,
            k_pos: task.k_pos,
            frequencies_hz: thesis_frequencies_hz(),
            observe: vec![Observed::Pose],
            interval_s: definition.interval_s,
            episode_s: definition.episode_s,
            alpha_deg: definition.alpha_deg,
            randomize: definition.randomization.share,
            environments: 16,
            updates: 150,
        }
    }
}

/// How walking straight is searched for (thesis (5.3) with ±F), and judged. The thesis gives none of these numbers but F's range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Straightness {
    /// F, Hz.
    pub frequency_hz: f64,
    /// Between two decisions, s: t₁ and t₂ are multiples of it.
    pub interval_s: f64,
    /// Intervals for which a frequency is held, of which every pair is tried.
    pub held: Vec<usize>,
    /// How long every pair is tried, s.
    pub episode_s: f64,
    /// Episodes of every pair; they differ by the angle of the shaft at their start.
    pub starts: usize,
    /// α of the robot, degrees; the robot file's own where it is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha_deg: Option<f64>,
    /// A robot that sees its pose steers to the point of the line that is so far ahead, m.
    pub lookahead_m: f64,
    /// It has to walk so far, m.
    pub distance_m: f64,
    /// In so much time, s.
    pub patience_s: f64,
}

impl Default for Straightness {
    fn default() -> Self {
        Self {
            frequency_hz: 7.0,
            interval_s: 0.1,
            held: vec![1, 2, 3, 5, 8, 13, 21, 34],
            episode_s: 20.0,
            starts: 4,
            alpha_deg: Definition::new(Task::Straight(tasks::Straight::default())).alpha_deg,
            lookahead_m: 0.015,
            distance_m: 0.2,
            patience_s: 600.0,
        }
    }
}

/// How a robot goes through a maze (thesis 5.3.3, Fig. 5.5). The thesis gives none of these numbers but F's range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MazeSettings {
    /// F, Hz: +F turns to one side, −F to the other.
    pub frequency_hz: f64,
    /// Between two decisions, s.
    pub interval_s: f64,
    /// It steers to the point of the way that is so far ahead, m.
    pub lookahead_m: f64,
    /// It has so much time, s.
    pub patience_s: f64,
    /// Edge of the maze's square cells, m.
    pub cell_m: f64,
    /// Cells of a maze drawn at random, along x and along y.
    pub size: [usize; 2],
    /// α of the robot, degrees; the robot file's own where it is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha_deg: Option<f64>,
    /// Share of the file's spreads from which robots are drawn.
    pub randomize: f64,
}

impl Default for MazeSettings {
    fn default() -> Self {
        Self {
            frequency_hz: 8.0,
            interval_s: 0.5,
            lookahead_m: 0.08,
            patience_s: 900.0,
            cell_m: Maze::CELL_M,
            size: [4, 4],
            alpha_deg: Some(90.0),
            randomize: 1.0,
        }
    }
}

impl MazeSettings {
    /// Checks what the environments do not.
    ///
    /// # Errors
    /// The key that is out of its range, with what is expected.
    pub fn check(&self) -> Result<(), super::LearnError> {
        positive("maze.frequency_hz", self.frequency_hz)?;
        positive("maze.lookahead_m", self.lookahead_m)?;
        positive("maze.patience_s", self.patience_s)?;
        positive("maze.cell_m", self.cell_m)?;
        let cells = self.size[0].saturating_mul(self.size[1]);
        key("maze.size", cells > 1 && cells <= 10_000, "two whole numbers, of 2 to 10 000 cells")
    }
}

/// Over which terrain robots walk along a line, and how. All of it is chosen; the thesis only wishes for it (6.2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TerrainSettings {
    /// By how much the ground rises ahead, degrees.
    pub slopes_deg: Vec<f64>,
    /// By how much it is higher from `begins_m` on, m.
    pub steps_m: Vec<f64>,
    /// Share of the friction from `begins_m` on.
    pub patches: Vec<f64>,
    /// Where steps and patches begin: so far along x, m. The robot's centre starts at 0.
    pub begins_m: f64,
    /// F, Hz.
    pub frequency_hz: f64,
    /// Between two decisions, s; without its pose a robot changes between +F and −F as often.
    pub interval_s: f64,
    /// How long it walks, s.
    pub episode_s: f64,
    /// It steers to the point of the line that is so far ahead, m.
    pub lookahead_m: f64,
    /// α of the robot, degrees; the robot file's own where it is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha_deg: Option<f64>,
    /// Share of the file's spreads from which robots are drawn.
    pub randomize: f64,
}

impl Default for TerrainSettings {
    fn default() -> Self {
        Self {
            slopes_deg: vec![5.0, -5.0],
            steps_m: vec![0.0005, 0.001, -0.001],
            patches: vec![0.5],
            begins_m: 0.09,
            frequency_hz: 8.0,
            interval_s: 0.2,
            episode_s: 40.0,
            lookahead_m: 0.015,
            alpha_deg: Some(90.0),
            randomize: 1.0,
        }
    }
}

impl TerrainSettings {
    /// Checks what the environments and the robot file do not.
    ///
    /// # Errors
    /// The key that is out of its range, with what is expected.
    pub fn check(&self) -> Result<(), super::LearnError> {
        positive("terrain.frequency_hz", self.frequency_hz)?;
        positive("terrain.lookahead_m", self.lookahead_m)?;
        key("terrain.begins_m", self.begins_m.is_finite(), "a number")
    }
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

impl Straightness {
    /// Checks what the environments do not.
    ///
    /// # Errors
    /// The key that is out of its range, with what is expected.
    pub fn check(&self) -> Result<(), super::LearnError> {
        key("straight.held", !self.held.is_empty() && !self.held.contains(&0), "one whole number above 0 or more")?;
        key("straight.starts", self.starts > 0, "a whole number above 0")?;
        positive("straight.frequency_hz", self.frequency_hz)?;
        positive("straight.lookahead_m", self.lookahead_m)?;
        positive("straight.distance_m", self.distance_m)?;
        positive("straight.patience_s", self.patience_s)
    }
}

impl Turning {
    /// The environments that this describes.
    #[must_use]
    pub fn definition(&self, direction: Direction) -> Definition {
        let task = Turn {
            desired_rad_per_s: direction.sign() * self.rate_deg_per_s.to_radians(),
            k_rot: self.k_rot,
            k_pos: self.k_pos,
        };
        let mut definition = Definition {
            frequencies_hz: self.frequencies_hz.clone(),
            parts: self.observe.iter().copied().map(Part::from).collect(),
            interval_s: self.interval_s,
            episode_s: self.episode_s,
            alpha_deg: self.alpha_deg,
            ..Definition::new(Task::Turn(task))
        };
        definition.randomization.share = self.randomize;
        definition
    }
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
