//! What the controller tells about itself.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::sample::Actuation;
use crate::sensor_pair::Sensor;
use crate::supervisor::{Fault, State};

/// One tick, as the controller sees it.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, Schema)]
pub struct Telemetry {
    /// Time of the sample, µs.
    pub time_us: u64,
    /// State of the supervisor.
    pub state: State,
    /// Cause of the fault; `None` outside `State::Fault`.
    pub fault: Option<Fault>,
    /// An angle has been acquired; without, `angle` means nothing.
    pub tracking: bool,
    /// Estimated angle, rad, −π … π.
    pub angle: f32,
    /// Estimated speed, rad/s.
    pub speed: f32,
    /// Estimated current, A.
    pub current: f32,
    /// Estimated drag torque along −sign ω, N·m.
    pub drag: f32,
    /// Reference angle, rad; the estimate where there is none.
    pub reference_angle: f32,
    /// Reference speed, rad/s.
    pub reference_speed: f32,
    /// The reading, rad; `None` for a code that can only come from the blind arc.
    pub reading: Option<f32>,
    /// The reading was used with the noise of the reliable zone.
    pub accepted: bool,
    /// The controller believes that the wiper is in the blind arc: with two sensors, the wiper of every working one.
    pub blind: bool,
    /// Of two angle sensors the one that has failed: the robot goes on with the other.
    pub failed_sensor: Option<Sensor>,
    /// The demand was beyond the supply.
    pub saturated: bool,
    /// Cell voltage, V; 0 where it is not measured.
    pub battery: f32,
    /// What the bridge is told.
    pub actuation: Actuation,
}
