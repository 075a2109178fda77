//! Sensors that give the angle as a number: the ideal one and an absolute encoder.

use std::f64::consts::TAU;

use effects::{Laws, States};
use robot_file::angle_code::AngleScale;

use crate::random::Stream;

/// An angle rounded to the nearest code of its scale, codes around the whole turn.
#[derive(Clone, Debug)]
pub struct Digital {
    /// Code against angle.
    pub scale: AngleScale,
    /// The effects between shaft and reading.
    pub laws: Laws,
    /// Noise, standard deviation, rad.
    pub noise: f64,
    stream: Stream,
    /// What is read follows the shaft with a memory.
    follows: bool,
    states: States,
    /// Where the shaft stands, rad, not wrapped.
    shaft: f64,
}

impl Digital {
    /// A sensor whose scale covers the turn, on a shaft at an angle (rad).
    #[must_use]
    pub fn new(scale: AngleScale, laws: Laws, noise: f64, shaft: f64, stream: Stream) -> Self {
        Self { scale, laws, noise, stream, follows: laws.follows(), states: States::default(), shaft }
    }

    /// Moves the shaft (rad) within a step (s) and returns the angle that is read, rad.
    #[inline]
    pub fn step(&mut self, shaft_angle: f64, step: f64) -> f64 {
        if !self.follows {
            return shaft_angle;
        }
        self.laws.follow(&mut self.states, shaft_angle - self.shaft, step);
        self.shaft = shaft_angle;
        shaft_angle - self.laws.behind(&self.states)
    }

    /// Code at an angle, rad.
    pub fn code(&mut self, angle: f64) -> u16 {
        let noisy = angle + self.laws.reading_error(angle) + self.noise * self.stream.normal();
        let codes = f64::from(self.scale.top_code) + 1.0;
        let turn = (noisy - self.scale.zero).rem_euclid(TAU) / self.scale.rad_per_code;
        (turn.round() % codes) as u16
    }
}
