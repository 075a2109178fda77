//! The host and the controller agree where an angle belongs.

use std::f32::consts::{PI, TAU};

use common::wrap;

/// The controller's answer, the host's to the same number, and what the rounding to `f32` may differ by.
fn both(angle: f32) -> (f64, f64, f64) {
    // A turn as `f32` is 1.7e-7 rad too long, and so many of them are rounded to 2⁻²⁴ of their size.
    let turns = f64::from((angle / TAU).abs()) + 1.0;
    (f64::from(control::angle::wrap(angle)), wrap(f64::from(angle)), 8e-7 * turns)
}

#[test]
fn inside_the_range_both_leave_an_angle_as_it_is() {
    for angle in [-PI.next_down(), -3.0, -0.1, 0.0, 0.1, 3.0, PI.next_down()] {
        let (there, here, _) = both(angle);
        assert_eq!(there, f64::from(angle));
        assert_eq!(here, f64::from(angle));
    }
}

#[test]
fn the_ends_keep_their_sign_in_both() {
    for end in [PI, -PI, 3.0 * PI, -3.0 * PI] {
        let there = control::angle::wrap(end);
        assert!((there - PI.copysign(end)).abs() < 1e-6, "{end} became {there} in the controller");
        let here = wrap(std::f64::consts::PI * f64::from((end / PI).round()));
        assert!(
            (here - std::f64::consts::PI.copysign(f64::from(end))).abs() < 1e-14,
            "{end} became {here} on the host"
        );
    }
}

#[test]
fn both_agree_over_a_thousand_turns() {
    for step in -100_000..100_000_i32 {
        let angle = step as f32 * 0.0628;
        let (there, here, error) = both(angle);
        // At the seam rounding may put them on its two sides.
        let apart = (there - here).abs();
        let apart = if here.abs() > 3.0 { apart.min((apart - std::f64::consts::TAU).abs()) } else { apart };
        assert!(apart <= error, "{angle}: {there} and {here}");
    }
}

/// A controller must go on with something; an analysis must not take nothing for a direction.
#[test]
fn what_is_no_angle_is_zero_in_the_controller_and_nan_on_the_host() {
    for angle in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(control::angle::wrap(angle), 0.0);
        assert!(wrap(f64::from(angle)).is_nan());
    }
}
