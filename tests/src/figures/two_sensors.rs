//! Two potentiometers half a turn apart: the estimate where the first one's blind arc was, and what fails how.

use std::path::Path;

use common::conventions::degrees;
use common::wrap;
use control::supervisor::TRIGGERS;
use control::{Parameters, Sensor as Which, Stroke};
use hal_sim::Fault;
use hal_sim::faults::Line;
use identify::potentiometer::{potentiometer, second_potentiometer};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use robot_file::design::design;
use robot_file::robot::{Robot, Sensor};
use serde_json::json;
use simulation::{Break, Drive, DriveCommand, Plan, Scheduled, Step, Trace, metrics, recording};

use super::FigureRow;
use super::run::{DesignedRobot, for_seeds, holds_frequency, plan, pooled, swing, trace, worst};
use super::speed::FREQUENCIES_HZ;

/// Earliest fault, s.
const FROM_S: f64 = 1.0;
/// The fault comes within this time, s: several turns.
const SPAN_S: f64 = 0.5;
/// Length of a run with a fault, s: the last second is judged.
const SECONDS: f64 = 3.5;
/// Length and duty of the calibration run: as `calibrated`.
const CALIBRATION_S: f64 = 2.5;
const CALIBRATION_DUTY: f64 = 0.95;

/// A code of the converter, degrees: 330° are 3755 codes.
const CODE_DEG: f64 = 0.09;

/// What can happen to one sensor.
const LINES: [(Fault, Fault); 7] = [
    (Fault::SensorOpen, Fault::SecondSensor(Line::Open)),
    (Fault::SensorShortLow, Fault::SecondSensor(Line::Low)),
    (Fault::SensorShortHigh, Fault::SecondSensor(Line::High)),
    (Fault::SensorFrozen, Fault::SecondSensor(Line::Frozen)),
    (Fault::SensorNoisy { share: 0.03 }, Fault::SecondSensor(Line::Noisy(0.03))),
    (Fault::SensorDrifting { share_per_s: 0.1 }, Fault::SecondSensor(Line::Drifting(0.1))),
    (Fault::AdcSaturated { factor: 5.0 / 3.3 }, Fault::SecondSensor(Line::Scaled(5.0 / 3.3))),
];
/// So many of them leave no reading that fits; the others are not noticed on a robot with one sensor.
const GONE: usize = 4;

/// The robot with two sensors and its designed controller.
#[must_use]
pub fn bench() -> DesignedRobot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/two-sensors.toml");
    let robot = Robot::load(&path).unwrap_or_else(|error| panic!("{error}"));
    let parameters = design(&robot).unwrap_or_else(|error| panic!("{error}")).parameters;
    DesignedRobot { robot, parameters }
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(_: &DesignedRobot, seeds: u64) -> Vec<FigureRow> {
    rows_from(0, seeds)
}

/// The rows from a seed on: others than those that are judged by are for tuning.
#[must_use]
pub fn rows_from(first: u64, seeds: u64) -> Vec<FigureRow> {
    let (bench, alone) = (bench(), DesignedRobot::new());
    let over = |one: &(dyn Fn(u64) -> Vec<Trace> + Sync)| for_seeds(seeds, |seed| one(first + seed));
    let mut rows = vec![
        arc_row("uncalibrated", &over(&|seed| held(&bench, &bench.parameters, seed))),
        arc_row("calibrated", &over(&|seed| calibrated(&bench, seed))),
        alone_row(&over(&|seed| held(&alone, &alone.parameters, seed))),
        healthy_row(&bench, first, seeds),
    ];
    rows.extend(LINES.iter().map(|faults| one_row(&bench, first, seeds, *faults)));
    rows.push(both_row(&bench, first, seeds));
    rows
}

/// The thesis's frequencies from rest, of one specimen.
fn held(bench: &DesignedRobot, parameters: &Parameters, seed: u64) -> Vec<Trace> {
    FREQUENCIES_HZ.map(|hz| trace(&bench.robot, parameters, seed, &plan(DriveCommand::Freq { hz }, 2.0))).to_vec()
}

/// The same with both sensors calibrated from one run; nothing where they cannot be.
fn calibrated(bench: &DesignedRobot, seed: u64) -> Vec<Trace> {
    let robot = calibrate(bench, seed);
    let parameters = robot.and_then(|robot| Some(design(&robot).ok()?.parameters));
    parameters.map_or_else(Vec::new, |parameters| held(bench, &parameters, seed))
}

fn calibrate(bench: &DesignedRobot, seed: u64) -> Option<Robot> {
    let command = DriveCommand::Duty { duty: CALIBRATION_DUTY };
    let run = recording(&trace(&bench.robot, &bench.parameters, seed, &plan(command, CALIBRATION_S)), &bench.robot);
    let mut robot = bench.robot.clone();
    let Sensor::Potentiometer(sensor) = &mut robot.sensor else { return None };
    sensor.correction = Some(potentiometer(&bench.robot, &run).ok()?.correction);
    let fit = second_potentiometer(&bench.robot, &run).ok()?;
    let second = sensor.second.as_mut()?;
    second.correction = Some(fit.own.correction);
    second.offset_deg = fit.offset;
    Some(robot)
}

/// RMS of the estimate's error, degrees, in and outside the first sensor's arc.
fn errors(run: &Trace) -> [Option<f64>; 2] {
    [true, false].map(|inside| {
        let is_wanted = |angle: f64| run.parameters.sensor.is_blind(wrap(angle) as f32) == inside;
        let errors = run.ticks.iter().filter(|t| t.telemetry.tracking && is_wanted(t.truth.angle));
        let squares: Vec<f64> =
            errors.map(|t| degrees(wrap(f64::from(t.telemetry.angle) - t.truth.angle)).powi(2)).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    })
}

fn arc_row(how: &str, runs: &[Vec<Trace>]) -> FigureRow {
    let missing = runs.iter().filter(|traces| traces.is_empty()).count();
    let runs: Vec<&Trace> = runs.iter().flatten().collect();
    let all: Vec<_> = runs.iter().map(|run| errors(run)).collect();
    let inside = pooled(all.iter().map(|errors| errors[0]));
    let outside = pooled(all.iter().map(|errors| errors[1]));
    let blind = runs.iter().flat_map(|run| &run.ticks).filter(|t| t.telemetry.tracking && t.telemetry.blind).count();
    let missed = runs.iter().filter(|run| !holds_frequency(&metrics(run))).count();
    FigureRow::new(
        &format!("two sensors, {how}: estimate against truth where the first one's blind arc was / outside it"),
        "no worse than outside, to a code of the converter (0.09°); never blind; frequency within 0.1 %",
        format!(
            "{inside:.3}° / {outside:.3}° RMS pooled over {} runs, blind in {blind} ticks, {missed} missed their frequency, \
             {missing} not identified",
            runs.len()
        ),
        inside <= outside + CODE_DEG && blind == 0 && missed == 0 && missing == 0 && !runs.is_empty(),
        json!({ "inside_deg": inside, "outside_deg": outside, "blind": blind, "missed": missed, "missing": missing }),
    )
}

/// The same of a robot with one sensor, uncalibrated.
fn alone_row(runs: &[Vec<Trace>]) -> FigureRow {
    let all: Vec<_> = runs.iter().flatten().map(errors).collect();
    let [inside, outside] = [0, 1].map(|index| pooled(all.iter().map(|errors| errors[index])));
    FigureRow::beside(
        "the same with one sensor, uncalibrated",
        format!("{inside:.3}° / {outside:.3}° RMS pooled over {} runs", all.len()),
        json!({ "inside_deg": inside, "outside_deg": outside }),
    )
}

/// Everything that a healthy robot does, in turn: slow and fast, both ways, strokes and moves, with commands that change.
fn busy(seed: u64) -> Plan {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut at_s = 0.0;
    let mut steps = Vec::new();
    while at_s < 6.0 {
        let hz = random.random_range(1.0..8.0) * if random.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
        let command = match random.random_range(0..6) {
            0..=2 => DriveCommand::Freq { hz },
            3 => swing(Stroke::BangBang),
            4 => swing(Stroke::Proportional),
            _ => DriveCommand::Position { deg: random.random_range(-180.0..180.0) },
        };
        steps.push(Step { at_s, command });
        at_s += random.random_range(0.2..1.5);
    }
    Plan { drive: Drive { steps, end_s: None }, seconds: 6.0, faults: Vec::new() }
}

fn healthy_row(bench: &DesignedRobot, first: u64, seeds: u64) -> FigureRow {
    let runs = for_seeds(seeds, |seed| trace(&bench.robot, &bench.parameters, first + seed, &busy(first + seed)));
    let failed = runs.iter().filter(|run| failed(run).is_some()).count();
    let faults = runs.iter().filter(|run| run.ticks.iter().any(|t| t.telemetry.fault.is_some())).count();
    FigureRow::new(
        "two sensors, both healthy, orders that change: none is called failed",
        "in every run; no fault",
        format!("{failed} called failed, {faults} faults in {seeds} runs"),
        failed == 0 && faults == 0,
        json!({ "called_failed": failed, "faults": faults }),
    )
}

/// When a sensor was called failed, and which.
fn failed(run: &Trace) -> Option<(f64, Which)> {
    run.ticks.iter().find_map(|t| t.telemetry.failed_sensor.map(|which| (t.time_s, which)))
}

fn moment(seed: u64) -> f64 {
    FROM_S + Pcg64::seed_from_u64(seed).random_range(0.0..SPAN_S)
}

/// Half of the seeds break the first sensor, half the second one. Which of two drifts apart slowly nobody can tell: then the
/// bridge may go off, too.
fn one_row(bench: &DesignedRobot, first: u64, seeds: u64, faults: (Fault, Fault)) -> FigureRow {
    let runs = for_seeds(seeds, |seed| {
        let seed = first + seed;
        let (fault, which) = if seed.is_multiple_of(2) { (faults.0, Which::First) } else { (faults.1, Which::Second) };
        let hz = FREQUENCIES_HZ[(seed / 2 % 6) as usize];
        let at_s = moment(seed);
        let broken = vec![Scheduled { at_s, what: Break::Robot(fault) }];
        let run = trace(
            &bench.robot,
            &bench.parameters,
            seed,
            &Plan { faults: broken, ..plan(DriveCommand::Freq { hz }, SECONDS) },
        );
        let judged = metrics(&run);
        let is_wrong = failed(&run).is_some_and(|(_, called)| called != which);
        let is_off = run.ticks.iter().any(|t| t.telemetry.fault.is_some());
        (holds_frequency(&judged) && !is_off, is_off, is_wrong, failed(&run).map(|(time_s, _)| time_s - at_s))
    });
    let held = runs.iter().filter(|run| run.0).count();
    let off = runs.iter().filter(|run| run.1).count();
    let wrong = runs.iter().filter(|run| run.2).count();
    let found: Vec<f64> = runs.iter().filter_map(|run| run.3).collect();
    let latest = worst(found.iter().copied());
    let numbers = json!({ "held": held, "off": off, "found": found.len(), "latest_s": latest, "wrong": wrong });
    if matches!(faults.0, Fault::SensorDrifting { .. }) {
        return FigureRow::new(
            "two sensors, one drifts from any moment: the robot goes on or stops",
            "in every run; never the healthy one called failed",
            format!("{held} of {seeds} go on, {off} with the bridge off, {wrong} wrong"),
            seeds > 0 && (held + off) as u64 == seeds && wrong == 0,
            numbers,
        );
    }
    FigureRow::new(
        &format!("two sensors, one is broken ({}) at any moment: the robot goes on", faults.0.name()),
        "holds ±6, ±7, ±8 Hz within 0.1 % in every run, no fault, never the healthy one called failed",
        format!(
            "{held} of {seeds}, called failed in {} (after {latest:.3} s at most), {off} bridge off, {wrong} wrong",
            found.len()
        ),
        seeds > 0 && held as u64 == seeds && wrong == 0,
        numbers,
    )
}

/// From the second failure on the bound of what the supervisor calls it holds.
fn both_row(bench: &DesignedRobot, first: u64, seeds: u64) -> FigureRow {
    let runs = for_seeds(seeds, |seed| {
        let seed = first + seed;
        let mut random = Pcg64::seed_from_u64(seed ^ 0xB07);
        let mut fault = |second: bool| {
            let pair = LINES[random.random_range(0..GONE)];
            let at_s = FROM_S + random.random_range(0.0..2.0 * SPAN_S);
            Scheduled { at_s, what: Break::Robot(if second { pair.1 } else { pair.0 }) }
        };
        let mut faults = vec![fault(false), fault(true)];
        if seed.is_multiple_of(3) {
            faults[1].at_s = faults[0].at_s;
        }
        let last_s = faults[0].at_s.max(faults[1].at_s);
        let command = match seed % 4 {
            0 => swing(Stroke::BangBang),
            _ => DriveCommand::Freq { hz: FREQUENCIES_HZ[(seed / 4 % 6) as usize] },
        };
        let run = trace(&bench.robot, &bench.parameters, seed, &Plan { faults, ..plan(command, 4.0) });
        let off = run.ticks.iter().find(|t| t.telemetry.fault.is_some());
        let cause = off.and_then(|t| t.telemetry.fault);
        let trigger = cause.and_then(|cause| TRIGGERS.iter().find(|trigger| trigger.fault == cause));
        let bound = trigger.map(|trigger| f64::from((trigger.limit)(&run.parameters.supervisor).bound));
        let off_s = off.map_or(f64::INFINITY, |t| t.time_s - last_s);
        (off_s, bound.is_some_and(|bound| off_s <= bound + 5e-4))
    });
    let in_time = runs.iter().filter(|run| run.1).count();
    let slowest = worst(runs.iter().map(|run| run.0));
    FigureRow::new(
        "two sensors, both broken at any moments: bridge off",
        "within the bound of what it is called, in every run",
        format!("{in_time} of {seeds}, worst {slowest:.3} s after the later one"),
        seeds > 0 && in_time as u64 == seeds,
        json!({ "in_time": in_time, "worst_s": slowest }),
    )
}
