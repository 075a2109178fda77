//! What a run is judged by, all of it against the truth of the simulation.

use control::{State, Telemetry};
use serde::Serialize;

use super::strokes::Strokes;
use super::{DriveCommand, Tick, Trace};
use common::conventions::{degrees, frequency_from_omega, omega_from_frequency};
use common::wrap;

/// The last part of a run over which steady values are taken, s.
const STEADY_S: f64 = 1.0;
/// The band of settling, as a share of the target.
const BAND: f64 = 0.02;

/// What happened after something broke, or when the supervisor stepped in without that.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultReport {
    /// What the supervisor names; null when it did not notice.
    pub cause: Option<String>,
    /// What was broken on purpose.
    pub injected: Option<String>,
    /// When it broke, s; when the supervisor stepped in where nothing was broken on purpose.
    pub at_s: f64,
    /// From then until the bridge was off for good, s; null while it is on.
    pub bridge_off_after_s: Option<f64>,
    /// The bridge was on in the tick before: without that it was off already.
    pub bridge_was_on: bool,
    /// Estimated against true angle from then until the supervisor stepped in or the run ended, RMS; null where the
    /// controller knew no angle.
    pub estimate_rms_deg: Option<f64>,
}

/// The figures of a run. Times in s from the beginning of the command, degrees, Hz with the thesis's sign.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// Frequency that was asked for.
    pub target_frequency_hz: Option<f64>,
    /// Turns per second over the last second (or the whole order where it is shorter).
    pub mean_frequency_hz: Option<f64>,
    /// Reference phase against the true angle over the last second, RMS.
    pub phase_rms_deg: Option<f64>,
    /// From when on the speed averaged over the last full turn stays within 2 % of the target.
    pub settling_s: Option<f64>,
    /// From when on the instantaneous speed stays within 2 % of the target.
    pub settling_instantaneous_s: Option<f64>,
    /// When the controller first knew the angle.
    pub acquired_s: Option<f64>,
    /// Estimated against true angle outside the controller's blind arc, once acquired, RMS.
    pub estimate_rms_deg: Option<f64>,
    /// The same inside the blind arc.
    pub estimate_rms_blind_deg: Option<f64>,
    /// Largest winding current, A.
    pub peak_current_a: f64,
    /// Winding current, RMS, A.
    pub rms_current_a: f64,
    /// Energy that the bridge took from its supply, J.
    pub energy_j: f64,
    /// Where the oscillation turned.
    pub turning_points_deg: Vec<f64>,
    /// Distance of the turning points from their bounds, median.
    pub turning_error_median_deg: Option<f64>,
    /// Distance of the turning points from their bounds, worst.
    pub turning_error_worst_deg: Option<f64>,
    /// Strokes that went 90° too far or did not end within a second.
    pub strokes_ran_away: usize,
    /// Full swings per second.
    pub oscillation_frequency_hz: Option<f64>,
    /// True angle against the target over the last half second, RMS.
    pub position_rms_deg: Option<f64>,
    /// What broke, and how the supervisor answered, over the whole run.
    pub faults: Vec<FaultReport>,
}

/// The figures of a run's last command.
#[must_use]
pub fn metrics(trace: &Trace) -> Metrics {
    let Some((command, from, to)) = trace.segments().pop() else {
        return Metrics { faults: fault_reports(trace), ..Metrics::default() };
    };
    Metrics { faults: fault_reports(trace), ..metrics_of(trace, command, from, to) }
}

/// The figures of one order: ticks `from..to`. Its `faults` are empty; they belong to the run.
#[must_use]
pub fn metrics_of(trace: &Trace, command: DriveCommand, from: usize, to: usize) -> Metrics {
    let ticks = &trace.ticks[from..to];
    let Some(first) = ticks.first() else { return Metrics::default() };
    let mut m = Metrics {
        acquired_s: ticks.iter().find(|t| t.telemetry.tracking).map(|t| t.time_s - first.time_s),
        estimate_rms_deg: estimate_rms(ticks, |telemetry| !telemetry.blind),
        estimate_rms_blind_deg: estimate_rms(ticks, |telemetry| telemetry.blind),
        peak_current_a: ticks.iter().map(|t| t.truth.current.abs()).fold(0.0, f64::max),
        rms_current_a: rms(ticks.iter().map(|t| t.truth.current)).unwrap_or(0.0),
        energy_j: ticks.iter().map(bridge_power).sum::<f64>() * trace.tick_s,
        ..Metrics::default()
    };
    let steady = last(ticks, STEADY_S, trace.tick_s);
    m.mean_frequency_hz = mean_speed(steady).map(frequency_from_omega);
    match command {
        DriveCommand::Freq { hz } => {
            m.target_frequency_hz = Some(hz);
            let omega = omega_from_frequency(hz);
            let held = steady.iter().filter(|t| t.telemetry.state == State::Speed && t.telemetry.tracking);
            m.phase_rms_deg = rms(held.map(|t| degrees(wrap(f64::from(t.telemetry.reference_angle) - t.truth.angle))));
            m.settling_s = settled(&turn_averages(ticks), omega).map(|t| t - first.time_s);
            let instantaneous: Vec<(f64, f64)> = ticks.iter().map(|t| (t.time_s, t.truth.speed)).collect();
            m.settling_instantaneous_s = settled(&instantaneous, omega).map(|t| t - first.time_s);
        }
        DriveCommand::Oscillate { from_deg, to_deg, .. } => {
            let strokes = Strokes::of(ticks, from_deg.to_radians(), to_deg.to_radians());
            let mut errors: Vec<f64> = strokes.errors_deg.iter().map(|e| e.abs()).collect();
            errors.sort_by(f64::total_cmp);
            m.turning_error_median_deg = errors.get(errors.len() / 2).copied();
            m.turning_error_worst_deg = errors.last().copied();
            m.turning_points_deg = strokes.turning_points_deg;
            m.strokes_ran_away = strokes.ran_away;
            m.oscillation_frequency_hz = strokes.frequency_hz;
        }
        DriveCommand::Position { deg } => {
            let end = last(ticks, 0.5 * STEADY_S, trace.tick_s);
            m.position_rms_deg = rms(end.iter().map(|t| degrees(wrap(t.truth.angle - deg.to_radians()))));
        }
        DriveCommand::Duty { .. }
        | DriveCommand::Gait(_)
        | DriveCommand::Coast
        | DriveCommand::Idle
        | DriveCommand::Clear => {}
    }
    m
}

/// What the bridge takes from its supply, W.
fn bridge_power(tick: &Tick) -> f64 {
    if tick.actuation.enable {
        f64::from(tick.actuation.duty) * tick.truth.bridge_supply_v * tick.truth.current
    } else {
        0.0
    }
}

fn last(ticks: &[Tick], seconds: f64, tick_s: f64) -> &[Tick] {
    // One tick more than periods.
    let count = (seconds / tick_s).round() as usize + 1;
    &ticks[ticks.len().saturating_sub(count)..]
}

fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0u64, 0.0), |(count, sum), v| (count + 1, sum + v * v));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

fn mean_speed(ticks: &[Tick]) -> Option<f64> {
    let [first, .., end] = ticks else { return None };
    Some((end.truth.angle - first.truth.angle) / (end.time_s - first.time_s))
}

fn estimate_rms(ticks: &[Tick], wanted: impl Fn(&Telemetry) -> bool) -> Option<f64> {
    let tracked = ticks.iter().filter(|t| t.telemetry.tracking && wanted(&t.telemetry));
    rms(tracked.map(|t| degrees(wrap(f64::from(t.telemetry.angle) - t.truth.angle))))
}

/// Speed averaged over the last full turn, at every tick by which there was one: (time, rad/s).
fn turn_averages(ticks: &[Tick]) -> Vec<(f64, f64)> {
    let turn = std::f64::consts::TAU;
    let mut averages = Vec::new();
    let mut begin = 0;
    for (index, tick) in ticks.iter().enumerate() {
        let travelled = |from: usize| (tick.truth.angle - ticks[from].truth.angle).abs();
        while begin + 1 < index && travelled(begin + 1) >= turn {
            begin += 1;
        }
        if travelled(begin) < turn {
            continue;
        }
        // The turn begins between two ticks.
        let (before, after) = (travelled(begin), travelled(begin + 1));
        let share = if before > after { (before - turn) / (before - after) } else { 0.0 };
        let begin_s = ticks[begin].time_s + share * (ticks[begin + 1].time_s - ticks[begin].time_s);
        let direction = (tick.truth.angle - ticks[begin].truth.angle).signum();
        averages.push((tick.time_s, direction * turn / (tick.time_s - begin_s)));
    }
    averages
}

/// Since when the values stay within the band until the end; `None` where the last one is outside.
fn settled(values: &[(f64, f64)], target: f64) -> Option<f64> {
    let outside = values.iter().rposition(|(_, value)| (value - target).abs() > BAND * target.abs());
    match outside {
        None => values.first().map(|(t, _)| *t),
        Some(index) => values.get(index + 1).map(|(t, _)| *t),
    }
}

/// What broke and how it was answered.
fn fault_reports(trace: &Trace) -> Vec<FaultReport> {
    // A fault state begins where the tick before had none, or another cause.
    let mut begins: Vec<(usize, String)> = Vec::new();
    let mut before = None;
    for (index, tick) in trace.ticks.iter().enumerate() {
        let now = tick.telemetry.fault;
        if now != before
            && let Some(cause) = now
        {
            begins.push((index, format!("{cause:?}")));
        }
        before = now;
    }
    let mut injected: Vec<_> = trace.faults.clone();
    injected.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    let mut reports: Vec<FaultReport> = injected
        .iter()
        .map(|scheduled| {
            let found = begins.iter().position(|(index, _)| trace.ticks[*index].time_s >= scheduled.at_s);
            let cause = found.map(|at| begins.remove(at).1);
            let off = trace.ticks.iter().rposition(|t| t.actuation.enable).map_or(0, |on| on + 1);
            let off_s = trace.ticks.get(off).map(|t| (t.time_s - scheduled.at_s).max(0.0));
            let from = trace.ticks.partition_point(|t| t.time_s < scheduled.at_s);
            FaultReport {
                cause,
                injected: Some(scheduled.what.name().to_owned()),
                at_s: scheduled.at_s,
                bridge_off_after_s: off_s,
                bridge_was_on: was_on(trace, from),
                estimate_rms_deg: estimate_since(&trace.ticks[from..]),
            }
        })
        .collect();
    for (index, cause) in begins {
        let at_s = trace.ticks[index].time_s;
        let off = trace.ticks[index..].iter().find(|t| !t.actuation.enable).map(|t| t.time_s - at_s);
        reports.push(FaultReport {
            cause: Some(cause),
            injected: None,
            at_s,
            bridge_off_after_s: off,
            bridge_was_on: was_on(trace, index),
            estimate_rms_deg: None,
        });
    }
    reports.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    reports
}

fn was_on(trace: &Trace, tick: usize) -> bool {
    tick.checked_sub(1).is_some_and(|before| trace.ticks[before].actuation.enable)
}

fn estimate_since(ticks: &[Tick]) -> Option<f64> {
    let end = ticks.iter().position(|tick| tick.telemetry.fault.is_some()).unwrap_or(ticks.len());
    estimate_rms(&ticks[..end], |_| true)
}
