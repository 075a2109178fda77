//! Angles on the circle.

use core::f32::consts::{PI, TAU};

/// The same angle within −π … π. 0 for what is not finite.
#[inline]
#[must_use]
pub fn wrap(angle: f32) -> f32 {
    if angle.abs() <= PI {
        return angle;
    }
    if !angle.is_finite() {
        return 0.0;
    }
    // The usual case is one turn too many or too few.
    let once = if angle > 0.0 { angle - TAU } else { angle + TAU };
    if once.abs() <= PI { once } else { angle - TAU * nearest(angle / TAU) }
}

/// The nearest whole number, as far as `i32` reaches; farther out an `f32` holds no fraction of a turn anyway.
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates, and beyond its range there is no angle left")]
#[expect(clippy::cast_precision_loss, reason = "exact below 2^24 turns")]
fn nearest(value: f32) -> f32 {
    let half = if value > 0.0 { 0.5 } else { -0.5 };
    (value + half) as i32 as f32
}

/// The binary angle of an angle (rad): the turn in 2³² parts, half a turn and −half a turn being the same. Differences
/// wrap by themselves and sums are exact, in integers: all that a core without a floating-point unit has.
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates at half a turn")]
#[must_use]
pub fn to_binary(angle: f32) -> i32 {
    (wrap(angle) * (0.5 * TURN_PARTS / PI)) as i32
}

/// rad in one part of a binary angle.
pub const BINARY_PART: f32 = TAU / TURN_PARTS;
const TURN_PARTS: f32 = 4_294_967_296.0;

/// An angle that is followed over whole turns: the wrapped value and the turns beside it.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Unwrapped {
    wrapped: f32,
    turns: f32,
}

impl Unwrapped {
    /// Starts at `angle` (rad, wrapped) in the turn whose middle is nearest to `center` (rad).
    #[must_use]
    pub fn near(angle: f32, center: f32) -> Self {
        let wrapped = wrap(angle);
        Self { wrapped, turns: nearest((center - wrapped) / TAU) }
    }

    /// Follows to the next wrapped angle the short way; rad since the beginning.
    pub fn follow(&mut self, angle: f32) -> f32 {
        let next = wrap(angle);
        let step = next - self.wrapped;
        if step > PI {
            self.turns -= 1.0;
        } else if step < -PI {
            self.turns += 1.0;
        }
        self.wrapped = next;
        self.value()
    }

    /// Angle over whole turns, rad.
    #[must_use]
    pub fn value(&self) -> f32 {
        self.wrapped + TAU * self.turns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrap_stays_within_half_a_turn_and_keeps_the_direction() {
        for step in -4000..4000i16 {
            let angle = f32::from(step) * 0.01;
            let wrapped = wrap(angle);
            assert!(wrapped.abs() <= PI + 1e-5, "{angle} -> {wrapped}");
            assert!((angle.sin() - wrapped.sin()).abs() < 1e-4 && (angle.cos() - wrapped.cos()).abs() < 1e-4);
        }
    }

    #[test]
    fn wrap_of_nonsense_is_zero() {
        for angle in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(wrap(angle).abs() < 1e-9);
        }
    }

    #[test]
    fn binary_angles_wrap_by_themselves() {
        for (from, to) in [(3.1f32, -3.1f32), (-3.1, 3.1), (0.3, -0.2), (PI, -PI), (0.0, 3.0)] {
            let difference = to_binary(to).wrapping_sub(to_binary(from)) as f32 * BINARY_PART;
            assert!((difference - wrap(to - from)).abs() < 1e-6, "{from} to {to}: {difference}");
        }
    }

    #[test]
    fn unwrapped_follows_both_ways_over_the_seam() {
        let mut angle = Unwrapped::near(3.0, 0.0);
        for step in 1..200i16 {
            let truth = 3.0 + 0.1 * f32::from(step);
            assert!((angle.follow(wrap(truth)) - truth).abs() < 1e-4);
        }
        let mut angle = Unwrapped::near(-3.0, 0.0);
        for step in 1..200i16 {
            let truth = -3.0 - 0.1 * f32::from(step);
            assert!((angle.follow(wrap(truth)) - truth).abs() < 1e-4);
        }
    }

    #[test]
    fn unwrapped_starts_in_the_turn_nearest_to_the_center() {
        assert!((Unwrapped::near(-3.0, 3.2).value() - (TAU - 3.0)).abs() < 1e-5);
        assert!((Unwrapped::near(1.0, -5.0).value() - (1.0 - TAU)).abs() < 1e-5);
    }
}
