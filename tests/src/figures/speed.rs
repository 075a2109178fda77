//! Holding ±6, ±7, ±8 Hz from rest at any angle, uncalibrated.

use serde_json::json;
use simulation::{DriveCommand, Metrics};

use super::FigureRow;
use super::run::{DesignedRobot, for_seeds, frequency_error, holds_frequency, median, pooled, run, worst};

/// The frequencies of the thesis's experiments, Hz.
pub const FREQUENCIES_HZ: [f64; 6] = [-8.0, -7.0, -6.0, 6.0, 7.0, 8.0];

/// Every frequency with every seed.
#[must_use]
pub fn runs(bench: &DesignedRobot, seeds: u64) -> Vec<Metrics> {
    let one =
        |seed| FREQUENCIES_HZ.map(|hz| run(&bench.robot, &bench.parameters, seed, DriveCommand::Freq { hz }, 2.0));
    for_seeds(seeds, one).into_iter().flatten().collect()
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    let runs = runs(bench, seeds);
    let count = runs.len();
    let error = worst(runs.iter().map(frequency_error));
    let missed = runs.iter().filter(|m| !holds_frequency(m)).count();
    let faults = runs.iter().filter(|m| !m.faults.is_empty()).count();
    let acquired = worst(runs.iter().map(|m| m.acquired_s.unwrap_or(f64::INFINITY)));
    let settling = || runs.iter().map(|m| m.settling_s.unwrap_or(f64::INFINITY));
    let instantaneous = runs.iter().filter(|m| m.settling_instantaneous_s.is_some_and(|s| s <= 0.4)).count();
    let outside = pooled(runs.iter().map(|m| m.estimate_rms_deg));
    let inside = pooled(runs.iter().map(|m| m.estimate_rms_blind_deg));
    vec![
        FigureRow::new(
            "hold ±6, ±7, ±8 Hz from rest: mean frequency over the last second",
            "within 0.1 % in every run",
            format!(
                "worst {:.4} % of {count} runs, {missed} missed, {faults} faults, acquired in {:.0} ms at most",
                error * 100.0,
                acquired * 1e3
            ),
            missed == 0 && faults == 0,
            json!({ "runs": count, "worst": error, "missed": missed, "faults": faults, "acquired_s": acquired }),
        ),
        FigureRow::new(
            "speed averaged over one turn within 2 %, and staying",
            "in 0.4 s",
            format!(
                "worst {:.3} s, median {:.3} s; instantaneous in 0.4 s, uncalibrated: {instantaneous} of {count}",
                worst(settling()),
                median(settling())
            ),
            worst(settling()) <= 0.4,
            json!({ "worst_s": worst(settling()), "median_s": median(settling()), "instantaneous": instantaneous }),
        ),
        FigureRow::new(
            "estimate against truth, RMS outside / inside the blind arc, uncalibrated (up to ±3°)",
            "1.2° / 1.5° pooled",
            format!("{outside:.2}° / {inside:.2}° pooled over {count} runs"),
            outside <= 1.2 && inside <= 1.5,
            json!({ "outside_deg": outside, "inside_deg": inside }),
        ),
    ]
}
