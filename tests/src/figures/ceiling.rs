//! The highest frequency that is held, against the supply's own ceiling in closed form.

use std::f64::consts::TAU;

use robot_file::design;
use serde_json::json;
use simulation::DriveCommand;

use super::FigureRow;
use super::run::{DesignedRobot, for_seeds, frequency_error, run, worst};

/// Steps of the search, as a share of the ceiling.
const STEP: f64 = 0.0025;
/// The search goes from here …
const FROM: f64 = 0.97;
/// … to here.
const TO: f64 = 1.01;

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    let ceiling_hz = design::ceiling(&bench.robot) / TAU;
    let seeds = (seeds / 5).max(1);
    let steps = ((TO - FROM) / STEP).round() as usize;
    let mut held_hz: f64 = 0.0;
    let mut beyond = f64::NAN;
    for step in 0..=steps {
        let hz = ceiling_hz * (FROM + STEP * step as f64);
        let one = |seed: u64| {
            let sign = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
            frequency_error(&run(&bench.robot, &bench.parameters, seed, DriveCommand::Freq { hz: sign * hz }, 3.0))
        };
        let error = worst(for_seeds(seeds, one));
        if error > 1e-3 {
            beyond = error;
            break;
        }
        held_hz = hz;
    }
    let share = held_hz / ceiling_hz;
    vec![FigureRow::new(
        "highest frequency that the shaft holds, nothing but the eccentric on it (within 0.1 % in every run)",
        "99 % of the supply's ceiling",
        format!(
            "{held_hz:.2} Hz of {ceiling_hz:.2} Hz in closed form ({:.2} %), {seeds} seeds a step; the next step is {:.2} % off",
            share * 100.0,
            beyond * 100.0
        ),
        share >= 0.99,
        json!({ "held_hz": held_hz, "ceiling_hz": ceiling_hz }),
    )]
}
