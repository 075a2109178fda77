//! Readings that follow the shaft with a memory, and play between the two.

use crate::common::{default_robot, drive};
use control::Actuation;
use effects::{ClockDrift, Effect, HeldSamples, Laws, SensorHysteresis, SensorLag, States};
use hal_sim::{Settings, SimulatedRobot};
use robot_file::angle_code::angle_scale;
use robot_file::robot::{Quantity, Robot, Sensor};

fn lag(time_s: f64) -> Laws {
    Laws { sensor_lag: Some(SensorLag { time_s }), ..Laws::NONE }
}

/// What is read after a shaft has moved through angles (rad), a step (s) between them.
fn read(laws: &Laws, angles: &[f64], step: f64) -> Vec<f64> {
    let mut states = States::default();
    let follow = |pair: &[f64]| {
        laws.follow(&mut states, pair[1] - pair[0], step);
        pair[1] - laws.behind(&states)
    };
    angles.windows(2).map(follow).collect()
}

#[test]
fn a_lag_answers_a_step_and_a_ramp_in_closed_form() {
    let (time, step) = (8e-3, 1e-4);
    // A jump within a step of next to no time, then nothing.
    let mut states = States::default();
    let laws = lag(time);
    laws.follow(&mut states, 1.0, 1e-12);
    for n in 1..400 {
        laws.follow(&mut states, 0.0, step);
        let (behind, expected) = (laws.behind(&states), (-f64::from(n) * step / time).exp());
        assert!((behind - expected).abs() < 1e-9, "{behind}, {expected} expected");
    }
    // Behind a shaft of even speed by speed × T, whatever the step.
    for step in [1e-5, 1e-3, 0.1] {
        let ramp: Vec<f64> = (0..2000).map(|n| 30.0 * f64::from(n) * step).collect();
        let behind = ramp[1999] - read(&laws, &ramp, step)[1998];
        let expected = 30.0 * time * (1.0 - (-1999.0 * step / time).exp());
        assert!((behind - expected).abs() < 1e-9, "{behind} rad, {expected} expected");
    }
    let mut settled = States::default();
    laws.settle(&mut settled, 30.0, 1.0);
    assert!((laws.behind(&settled) - 30.0 * time).abs() < 1e-12);
}

#[test]
fn hysteresis_is_as_wide_as_its_gap() {
    let law = SensorHysteresis { gap_rad: 0.06 };
    let laws = Laws { sensor_hysteresis: Some(law), ..Laws::NONE };
    let angles: Vec<f64> = (0..4000).map(|n| (0.004 * f64::from(n)).sin()).collect();
    let readings = read(&laws, &angles, 1e-3);
    // Once dragged along: half of the gap behind on the way up, ahead on the way down, nothing between the two.
    for n in 600..3999 {
        let (angle, speed) = (angles[n + 1], (0.004 * (n as f64 + 1.0)).cos());
        let behind = angle - readings[n];
        assert!(behind.abs() <= 0.03 + 1e-12);
        // 0.06 rad after a turning point it drags again.
        if 1.0 - angle.abs() > 0.061 {
            assert!((behind - 0.03f64.copysign(speed)).abs() < 1e-9, "{behind} rad at {angle}");
        }
    }
    let widest = |up: bool| {
        let at = |n: &usize| (readings[*n] - 0.5).abs() < 2e-3 && ((0.004 * (*n as f64 + 1.0)).cos() > 0.0) == up;
        angles[(700..3999).find(at).unwrap() + 1]
    };
    assert!((widest(true) - widest(false) - 0.06).abs() < 8e-3, "{} and {}", widest(true), widest(false));
}

#[test]
fn what_follows_adds_up_in_a_row() {
    // The lag follows what the play gives on.
    let laws = Laws { sensor_hysteresis: Some(SensorHysteresis { gap_rad: 0.02 }), ..lag(5e-3) };
    let ramp: Vec<f64> = (0..3000).map(|n| 2.0 * f64::from(n) * 1e-4).collect();
    let behind = ramp[2999] - read(&laws, &ramp, 1e-4)[2998];
    assert!((behind - (0.01 + 2.0 * 5e-3)).abs() < 1e-9, "{behind} rad");
}

fn quantity(value: f64) -> Quantity {
    Quantity { value, low: value, high: value, source: "test".to_owned() }
}

/// The default robot with an ideal sensor and an effect.
fn ideal<E: Effect>(value: f64) -> Robot {
    let mut robot = default_robot();
    robot.sensor = Sensor::Ideal;
    robot.effects.remove("sensor_nonlinearity");
    robot.effects.insert::<E>(vec![quantity(value)]);
    robot
}

/// Largest error of the reading in degrees, and the true speed's at that time, over a second of driving.
fn errors(robot: &Robot) -> Vec<(f64, f64)> {
    let scale = angle_scale(&robot.sensor);
    let mut simulated = SimulatedRobot::with(robot, 1, &Settings { start_angle: Some(0.0), ..Settings::default() });
    (0..1000)
        .map(|tick| {
            let sample = simulated.sample();
            let truth = simulated.truth();
            let error = common_wrap(scale.angle(f64::from(sample.angle.0)) - truth.angle);
            simulated.advance(if tick < 700 { drive(1.0) } else { Actuation { duty: 0.0, enable: true } });
            (error, truth.speed)
        })
        .collect()
}

fn common_wrap(angle: f64) -> f64 {
    (angle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI
}

#[test]
fn the_robots_reading_lags_and_plays() {
    // The ideal sensor's code.
    let code = angle_scale(&Sensor::Ideal).rad_per_code;
    let (error, speed) = errors(&ideal::<SensorLag>(6e-3))[699];
    assert!((error + 6e-3 * speed).abs() < code, "{error} rad at {speed} rad/s");
    assert!(speed > 20.0);
    let (error, _) = errors(&ideal::<SensorHysteresis>(2.0))[699];
    assert!((error + 1f64.to_radians()).abs() < code, "{error} rad");
}

#[test]
fn held_readings_repeat_as_often_as_the_file_says_and_are_late_on_average() {
    const SHARE: f64 = 0.6;
    let code = angle_scale(&Sensor::Ideal).rad_per_code;
    let mut robot = ideal::<HeldSamples>(SHARE);
    robot.effects.remove("stribeck_friction");
    let mut simulated = SimulatedRobot::with(&robot, 1, &Settings { start_angle: Some(0.0), ..Settings::default() });
    let scale = angle_scale(&robot.sensor);
    let (mut held, mut late, mut last) = (0, 0.0, None);
    const SKIPPED: usize = 500;
    const TICKS: usize = 20_000;
    for tick in 0..SKIPPED + TICKS {
        let (angle, truth) = (simulated.sample().angle.0, simulated.truth());
        if tick >= SKIPPED {
            held += usize::from(last == Some(angle));
            late -= common_wrap(scale.angle(f64::from(angle)) - truth.angle) / (truth.speed * 1e-3);
            // Nothing but an earlier reading is ever shown.
            assert!(common_wrap(scale.angle(f64::from(angle)) - truth.angle) < code);
        }
        last = Some(angle);
        simulated.advance(drive(1.0));
    }
    let (held, late) = (held as f64 / TICKS as f64, late / TICKS as f64);
    // Four standard deviations of so many draws; a stretch of held readings is 1/(1 − share) long.
    assert!((held - SHARE).abs() < 4.0 * (SHARE * (1.0 - SHARE) / TICKS as f64).sqrt(), "{held} are held");
    assert!((late - SHARE / (1.0 - SHARE)).abs() < 0.1, "{late} samples late");
}

#[test]
fn a_drifting_clock_is_later_and_later_but_never_early() {
    let code = angle_scale(&Sensor::Ideal).rad_per_code;
    for (tick, ppm) in [(100, 5000.0), (699, 5000.0), (699, 1000.0)] {
        let (error, speed) = errors(&ideal::<ClockDrift>(ppm))[tick];
        let age = 1e-6 * ppm * 1e-3 * tick as f64;
        assert!(speed > 20.0 && (error + age * speed).abs() < 1.5 * code, "{error} rad at {speed} rad/s");
    }
    let (error, _) = errors(&ideal::<ClockDrift>(-5000.0))[699];
    assert!(error.abs() < code, "{error} rad");
}
