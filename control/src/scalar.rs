//! The few scalar functions that `core` lacks or that could panic there.

/// `value` limited to `low ..= high`; `low` for NaN. Unlike `f32::clamp` it cannot panic.
#[inline]
#[must_use]
pub fn clamp(value: f32, low: f32, high: f32) -> f32 {
    if value > high {
        high
    } else if value >= low {
        value
    } else {
        low
    }
}

/// `value`, at most `high`; `high` for NaN.
#[inline]
#[must_use]
pub fn at_most(value: f32, high: f32) -> f32 {
    if value < high { value } else { high }
}

/// −1, 0 or 1: the sign of `value`, 0 for zero and for NaN.
#[inline]
#[must_use]
pub fn sign(value: f32) -> f32 {
    if value > 0.0 {
        1.0
    } else if value < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// `value²`.
#[inline]
#[must_use]
pub fn square(value: f32) -> f32 {
    value * value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clamp_bears_everything() {
        assert!((clamp(2.0, -1.0, 1.0) - 1.0).abs() < 1e-9);
        assert!((clamp(-2.0, -1.0, 1.0) + 1.0).abs() < 1e-9);
        assert!((clamp(0.5, -1.0, 1.0) - 0.5).abs() < 1e-9);
        assert!((clamp(f32::NAN, -1.0, 1.0) + 1.0).abs() < 1e-9);
        assert!((clamp(f32::INFINITY, -1.0, 1.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn sign_of_zero_and_of_no_number_is_zero() {
        assert!(sign(0.0).abs() < 1e-9);
        assert!(sign(f32::NAN).abs() < 1e-9);
        assert!(sign(3.0) > 0.5 && sign(-3.0) < -0.5);
    }
}
