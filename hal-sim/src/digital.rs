//! Sensors that give the angle as a number: the ideal one and an absolute encoder.

use std::f64::consts::TAU;

use description::angle_code::AngleScale;

use crate::linearity::Linearity;
use crate::random::Stream;

/// An angle rounded to the nearest code of its scale, codes around the whole turn.
#[derive(Clone, Debug)]
pub struct Digital {
    /// Code against angle.
    pub scale: AngleScale,
    /// Angle error over the turn.
    pub linearity: Linearity,
    /// Noise, standard deviation, rad.
    pub noise: f64,
    stream: Stream,
}

impl Digital {
    /// A sensor whose scale covers the turn.
    #[must_use]
    pub fn new(scale: AngleScale, linearity: Linearity, noise: f64, stream: Stream) -> Self {
        Self { scale, linearity, noise, stream }
    }

    /// Code at an angle, rad.
    pub fn code(&mut self, angle: f64) -> u16 {
        let noisy = angle + self.linearity.error(angle) + self.noise * self.stream.normal();
        let codes = f64::from(self.scale.top_code) + 1.0;
        let turn = (noisy - self.scale.zero).rem_euclid(TAU) / self.scale.rad_per_code;
        (turn.round() % codes) as u16
    }
}
