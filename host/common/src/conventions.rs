//! Units and signs where people read and type: degrees, hertz, and the thesis's sign of the actuation frequency.
//!
//! Inside, a shaft turns counter-clockwise with positive speed. The thesis counts the actuation frequency positive when
//! the shaft turns clockwise seen from above. The two meet here and nowhere else.

use std::f64::consts::TAU;

/// Shaft speed (rad/s, counter-clockwise positive) of an actuation frequency (Hz, clockwise positive).
#[must_use]
pub fn omega_from_frequency(f_hz: f64) -> f64 {
    -TAU * f_hz
}

/// Actuation frequency (Hz, clockwise positive) of a shaft speed (rad/s, counter-clockwise positive).
#[must_use]
pub fn frequency_from_omega(omega: f64) -> f64 {
    // A shaft at rest has a frequency of 0 Hz, not of −0 Hz.
    -omega / TAU + 0.0
}

/// An angle in degrees, for people.
#[must_use]
pub fn degrees(rad: f64) -> f64 {
    rad.to_degrees()
}

/// An angle in radians, from a person.
#[must_use]
pub fn radians(deg: f64) -> f64 {
    deg.to_radians()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clockwise_is_a_positive_frequency_and_a_negative_speed() {
        assert_eq!(omega_from_frequency(7.0), -TAU * 7.0);
        assert!((frequency_from_omega(-TAU * 7.0) - 7.0).abs() < 1e-12);
        assert!(frequency_from_omega(0.0).is_sign_positive());
    }
}
