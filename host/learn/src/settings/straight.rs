//! `[straight]`.

use serde::{Deserialize, Serialize};
use tasks::{Definition, Task};

use super::super::LearnError;
use super::{key, positive};

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
    /// Share of the robot file's spreads from which the robots are drawn that steer.
    pub randomize: f64,
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
            randomize: 1.0,
        }
    }
}

impl Straightness {
    /// Checks what the environments do not.
    ///
    /// # Errors
    /// The key that is out of its range, with what is expected.
    pub fn check(&self) -> Result<(), LearnError> {
        key("straight.held", !self.held.is_empty() && !self.held.contains(&0), "one whole number above 0 or more")?;
        key("straight.starts", self.starts > 0, "a whole number above 0")?;
        positive("straight.frequency_hz", self.frequency_hz)?;
        positive("straight.lookahead_m", self.lookahead_m)?;
        positive("straight.distance_m", self.distance_m)?;
        positive("straight.patience_s", self.patience_s)
    }
}
