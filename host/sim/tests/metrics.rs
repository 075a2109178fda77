//! The figures of a run against closed forms, on motions made by hand.

use std::f64::consts::TAU;
use std::path::Path;

use control::{Actuation, AdcCode, Fault, Parameters, Sample, State, Telemetry};
use hal_sim::Truth;
use simulation::{Break, DriveCommand, GivenCommand, Scheduled, Tick, Trace, metrics};

const TICK_S: f64 = 1e-3;

fn parameters() -> Parameters {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
    robot_file::design::design(&robot_file::Robot::load(&path).unwrap()).unwrap().parameters
}

/// A tick at a time with a true angle (rad) and speed (rad/s), the estimate exact.
fn tick(time_s: f64, angle: f64, speed: f64) -> Tick {
    let actuation = Actuation { duty: 0.5, enable: true };
    Tick {
        time_s,
        sample: Sample { time_us: (time_s * 1e6).round() as u64, angle: AdcCode(0), second: None, battery: AdcCode(0) },
        actuation,
        telemetry: Telemetry {
            state: State::Speed,
            tracking: true,
            angle: common::wrap(angle) as f32,
            reference_angle: common::wrap(angle) as f32,
            actuation,
            ..Telemetry::default()
        },
        truth: Truth {
            time_s,
            angle,
            speed,
            current: 0.1,
            terminal_v: 2.0,
            bridge_supply_v: 5.0,
            battery_v: 4.0,
            in_gap: false,
        },
    }
}

fn trace(command: DriveCommand, seconds: f64, at: impl Fn(f64) -> Tick) -> Trace {
    let count = (seconds / TICK_S).round() as usize;
    Trace {
        tick_s: TICK_S,
        ticks: (0..count).map(|i| at(i as f64 * TICK_S)).collect(),
        commands: vec![GivenCommand { at_s: 0.0, tick: 0, command, refusal: None }],
        told: Vec::new(),
        kept: Vec::new(),
        faults: Vec::new(),
        parameters: parameters(),
    }
}

#[track_caller]
fn near(value: Option<f64>, expected: f64, tolerance: f64) {
    let value = value.expect("there must be a value");
    assert!((value - expected).abs() <= tolerance, "{value} instead of {expected} ± {tolerance}");
}

#[test]
fn a_first_order_spin_up_settles_when_its_closed_form_does() {
    const TAU_S: f64 = 0.05;
    let omega = -7.0 * TAU;
    let angle = |t: f64| omega * (t - TAU_S * (1.0 - (-t / TAU_S).exp()));
    let speed = |t: f64| omega * (1.0 - (-t / TAU_S).exp());
    let m = metrics(&trace(DriveCommand::Freq { hz: 7.0 }, 2.0, |t| tick(t, angle(t), speed(t))));
    near(m.mean_frequency_hz, 7.0, 1e-6);
    near(m.settling_instantaneous_s, TAU_S * 50f64.ln(), TICK_S);
    // The average over the last turn: (angle(t) − angle(s)) = one turn, and its mean speed 2 % short.
    let turn_average = |t: f64| {
        let (mut low, mut high) = (0.0, t);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (angle(t) - angle(middle)).abs() > TAU { low = middle } else { high = middle }
        }
        TAU / (t - low)
    };
    let (mut low, mut high) = (0.2, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if turn_average(middle) < 0.98 * omega.abs() { low = middle } else { high = middle }
    }
    near(m.settling_s, low, TICK_S);
    near(m.phase_rms_deg, 0.0, 1e-4);
    near(m.estimate_rms_deg, 0.0, 1e-4);
    assert_eq!(m.estimate_rms_blind_deg, None);
    assert!((m.energy_j - 0.5 * 5.0 * 0.1 * 2.0).abs() < 1e-9, "duty × supply × current × time: {}", m.energy_j);
}

#[test]
fn a_speed_that_leaves_the_band_again_has_not_settled_before() {
    let omega = -7.0 * TAU;
    let dip = |t: f64| if (1.0..1.01).contains(&t) { 0.9 } else { 1.0 };
    let m = metrics(&trace(DriveCommand::Freq { hz: 7.0 }, 2.0, |t| tick(t, omega * t, omega * dip(t))));
    near(m.settling_instantaneous_s, 1.01, 1.5 * TICK_S);
    let wrong_way = metrics(&trace(DriveCommand::Freq { hz: -7.0 }, 2.0, |t| tick(t, omega * t, omega)));
    assert_eq!((wrong_way.settling_s, wrong_way.settling_instantaneous_s), (None, None));
}

#[test]
fn the_estimate_is_judged_inside_and_outside_the_arc() {
    let m = metrics(&trace(DriveCommand::Freq { hz: 7.0 }, 1.0, |t| {
        let mut tick = tick(t, 0.5, 0.0);
        tick.telemetry.tracking = t >= 0.2;
        tick.telemetry.blind = t >= 0.6;
        // Before the angle is known anything goes; then 1° outside, 3° inside, across the wrap.
        let off: f64 = if t < 0.2 {
            90.0
        } else if t < 0.6 {
            1.0
        } else {
            -3.0
        };
        tick.truth.angle += TAU * 5.0;
        tick.telemetry.angle = (0.5 + off.to_radians()) as f32;
        tick
    }));
    near(m.estimate_rms_deg, 1.0, 1e-4);
    near(m.estimate_rms_blind_deg, 3.0, 1e-4);
    near(m.acquired_s, 0.2, 1e-9);
}

fn swing(turns_beyond: impl Fn(f64) -> f64) -> simulation::Metrics {
    let style = control::Stroke::BangBang;
    let command = DriveCommand::Oscillate { from_deg: -100.0, to_deg: 100.0, style };
    metrics(&trace(command, 3.0, |t| {
        let angle = 105f64.to_radians() * (TAU * 4.0 * t).sin() + TAU * turns_beyond(t);
        tick(t, angle, 0.0)
    }))
}

#[test]
fn turning_points_and_strokes_that_run_away() {
    let good = swing(|_| 0.0);
    // 12 swings have 24 reversals; the first is the acquisition's, and the last stroke is under way.
    assert_eq!(good.turning_points_deg.len(), 23);
    for (index, deg) in good.turning_points_deg.iter().enumerate() {
        let expected = if index % 2 == 0 { -105.0 } else { 105.0 };
        assert!((deg - expected).abs() < 0.05, "{deg}");
    }
    near(good.turning_error_median_deg, 5.0, 0.05);
    near(good.turning_error_worst_deg, 5.0, 0.05);
    near(good.oscillation_frequency_hz, 4.0, 0.01);
    assert_eq!(good.strokes_ran_away, 0);

    // One upward stroke goes on for a whole turn: its turning point looks right, its length gives it away.
    let up = |t: f64| ((t - 1.4375) / 0.125).clamp(0.0, 1.0);
    let once = swing(up);
    assert_eq!(once.strokes_ran_away, 1);
    // It never turns: one stroke, without end.
    let style = control::Stroke::BangBang;
    let command = DriveCommand::Oscillate { from_deg: -100.0, to_deg: 100.0, style };
    let never = metrics(&trace(command, 3.0, |t| tick(t, 40.0 * t, 40.0)));
    assert_eq!((never.strokes_ran_away, never.turning_points_deg.len()), (1, 0));
}

#[test]
fn faults_are_reported_with_cause_and_delay() {
    let mut run = trace(DriveCommand::Freq { hz: 7.0 }, 2.0, |t| {
        let mut tick = tick(t, 0.0, 0.0);
        if t >= 1.25 {
            tick.telemetry.fault = Some(Fault::Stall);
            tick.telemetry.state = State::Fault;
            tick.actuation = Actuation::OFF;
        }
        tick
    });
    let unprovoked = metrics(&run).faults;
    assert_eq!(unprovoked.len(), 1);
    assert_eq!((unprovoked[0].cause.as_deref(), unprovoked[0].injected.as_deref()), (Some("Stall"), None));
    near(Some(unprovoked[0].at_s), 1.25, 1e-9);
    assert!(unprovoked[0].bridge_was_on, "until the tick that found it");
    assert_eq!(unprovoked[0].bridge_off_after_s, Some(0.0));

    run.faults = vec![Scheduled { at_s: 1.0, what: Break::Robot(hal_sim::Fault::Stalled) }];
    let provoked = metrics(&run).faults;
    assert_eq!(provoked.len(), 1);
    assert_eq!(provoked[0].injected.as_deref(), Some("stalled"));
    near(provoked[0].bridge_off_after_s, 0.25, 1.5 * TICK_S);
    assert!(provoked[0].bridge_was_on);
    run.faults[0].at_s = 1.5;
    let late = &metrics(&run).faults[1];
    assert_eq!((late.bridge_was_on, late.bridge_off_after_s), (false, Some(0.0)), "it was off already");
    run.faults[0].at_s = 1.0;

    for tick in &mut run.ticks {
        tick.telemetry.fault = None;
        tick.actuation = Actuation { duty: 0.5, enable: true };
    }
    let missed = &metrics(&run).faults[0];
    assert_eq!((missed.cause.as_deref(), missed.bridge_off_after_s), (None, None));
}
