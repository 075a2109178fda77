//! What a robot tracks under controllers that were designed from two robot files: before its model was extended, and after.

use hal_sim::Settings;
use robot_file::Robot;
use serde::Serialize;

use super::{Drive, Metrics, Plan, SimError, metrics, run_designed_from};

/// Drives that are compared where nobody asks for one, in words of `scram sim --drive`.
const DRIVES: [&str; 3] = ["freq:7", "oscillate:-100..100", "position:90"];
/// Length of such a drive, s.
const SECONDS: f64 = 4.0;
/// Seeds whose figures are averaged: they draw where the shaft starts and what the sensor's noise is.
const SEEDS: [u64; 3] = [1, 2, 3];

/// A drive under two controllers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The drive, in words of `scram sim --drive`.
    pub drive: String,
    /// What is tracked, a figure a row.
    pub rows: Vec<ComparedFigure>,
    /// Why the supervisor ended it, before and after; null where it did not.
    pub stopped: [Option<String>; 2],
}

/// A figure before and after; smaller is better.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedFigure {
    /// What it is.
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Under the controller of before; null where there is none, of a speed that was not reached, say.
    pub before: Option<f64>,
    /// Under the controller of after.
    pub after: Option<f64>,
}

/// What a drive tracked, a figure each: what it is, its unit, and its value. Smaller is better.
#[must_use]
pub fn tracking_figures(m: &Metrics) -> [(&'static str, &'static str, Option<f64>); 7] {
    let off = m.target_frequency_hz.zip(m.mean_frequency_hz).map(|(target, mean)| (mean - target).abs());
    [
        ("mean frequency off by", "Hz", off),
        ("phase, RMS", "deg", m.phase_rms_deg),
        ("speed settled after", "s", m.settling_s),
        ("turning points, median off by", "deg", m.turning_error_median_deg),
        ("turning points, worst off by", "deg", m.turning_error_worst_deg),
        ("position, RMS", "deg", m.position_rms_deg),
        ("estimate of the angle, RMS", "deg", m.estimate_rms_deg),
    ]
}

/// Compares the figures of runs of one drive, each averaged over the runs; those that neither has are left out.
#[must_use]
pub fn compare(drive: &str, before: &[Metrics], after: &[Metrics]) -> Comparison {
    let [was, is] = [before, after].map(means);
    let rows = was
        .into_iter()
        .zip(is)
        .map(|((what, unit, before), (_, _, after))| ComparedFigure { what, unit, before, after })
        .filter(|row| row.before.is_some() || row.after.is_some())
        .collect();
    let stopped = [before, after].map(|runs| runs.iter().find_map(|m| m.faults.iter().find_map(|f| f.cause.clone())));
    Comparison { drive: drive.to_owned(), rows, stopped }
}

/// Means over runs; none where a run has no figure.
fn means(runs: &[Metrics]) -> Vec<(&'static str, &'static str, Option<f64>)> {
    let each: Vec<_> = runs.iter().map(tracking_figures).collect();
    let Some(first) = each.first() else { return Vec::new() };
    let mean = |index: usize| {
        let sum: Option<f64> = each.iter().map(|figures| figures[index].2).sum();
        sum.map(|sum| sum / runs.len() as f64)
    };
    first.iter().enumerate().map(|(index, (what, unit, _))| (*what, *unit, mean(index))).collect()
}

/// What the robot of an extended file tracks on a bench, under the controller of the file before and under its own: a held
/// speed, an oscillation and a position, means of three seeds.
///
/// # Errors
/// There is no controller for one of them.
pub fn tracking_gain(before: &Robot, extended: &Robot) -> Result<Vec<Comparison>, SimError> {
    let figures = |designed_from: &Robot, drive: &str| -> Result<Vec<Metrics>, SimError> {
        let parsed = Drive::parse(drive).expect("the drives of this file can be read");
        let plan = Plan { drive: parsed, seconds: SECONDS, faults: Vec::new() };
        let run = |seed| run_designed_from(designed_from, extended, seed, &Settings::default(), &plan);
        SEEDS.into_iter().map(|seed| Ok(metrics(&run(seed)?))).collect()
    };
    DRIVES.into_iter().map(|drive| Ok(compare(drive, &figures(before, drive)?, &figures(extended, drive)?))).collect()
}

#[cfg(test)]
mod tests {
    use robot_file::edit::Document;
    use robot_file::robot::Quantity;

    use super::*;

    /// The default robot, with an effect more.
    fn robot(effect: Option<(&str, &str, f64)>) -> Robot {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let mut document = Document::parse(&std::fs::read_to_string(file).unwrap(), "robot.toml").unwrap();
        if let Some((name, key, value)) = effect {
            let number = Quantity { value, low: value, high: value, source: "test".into() };
            document.set_effect(name, &[(key, number)]).unwrap();
        }
        document.robot().unwrap()
    }

    fn figure(compared: &[Comparison], what: &str) -> [f64; 2] {
        let row = compared.iter().flat_map(|one| &one.rows).find(|row| row.what == what).unwrap();
        [row.before.unwrap(), row.after.unwrap()]
    }

    #[test]
    fn a_controller_that_knows_of_a_late_reading_tracks_better() {
        let gained = tracking_gain(&robot(None), &robot(Some(("sensor_delay", "delay_s", 5e-3)))).unwrap();
        let [before, after] = figure(&gained, "phase, RMS");
        assert!(after < 0.3 * before, "phase: {before:.2}° before, {after:.2}° after");
        let [before, after] = figure(&gained, "turning points, median off by");
        assert!(after < 0.5 * before, "turning points: {before:.2}° before, {after:.2}° after");
    }

    #[test]
    fn a_controller_that_knows_of_a_deadband_positions_better() {
        let gained = tracking_gain(&robot(None), &robot(Some(("driver_deadband", "width_duty", 0.12)))).unwrap();
        let [before, after] = figure(&gained, "turning points, median off by");
        assert!(after < before, "turning points: {before:.2}° before, {after:.2}° after");
    }

    #[test]
    fn what_is_not_extended_tracks_as_before() {
        let same = robot(None);
        for one in tracking_gain(&same, &same).unwrap() {
            assert_eq!(one.stopped, [None, None]);
            assert!(one.rows.iter().all(|row| row.before == row.after), "{one:?}");
        }
    }
}
