//! Every fault of the supervisor, injected into a healthy run: the bridge must be off within the bound of its table. Beside
//! them, what it has no trigger for: whether the run goes on, and how good the estimate is.

use std::collections::BTreeMap;

use control::parameters::Parameters;
use control::supervisor::TRIGGERS;
use control::{Fault as Cause, Stroke};
use hal_sim::Fault;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::json;
use simulation::{Break, Drive, DriveCommand, ExpectedReaction, FaultReport, Plan, Scheduled, Step, Trace, metrics};

use super::FigureRow;
use super::run::{DesignedRobot, for_seeds, median, plan, swing, trace, worst};

/// When something breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum When {
    /// At any moment of a run.
    Any,
    /// At any moment with the wiper outside the blind arc.
    OutsideTheArc,
    /// Before the first command.
    FromRest,
}

/// What is broken, when, and what the supervisor may call it: each name with its own bound.
struct Case {
    what: &'static str,
    broken: Break,
    when: When,
    names: &'static [Cause],
}

/// A blocked shaft whose wiper rests on insulation shows whatever the gap does: a floating, drifting, held or grounded
/// reading. Nothing tells it from that fault of the sensor, whose bound holds then.
const BLOCKED: &[Cause] = &[Cause::Stall, Cause::SensorOpen, Cause::SensorFrozen, Cause::SensorShorted, Cause::Runaway];

const CASES: [Case; 11] = [
    Case { what: "shaft blocked", broken: Break::Robot(Fault::Stalled), when: When::Any, names: BLOCKED },
    Case {
        what: "shaft blocked from rest",
        broken: Break::Robot(Fault::Stalled),
        when: When::FromRest,
        names: BLOCKED,
    },
    Case { what: "motor lead broken", broken: Break::Robot(Fault::MotorOpen), when: When::Any, names: BLOCKED },
    // Below the bridge's own drop no current flows.
    Case {
        what: "bridge's supply collapsed to 2 V",
        broken: Break::Robot(Fault::RailLow { rail_v: 2.0 }),
        when: When::Any,
        names: BLOCKED,
    },
    Case {
        what: "motor leads swapped",
        broken: Break::Robot(Fault::MotorReversed),
        when: When::Any,
        names: &[Cause::Runaway, Cause::SensorOpen],
    },
    Case {
        what: "sensor open",
        broken: Break::Robot(Fault::SensorOpen),
        when: When::Any,
        // The floating input drifts, holds, or lies at zero.
        names: BLOCKED,
    },
    Case {
        what: "sensor shorted to ground",
        broken: Break::Robot(Fault::SensorShortLow),
        when: When::Any,
        names: &[Cause::SensorShorted],
    },
    Case {
        what: "sensor shorted to its supply",
        broken: Break::Robot(Fault::SensorShortHigh),
        when: When::Any,
        names: &[Cause::SensorShorted],
    },
    // In the arc a code may stand still; one of an end counts as shorted.
    Case {
        what: "sensor frozen outside the arc",
        broken: Break::Robot(Fault::SensorFrozen),
        when: When::OutsideTheArc,
        names: &[Cause::SensorFrozen],
    },
    Case {
        what: "cell below its limit",
        broken: Break::Robot(Fault::BatteryLow { open_circuit_v: 2.9 }),
        when: When::Any,
        names: &[Cause::SupplyLow],
    },
    Case { what: "link lost", broken: Break::Link, when: When::Any, names: &[Cause::CommandTooOld] },
];

/// Length of a run, s.
const SECONDS: f64 = 2.5;
/// Earliest fault, s.
const FROM_S: f64 = 1.0;
/// The fault comes within this time, s: several turns, more than a swing.
const SPAN_S: f64 = 0.5;
/// Interval between targets of the position control, s: short enough that it always moves.
const MOVE_S: f64 = 0.1;

/// Speeds both ways, swings, and moves from target to target, in turn.
fn drive(seed: u64) -> Drive {
    match seed % 5 {
        0 => Drive::constant(DriveCommand::Freq { hz: 7.0 }),
        1 | 3 => Drive::constant(swing(Stroke::BangBang)),
        2 => Drive::constant(DriveCommand::Freq { hz: -7.0 }),
        _ => {
            let moves = (LONG_S / MOVE_S).ceil() as usize;
            let step = |k: usize| Step {
                at_s: MOVE_S * k as f64,
                command: DriveCommand::Position { deg: if k.is_multiple_of(2) { 100.0 } else { -100.0 } },
            };
            Drive { steps: (0..moves).map(step).collect(), end_s: None }
        }
    }
}

fn run_of(bench: &DesignedRobot, seed: u64, seconds: f64, faults: Vec<Scheduled>) -> Trace {
    let healthy = plan(DriveCommand::Coast, seconds);
    trace(&bench.robot, &bench.parameters, seed, &Plan { drive: drive(seed), faults, ..healthy })
}

/// When the fault comes, s.
fn moment(bench: &DesignedRobot, when: When, seed: u64) -> f64 {
    let drawn = FROM_S + Pcg64::seed_from_u64(seed).random_range(0.0..SPAN_S);
    match when {
        When::FromRest => 0.0,
        When::Any => drawn,
        When::OutsideTheArc => {
            let healthy = run_of(bench, seed, FROM_S + 2.0 * SPAN_S, Vec::new());
            let mut sensor = healthy.parameters.sensor;
            sensor.edge_margin += 0.05;
            let outside = |angle: f64| !sensor.is_blind(common::wrap(angle) as f32);
            let found = healthy.ticks.iter().find(|tick| tick.time_s >= drawn && outside(tick.truth.angle));
            found.map_or(drawn, |tick| tick.time_s)
        }
    }
}

/// How a run ended.
struct Ended {
    /// From the fault to the bridge off for good, s; infinite if it never is.
    off_s: f64,
    /// What the supervisor called it.
    cause: String,
    /// Faults that nothing was broken for.
    false_alarms: usize,
}

fn one(bench: &DesignedRobot, case: &Case, seed: u64) -> Ended {
    let at_s = moment(bench, case.when, seed);
    let reports = metrics(&run_of(bench, seed, SECONDS, vec![Scheduled { at_s, what: case.broken }])).faults;
    let false_alarms = reports.iter().filter(|report| report.injected.is_none()).count();
    let answer = reports.into_iter().find(|report| report.injected.is_some() && report.cause.is_some());
    let (off_s, cause) = answer.map_or((f64::INFINITY, "none".into()), |report| {
        (report.bridge_off_after_s.unwrap_or(f64::INFINITY), report.cause.unwrap_or_default())
    });
    Ended { off_s, cause, false_alarms }
}

/// The bound of a name among those that a case accepts, s.
fn bound(p: &Parameters, case: &Case, name: &str) -> Option<f64> {
    let cause = case.names.iter().find(|cause| format!("{cause:?}") == name)?;
    let trigger = TRIGGERS.iter().find(|trigger| trigger.fault == *cause)?;
    Some(f64::from((trigger.limit)(&p.supervisor).bound))
}

/// Length of a run with a fault that has no trigger of its own, s: what grows slowly shall have grown.
const LONG_S: f64 = 10.0;
/// A controller that bears a fault knows the angle as well as this, degrees RMS: two and a half times what is required of a
/// healthy sensor.
const BORNE_DEG: f64 = 3.0;

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    let found = CASES.iter().map(|case| row(bench, seeds, case));
    let others = Break::all().filter(|broken| broken.expected_reaction() != ExpectedReaction::Found);
    found.chain(others.flat_map(|broken| [true, false].map(|held| not_found(bench, seeds, broken, held)))).collect()
}

/// Whether the speed is held in the run of a seed; otherwise it swings or moves.
fn is_held(seed: u64) -> bool {
    drive(seed).steps.iter().all(|step| matches!(step.command, DriveCommand::Freq { .. }))
}

/// What becomes of a fault that has no trigger of its own: the run goes on, or ends under the name of another. Required
/// is only what is promised: that a held speed goes on with a good estimate where the fault is to be borne.
fn not_found(bench: &DesignedRobot, seeds: u64, broken: Break, held: bool) -> FigureRow {
    let reports: Vec<FaultReport> = for_seeds(seeds, |seed| {
        if is_held(seed) != held {
            return None;
        }
        let at_s = moment(bench, When::Any, seed);
        let faults = metrics(&run_of(bench, seed, LONG_S, vec![Scheduled { at_s, what: broken }])).faults;
        faults.into_iter().find(|report| report.injected.is_some())
    })
    .into_iter()
    .flatten()
    .collect();
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    for report in &reports {
        *names.entry(report.cause.as_deref().unwrap_or("none")).or_default() += 1;
    }
    let on = reports.iter().filter(|report| report.bridge_off_after_s.is_none()).count();
    let off_s = worst(reports.iter().filter_map(|report| report.bridge_off_after_s));
    let errors = || reports.iter().filter_map(|report| report.estimate_rms_deg);
    let (median_deg, worst_deg) = (median(errors()), worst(errors()));
    let called: Vec<_> = names.iter().map(|(cause, count)| format!("{cause} {count}")).collect();
    let off = if on < reports.len() { format!(", else off after {off_s:.2} s at worst") } else { String::new() };
    let measured = format!(
        "the bridge stays on in {on} of {}{off}; estimate off by {median_deg:.1}° (median), {worst_deg:.1}° (worst) RMS \
         until then; called {}",
        reports.len(),
        called.join(", ")
    );
    let numbers = json!({
        "runs": reports.len(), "on": on, "off_worst_s": off_s, "median_deg": median_deg, "worst_deg": worst_deg,
        "called": names,
    });
    let what = format!("fault, {}, {}", broken.name(), if held { "speed held" } else { "swings and moves" });
    if broken.expected_reaction() == ExpectedReaction::NotFound || !held {
        return FigureRow::beside(&what, measured, numbers);
    }
    let required = format!("the bridge stays on, estimate within {BORNE_DEG}° RMS in every run");
    let holds = !reports.is_empty() && on == reports.len() && worst_deg <= BORNE_DEG;
    FigureRow::new(&what, &required, measured, holds, numbers)
}

fn row(bench: &DesignedRobot, seeds: u64, case: &Case) -> FigureRow {
    let p = &bench.parameters;
    let runs = for_seeds(seeds, |seed| one(bench, case, seed));
    // Half a tick of rounding.
    let holds = |run: &Ended| bound(p, case, &run.cause).is_some_and(|bound| run.off_s <= bound + 5e-4);
    let in_time = runs.iter().filter(|run| holds(run)).count();
    let false_alarms: usize = runs.iter().map(|run| run.false_alarms).sum();
    let slowest = worst(runs.iter().map(|run| run.off_s));
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    for run in &runs {
        *names.entry(&run.cause).or_default() += 1;
    }
    let called: Vec<_> = names.iter().map(|(cause, count)| format!("{cause} {count}")).collect();
    let mut required: Vec<_> = case
        .names
        .iter()
        .filter_map(|cause| Some(format!("{cause:?} {:.2}", bound(p, case, &format!("{cause:?}"))?)))
        .collect();
    required.sort();
    FigureRow::new(
        &format!("fault, {}: bridge off", case.what),
        &format!("s in every run: {}; no false alarm", required.join(", ")),
        format!(
            "{in_time} of {seeds}, worst {slowest:.3} s; called {}; {false_alarms} false alarms",
            called.join(", ")
        ),
        seeds > 0 && in_time as u64 == seeds && false_alarms == 0,
        json!({
            "worst_s": slowest, "in_time": in_time, "false_alarms": false_alarms, "required": required, "called": names,
        }),
    )
}
