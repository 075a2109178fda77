//! What a console session records beside samples: states, events, the quality of the link. Plain data, no link in it.

use control::{Command, Fault, Gait, Sensor, State};
use serde::{Deserialize, Serialize};

/// One tick as a robot told it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TelemetryRow {
    /// Seconds since the session began, by the robot's ticks: strictly increasing for each robot. Kept to 1 µs.
    pub t_s: f64,
    /// Number of the control period since the robot's start; a gap is a lost tick.
    pub tick: u64,
    /// Exact time of the sample on the robot's clock, µs, where the robot told it.
    pub time_us: Option<u64>,
    /// Raw code of the angle sensor.
    pub adc: u16,
    /// Raw code of the second angle sensor, where there is one: then in every row.
    pub adc_second: Option<u16>,
    /// Duty, −1 … 1, positive turns counter-clockwise; `None` while the bridge is off.
    pub duty: Option<f32>,
    /// Estimated angle, rad; means nothing unless `tracking`.
    pub angle_rad: f32,
    /// Estimated speed, rad/s.
    pub speed_rad_per_s: f32,
    /// Battery cell, V, where measured.
    pub battery_v: Option<f32>,
    /// The bridge's supply, V, where measured: then in every row from the robot's first on.
    pub supply_v: Option<f32>,
    /// Pose of the robot over the ground, where poses are measured: then in every row, with nothing in it but in the first row after each one.
    pub pose: Option<MeasuredPose>,
    /// What the supervisor and the estimator say.
    pub stated: Stated,
}

/// The columns of a pose; nothing in a row at whose time none was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeasuredPose {
    /// x over the ground, m.
    pub x_m: Option<f64>,
    /// y over the ground, m.
    pub y_m: Option<f64>,
    /// Heading, rad, counter-clockwise, not wrapped.
    pub yaw_rad: Option<f64>,
    /// When it was measured, on the clock of whoever measured it, s.
    pub pose_t_s: Option<f64>,
}

/// What holds for many ticks in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stated {
    /// State of the supervisor.
    pub state: State,
    /// Cause of the fault; `None` outside `State::Fault`.
    pub fault: Option<Fault>,
    /// An angle has been acquired.
    pub tracking: bool,
    /// Of two angle sensors the one that has failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed_sensor: Option<Sensor>,
}

/// The link over the last second or so.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkQuality {
    /// Telemetry messages received, 1/s.
    pub rate_hz: f32,
    /// Share of ticks that were lost, 0 … 1.
    pub loss: f32,
    /// From a command to its answer, s.
    pub latency_s: Option<f32>,
    /// Received signal strength, dBm.
    pub rssi_dbm: Option<f32>,
}

/// Something that happened in a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum SessionEvent {
    /// A person or a script commanded something.
    #[serde(rename = "order")]
    Command {
        /// As it was typed.
        text: String,
        /// What it means to the controller; `None` for what does not go there (`get`, `set`, `save` …).
        command: Option<Command>,
        /// The command before, told again to keep it fresh.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        repeat: bool,
        /// The gait that the robot shall keep, where it is sent one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gait: Option<Box<Gait>>,
    },
    /// The robot answered a command.
    Answer {
        /// For people: the value of a `get`, why it is refused.
        text: String,
        /// What became of it.
        outcome: Outcome,
        /// Number of the control period whose decision is the first after it was done or refused; `None` where the robot did
        /// not say so.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        tick: Option<u64>,
        /// After a `set`: what the robot runs on.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parameter: Option<ParameterValue>,
    },
    /// The supervisor stepped in.
    Fault {
        /// Cause of the fault.
        fault: Fault,
    },
    /// Nothing is heard of the robot any more.
    LinkLost,
    /// It is heard again.
    LinkRegained,
    /// The stop key was pressed.
    Stop,
    /// Anything else worth a line.
    Note {
        /// For people.
        text: String,
    },
}

/// A parameter of the controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// Its name in [`control::parameters::table::TABLE`].
    pub name: String,
    /// In the table's unit.
    pub value: f32,
}

/// Outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Done.
    Done,
    /// The robot refused it.
    Refused,
    /// Its deadline had passed, or no answer came.
    TooLate,
}

/// An event of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedEvent {
    /// Seconds, on the samples' clock.
    pub t_s: f64,
    /// The robot by its name in the file; `None` for the whole session, and in a file of one unnamed robot.
    pub robot: Option<String>,
    /// What happened.
    pub event: SessionEvent,
}

/// A message with its time.
#[derive(Serialize, Deserialize)]
pub(super) struct At<T> {
    pub(super) t_s: f64,
    #[serde(flatten)]
    pub(super) what: T,
}
