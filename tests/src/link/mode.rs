//! What the robot is doing when something breaks.

use std::f32::consts::TAU;

use control::{Command, State, Stroke};

/// Command under which the robot runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// 7 Hz.
    Forward,
    /// −7 Hz.
    Backward,
    /// Swings of 200° at full voltage.
    BangBang,
    /// Swings of 200° as in the thesis.
    Proportional,
    /// To 100° and back, another target every 100 ms.
    Position,
    /// A duty of 0.95.
    Duty,
    /// All of these in turn, each for as long as [`Task::change_us`](super::run::Task::change_us) says.
    Changing,
    /// Bridge off.
    Idle,
}

/// The frequency that is commanded, Hz.
const FREQUENCY_HZ: f32 = 7.0;
/// The turning points and targets, rad.
const REACH: f32 = 100.0 / 360.0 * TAU;
/// The duty: from rest, 0.8 does not overcome the bridge's drop and the friction.
const DUTY: f32 = 0.95;

/// Every mode.
pub const MODES: [Mode; 8] = [
    Mode::Forward,
    Mode::Backward,
    Mode::BangBang,
    Mode::Proportional,
    Mode::Position,
    Mode::Duty,
    Mode::Changing,
    Mode::Idle,
];

/// What [`Mode::Changing`] goes through.
const IN_TURN: [Mode; 6] =
    [Mode::Forward, Mode::Position, Mode::Duty, Mode::Backward, Mode::BangBang, Mode::Proportional];

impl Mode {
    /// The command, and the next ones after it.
    #[must_use]
    pub fn command(self, index: usize) -> Command {
        let swing = |style| Command::Oscillate { from: -REACH, to: REACH, style };
        match self {
            Self::Forward => Command::Speed { omega: TAU * FREQUENCY_HZ },
            Self::Backward => Command::Speed { omega: -TAU * FREQUENCY_HZ },
            Self::BangBang => swing(Stroke::BangBang),
            Self::Proportional => swing(Stroke::Proportional),
            Self::Position => Command::Position { angle: if index.is_multiple_of(2) { REACH } else { -REACH } },
            Self::Duty => Command::Duty { duty: DUTY },
            Self::Changing => IN_TURN[index % IN_TURN.len()].command(index / IN_TURN.len()),
            Self::Idle => Command::Idle,
        }
    }

    /// Whether it leads to a state.
    #[must_use]
    pub fn leads_to(self, state: State) -> bool {
        match self {
            Self::Forward | Self::Backward => state == State::Speed,
            Self::BangBang | Self::Proportional => state == State::Oscillate,
            Self::Position => state == State::Position,
            Self::Duty => state == State::Duty,
            Self::Changing => state.is_driving(),
            Self::Idle => state == State::Idle,
        }
    }

    /// The shaft's speed that it leads to, rad/s, where it is one.
    #[must_use]
    pub fn speed(self) -> Option<f64> {
        match self.command(0) {
            Command::Speed { omega } if self != Self::Changing => Some(f64::from(omega)),
            _ => None,
        }
    }

    /// Whether what the bridge is told may be the command's.
    #[must_use]
    pub fn allows(self, duty: f32) -> bool {
        match self {
            Self::Duty => (0.0..=DUTY).contains(&duty),
            Self::Idle => false,
            _ => duty.abs() <= 1.0,
        }
    }
}
