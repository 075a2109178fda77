//! What the robot can be told to do, and why it may refuse.

use core::f32::consts::{PI, TAU};

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::parameters::Limits;
use crate::self_check::Unready;
use crate::supervisor::{Event, Fault};

/// A command. Angles in rad, counter-clockwise positive, 0 in the middle of the potentiometer's gap; speeds in rad/s,
/// counter-clockwise positive (the thesis's sign for the actuation frequency is converted at the edge, on the host).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Command {
    /// Bridge off, ready.
    Idle,
    /// Bridge off, the shaft turns out; the state estimate goes on.
    Coast,
    /// Hold a speed and its phase.
    Speed {
        /// Target speed, rad/s.
        omega: f32,
    },
    /// Swing between two angles through the short or the long way: `from < to`, both within one turn of zero.
    Oscillate {
        /// Lower turning point, rad.
        from: f32,
        /// Upper turning point, rad.
        to: f32,
        /// How the stroke is driven.
        style: Stroke,
    },
    /// Go to an angle and stay.
    Position {
        /// Target, rad, −π … π.
        angle: f32,
    },
    /// Open loop, for calibrating the sensor and for identification: the bridge gets this duty, the controller only
    /// watches.
    Duty {
        /// Share of the bridge's supply, −1 … 1, positive turns the shaft counter-clockwise.
        duty: f32,
    },
    /// Leave the fault state; refused while its cause persists.
    ClearFault,
}

/// How the oscillator drives a stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub enum Stroke {
    /// Full voltage, reversed a predicted stopping distance before the bound.
    #[default]
    BangBang,
    /// Proportional to the distance, as in the thesis (4.7–4.8).
    Proportional,
}

/// A field of a command, as refusals name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Field {
    /// Target speed with its sign.
    Omega,
    /// Magnitude of the target speed.
    OmegaMagnitude,
    /// Lower turning point of `Oscillate`.
    From,
    /// Upper turning point of `Oscillate`.
    To,
    /// Upper turning point less the lower one.
    Span,
    /// Target angle of `Position`.
    Angle,
    /// Duty of the open loop.
    Duty,
}

impl core::fmt::Display for Field {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Omega => "omega",
            Self::OmegaMagnitude => "|omega|",
            Self::From => "from",
            Self::To => "to",
            Self::Span => "to - from",
            Self::Angle => "angle",
            Self::Duty => "duty",
        })
    }
}

/// Why a command is refused. The robot goes on with what it does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// A field is not a finite number.
    NonFinite {
        /// Field of the command that is out of range.
        name: Field,
    },
    /// A field is out of its range.
    OutOfRange {
        /// Field of the command that is out of range.
        name: Field,
        /// What was given, SI.
        value: f32,
        /// Lower limit, in the field's unit.
        low: f32,
        /// Upper limit, in the field's unit.
        high: f32,
    },
    /// The robot is in the fault state: `ClearFault` first.
    Faulted(Fault),
    /// The cause of the fault is still there.
    CausePersists(Fault),
    /// The robot is not fit to drive.
    NotReady(Unready),
    /// The value would weaken a failsafe beyond the factory's, in the unit of robot.toml.
    WeakensFailsafe {
        /// Lower limit, in the field's unit.
        low: f32,
        /// Upper limit, in the field's unit.
        high: f32,
    },
    /// Only with the bridge off.
    Driving,
    /// The flash is being written: once more in a second.
    Saving,
    /// There is no such parameter.
    NoParameter,
    /// The image was not built to make faults on request.
    NotBuiltIn,
    /// Outside the parameter's range, or at odds with another one.
    Parameter,
    /// The flash did not keep it.
    NotKept,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NonFinite { name } => write!(f, "{name} must be a finite number"),
            Self::OutOfRange { name, value, low, high } => {
                write!(f, "{name} must be from {low} to {high}, not {value}")
            }
            Self::Faulted(fault) => write!(f, "refused after the fault {fault:?}: clear it first"),
            Self::CausePersists(fault) => write!(f, "the cause of the fault {fault:?} persists"),
            Self::NotReady(unready) => write!(f, "the robot does not drive: {unready}"),
            Self::WeakensFailsafe { low, high } => write!(
                f,
                "it would weaken a failsafe: allowed are {low} to {high}; for more, change robot.toml and flash the robot"
            ),
            Self::Driving => f.write_str("not while the motor is driven: stop it first"),
            Self::Saving => f.write_str("the flash is being written: try again in a second"),
            Self::NoParameter => f.write_str("there is no such parameter"),
            Self::NotBuiltIn => {
                f.write_str("this image makes no faults: flash one that was built with fault injection")
            }
            Self::Parameter => f.write_str("the value is outside the parameter's range, or at odds with another one"),
            Self::NotKept => {
                f.write_str("the flash did not keep it: the partition is missing, or the flash is worn out")
            }
        }
    }
}

impl core::error::Error for Refusal {}

fn within(name: Field, value: f32, low: f32, high: f32) -> Result<(), Refusal> {
    if !value.is_finite() {
        Err(Refusal::NonFinite { name })
    } else if value < low || value > high {
        Err(Refusal::OutOfRange { name, value, low, high })
    } else {
        Ok(())
    }
}

impl Command {
    /// Refuses what is not finite or beyond the robot's limits.
    ///
    /// # Errors
    /// The first field that is wrong.
    pub fn check(&self, limits: &Limits) -> Result<(), Refusal> {
        match *self {
            Self::Idle | Self::Coast | Self::ClearFault => Ok(()),
            Self::Speed { omega } => {
                within(Field::Omega, omega, -limits.speed, limits.speed)?;
                within(Field::OmegaMagnitude, omega.abs(), limits.least_speed, limits.speed)
            }
            Self::Oscillate { from, to, .. } => {
                within(Field::From, from, -TAU, TAU)?;
                within(Field::To, to, -TAU, TAU)?;
                within(Field::Span, to - from, limits.least_stroke, 2.0 * TAU)
            }
            Self::Position { angle } => within(Field::Angle, angle, -PI, PI),
            Self::Duty { duty } => within(Field::Duty, duty, -1.0, 1.0),
        }
    }

    /// What it asks of the state machine.
    #[must_use]
    pub fn event(&self) -> Event {
        match self {
            Self::Idle => Event::Idle,
            Self::Coast => Event::Coast,
            Self::Speed { .. } => Event::Speed,
            Self::Oscillate { .. } => Event::Oscillate,
            Self::Position { .. } => Event::Position,
            Self::Duty { .. } => Event::Duty,
            Self::ClearFault => Event::Clear,
        }
    }
}
