//! `[turn]`.

use serde::{Deserialize, Serialize};
use tasks::{Definition, Part, Task, Turn, thesis_frequencies_hz};

use super::{Direction, Drive, Observed};

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
    /// Further actions where the motor drives: swings of the controller from one angle to the other and back, degrees.
    pub oscillations_deg: Vec<[f64; 2]>,
    /// What is observed: `pose`, `velocity`, `shaft`, in this order.
    pub observe: Vec<Observed>,
    /// What turns the eccentric: a shaft that follows its frequency exactly, or controller, motor and sensor.
    pub drive: Drive,
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
    /// What the thesis is silent about is chosen such that the file's robot learns with `examples/learn-turn.toml`: ω_desired beyond what
    /// the robot reaches, since a robot that turns also shakes about its heading, and with one within its reach standing still costs
    /// less; and Δt a fraction of a swing of the shaft by ±100°, so that the policy may end it at any angle.
    fn default() -> Self {
        let turn = Turn::default();
        let definition = Definition::new(Task::Turn(turn));
        Self {
            rate_deg_per_s: 573.0,
            k_rot: turn.k_rot,
            k_pos: turn.k_pos,
            frequencies_hz: thesis_frequencies_hz(),
            oscillations_deg: vec![],
            observe: vec![Observed::Pose],
            drive: Drive::Exact,
            interval_s: definition.interval_s,
            episode_s: definition.episode_s,
            alpha_deg: definition.alpha_deg,
            randomize: definition.randomization.share,
            environments: 16,
            updates: 150,
        }
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
            oscillations_deg: self.oscillations_deg.clone(),
            parts: self.observe.iter().copied().map(Part::from).collect(),
            drive: self.drive.into(),
            interval_s: self.interval_s,
            episode_s: self.episode_s,
            alpha_deg: self.alpha_deg,
            ..Definition::new(Task::Turn(task))
        };
        definition.randomization.share = self.randomize;
        definition
    }
}
