//! From a raw code to an angle, and where that angle can be believed.
//!
//! The blind arc is wider than the potentiometer's gap: the ADC reads zero near one end of the track and saturates near
//! the other. Codes near either end can only come from the arc. The arc is not symmetric about shaft angle 0.

use core::f32::consts::TAU;

use micromath::F32Ext;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::angle::wrap;
use crate::error::ParameterError;
use crate::sample::AdcCode;
use crate::scalar::clamp;

/// Points of the nominal curve from code to angle.
pub const KNOTS: usize = 16;
/// Harmonics of a correction: two of the potentiometer, up to six for the converter's integral nonlinearity.
pub const HARMONICS: usize = 6;

/// From this speed on the wiper is taken to lag by all of its half play, rad/s.
const PLAY_SPEED: f32 = 5.0;

/// A point of the nominal curve.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, Schema)]
pub struct Knot {
    /// ADC code.
    pub code: f32,
    /// Angle, rad, not wrapped.
    pub angle: f32,
}

/// Amplitudes of one harmonic of the correction, rad.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, Schema)]
pub struct Harmonic {
    /// Of cos kφ.
    pub cos: f32,
    /// Of sin kφ.
    pub sin: f32,
}

/// The sensor as the design knows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SensorMap {
    /// φ(code), straight between knots whose codes increase.
    pub knots: [Knot; KNOTS],
    /// θ = φ + Σ cos_k cos kφ + sin_k sin kφ, k = 1, 2, …
    pub harmonics: [Harmonic; HARMONICS],
    /// How many of them count; 0 for an uncalibrated sensor.
    pub harmonic_count: u16,
    /// Codes below can only come from the blind arc.
    pub lowest_code: u16,
    /// Codes above can only come from the blind arc.
    pub highest_code: u16,
    /// The arc begins here (turning counter-clockwise into it), rad, −π … 0. Equal to `blind_to` for no arc.
    pub blind_from: f32,
    /// The arc ends here, rad, 0 … π.
    pub blind_to: f32,
    /// This far outside its edges a reading is not yet believed, rad.
    pub edge_margin: f32,
    /// Half of the wiper's play, rad: while the shaft turns, the wiper lags by it.
    pub half_play: f32,
}

/// What a code says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Shaft angle, rad, −π … π.
    Angle(f32),
    /// A code of the low end: somewhere in the arc, or shorted to ground.
    LowEnd,
    /// A code of the high end: somewhere in the arc, or shorted to the supply.
    HighEnd,
}

impl SensorMap {
    /// Every code is an angle, and that angle is 0: what a map is filled from.
    pub const EMPTY: Self = Self {
        knots: [Knot { code: 0.0, angle: 0.0 }; KNOTS],
        harmonics: [Harmonic { cos: 0.0, sin: 0.0 }; HARMONICS],
        harmonic_count: 0,
        lowest_code: 0,
        highest_code: u16::MAX,
        blind_from: 0.0,
        blind_to: 0.0,
        edge_margin: 0.0,
        half_play: 0.0,
    };

    /// Reads a code.
    #[must_use]
    pub fn read(&self, code: AdcCode) -> Reading {
        if code.0 < self.lowest_code {
            Reading::LowEnd
        } else if code.0 > self.highest_code {
            Reading::HighEnd
        } else {
            Reading::Angle(self.angle(code))
        }
    }

    /// Angle of a code wherever it comes from, rad, −π … π.
    #[must_use]
    pub fn angle(&self, code: AdcCode) -> f32 {
        let nominal = self.nominal(f32::from(code.0));
        if self.harmonic_count == 0 { wrap(nominal) } else { wrap(nominal + self.correction(nominal)) }
    }

    fn nominal(&self, code: f32) -> f32 {
        let [mut left, mut right, ..] = self.knots;
        for next in self.knots.iter().skip(2) {
            // The last knot is repeated to the end; beyond it the last line goes on.
            if code <= right.code || next.code <= right.code {
                break;
            }
            (left, right) = (right, *next);
        }
        left.angle + (code - left.code) / (right.code - left.code) * (right.angle - left.angle)
    }

    /// The Fourier sum by Clenshaw's recurrence.
    fn correction(&self, nominal: f32) -> f32 {
        let first = wrap(nominal);
        // By name: where std is linked its own methods would come first, and the host would compute other bits than a chip.
        let (cos, sin) = (F32Ext::cos(first), F32Ext::sin(first));
        let twice = 2.0 * cos;
        let (mut even, mut even_before) = (0.0, 0.0);
        let (mut odd, mut odd_before) = (0.0, 0.0);
        for harmonic in self.harmonics.iter().take(usize::from(self.harmonic_count)).rev() {
            (even, even_before) = (harmonic.cos + twice * even - even_before, even);
            (odd, odd_before) = (harmonic.sin + twice * odd - odd_before, odd);
        }
        even * cos - even_before + odd * sin
    }

    /// How far the wiper is behind the shaft at a speed (rad/s), rad. Where the speed is hardly known, neither is this.
    #[must_use]
    pub fn lag(&self, speed: f32) -> f32 {
        self.half_play * clamp(speed * (1.0 / PLAY_SPEED), -1.0, 1.0)
    }

    /// Whether there is a blind arc at all.
    #[must_use]
    pub fn has_arc(&self) -> bool {
        self.blind_to > self.blind_from
    }

    /// Whether an angle (rad, wrapped) lies in the blind arc or within the edge margin of it.
    #[must_use]
    pub fn is_blind(&self, angle: f32) -> bool {
        self.has_arc() && angle > self.blind_from - self.edge_margin && angle < self.blind_to + self.edge_margin
    }

    /// Width of the arc, rad.
    #[must_use]
    pub fn arc_width(&self) -> f32 {
        self.blind_to - self.blind_from
    }

    /// Refuses a map that is no function of the code. The edge margin's range is in [`crate::parameters::table`].
    ///
    /// # Errors
    /// The first entry that is not finite or out of its range, by name.
    pub fn check(&self) -> Result<(), ParameterError> {
        let finite =
            |name, value: f32| if value.is_finite() { Ok(()) } else { Err(ParameterError::NonFinite { name }) };
        for knot in &self.knots {
            finite("sensor.knots", knot.code)?;
            finite("sensor.knots", knot.angle)?;
        }
        // Equal codes at the end repeat the last knot; two make a line at least.
        let mut first = true;
        for (left, right) in self.knots.iter().zip(self.knots.iter().skip(1)) {
            let span = right.code - left.code;
            if span < 0.0 || (first && span <= 0.0) {
                return Err(ParameterError::NonPositive { name: "sensor.knots", value: span });
            }
            first = false;
        }
        for harmonic in &self.harmonics {
            for value in [harmonic.cos, harmonic.sin] {
                finite("sensor.harmonics", value)?;
                if value.abs() > 1.0 {
                    return Err(ParameterError::OutOfRange { name: "sensor.harmonics", value, low: -1.0, high: 1.0 });
                }
            }
        }
        range("sensor.harmonic_count", f32::from(self.harmonic_count), 0.0, HARMONICS as f32)?;
        range("sensor.lowest_code", f32::from(self.lowest_code), 0.0, f32::from(self.highest_code))?;
        range("sensor.blind_from", self.blind_from, -0.5 * TAU, 0.0)?;
        range("sensor.blind_to", self.blind_to, 0.0, 0.5 * TAU)?;
        range("sensor.half_play", self.half_play, 0.0, 0.1)
    }
}

pub(crate) fn range(name: &'static str, value: f32, low: f32, high: f32) -> Result<(), ParameterError> {
    if !value.is_finite() {
        Err(ParameterError::NonFinite { name })
    } else if value < low || value > high {
        Err(ParameterError::OutOfRange { name, value, low, high })
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correction_is_the_fourier_sum() {
        let mut map = SensorMap::EMPTY;
        for (harmonic, size) in map.harmonics.iter_mut().zip([0.05f32, -0.03, 0.02, 0.01, -0.015, 0.02]) {
            *harmonic = Harmonic { cos: size, sin: 0.02 - size };
        }
        for count in 1..=6u16 {
            map.harmonic_count = count;
            for step in -31..=31i16 {
                let phi = 0.1 * f32::from(step);
                let terms = (1u16..).zip(&map.harmonics[..usize::from(count)]);
                let sum: f32 =
                    terms.map(|(k, h)| h.cos * (f32::from(k) * phi).cos() + h.sin * (f32::from(k) * phi).sin()).sum();
                // micromath's sine and cosine are good to 0.002.
                assert!(
                    (map.correction(phi) - sum).abs() < 6e-4,
                    "{count} harmonics at {phi}: {} of {sum}",
                    map.correction(phi)
                );
            }
        }
    }

    #[test]
    fn the_wiper_lags_by_half_of_its_play_in_the_direction_of_motion() {
        let map = SensorMap { half_play: 0.01, ..SensorMap::EMPTY };
        assert!((map.lag(40.0) - 0.01).abs() < 1e-9 && (map.lag(-40.0) + 0.01).abs() < 1e-9);
        assert!(map.lag(0.0).abs() < 1e-9 && map.lag(1.0) > 0.0 && map.lag(1.0) < 0.01);
    }
}
