//! Oscillation between −100° and 100°, through the blind arc on every stroke.

use control::Stroke;
use serde_json::{Value, json};
use simulation::Metrics;

use super::FigureRow;
use super::run::{DesignedRobot, for_seeds, median, run, swing, worst};

/// Length of a run, s.
pub const SECONDS: f64 = 3.0;

/// What a campaign of oscillations comes to.
#[derive(Clone, Copy, Debug)]
pub struct Turning {
    /// Runs.
    pub runs: usize,
    /// Turning points.
    pub points: usize,
    /// Fewest turning points in a run.
    pub fewest: usize,
    /// Median distance from the bound, degrees.
    pub median_deg: f64,
    /// Largest distance, degrees.
    pub worst_deg: f64,
    /// Strokes that ran away, and runs that never found the angle.
    pub ran_away: usize,
    /// Runs that ended in a fault.
    pub faults: usize,
    /// Median frequency, Hz.
    pub frequency_hz: f64,
}

impl Turning {
    /// Of runs between −100° and 100°.
    #[must_use]
    pub fn of(runs: &[Metrics]) -> Self {
        let errors = || runs.iter().flat_map(|m| m.turning_points_deg.iter().map(|point| (point.abs() - 100.0).abs()));
        Self {
            runs: runs.len(),
            points: errors().count(),
            median_deg: median(errors()),
            worst_deg: worst(errors()),
            fewest: runs.iter().map(|m| m.turning_points_deg.len()).min().unwrap_or(0),
            ran_away: runs.iter().map(|m| m.strokes_ran_away + usize::from(m.acquired_s.is_none())).sum(),
            faults: runs.iter().filter(|m| !m.faults.is_empty()).count(),
            frequency_hz: median(runs.iter().filter_map(|m| m.oscillation_frequency_hz)),
        }
    }

    /// In words.
    #[must_use]
    pub fn text(&self) -> String {
        format!(
            "median {:.2}°, worst {:.2}° of {} turning points in {} runs ({} at least in each), {} ran away, {} faults, {:.2} Hz",
            self.median_deg,
            self.worst_deg,
            self.points,
            self.runs,
            self.fewest,
            self.ran_away,
            self.faults,
            self.frequency_hz
        )
    }

    /// Within limits, nothing ran away, every run swung.
    #[must_use]
    pub fn holds(&self, median_deg: f64, worst_deg: f64) -> bool {
        self.median_deg <= median_deg
            && self.worst_deg <= worst_deg
            && self.ran_away == 0
            && self.faults == 0
            && self.fewest >= 4
    }

    /// For machines.
    #[must_use]
    pub fn numbers(&self) -> Value {
        json!({
            "runs": self.runs, "points": self.points, "fewest": self.fewest, "median_deg": self.median_deg, "worst_deg": self.worst_deg,
            "ran_away": self.ran_away, "faults": self.faults, "frequency_hz": self.frequency_hz,
        })
    }
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    let swings = |style| {
        Turning::of(&for_seeds(seeds, |seed| run(&bench.robot, &bench.parameters, seed, swing(style), SECONDS)))
    };
    let bang = swings(Stroke::BangBang);
    let proportional = swings(Stroke::Proportional);
    vec![
        FigureRow::new(
            "oscillate −100…100°: turning points, median / worst; strokes that run away",
            "2° / 8°; none",
            bang.text(),
            bang.holds(2.0, 8.0),
            bang.numbers(),
        ),
        FigureRow::beside(
            "  the same with proportional strokes on the estimate",
            proportional.text(),
            proportional.numbers(),
        ),
    ]
}
