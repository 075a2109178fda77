//! Every fault changes something, at its time and not before.

use crate::common::{default_robot, drive, quiet_robot};
use control::{Actuation, Sample};
use hal_sim::{Fault, Settings, SimulatedRobot, Truth};

fn run(robot: &mut SimulatedRobot, ticks: usize) -> Vec<(Sample, Truth)> {
    (0..ticks)
        .map(|_| {
            let sample = robot.sample();
            robot.advance(drive(0.9));
            (sample, robot.truth())
        })
        .collect()
}

#[test]
fn every_fault_changes_something_at_its_time() {
    let robot = default_robot();
    let healthy = run(&mut SimulatedRobot::new(&robot, 6), 600);
    for fault in Fault::ALL {
        let mut broken = SimulatedRobot::new(&robot, 6);
        broken.schedule(fault, 0.3);
        let broken = run(&mut broken, 600);
        assert_eq!(broken[..300], healthy[..300], "{}: too early", fault.name());
        assert_ne!(broken[300..], healthy[300..], "{}: no difference", fault.name());
    }
}

#[test]
fn injecting_is_scheduling_for_now() {
    let robot = default_robot();
    for fault in Fault::ALL {
        let mut injected = SimulatedRobot::new(&robot, 6);
        run(&mut injected, 200);
        let mut scheduled = injected.clone();
        injected.inject(fault);
        scheduled.schedule(fault, 0.0);
        assert_eq!(run(&mut injected, 200), run(&mut scheduled, 200), "{}", fault.name());
    }
}

#[test]
fn names_lead_back() {
    for fault in Fault::ALL {
        assert_eq!(Fault::from_name(fault.name()), Some(fault));
    }
    assert_eq!(Fault::from_name("sensor"), None);
}

fn after(fault: Fault) -> Vec<(Sample, Truth)> {
    let mut robot = SimulatedRobot::with(&quiet_robot(), 6, &Settings::default());
    run(&mut robot, 500);
    robot.inject(fault);
    run(&mut robot, 500)
}

#[test]
fn shorted_lines_read_the_end_of_the_scale() {
    assert!(after(Fault::SensorShortLow).iter().all(|(sample, _)| sample.angle.0 == 0));
    assert!(after(Fault::SensorShortHigh).iter().all(|(sample, _)| sample.angle.0 == 4095));
}

#[test]
fn a_frozen_converter_repeats_itself_while_the_shaft_turns() {
    let run = after(Fault::SensorFrozen);
    assert!(run.iter().all(|(sample, _)| sample.angle == run[0].0.angle));
    assert!(run[499].1.angle - run[0].1.angle > 5.0);
}

/// Readings from 0.1 s on of a shaft that stands on the track, with and without a fault.
fn at_rest(fault: Fault) -> Vec<(f64, f64)> {
    let settings = Settings { start_angle: Some(1.5), ..Settings::default() };
    let mut healthy = SimulatedRobot::with(&quiet_robot(), 6, &settings);
    let mut broken = healthy.clone();
    broken.schedule(fault, 0.1);
    let read = |robot: &mut SimulatedRobot| {
        let code = f64::from(robot.sample().angle.0);
        robot.advance(Actuation::OFF);
        code
    };
    let pairs: Vec<_> = (0..600).map(|_| (read(&mut healthy), read(&mut broken))).collect();
    assert!(pairs[..100].iter().all(|(healthy, broken)| healthy == broken), "{}: too early", fault.name());
    pairs[100..].to_vec()
}

#[test]
fn a_bad_contact_adds_noise_of_its_size_and_no_offset() {
    let pairs = at_rest(Fault::SensorNoisy { share: 0.03 });
    let errors: Vec<f64> = pairs.iter().map(|(healthy, broken)| (broken - healthy) / 4095.0).collect();
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let deviation = (errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / count).sqrt();
    // The converter's range ends below the supply: a share of the supply is a little more of its codes.
    assert!((0.025..0.045).contains(&deviation), "{deviation}");
    assert!(mean.abs() < 0.006, "{mean}");
    let alike = errors.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert!(alike < 20, "every tick has its own: {alike} repeated");
}

#[test]
fn a_drifting_reading_leaves_at_its_rate() {
    let pairs = at_rest(Fault::SensorDrifting { share_per_s: 0.2 });
    let off = |index: usize| (pairs[index].1 - pairs[index].0) / 4095.0;
    assert!(off(0).abs() < 0.002, "{}", off(0));
    let (half, whole) = (off(200), off(400));
    assert!((0.03..0.06).contains(&half), "0.04 of the scale after 0.2 s: {half}");
    assert!((whole / half - 2.0).abs() < 0.15, "{half}, {whole}");
}

#[test]
fn a_supply_that_is_too_high_saturates_the_converter_for_a_part_of_the_turn() {
    let run = after(Fault::AdcSaturated { factor: 5.0 / 3.3 });
    let saturated = run.iter().filter(|(sample, _)| sample.angle.0 == 4095).count() as f64 / run.len() as f64;
    assert!((0.3..0.8).contains(&saturated), "{saturated} of the readings");
    let pairs = at_rest(Fault::AdcSaturated { factor: 1.2 });
    assert!(pairs.iter().all(|(healthy, broken)| (broken / healthy - 1.2).abs() < 0.1), "{:?}", pairs[0]);
}

#[test]
fn a_broken_wiper_lead_no_longer_shows_the_angle() {
    let healthy = {
        let mut robot = SimulatedRobot::with(&quiet_robot(), 6, &Settings::default());
        run(&mut robot, 500);
        run(&mut robot, 500)
    };
    let open = after(Fault::SensorOpen);
    let same = open.iter().zip(&healthy).filter(|(a, b)| a.0.angle.0.abs_diff(b.0.angle.0) < 5).count();
    assert!(same < 200, "{same} of 500 readings as if nothing had happened");
    assert_eq!(open[499].1, healthy[499].1, "the shaft is not concerned");
}

#[test]
fn a_blocked_shaft_stands_and_draws_its_stall_current() {
    let run = after(Fault::Stalled);
    let truth = run[499].1;
    assert_eq!(truth.speed, 0.0);
    assert_eq!(truth.angle, run[0].1.angle);
    assert!(truth.current > 0.13, "{} A", truth.current);
}

#[test]
fn swapped_leads_turn_the_other_way() {
    assert!(after(Fault::MotorReversed)[499].1.speed < -10.0);
}

#[test]
fn a_broken_motor_lead_lets_the_shaft_run_down() {
    let truth = after(Fault::MotorOpen)[499].1;
    assert_eq!(truth.current, 0.0);
    assert!(truth.speed.abs() < 0.1, "{} rad/s", truth.speed);
}

#[test]
fn an_empty_cell_and_a_collapsed_rail_are_seen() {
    let truth = after(Fault::BatteryLow { open_circuit_v: 2.9 })[499].1;
    assert!(truth.battery_v < 2.9, "{} V", truth.battery_v);
    let truth = after(Fault::RailLow { rail_v: 2.0 })[499].1;
    assert!(truth.bridge_supply_v <= 2.0 && truth.speed.abs() < 0.1, "{truth:?}");
}
