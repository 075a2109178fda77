//! The figures on the body that the project promises: beside MuJoCo, beside its own limit of small steps, and against the
//! clock. `body_figures` (the binary) prints them all; `tests/tests/suite/body_small.rs` runs what is quick.

pub mod air;
pub mod backbone;
pub mod bits;
pub mod convergence;
pub mod corrected;
pub mod equal_error;
pub mod error_measures;
pub mod highest;
pub mod instructions;
pub mod mirror;
pub mod multibody;
pub mod oscillation;
pub mod own_law;
pub mod paths;
pub mod peer;
pub mod processor;
pub mod rate;
pub mod reference;
pub mod robots;
pub mod scaling;
pub mod stopwatch;
pub mod sweep;
pub mod uneven;
pub mod walking;

use std::path::PathBuf;

use robot_file::Robot;

pub use crate::row::FigureRow;
use peer::{Peer, PeerError};

/// Robot, MuJoCo and output directory of the body's campaigns.
#[derive(Debug)]
pub struct PeerSetup {
    /// Robot of `robot.toml`.
    pub robot: Robot,
    /// MuJoCo, or why it is not there.
    pub peer: Result<Peer, PeerError>,
    /// Where plots and MuJoCo's converged runs are kept.
    pub out: PathBuf,
}

impl PeerSetup {
    /// The project's `robot.toml`.
    ///
    /// # Panics
    /// When the file is not there: there is nothing to measure then.
    #[must_use]
    pub fn new(out: PathBuf) -> Self {
        let robot = Robot::load(&peer::root().join("robot.toml")).unwrap_or_else(|error| panic!("{error}"));
        // MuJoCo's scripts run elsewhere.
        let out = std::path::absolute(&out).unwrap_or(out);
        Self { robot, peer: Peer::find(), out }
    }
}

/// Campaigns that `--quick` leaves out: they take minutes, or time what an idle machine alone does well.
pub const SLOW: [&str; 12] = [
    "hundred-backbones",
    "two-robots",
    "twelve-robots",
    "same-law",
    "speeds",
    "roots",
    "corrected",
    "scaling",
    "rate",
    "equal-error",
    "sweep",
    "instructions",
];

/// One campaign: its name, and what makes its rows.
pub type Campaign = (&'static str, fn(&PeerSetup) -> Vec<FigureRow>);

/// Every campaign with its name for `--only`.
pub const CAMPAIGNS: [Campaign; 21] = [
    ("oscillation", oscillation::rows),
    ("paths", paths::rows),
    ("air", air::rows),
    ("two-backbones", backbone::quick_rows),
    ("hundred-backbones", backbone::rows),
    ("two-robots", robots::quick_rows),
    ("twelve-robots", robots::rows),
    ("law-of-the-feet", own_law::quick_rows),
    ("same-law", own_law::rows),
    ("speeds", walking::rows),
    ("roots", corrected::quick_rows),
    ("corrected", corrected::rows),
    ("mirror", mirror::rows),
    ("highest", highest::rows),
    ("convergence", convergence::rows),
    ("bits", bits::rows),
    ("scaling", scaling::rows),
    ("rate", rate::rows),
    ("equal-error", equal_error::rows),
    ("sweep", sweep::rows),
    ("instructions", instructions::rows),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_slow_is_a_campaign() {
        assert!(SLOW.iter().all(|slow| CAMPAIGNS.iter().any(|(name, _)| name == slow)));
    }
}
