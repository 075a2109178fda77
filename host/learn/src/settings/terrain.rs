//! `[terrain]`.

use serde::{Deserialize, Serialize};

use super::super::LearnError;
use super::{key, positive};

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
    pub fn check(&self) -> Result<(), LearnError> {
        positive("terrain.frequency_hz", self.frequency_hz)?;
        positive("terrain.lookahead_m", self.lookahead_m)?;
        key("terrain.begins_m", self.begins_m.is_finite(), "a number")
    }
}
