//! What a raw code of the angle sensor means at the file's nominal values: the one place that says so. The simulation
//! makes codes with it and the controller's design reads them back with it.

use std::f64::consts::{PI, TAU};

use common::wrap;

use crate::robot::{Adc, Correction, Potentiometer, Sensor};

/// The straight line `angle = zero + rad_per_code·code`, rad, to be wrapped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleScale {
    /// Angle at code 0, rad.
    pub zero: f64,
    /// Slope, rad per code.
    pub rad_per_code: f64,
    /// Highest code.
    pub top_code: u16,
}

impl AngleScale {
    /// Angle of a code, rad, wrapped to −π … π.
    #[must_use]
    pub fn angle(&self, code: f64) -> f64 {
        wrap(self.zero + self.rad_per_code * code)
    }
}

/// The nominal straight line of a sensor.
///
/// * Ideal: 65536 codes a turn, code 0 at −π.
/// * Encoder: one code a count (at most 65536 a turn), code 0 at −π.
/// * Potentiometer: the track begins at the gap's counter-clockwise edge (0 V) and ends at its other edge (the
///   element's supply). The ADC reads `low_reading_v` too low, so code 0 on the line lies that much up the track.
///   The line is good between the ADC's lower dead zone and its bend; [`AdcCurve`] has the whole curve.
#[must_use]
pub fn angle_scale(sensor: &Sensor) -> AngleScale {
    match sensor {
        Sensor::Ideal => full_turn(65536.0),
        Sensor::Encoder(encoder) => full_turn(encoder.counts_per_turn.value.round().clamp(1.0, 65536.0)),
        Sensor::Potentiometer(potentiometer) => {
            let curve = AdcCurve::new(&potentiometer.adc);
            let track = Track::new(potentiometer);
            AngleScale {
                zero: track.angle(curve.low_v),
                rad_per_code: track.angle_per_v() / curve.codes_per_v,
                top_code: curve.top_code as u16,
            }
        }
    }
}

fn full_turn(codes: f64) -> AngleScale {
    AngleScale { zero: -PI, rad_per_code: TAU / codes, top_code: (codes - 1.0) as u16 }
}

/// Mechanical angle against wiper voltage of a linear potentiometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Track {
    /// Half of the gap around shaft angle 0, rad.
    pub half_gap: f64,
    /// Electrical angle, rad.
    pub electrical: f64,
    /// Voltage across the element, V.
    pub supply_v: f64,
}

impl Track {
    /// From the file's nominal values.
    #[must_use]
    pub fn new(potentiometer: &Potentiometer) -> Self {
        let electrical = potentiometer.electrical_angle_deg.value.to_radians();
        Self { half_gap: 0.5 * (TAU - electrical), electrical, supply_v: potentiometer.supply_v.value }
    }

    /// Angle (rad, 0 … 2π, not wrapped) where the wiper has a voltage (V).
    #[must_use]
    pub fn angle(&self, voltage: f64) -> f64 {
        self.half_gap + self.angle_per_v() * voltage
    }

    /// rad per V.
    #[must_use]
    pub fn angle_per_v(&self) -> f64 {
        self.electrical / self.supply_v
    }

    /// Wiper voltage at an angle (rad, any turn); inside the gap that of the nearer end of the track.
    #[must_use]
    pub fn voltage(&self, angle: f64) -> f64 {
        ((angle.rem_euclid(TAU) - self.half_gap) / self.angle_per_v()).clamp(0.0, self.supply_v)
    }

    /// Whether the wiper stands on insulation.
    #[must_use]
    pub fn in_gap(&self, angle: f64) -> bool {
        wrap(angle).abs() < self.half_gap
    }
}

/// The nominal curve of the ESP32's ADC at 11 dB (Espressif's "ADC calibration" characteristics): zero up to
/// `zero_below_v`, then it catches up at twice the slope with a straight line that reads `low_v` too low; above
/// `bend_v` a parabola leaves the line and reaches full scale at `saturates_v`. Continuous and monotonic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdcCurve {
    /// Full scale, codes.
    pub top_code: f64,
    /// Slope of the straight part, codes per V.
    pub codes_per_v: f64,
    /// How much too low the straight part reads, V.
    pub low_v: f64,
    /// Reads zero below, V.
    pub zero_below_v: f64,
    /// The parabola begins, V.
    pub bend_v: f64,
    /// Reads full scale above, V.
    pub saturates_v: f64,
    /// The parabola's coefficient, codes per V².
    pub bend_codes_per_v2: f64,
}

impl AdcCurve {
    /// From the file's nominal values.
    #[must_use]
    pub fn new(adc: &Adc) -> Self {
        let top_code = adc.bits.value.round().clamp(1.0, 16.0).exp2() - 1.0;
        let codes_per_v = top_code / adc.full_scale_v.value;
        let low_v = adc.low_reading_v.value;
        let (bend_v, saturates_v) = (adc.bend_above_v.value, adc.saturates_above_v.value);
        let missing = top_code - codes_per_v * (saturates_v - low_v);
        let width = saturates_v - bend_v;
        let bend_codes_per_v2 = if width > 0.0 { (missing / (width * width)).max(0.0) } else { 0.0 };
        Self {
            top_code,
            codes_per_v,
            low_v,
            zero_below_v: adc.zero_below_v.value,
            bend_v,
            saturates_v,
            bend_codes_per_v2,
        }
    }

    /// Code (not rounded) at a voltage (V).
    #[must_use]
    pub fn code(&self, voltage: f64) -> f64 {
        if voltage <= self.zero_below_v {
            return 0.0;
        }
        if voltage >= self.saturates_v {
            return self.top_code;
        }
        let catching_up = 2.0 * self.codes_per_v * (voltage - self.zero_below_v);
        let over = (voltage - self.bend_v).max(0.0);
        let line = self.codes_per_v * (voltage - self.low_v) + self.bend_codes_per_v2 * over * over;
        line.min(catching_up).clamp(0.0, self.top_code)
    }

    /// Voltage (V) at a code between 0 and full scale; the edge of the dead zone or of saturation at the ends.
    #[must_use]
    pub fn voltage(&self, code: f64) -> f64 {
        let (k, a) = (self.codes_per_v, self.bend_codes_per_v2);
        let lower = (self.low_v + code / k).max(self.zero_below_v + 0.5 * code / k);
        let over = lower - self.bend_v;
        let voltage = if over <= 0.0 || a == 0.0 {
            lower
        } else {
            // k·x + a·x² = k·over
            self.bend_v + 2.0 * k * over / (k + (k * k + 4.0 * a * k * over).sqrt())
        };
        voltage.min(self.saturates_v)
    }

    /// The code that a converter without dead zone and bend would give: the argument of a
    /// [`Correction`]'s straight line.
    #[must_use]
    pub fn straightened(&self, code: f64) -> f64 {
        self.codes_per_v * (self.voltage(code) - self.low_v)
    }
}

/// Shaft angle (rad, not wrapped) that a correction gives for a raw code of the converter it was made with.
#[must_use]
pub fn corrected_angle(correction: &Correction, curve: &AdcCurve, code: f64) -> f64 {
    let straight = (correction.zero_deg + correction.deg_per_code * curve.straightened(code)).to_radians();
    let mut angle = straight;
    for (k, cos) in correction.cos_deg.iter().enumerate() {
        angle += cos.to_radians() * ((k + 1) as f64 * straight).cos();
    }
    for (k, sin) in correction.sin_deg.iter().enumerate() {
        angle += sin.to_radians() * ((k + 1) as f64 * straight).sin();
    }
    angle
}

/// The curve by which the cell's divider is read: the sensor's converter, or 12 bit over 3.3 V where there is none.
/// Cell voltage = `battery_curve(sensor).voltage(code) / divider`. Without a `[supply.battery]` the code is full scale.
#[must_use]
pub fn battery_curve(sensor: &Sensor) -> AdcCurve {
    match sensor {
        Sensor::Potentiometer(potentiometer) => AdcCurve::new(&potentiometer.adc),
        Sensor::Ideal | Sensor::Encoder(_) => AdcCurve {
            top_code: 4095.0,
            codes_per_v: 4095.0 / 3.3,
            low_v: 0.0,
            zero_below_v: 0.0,
            bend_v: 3.3,
            saturates_v: 3.3,
            bend_codes_per_v2: 0.0,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> AdcCurve {
        let top_code = 4095.0;
        let codes_per_v = top_code / 3.3;
        let missing = top_code - codes_per_v * (3.07 - 0.09);
        AdcCurve {
            top_code,
            codes_per_v,
            low_v: 0.09,
            zero_below_v: 0.14,
            bend_v: 2.5,
            saturates_v: 3.07,
            bend_codes_per_v2: missing / (0.57 * 0.57),
        }
    }

    #[test]
    fn the_curve_and_its_inverse_agree() {
        let curve = curve();
        for i in 1..=1000 {
            let voltage = curve.zero_below_v + (curve.saturates_v - curve.zero_below_v) * f64::from(i) / 1001.0;
            let back = curve.voltage(curve.code(voltage));
            assert!((back - voltage).abs() < 1e-12, "{voltage} V came back as {back} V");
        }
    }

    #[test]
    fn the_curve_is_continuous_and_rises() {
        let curve = curve();
        let mut last = 0.0;
        for i in 0..=3_300 {
            let code = curve.code(f64::from(i) * 1e-3);
            assert!((0.0..8.0).contains(&(code - last)), "step of {} codes at {i} mV", code - last);
            last = code;
        }
        assert_eq!(last, 4095.0);
    }

    #[test]
    fn sensors_without_a_gap_use_the_whole_turn() {
        let scale = angle_scale(&Sensor::Ideal);
        assert!((scale.angle(32768.0)).abs() < 1e-12);
        assert!((scale.angle(0.0).abs() - PI).abs() < 1e-12);
        assert_eq!(scale.top_code, 65535);
    }
}
