//! `[maze]`.

use serde::{Deserialize, Serialize};
use tasks::Maze;

use super::super::LearnError;
use super::{key, positive};

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
    pub fn check(&self) -> Result<(), LearnError> {
        positive("maze.frequency_hz", self.frequency_hz)?;
        positive("maze.lookahead_m", self.lookahead_m)?;
        positive("maze.patience_s", self.patience_s)?;
        positive("maze.cell_m", self.cell_m)?;
        let cells = self.size[0].saturating_mul(self.size[1]);
        key("maze.size", cells > 1 && cells <= 10_000, "two whole numbers, of 2 to 10 000 cells")
    }
}
