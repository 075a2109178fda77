//! The parameters of a second potentiometer on the shaft.

use core::f32::consts::PI;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::error::ParameterError;
use crate::sensor::{SensorMap, range};

/// The second potentiometer as the design knows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SecondSensor {
    /// Its map, in angles from the middle of its own gap.
    pub map: SensorMap,
    /// Middle of its gap on the shaft, rad, −π … π.
    pub offset: f32,
    /// How far off that may be, rad.
    pub tolerance: f32,
    /// Its conversions are so much later than the first one's, s.
    pub delay: f32,
    /// Standard deviation of its readings, in that of the first one's.
    pub noise: f32,
}

impl SecondSensor {
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        self.map.check()?;
        range("second.offset", self.offset, -PI, PI)?;
        range("second.tolerance", self.tolerance, 0.0, 1.0)?;
        range("second.delay", self.delay, 0.0, 5e-3)?;
        range("second.noise", self.noise, 0.01, 100.0)
    }
}
