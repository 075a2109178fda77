//! The usual step against a ten times finer one, and the order at which the error falls.

use crate::common::{FULL, LINEAR, default_robot, drive as duty, driven};
use hal_sim::shaft::{Shaft, ShaftState};
use hal_sim::{Settings, SimulatedRobot, Truth};

/// The state after 0.5 s of a smooth drive that reverses many times, piecewise constant over 1 ms as a controller's is.
fn drive(shaft: &Shaft, step: f64) -> ShaftState {
    let stepper = shaft.stepper(step);
    let per_tick = (1e-3 / step).round() as usize;
    let mut state = ShaftState::default();
    for tick in 0..500 {
        let voltage = 5.0 * (0.044 * f64::from(tick)).sin();
        for _ in 0..per_tick {
            stepper.advance(&mut state, driven(voltage));
        }
    }
    state
}

fn error(shaft: &Shaft, step: f64, reference: &ShaftState) -> f64 {
    (drive(shaft, step).angle - reference.angle).abs()
}

#[test]
fn a_ten_times_finer_step_says_the_same() {
    // One code of the converter is 1.5e-3 rad: stay far below a tenth of it.
    for (name, shaft, bound) in [("linear", LINEAR, 1e-5), ("with every effect", FULL, 1e-4)] {
        let fine = drive(&shaft, 1e-5);
        let usual = drive(&shaft, 1e-4);
        let apart = (usual.angle - fine.angle).abs();
        println!(
            "{name}: angle after 0.5 s differs by {apart:.1e} rad, speed by {:.1e} rad/s",
            usual.speed - fine.speed
        );
        assert!(apart < bound, "{name}: {apart} rad");
    }
}

#[test]
fn the_linear_motor_converges_with_the_second_order() {
    // Without inductance: after every change of the voltage the current's rise within a step bends the speed, which
    // costs a part of the order (1.7 observed) at an error of 1e-6 rad.
    let shaft = Shaft { inductance_h: 0.0, ..LINEAR };
    let reference = drive(&shaft, 1e-6);
    let (coarse, fine) = (error(&shaft, 2e-4, &reference), error(&shaft, 5e-5, &reference));
    let order = (coarse / fine).log2() / 2.0;
    println!("order {order:.2}");
    assert!((1.8..2.3).contains(&order), "order {order}: {coarse} to {fine}");
}

#[test]
fn with_every_effect_the_error_still_falls() {
    let reference = drive(&FULL, 1e-6);
    let errors: Vec<f64> = [5e-4, 1e-4, 2e-5].iter().map(|&step| error(&FULL, step, &reference)).collect();
    println!("errors {errors:?}");
    // The bridge's kink and the stops are crossed within a step: between first and second order.
    assert!(errors[1] < 0.3 * errors[0] && errors[2] < 0.3 * errors[1], "{errors:?}");
}

/// The default robot, every effect of its file on, after 2 s of a drive that holds, reverses and stops.
fn whole(steps_per_tick: usize) -> Truth {
    let settings = Settings { steps_per_tick, charge: Some(0.8), start_angle: Some(0.4), ..Settings::default() };
    let mut robot = SimulatedRobot::with(&default_robot(), 1, &settings);
    for tick in 0..2000 {
        robot.advance(duty([0.9, -0.7, 0.3, 1.0][tick / 150 % 4]));
    }
    robot.truth()
}

#[test]
fn the_default_robots_step_is_fine_enough() {
    let (usual, fine) = (whole(Settings::default().steps_per_tick), whole(100));
    let (angle, speed) = (usual.angle - fine.angle, usual.speed - fine.speed);
    for steps in [1, 2, 5, 20] {
        println!("{steps} steps a tick: {:.1e} rad", whole(steps).angle - fine.angle);
    }
    println!("10 steps a tick: {angle:.1e} rad and {speed:.1e} rad/s off after {:.0} rad", fine.angle);
    assert!(angle.abs() < 1e-3 && speed.abs() < 1e-3, "{angle} rad, {speed} rad/s");
}
