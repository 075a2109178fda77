//! What enters and leaves a tick.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A raw conversion of the ADC, in counts of its least significant bit (12 bit on the ESP32).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize, Schema)]
pub struct AdcCode(pub u16);

/// What the robot measured at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub struct Sample {
    /// Time of the angle conversion, µs since boot. Must not go backwards.
    pub time_us: u64,
    /// The potentiometer's wiper.
    pub angle: AdcCode,
    /// The second potentiometer's wiper, where there is one.
    pub second: Option<AdcCode>,
    /// The battery cell through its divider.
    pub battery: AdcCode,
}

/// What the bridge is told until the next tick.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, Schema)]
pub struct Actuation {
    /// Share of the bridge's supply, −1 … 1, positive turns the shaft counter-clockwise.
    pub duty: f32,
    /// `false`: every switch of the bridge is off and the shaft coasts.
    pub enable: bool,
}

impl Actuation {
    /// The bridge off.
    pub const OFF: Self = Self { duty: 0.0, enable: false };
}
