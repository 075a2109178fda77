//! What the robot hears and tells over ESP-NOW, at most [`LONGEST`] bytes a message: a [`Command`] to it, a [`FromRobot`]
//! from it. Every message begins with the same header: [`super::VERSION`], so that ends of different versions say so
//! instead of misreading each other; the [`Direction`], because everybody on the channel hears everything; and a number,
//! one more than the sender's last, so that losses are counted and what comes late or twice is known.

use core::f32::consts::PI;

use heapless::{String, Vec};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::frame::TooLong;
use crate::{AdcCode, Command, Fault, Refusal, State, Telemetry};

/// Longest ESP-NOW payload (version 1), bytes.
pub const LONGEST: usize = 250;
/// Ticks in a telemetry message: 100 messages a second at 1 kHz.
pub const BATCH: usize = 10;
/// Longest name of a robot, bytes.
pub const NAME: usize = 32;

/// Why a message is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Misread {
    /// The sender speaks another version of the protocol.
    OtherVersion(u16),
    /// Of this version, for the other side: from another robot to its host, or from another host to its robot.
    OtherDirection,
    /// No message of this version.
    Rubbish,
}

/// Which way a message goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Direction {
    /// From a host to a robot.
    ToRobot,
    /// From a robot to a host.
    FromRobot,
}

/// What a message carries behind its header.
pub trait Body: Serialize + DeserializeOwned {
    /// Which way it goes.
    const DIRECTION: Direction;
}

/// Repeated while it shall hold: see `controller.supervisor.command_age_s`.
impl Body for Command {
    const DIRECTION: Direction = Direction::ToRobot;
}

impl Body for FromRobot {
    const DIRECTION: Direction = Direction::FromRobot;
}

/// Writes a message; the bytes of `buffer` to send. `sequence` is one more than in the sender's last message, whoever that
/// was to; it begins anywhere and comes round.
///
/// # Errors
/// It is longer than [`LONGEST`].
pub fn encode<'b, B: Body>(sequence: u16, body: &B, buffer: &'b mut [u8; LONGEST]) -> Result<&'b [u8], TooLong> {
    let written = postcard::to_slice(&(super::VERSION, B::DIRECTION, sequence, body), buffer).map_err(|_| TooLong)?;
    Ok(written)
}

/// Reads a message of [`encode`]: its number and its body.
///
/// # Errors
/// It is of another version, goes the other way, or is none at all. Bytes left over make it none, too.
pub fn decode<B: Body>(bytes: &[u8]) -> Result<(u16, B), Misread> {
    let (version, rest) = postcard::take_from_bytes::<u16>(bytes).map_err(|_| Misread::Rubbish)?;
    if version != super::VERSION {
        return Err(Misread::OtherVersion(version));
    }
    let (direction, rest) = postcard::take_from_bytes::<Direction>(rest).map_err(|_| Misread::Rubbish)?;
    if direction != B::DIRECTION {
        return Err(Misread::OtherDirection);
    }
    match postcard::take_from_bytes(rest) {
        Ok((message, [])) => Ok(message),
        _ => Err(Misread::Rubbish),
    }
}

/// A larger gap between numbers is no loss but a sender that has started anew: ten seconds of telemetry.
const LARGEST_GAP: u16 = 1000;

/// How many messages are missing between two numbers of one sender; `None` if the second is not newer than the first.
/// Numbers come round: newer is what is less than half a round ahead.
#[must_use]
pub fn missing(before: u16, sequence: u16) -> Option<u16> {
    match sequence.wrapping_sub(before) {
        0 | 0x8000.. => None,
        ahead if ahead > LARGEST_GAP => Some(0),
        ahead => Some(ahead - 1),
    }
}

/// From the robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FromRobot {
    /// The answer to a command: when it or its outcome is new, and once a second while it is repeated.
    Answer {
        /// The command's.
        sequence: u16,
        /// Done, or why not.
        outcome: Result<(), Refusal>,
    },
    /// Some ticks.
    Telemetry(Batch),
    /// Once a second, and at boot. To everybody as long as nobody has spoken to the robot.
    Status(Status),
}

/// Control periods in a row, one row each: [`BATCH`] of them, or fewer where a period has no tick or the state changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Batch {
    /// Number of the control period of the first row since the loop's start; the others follow without a gap. A gap
    /// between messages is a lost message or periods without a tick ([`Counters::missed_deadlines`]).
    pub first_tick: u32,
    /// State in all of them.
    pub state: State,
    /// Cause, in `State::Fault`.
    pub fault: Option<Fault>,
    /// An angle has been acquired.
    pub tracking: bool,
    /// Cell at the last of them, mV; 0 where it is not measured.
    pub battery_mv: u16,
    /// The ticks.
    pub rows: Vec<Row, BATCH>,
}

/// One tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// Code of the wiper.
    pub code: u16,
    /// Duty in 1/32767; the bridge is off where `None`.
    pub duty: Option<i16>,
    /// Estimated angle, in π/32767 rad.
    pub angle: i16,
    /// Estimated speed, in 1/256 rad/s.
    pub speed: i16,
}

const DUTY_STEPS: f32 = 32767.0;
const ANGLE_STEPS: f32 = 32767.0 / PI;
const SPEED_STEPS: f32 = 256.0;

impl Row {
    /// What a tick read and what the controller said about it.
    #[must_use]
    pub fn new(code: AdcCode, telemetry: &Telemetry) -> Self {
        let actuation = telemetry.actuation;
        Self {
            code: code.0,
            duty: actuation.enable.then(|| rounded(actuation.duty * DUTY_STEPS)),
            angle: rounded(telemetry.angle * ANGLE_STEPS),
            speed: rounded(telemetry.speed * SPEED_STEPS),
        }
    }

    /// Duty, −1 … 1; the bridge is off where `None`.
    #[must_use]
    pub fn duty(&self) -> Option<f32> {
        self.duty.map(|duty| f32::from(duty) / DUTY_STEPS)
    }

    /// Estimated angle, rad.
    #[must_use]
    pub fn angle(&self) -> f32 {
        f32::from(self.angle) / ANGLE_STEPS
    }

    /// Estimated speed, rad/s.
    #[must_use]
    pub fn speed(&self) -> f32 {
        f32::from(self.speed) / SPEED_STEPS
    }
}

/// To the nearest; the ends where it does not fit, 0 for no number.
#[expect(clippy::cast_possible_truncation, reason = "saturates, as documented")]
fn rounded(value: f32) -> i16 {
    (value + 0.5_f32.copysign(value)) as i16
}

/// The robot's health.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// The robot's, from its robot file.
    pub name: String<NAME>,
    /// Since boot, ms.
    pub uptime_ms: u32,
    /// Why it booted.
    pub reset: Reset,
    /// Where the parameters came from.
    pub parameters: Source,
    /// The loop and the link.
    pub counters: Counters,
}

/// Why the processor started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reset {
    /// The battery went in, or the reset button was pressed: to these chips their enable pin is the same as power.
    #[default]
    PowerOn,
    /// A computer asked for it over the chip's own USB, as the flasher and the monitor do (ESP32-C3).
    External,
    /// Firmware asked for it.
    Software,
    /// A panic, and then firmware asked for it.
    Panic,
    /// The control loop did not feed the watchdog.
    Watchdog,
    /// The supply fell too low.
    BrownOut,
    /// Anything else.
    Other,
}

/// Where parameters came from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// Built in: there are none in flash.
    #[default]
    Factory,
    /// From flash.
    Stored,
    /// Built in: those in flash were stored by another firmware, or one that was built from another robot file.
    FactoryOtherVersion,
    /// Built in: those in flash are damaged or refused by the controller.
    FactoryDamaged,
}

/// Everything that is counted, since boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Ticks done.
    pub ticks: u32,
    /// Control periods without a tick of their own: none began within half a period of the time due, or the one before
    /// took too long. Missed ticks are not made up for.
    pub missed_deadlines: u32,
    /// Longest time from a tick's beginning to the next one's since the last status, µs.
    pub longest_period_us: u32,
    /// The shortest, µs.
    pub shortest_period_us: u32,
    /// Longest execution of a tick since the last status, µs: conversions, decision, bridge, telemetry.
    pub longest_tick_us: u32,
    /// Conversions far from the median of their tick.
    pub adc_outliers: u32,
    /// Commands received.
    pub received: u32,
    /// Of them, those ignored because a newer one was there before: late or repeated by the radio.
    pub outdated: u32,
    /// Received, but no command: rubbish, or what another robot says.
    pub misunderstood: u32,
    /// Received from a sender of another version.
    pub other_version: u32,
    /// Missing between sequence numbers.
    pub lost: u32,
    /// Commands dropped because the control loop's queue was full: the oldest go first.
    pub commands_dropped: u32,
    /// Answers dropped because the radio did not keep up.
    pub answers_dropped: u32,
    /// Messages sent and acknowledged by the radio.
    pub sent: u32,
    /// Sent and not acknowledged.
    pub send_failed: u32,
    /// Telemetry rows dropped because the radio did not keep up.
    pub rows_dropped: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Actuation;

    #[test]
    fn a_message_comes_back_and_another_version_says_so() {
        let command = Command::Speed { omega: -44.0 };
        let mut buffer = [0; LONGEST];
        let mut bytes = encode(u16::MAX, &command, &mut buffer).expect("short").to_vec();
        assert_eq!(decode(&bytes), Ok((u16::MAX, command)));
        bytes.push(0);
        assert_eq!(decode::<Command>(&bytes), Err(Misread::Rubbish));
        bytes[0] = 99;
        assert_eq!(decode::<Command>(&bytes), Err(Misread::OtherVersion(99)));
        assert_eq!(decode::<Command>(&[]), Err(Misread::Rubbish));
    }

    #[test]
    fn a_message_for_the_other_side_is_not_read_as_one_of_ours() {
        let mut buffer = [0; LONGEST];
        for command in [Command::Idle, Command::Coast, Command::Speed { omega: 44.0 }] {
            let bytes = encode(1, &command, &mut buffer).expect("short");
            assert_eq!(decode::<FromRobot>(bytes), Err(Misread::OtherDirection), "{command:?}");
        }
        for told in [FromRobot::Answer { sequence: 0, outcome: Ok(()) }, FromRobot::Status(Status::default())] {
            let bytes = encode(1, &told, &mut buffer).expect("short");
            assert_eq!(decode::<Command>(bytes), Err(Misread::OtherDirection), "{told:?}");
        }
    }

    #[test]
    fn numbers_come_round() {
        for (before, sequence, expected) in [
            (4, 5, Some(0)),
            (4, 7, Some(2)),
            (u16::MAX, 0, Some(0)),
            (u16::MAX - 1, 2, Some(3)),
            (4, 4, None),
            (4, 3, None),
            (2, u16::MAX, None),
            (0, 1000, Some(999)),
            (0, 1001, Some(0)),
            (0, 0x7FFF, Some(0)),
            (0, 0x8000, None),
            (40_000, 0, Some(0)),
            (20_000, 60_000, None),
        ] {
            assert_eq!(missing(before, sequence), expected, "{before} {sequence}");
        }
    }

    #[test]
    fn the_longest_messages_fit() {
        let row = Row { code: u16::MAX, duty: Some(i16::MIN), angle: i16::MIN, speed: i16::MIN };
        let batch = Batch {
            first_tick: u32::MAX,
            state: State::Fault,
            fault: Some(Fault::Restarted),
            tracking: true,
            battery_mv: u16::MAX,
            rows: Vec::from_array([row; BATCH]),
        };
        let most = u32::MAX;
        let counters = Counters {
            ticks: most,
            missed_deadlines: most,
            longest_period_us: most,
            shortest_period_us: most,
            longest_tick_us: most,
            adc_outliers: most,
            received: most,
            outdated: most,
            misunderstood: most,
            other_version: most,
            lost: most,
            commands_dropped: most,
            answers_dropped: most,
            sent: most,
            send_failed: most,
            rows_dropped: most,
        };
        let name = String::try_from("a name that has all 32 bytes of.").expect("it fits");
        let status =
            Status { name, uptime_ms: most, reset: Reset::Other, parameters: Source::FactoryDamaged, counters };
        for message in [FromRobot::Telemetry(batch), FromRobot::Status(status)] {
            let mut buffer = [0; LONGEST];
            assert_eq!(decode(encode(u16::MAX, &message, &mut buffer).expect("it fits")), Ok((u16::MAX, message)));
        }
    }

    #[test]
    fn a_row_says_what_the_controller_said_to_half_a_step() {
        for (duty, angle, speed) in [(0.3, -3.1, 44.0), (-1.0, PI, -127.9), (0.0, 0.0, 0.0)] {
            let actuation = Actuation { duty, enable: true };
            let row = Row::new(AdcCode(5), &Telemetry { angle, speed, actuation, ..Telemetry::default() });
            assert!((row.duty().expect("on") - duty).abs() <= 0.5001 / DUTY_STEPS);
            assert!((row.angle() - angle).abs() <= 0.5001 / ANGLE_STEPS);
            assert!((row.speed() - speed).abs() <= 0.5001 / SPEED_STEPS);
        }
        let lost = Telemetry { angle: f32::NAN, speed: f32::INFINITY, ..Telemetry::default() };
        assert_eq!(Row::new(AdcCode(5), &lost), Row { code: 5, duty: None, angle: 0, speed: i16::MAX });
    }
}
