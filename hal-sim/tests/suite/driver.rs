//! From the commanded duty to the duty that arrives.

use crate::common::drive;
use control::Actuation;
use effects::{DriverDeadband, Laws};
use hal_sim::driver::Driver;
use proptest::prelude::*;

const PWM: Driver = Driver { pwm_steps: 2048.0, ..Driver::IDEAL };

#[test]
fn the_register_has_so_many_steps() {
    let distinct: std::collections::BTreeSet<u64> =
        (0..=100_000).map(|i| PWM.effective(drive(i as f32 / 100_000.0)).unwrap().to_bits()).collect();
    assert_eq!(distinct.len(), 2049);
    assert_eq!(PWM.effective(drive(0.4 / 2048.0)), Some(0.0));
    assert_eq!(PWM.effective(drive(0.6 / 2048.0)), Some(1.0 / 2048.0));
}

#[test]
fn dead_time_takes_its_share_of_every_period_that_switches() {
    let driver = Driver { dead_duty: 550e-9 * 20e3, ..PWM };
    assert_eq!(driver.effective(drive(0.5)), Some(0.5 - 0.011));
    assert_eq!(driver.effective(drive(-0.5)), Some(-(0.5 - 0.011)));
    assert_eq!(driver.effective(drive(0.005)), Some(0.0));
    assert_eq!(driver.effective(drive(1.0)), Some(1.0), "a full duty does not switch");
}

#[test]
fn a_deadband_is_missing_inside_and_beyond() {
    let laws = Laws { driver_deadband: Some(DriverDeadband { width_duty: 0.1 }), ..Laws::NONE };
    for (duty, expected) in [(0.09, 0.0), (-0.1, 0.0), (0.3, 0.2), (-1.0, -0.9)] {
        assert!((laws.duty(duty) - expected).abs() < 1e-15, "{}, {expected} expected", laws.duty(duty));
    }
}

#[test]
fn what_is_no_duty_is_made_one() {
    assert_eq!(PWM.effective(drive(f32::NAN)), Some(0.0));
    assert_eq!(PWM.effective(drive(f32::INFINITY)), Some(1.0));
    assert_eq!(PWM.effective(drive(-7.0)), Some(-1.0));
    assert_eq!(PWM.effective(Actuation { duty: 1.0, enable: false }), None);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn odd_bounded_and_never_more_than_asked(duty in -1.5f32..1.5, steps in 0u16..5000, dead in 0.0f64..0.1, band in 0.0f64..0.5) {
        let driver = Driver { pwm_steps: f64::from(steps), dead_duty: dead };
        let laws = Laws { driver_deadband: Some(DriverDeadband { width_duty: band }), ..Laws::NONE };
        let arrives = |duty: f32| laws.duty(driver.effective(drive(duty)).unwrap());
        let out = arrives(duty);
        prop_assert_eq!(arrives(-duty), -out);
        let half_step = if steps > 0 { 0.5 / f64::from(steps) } else { 0.0 };
        prop_assert!(out.abs() <= f64::from(duty.abs()).min(1.0) + half_step);
        prop_assert!(out == 0.0 || out.signum() == f64::from(duty).signum());
    }
}
