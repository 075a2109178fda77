//! What a build takes from a robot file into the firmware.
//!
//! `robot_file::image::Image` writes it, for it is what knows robot files; that both have the same fields in the same
//! order is tested in `tests/image.rs`. Everything else has this type: the firmware, and its build script, which reads
//! back what was written.

use serde::{Deserialize, Serialize};

use crate::adc::Curve;
use crate::robot::Settings;

/// A robot as the firmware takes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Image {
    /// Settings of the tasks.
    pub settings: Settings,
    /// Settings of the bridge's PWM.
    pub pwm: Pwm,
    /// Conversion from the chip's millivolts to codes of the robot file.
    pub curve: Curve,
}

/// The bridge's PWM.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pwm {
    /// Frequency, Hz.
    pub hz: u32,
    /// Duty 1 is `2^bits` steps.
    pub bits: u8,
}

impl Image {
    /// Reads what was written with postcard.
    ///
    /// # Errors
    /// It is something else. Bytes left over make it something else, too.
    pub fn read(bytes: &[u8]) -> Result<Self, postcard::Error> {
        match postcard::take_from_bytes(bytes)? {
            (image, []) => Ok(image),
            _ => Err(postcard::Error::DeserializeBadEncoding),
        }
    }
}
