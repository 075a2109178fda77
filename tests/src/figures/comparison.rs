//! What the thesis's own ways give on the same robots, beside ours.

use control::parameters::{AngleSource, BlindArcHandling, SpeedLaw};
use control::{Parameters, Stroke};
use serde_json::json;
use simulation::{DriveCommand, Metrics};

use super::FigureRow;
use super::oscillation::{SECONDS, Turning};
use super::run::{DesignedRobot, for_seeds, frequency_error, holds_frequency, median, pooled, run, swing, worst};
use super::speed::FREQUENCIES_HZ;

fn swings(bench: &DesignedRobot, parameters: &Parameters, style: Stroke, seeds: u64) -> Turning {
    Turning::of(&for_seeds(seeds, |seed| run(&bench.robot, parameters, seed, swing(style), SECONDS)))
}

fn holds(bench: &DesignedRobot, parameters: &Parameters, seeds: u64) -> Vec<Metrics> {
    let one = |seed| FREQUENCIES_HZ.map(|hz| run(&bench.robot, parameters, seed, DriveCommand::Freq { hz }, 2.0));
    for_seeds(seeds, one).into_iter().flatten().collect()
}

/// Mean frequency, settling and estimate in words and numbers.
fn speed_row(what: &str, ours: &[Metrics], theirs: &[Metrics]) -> FigureRow {
    let missed = |runs: &[Metrics]| runs.iter().filter(|m| !holds_frequency(m)).count();
    let error = |runs: &[Metrics]| worst(runs.iter().map(frequency_error));
    let settling = |runs: &[Metrics]| median(runs.iter().map(|m| m.settling_s.unwrap_or(f64::INFINITY)));
    let outside = |runs: &[Metrics]| pooled(runs.iter().map(|m| m.estimate_rms_deg));
    let inside = |runs: &[Metrics]| {
        let seen: Vec<_> = runs.iter().filter(|m| m.estimate_rms_blind_deg.is_some()).collect();
        pooled(seen.iter().map(|m| m.estimate_rms_blind_deg))
    };
    let faults = |runs: &[Metrics]| runs.iter().filter(|m| !m.faults.is_empty()).count();
    FigureRow::beside(
        what,
        format!(
            "missed {} of {} ({} faults, worst {:.3} %; ours {}, {:.3} %), settling median {:.2} s ({:.2} s), estimate {:.2}° ({:.2}°, {:.1} times)",
            missed(theirs),
            theirs.len(),
            faults(theirs),
            error(theirs) * 100.0,
            missed(ours),
            error(ours) * 100.0,
            settling(theirs),
            settling(ours),
            outside(theirs),
            outside(ours),
            outside(theirs) / outside(ours),
        ),
        json!({
            "missed": missed(theirs), "missed_ours": missed(ours), "worst": error(theirs), "worst_ours": error(ours),
            "faults": faults(theirs), "estimate_deg": outside(theirs), "estimate_ours_deg": outside(ours),
            "estimate_blind_deg": inside(theirs), "estimate_blind_ours_deg": inside(ours),
        }),
    )
}

fn swing_row(what: &str, ours: &Turning, theirs: &Turning) -> FigureRow {
    let text = format!(
        "{}; {:.0} / {:.0} times ours",
        theirs.text(),
        theirs.median_deg / ours.median_deg,
        theirs.worst_deg / ours.worst_deg
    );
    FigureRow::beside(what, text, theirs.numbers())
}

/// The rows. The controller's are those of the other campaigns again, for the ratios.
#[must_use]
pub fn rows(bench: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    let ours = swings(bench, &bench.parameters, Stroke::BangBang, seeds);
    let ours_held = holds(bench, &bench.parameters, seeds);

    let mut moving_average = bench.parameters;
    moving_average.position.source = AngleSource::MovingAverage;
    let mut unhandled = bench.parameters;
    unhandled.estimator.handling = BlindArcHandling::None;
    let mut letter = bench.parameters;
    letter.speed.law = SpeedLaw::Thesis;
    vec![
        swing_row(
            "beside it: the thesis's P on a moving average, oscillation",
            &ours,
            &swings(bench, &moving_average, Stroke::Proportional, seeds),
        ),
        swing_row(
            "beside it: the filter without its blind-arc handling, oscillation",
            &ours,
            &swings(bench, &unhandled, Stroke::BangBang, seeds),
        ),
        speed_row(
            "beside it: the filter without its blind-arc handling, ±6, ±7, ±8 Hz",
            &ours_held,
            &holds(bench, &unhandled, seeds),
        ),
        speed_row("beside it: u = K(r − x̂) to the letter, ±6, ±7, ±8 Hz", &ours_held, &holds(bench, &letter, seeds)),
    ]
}
