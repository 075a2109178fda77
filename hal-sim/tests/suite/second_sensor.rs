//! The second potentiometer: its own draws, its own faults, and the first one as it was.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use crate::common::drive;
use control::AdcCode;
use hal_sim::{Fault, SimulatedRobot};
use robot_file::Robot;
use robot_file::robot::Sensor;

fn two() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/two-sensors.toml")).expect("a robot")
}

fn one() -> Robot {
    let mut robot = two();
    let Sensor::Potentiometer(sensor) = &mut robot.sensor else { panic!("a potentiometer") };
    sensor.second = None;
    robot
}

/// What both show while the shaft turns: time, first, second, battery.
fn run(robot: &mut SimulatedRobot, ticks: usize) -> Vec<(u64, AdcCode, Option<AdcCode>, AdcCode)> {
    let tick = |_| {
        let sample = robot.sample();
        robot.advance(drive(0.9));
        (sample.time_us, sample.angle, sample.second, sample.battery)
    };
    (0..ticks).map(tick).collect()
}

#[test]
fn the_first_sensors_bits_are_those_of_a_robot_without_a_second() {
    for seed in 0..20 {
        let with = run(&mut SimulatedRobot::new(&two(), seed), 500);
        let without = run(&mut SimulatedRobot::new(&one(), seed), 500);
        for (with, without) in with.iter().zip(&without) {
            assert_eq!((with.0, with.1, with.3), (without.0, without.1, without.3));
            assert!(with.2.is_some() && without.2.is_none());
        }
    }
}

#[test]
fn every_specimen_is_mounted_and_errs_in_its_own_way() {
    let mut mountings: Vec<f64> = Vec::new();
    for seed in 0..50 {
        let mut robot = SimulatedRobot::new(&two(), seed);
        let mounting = robot.second_mounting().expect("a second sensor").to_degrees();
        assert!((177.0..=183.0).contains(&mounting), "{mounting}°");
        assert!(mountings.iter().all(|other| (other - mounting).abs() > 1e-6));
        mountings.push(mounting);
        let (first, second): (Vec<_>, Vec<_>) = run(&mut robot, 400).iter().map(|tick| (tick.1, tick.2)).unzip();
        assert!(first.iter().zip(&second).filter(|(one, two)| Some(**one) == **two).count() < 20);
    }
}

#[test]
fn it_reads_the_angle_from_its_own_gap_at_its_own_time() {
    let mut robot = two();
    let Sensor::Potentiometer(sensor) = &mut robot.sensor else { panic!("a potentiometer") };
    for quantity in [
        &mut sensor.adc.noise_lsb,
        &mut sensor.adc.spike_share,
        &mut sensor.adc.jitter_s,
        &mut sensor.adc.inl_lsb,
        &mut sensor.hysteresis_deg,
    ] {
        (quantity.value, quantity.low, quantity.high) = (0.0, 0.0, 0.0);
    }
    let scale = robot_file::angle_code::angle_scale(&Sensor::Potentiometer(sensor.clone()));
    let later_s = sensor.adc.duration_s();
    robot.effects.remove("sensor_nonlinearity");
    let mut robot = SimulatedRobot::new(&robot, 3);
    let mounting = robot.second_mounting().expect("a second sensor");
    let mut seen = 0;
    for tick in 0..800 {
        let second = robot.sample().second.expect("a code");
        let truth = robot.truth();
        robot.advance(drive(0.9));
        // The straight part of the converter, in which the scale holds.
        if tick < 300 || !(300..2800).contains(&second.0) {
            continue;
        }
        let expected = truth.angle + truth.speed * later_s - mounting;
        let error = scale.angle(f64::from(second.0)) - expected;
        let error = error - TAU * (error / TAU).round();
        assert!(error.abs() < 2e-3, "{error} rad at {tick}");
        seen += 1;
    }
    assert!(seen > 200, "{seen}");
    assert!((mounting - PI).abs() < 0.06);
}

#[test]
fn its_faults_are_its_own() {
    let healthy = run(&mut SimulatedRobot::new(&two(), 6), 600);
    for fault in Fault::SECOND {
        assert_eq!(Fault::from_name(fault.name()), Some(fault));
        let mut broken = SimulatedRobot::new(&two(), 6);
        broken.schedule(fault, 0.3);
        let broken = run(&mut broken, 600);
        assert_eq!(broken[..300], healthy[..300], "{}: too early", fault.name());
        assert!(
            broken[300..].iter().zip(&healthy[300..]).any(|(now, then)| now.2 != then.2),
            "{}: no difference",
            fault.name()
        );
        assert!(
            broken.iter().zip(&healthy).all(|(now, then)| (now.1, now.3) == (then.1, then.3)),
            "{}: it shows at the first sensor",
            fault.name()
        );
        let mut alone = SimulatedRobot::new(&one(), 6);
        alone.inject(fault);
        assert_eq!(run(&mut alone, 300), run(&mut SimulatedRobot::new(&one(), 6), 300), "{}", fault.name());
    }
    // And those of the first one are not seen at the second.
    for fault in [Fault::SensorOpen, Fault::SensorShortHigh, Fault::SensorFrozen] {
        let mut broken = SimulatedRobot::new(&two(), 6);
        broken.inject(fault);
        assert!(run(&mut broken, 600).iter().zip(&healthy).all(|(now, then)| now.2 == then.2), "{}", fault.name());
    }
}
