//! Angles on the circle.

use std::f64::consts::{PI, TAU};

/// The same angle (rad) within −π … π.
///
/// * An angle in that range is returned as it is, bit for bit, both ends included: π stays π, −π stays −π.
/// * An odd number of half turns gives the end with the angle's own sign: 3π gives π, −3π gives −π.
/// * What is not finite gives NaN.
///
/// The error is that of `angle` itself: 2⁻⁵³ of its size. `control::angle::wrap` has the same convention in `f32`, but gives 0
/// for what is not finite, for a controller must go on.
///
/// ```
/// use std::f64::consts::PI;
///
/// use common::wrap;
///
/// assert_eq!(wrap(-0.1), -0.1);
/// assert_eq!([wrap(PI), wrap(-PI)], [PI, -PI]);
/// assert!((wrap(2.0 * PI + 0.25) - 0.25).abs() < 1e-12);
/// ```
#[inline]
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    if angle.abs() <= PI {
        return angle;
    }
    // The nearest whole number of turns, halves rounded towards zero.
    let turns = ((angle / TAU).abs() - 0.5).ceil().copysign(angle);
    let rest = angle - TAU * turns;
    // An infinite angle leaves NaN, which `clamp` keeps.
    rest.clamp(-PI, PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_itself_is_left_alone() {
        for angle in [-PI, -3.0, -0.1, -f64::MIN_POSITIVE, -0.0, 0.0, 1e-300, 0.1, 3.0, PI] {
            assert_eq!(wrap(angle).to_bits(), angle.to_bits(), "{angle}");
        }
        let (above, below) = (PI.next_up(), (-PI).next_down());
        assert!((wrap(above) + PI).abs() < 1e-15 && (wrap(below) - PI).abs() < 1e-15);
    }

    #[test]
    fn odd_half_turns_keep_their_sign() {
        for half_turns in [1.0, 3.0, 5.0, 7.0, 101.0] {
            let near = 1e-15 * half_turns;
            assert!((wrap(half_turns * PI) - PI).abs() <= near, "{half_turns}");
            assert!((wrap(-half_turns * PI) + PI).abs() <= near, "−{half_turns}");
        }
    }

    #[test]
    fn wrapping_keeps_the_direction() {
        for step in -40_000..40_000 {
            let angle = f64::from(step) * 0.01;
            let wrapped = wrap(angle);
            assert!(wrapped.abs() <= PI, "{angle} became {wrapped}");
            assert!((angle.sin() - wrapped.sin()).abs() < 1e-12 && (angle.cos() - wrapped.cos()).abs() < 1e-12);
        }
    }

    #[test]
    fn large_angles_stay_in_the_range_and_those_that_are_none_are_nan() {
        for angle in [1e6, 1e15, 1e300, f64::MAX] {
            assert!(wrap(angle).abs() <= PI && wrap(-angle).abs() <= PI, "{angle}");
        }
        // 10⁶ turns and a bit.
        assert!((wrap(1e6 * TAU + 0.5) - 0.5).abs() < 1e-8);
        for angle in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(wrap(angle).is_nan());
        }
    }
}
