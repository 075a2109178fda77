//! Motors that differ from the file by R, K ±15 %, J ±30 %, drag ±20 %, unknown to the controller: each judged against its
//! own ceiling.

use std::f64::consts::TAU;

use control::Stroke;
use hal_sim::variation::{Spreads, draw};
use robot_file::design;
use robot_file::robot::Robot;
use serde_json::json;
use simulation::DriveCommand;

use super::FigureRow;
use super::oscillation::{SECONDS, Turning};
use super::run::{DesignedRobot, for_seeds, frequency_error, run, swing, worst};

/// A motor is asked for at most this share of its own ceiling: beyond, nothing is left to correct with.
const SHARE: f64 = 0.97;
/// Motors whose supply cannot turn them faster than this are not asked to hold a speed or to swing, Hz.
const LEAST_HZ: f64 = 1.5;

/// A specimen with its ceiling, Hz.
fn specimen(bench: &DesignedRobot, seed: u64) -> (Robot, f64) {
    let robot = draw(&bench.robot, seed, &Spreads::MISMATCHED);
    let ceiling = design::ceiling(&robot) / TAU;
    (robot, ceiling)
}

/// Those of ±6, ±7, ±8 Hz that the motor can reach, or what it just can.
fn targets(ceiling_hz: f64) -> Vec<f64> {
    let most = SHARE * ceiling_hz;
    let mut targets: Vec<f64> = [6.0, 7.0, 8.0].into_iter().filter(|hz| *hz <= most).collect();
    if targets.is_empty() {
        targets.push(most);
    }
    targets.iter().flat_map(|hz| [-hz, *hz]).collect()
}

/// Worst frequency error of a motor over its targets, and whether any ended in a fault; `None` when it cannot turn.
fn hold(bench: &DesignedRobot, seed: u64) -> Option<(f64, bool)> {
    let (robot, ceiling_hz) = specimen(bench, seed);
    if ceiling_hz < LEAST_HZ {
        return None;
    }
    let runs: Vec<_> = targets(ceiling_hz)
        .into_iter()
        .map(|hz| run(&robot, &bench.parameters, seed, DriveCommand::Freq { hz }, 2.0))
        .collect();
    Some((worst(runs.iter().map(frequency_error)), runs.iter().any(|m| !m.faults.is_empty())))
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    let held: Vec<_> = for_seeds(seeds, |seed| hold(bench, seed));
    let weak = held.iter().filter(|one| one.is_none()).count();
    let judged: Vec<_> = held.iter().flatten().collect();
    let good = judged.iter().filter(|(error, fault)| *error <= 1e-3 && !fault).count();
    let error = worst(judged.iter().map(|(error, _)| *error));
    // Of fewer than a hundred, none is forgiven.
    let needed = judged.len() - judged.len() / 100;

    let swings: Vec<_> = for_seeds(seeds, |seed| {
        let (robot, ceiling_hz) = specimen(bench, seed);
        (ceiling_hz >= LEAST_HZ).then(|| run(&robot, &bench.parameters, seed, swing(Stroke::BangBang), SECONDS))
    });
    let turning = Turning::of(&swings.into_iter().flatten().collect::<Vec<_>>());
    vec![
        FigureRow::new(
            "R, K ±15 %, J ±30 %, drag ±20 % unknown: mean frequency, each motor up to its own ceiling",
            "0.1 % in 99 of 100 of those whose ceiling is 1.5 Hz or more",
            format!(
                "{good} of {} motors, worst {:.3} %; {weak} more cannot reach {LEAST_HZ} Hz",
                judged.len(),
                error * 100.0
            ),
            !judged.is_empty() && good >= needed,
            json!({ "good": good, "judged": judged.len(), "too_weak": weak, "worst": error }),
        ),
        FigureRow::new(
            "the same: oscillation, median / worst; strokes that run away",
            "3° / 15°; none",
            turning.text(),
            turning.holds(3.0, 15.0),
            turning.numbers(),
        ),
    ]
}
