//! What the robot can be told to do, and why it may refuse.

use core::f32::consts::{PI, TAU};

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::gait::LONGEST_NAME;
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
    /// Play the stored gait from its first step: hold the motion of each step in turn, as `Speed` and `Oscillate` do. At its end the bridge is
    /// off and the shaft turns out (`Coast`), unless it repeats. Given again while it plays, it goes on.
    Gait {
        /// Which one is meant ([`Gait::id`](crate::Gait::id)): refused where another one is stored.
        id: u32,
    },
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
    /// Magnitude of a speed of a gait.
    GaitSpeed,
    /// The numbers of a gait's speeds and oscillations, one for each of the former and two for each of the latter.
    GaitTable,
    /// A step of a gait: index into its speeds and oscillations.
    GaitStep,
    /// Number of steps of a gait.
    GaitSteps,
    /// How long a gait holds a step, s.
    GaitInterval,
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
            Self::GaitSpeed => "|omega| of a gait's step",
            Self::GaitTable => "a gait's numbers, one a speed and two an oscillation,",
            Self::GaitStep => "a gait's step, an index into its speeds and oscillations,",
            Self::GaitSteps => "the number of a gait's steps",
            Self::GaitInterval => "a gait's interval",
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
    /// No gait is stored, or another one than is meant.
    NoGait,
    /// A gait's name is none.
    GaitName,
    /// A gait's interval is no whole number of control periods.
    UnevenInterval {
        /// How long the gait holds a step, s.
        interval: f32,
        /// The robot's control period, s.
        tick: f32,
    },
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
            Self::NoGait => f.write_str("this gait is not stored: send it with `gait` while the motor is off"),
            Self::GaitName => {
                write!(f, "a gait's name is 1 to {LONGEST_NAME} letters, digits, `-`, `_` and `.`")
            }
            Self::UnevenInterval { interval, tick } => {
                write!(f, "a gait's interval of {interval} s is no whole number of control periods of {tick} s")
            }
        }
    }
}

impl core::error::Error for Refusal {}

pub(crate) fn within(name: Field, value: f32, low: f32, high: f32) -> Result<(), Refusal> {
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
            // A gait is checked where it is stored: by the controller.
            Self::Idle | Self::Coast | Self::ClearFault | Self::Gait { .. } => Ok(()),
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
            Self::Gait { .. } => Event::Gait,
        }
    }
}
