//! From a calibrated voltage to the code that the controller's map is made for.
//!
//! A chip's calibration takes the part's own offset and gain out and gives millivolts; the robot file, and with it the
//! controller and the simulation, speak of codes of one nominal converter. This is that converter's curve.

use control::AdcCode;
use serde::{Deserialize, Serialize};

/// The nominal curve of the robot file's `[sensor.adc]`: zero up to `zero_below_v`, then at twice the slope up to a straight
/// line that reads `low_v` too low, and from `bend_v` on a parabola more, up to full scale at `saturates_v`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Full scale, codes.
    pub top_code: f32,
    /// Slope of the straight part, codes per V.
    pub codes_per_v: f32,
    /// How much too low the straight part reads, V.
    pub low_v: f32,
    /// Reads zero below, V.
    pub zero_below_v: f32,
    /// The parabola begins, V.
    pub bend_v: f32,
    /// Reads full scale above, V.
    pub saturates_v: f32,
    /// The parabola's coefficient, codes per V².
    pub bend_codes_per_v2: f32,
}

impl Curve {
    /// The nearest code at a voltage.
    #[must_use]
    pub fn code(&self, millivolt: u16) -> AdcCode {
        let volt = f32::from(millivolt) * 1e-3;
        let code = if volt <= self.zero_below_v {
            0.0
        } else if volt >= self.saturates_v {
            self.top_code
        } else {
            let catching_up = 2.0 * self.codes_per_v * (volt - self.zero_below_v);
            let over = (volt - self.bend_v).max(0.0);
            let line = self.codes_per_v * (volt - self.low_v) + self.bend_codes_per_v2 * over * over;
            line.min(catching_up).clamp(0.0, self.top_code)
        };
        self.rounded(code)
    }

    /// Full scale: what a converter at its upper end reads.
    #[must_use]
    pub fn top(&self) -> AdcCode {
        self.rounded(self.top_code)
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates at the ends of a u16")]
    fn rounded(&self, code: f32) -> AdcCode {
        AdcCode((code + 0.5) as u16)
    }
}
