//! What the console and the robot say to each other over ESP-NOW: [`Downlink`] and [`Uplink`]. Both travel in the frames of
//! [`super::secure`], which say who may speak, to whom, in which version, and how many frames are missing in between.

use core::f32::consts::PI;

use heapless::{String, Vec};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::gait::{Gait, GaitLabel};
use crate::{AdcCode, Command, Fault, Refusal, Sensor, State, Telemetry};

/// Longest ESP-NOW payload (version 1), bytes.
pub const LONGEST: usize = 250;
/// A batch's time comes round where [`Uplink::uptime_ms`] does, after seven weeks: six bytes on the air.
pub const ROUND_US: u64 = (1 << 32) * 1000;
/// Samples further apart than this, µs, are not in one telemetry message: below it [`PackedTick::after_us`] takes two bytes on the air.
pub const FURTHEST_US: u16 = (1 << 14) - 1;
/// Ticks in a telemetry message: 100 messages a second at 1 kHz.
pub const BATCH: usize = 10;
/// Longest name of a robot, bytes.
pub const NAME: usize = 32;

/// Message of the console to a robot, in a frame of [`super::secure`]. Without a heartbeat or a command the robot slows down after
/// `controller.supervisor.link_slow_s`, and cuts the bridge after `command_age_s`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to put a gait on")]
pub enum Downlink {
    /// The console lives and hears the robot.
    Heartbeat {
        /// [`Uplink::uptime_ms`] of the latest uplink that it has heard: on the robot's own clock, so that a heartbeat that
        /// somebody held back is as old as it is.
        /// `None` before it has heard anything: then it keeps nothing going.
        heard_ms: Option<u32>,
    },
    /// Bridge off, now. Repeated until telemetry says so; not answered.
    Stop,
    /// A request: repeated until it is answered.
    Request(RequestFrame),
}

/// A request, to be executed once. The console repeats it with the same number until an [`Answer`] of that number arrives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct RequestFrame {
    /// Another one than before; begins anywhere in a session and comes round.
    pub number: u16,
    /// On the robot's clock ([`Uplink::uptime_ms`]): later it is not done any more.
    pub deadline_ms: u32,
    /// What is asked for.
    pub request: Request,
}

/// What a console can request of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Request {
    /// Gives the controller a command.
    Command(Command),
    /// Tell a parameter, by its index in [`crate::parameters::table::TABLE`].
    Get(u16),
    /// Change a parameter until the next boot.
    Set {
        /// Index in [`crate::parameters::table::TABLE`].
        index: u16,
        /// New value, in the table's unit.
        value: f32,
    },
    /// Keep the parameters as they are over the next boot. Only with the bridge off.
    Save,
    /// Use the factory's parameters, now and after the next boot. Only with the bridge off.
    Factory,
    /// Keep a gait over the next boot, in place of the one before, for [`Command::Gait`]. Only with the bridge off.
    KeepGait(Gait),
    /// Make a fault. Refused by every image that was not built for that.
    Inject(Injection),
}

/// A fault that is made on request, for bring-up. It begins [`Injection::DELAY_MS`] after the request was accepted, so that the
/// answer is heard first, and a later request replaces it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Injection {
    /// Fault to inject.
    pub fault: InjectedFault,
    /// How long it lasts, ms. A crash ends with the reset.
    pub for_ms: u16,
}

impl Injection {
    /// From the request's acceptance to the fault, ms.
    pub const DELAY_MS: u16 = 200;
}

/// What can be made to fail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum InjectedFault {
    /// Nothing: ends what there is.
    #[default]
    None,
    /// The program crashes.
    Crash {
        /// Kind of crash.
        how: Crash,
        /// Task in which the program crashes.
        place: CrashPlace,
    },
    /// The control loop hangs in a conversion.
    HangLoop,
    /// The control loop hangs repeatedly.
    StarveLoop {
        /// Length of each hang, ms.
        hang_ms: u16,
        /// Undisturbed ticks between two hangs.
        run_ticks: u16,
    },
    /// The wiper's conversions repeat the first code.
    ConverterStuck,
    /// Every conversion of the wiper takes longer.
    ConverterSlow {
        /// Additional time per conversion, µs.
        by_us: u16,
    },
    /// The wiper's conversions are right for some ticks and zero for others, in turn.
    ConverterIntermittent {
        /// Ticks with correct codes.
        good_ticks: u16,
        /// Ticks with code 0.
        bad_ticks: u16,
    },
    /// Nothing is sent, and the radio says that it failed.
    SendsFail,
    /// The radio is not done with what it sends.
    SendsNeverEnd,
    /// The radio's driver takes nothing: it has no buffer left.
    SendsRefused,
}

/// How a program crashes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Crash {
    /// A panic.
    Panic,
    /// A recursion without end.
    StackOverflow,
    /// A read of address 0.
    Exception,
}

/// Where a program crashes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum CrashPlace {
    /// In the sending task, which the control loop interrupts.
    Task,
    /// In the control loop.
    Loop,
}

/// Result of a [`RequestFrame`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Answer {
    /// Done; after `Get` and `Set` with the parameter.
    Done(Option<Value>),
    /// Not done: the robot goes on with what it does.
    Refused(Refusal),
    /// Not done: it came after its deadline.
    TooLate,
}

/// Value of a parameter, in the unit of [`crate::parameters::table::TABLE`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Value {
    /// What the robot runs on.
    pub now: f32,
    /// What the firmware was built with.
    pub factory: f32,
}

/// Message of a robot to its console, in a frame of [`super::secure`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Uplink {
    /// Since boot, ms, when it was sealed; comes round after seven weeks.
    pub uptime_ms: u32,
    /// The last downlink that counted.
    pub echo: Echo,
    /// The message itself.
    pub report: Report,
}

/// Echo of the last downlink: lets the console measure the round trip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Echo {
    /// Counter of the downlink.
    pub counter: u32,
    /// How long ago it came, ms.
    pub age_ms: u16,
}

/// What a robot reports.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Report {
    /// Result of a [`RequestFrame`], sent each time that the frame arrives.
    Answer {
        /// Number of the request frame.
        number: u16,
        /// Number of the control period in which it was done or refused, as in [`Batch::first_tick`]: from that period's
        /// decision on it counts.
        tick: u32,
        /// Result of the request.
        answer: Answer,
    },
    /// Telemetry of up to [`BATCH`] control periods.
    Telemetry(Batch),
    /// At the beginning of a session, and then once a second.
    Status(Status),
}

/// Control periods in a row, one row each: [`BATCH`] of them, or fewer where a period has no tick or the state changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Batch {
    /// Number of the control period of the first row since the loop's start; the others follow without a gap. A gap
    /// between messages is a lost message or periods without a tick ([`Counters::missed_deadlines`]).
    pub first_tick: u32,
    /// Time of the first row's sample on the robot's clock, µs; comes round at [`ROUND_US`].
    pub time_us: u64,
    /// State in all of them.
    pub state: State,
    /// Cause of the fault; `None` outside `State::Fault`.
    pub fault: Option<Fault>,
    /// An angle has been acquired.
    pub tracking: bool,
    /// Of two angle sensors the one that has failed.
    pub failed_sensor: Option<Sensor>,
    /// Cell at the last of them, mV; 0 where it is not measured.
    pub battery_mv: u16,
    /// Telemetry per control period, oldest first.
    pub rows: Vec<PackedTick, BATCH>,
}

impl Batch {
    /// Time of each row's sample on the robot's clock, µs: exactly what the controller was given.
    pub fn times_us(&self) -> impl Iterator<Item = u64> + '_ {
        self.rows.iter().scan(self.time_us, |time_us, row| {
            *time_us = time_us.wrapping_add(u64::from(row.after_us));
            Some(*time_us)
        })
    }
}

/// Telemetry of one control period, quantised for the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct PackedTick {
    /// From the sample of the row before to this one's, µs; 0 in the first row of a batch.
    pub after_us: u16,
    /// Code of the wiper.
    pub code: u16,
    /// Code of the second sensor's wiper, where there is one.
    pub second: Option<u16>,
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

impl PackedTick {
    /// What a tick read and what the controller said about it.
    #[must_use]
    pub fn new(code: AdcCode, telemetry: &Telemetry) -> Self {
        let actuation = telemetry.actuation;
        Self {
            after_us: 0,
            code: code.0,
            second: None,
            duty: actuation.enable.then(|| rounded(actuation.duty * DUTY_STEPS)),
            angle: rounded(telemetry.angle * ANGLE_STEPS),
            speed: rounded(telemetry.speed * SPEED_STEPS),
        }
    }

    /// The same with the second sensor's code.
    #[must_use]
    pub fn with_second(self, code: Option<AdcCode>) -> Self {
        Self { second: code.map(|code| code.0), ..self }
    }

    /// The same, that long after the sample of the row before.
    #[must_use]
    pub fn after(self, after_us: u16) -> Self {
        Self { after_us, ..self }
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

/// Rounded to the nearest integer; saturates, and is 0 for NaN.
#[expect(clippy::cast_possible_truncation, reason = "saturates, as documented")]
fn rounded(value: f32) -> i16 {
    (value + 0.5_f32.copysign(value)) as i16
}

/// Health of the robot: name, cause of the boot, counters.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// The robot's, from its robot file.
    pub name: String<NAME>,
    /// Why it booted.
    pub reset: Reset,
    /// Where the parameters came from.
    pub parameters: Source,
    /// The image was built to make faults on request ([`Request::Inject`]): for bring-up, not for use.
    pub injectable: bool,
    /// The gait that is stored; `None` where there is none that the robot can play.
    pub gait: Option<GaitLabel>,
    /// The loop and the link.
    pub counters: Counters,
}

/// Why the processor started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Reset {
    /// The battery went in, or the reset button was pressed: to these chips their enable pin is the same as power.
    #[default]
    PowerOn,
    /// A computer asked for it over the chip's own USB, as the flasher and the monitor do (ESP32-C3).
    External,
    /// Firmware asked for it.
    Software,
    /// Firmware asked for it, because its radio sent nothing any more.
    Radio,
    /// A panic, and then firmware asked for it.
    Panic,
    /// The control loop did not feed the watchdog.
    Watchdog,
    /// The supply fell too low.
    BrownOut,
    /// A cause that the chip does not name.
    Other,
}

/// Where parameters came from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Source {
    /// Built in: there are none in flash.
    #[default]
    Factory,
    /// Read from flash.
    Stored,
    /// Built in: those in flash were stored by another firmware, or one that was built from another robot file.
    FactoryOtherVersion,
    /// Built in: those in flash are damaged or refused by the controller.
    FactoryDamaged,
}

/// Everything that is counted, since boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Counters {
    /// Control periods with a tick.
    pub ticks: u32,
    /// Control periods without a tick of their own: none began within half a period of the time due, or the one before
    /// took too long. Missed ticks are not made up for.
    pub missed_deadlines: u32,
    /// Longest time from a tick's beginning to the next one's since the last status, µs.
    pub longest_period_us: u32,
    /// Shortest time from a tick's beginning to the next one's since the last status, µs.
    pub shortest_period_us: u32,
    /// Longest execution of a tick since the last status, µs: conversions, decision, bridge, telemetry.
    pub longest_tick_us: u32,
    /// Conversions far from the median of their tick.
    pub adc_outliers: u32,
    /// Downlinks that were accepted.
    pub received: u32,
    /// Frames with a right tag, ignored because one at least as new was there before: late, repeated by the radio, or
    /// replayed by somebody.
    pub outdated: u32,
    /// Frames with a wrong tag: forged, damaged, of another robot's console, of a session that is over.
    pub forged: u32,
    /// Received, but nothing for this robot: rubbish, what another robot says, or a downlink to all that is for another one.
    pub misunderstood: u32,
    /// Received from a sender of another version.
    pub other_version: u32,
    /// Calls of the console that were answered; a replayed one is, too, and leads to nothing.
    pub calls: u32,
    /// Downlinks missing between those that counted.
    pub lost: u32,
    /// Downlinks that came after their deadline, and heartbeats that were held back, or came before the console had heard
    /// anything.
    pub too_late: u32,
    /// Downlinks dropped because the control loop's queue was full: the oldest go first.
    pub commands_dropped: u32,
    /// Answers dropped because the radio did not keep up.
    pub answers_dropped: u32,
    /// Messages sent and acknowledged by the radio.
    pub sent: u32,
    /// Sent and not acknowledged.
    pub send_failed: u32,
    /// Telemetry rows dropped because the radio did not keep up.
    pub rows_dropped: u32,
    /// Messages that the radio's driver did not take: it has no buffer left. They count as not acknowledged, too.
    pub send_refused: u32,
    /// Frames longer than any of ours, dropped where they came in: somebody else's, or a flood.
    pub too_long: u32,
    /// Frames dropped because the robot did not keep up with the radio: the oldest go first.
    pub overrun: u32,
    /// The least that was free of the radio's memory, bytes; 0 where it is not known.
    pub heap_least_free: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Actuation;
    use crate::gait::{MOST_NUMBERS, MOST_STEPS, Name};
    use crate::protocol::secure::{Key, Nonce, Sealer};

    #[test]
    fn the_longest_messages_fit() {
        let row = PackedTick {
            after_us: FURTHEST_US,
            code: u16::MAX,
            second: Some(u16::MAX),
            duty: Some(i16::MIN),
            angle: i16::MIN,
            speed: i16::MIN,
        };
        let batch = Batch {
            first_tick: u32::MAX,
            time_us: ROUND_US - 1,
            state: State::Fault,
            fault: Some(Fault::Restarted),
            tracking: true,
            failed_sensor: Some(Sensor::Second),
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
            forged: most,
            misunderstood: most,
            other_version: most,
            calls: most,
            lost: most,
            too_late: most,
            commands_dropped: most,
            answers_dropped: most,
            sent: most,
            send_failed: most,
            rows_dropped: most,
            send_refused: most,
            too_long: most,
            overrun: most,
            heap_least_free: most,
        };
        let name = String::try_from("a name that has all 32 bytes of.").expect("it fits");
        let gait = Some(longest_gait().label());
        let status =
            Status { name, reset: Reset::Other, parameters: Source::FactoryDamaged, injectable: true, gait, counters };
        let echo = Echo { counter: most, age_ms: u16::MAX };
        for message in [Report::Telemetry(batch), Report::Status(status)] {
            let uplink = Uplink { uptime_ms: most, echo, report: message };
            let mut buffer = [0; LONGEST];
            let (frame, _) = Sealer::robot(Key([1; 32])).seal(&uplink, &mut buffer).expect("it fits");
            std::println!("{} bytes on the air", frame.len());
        }
        let gait = RequestFrame { number: u16::MAX, deadline_ms: most, request: Request::KeepGait(longest_gait()) };
        let mut buffer = [0; LONGEST];
        let mut sealer = Sealer::console(Key([1; 32]), Nonce([2; 8]));
        let (frame, _) = sealer.seal(&Downlink::Request(gait), &mut buffer).expect("a gait fits one frame");
        std::println!("{} bytes on the air, a gait", frame.len());
    }

    /// As long on the air as any.
    fn longest_gait() -> Gait {
        let name = Name::new("twelve-bytes").expect("a name");
        let speeds = [-70.5; MOST_NUMBERS];
        Gait::new(name, &speeds, &[], &[15; MOST_STEPS], 2000, true).expect("sound")
    }

    #[test]
    fn a_row_says_what_the_controller_said_to_half_a_step() {
        for (duty, angle, speed) in [(0.3, -3.1, 44.0), (-1.0, PI, -127.9), (0.0, 0.0, 0.0)] {
            let actuation = Actuation { duty, enable: true };
            let row = PackedTick::new(AdcCode(5), &Telemetry { angle, speed, actuation, ..Telemetry::default() });
            assert!((row.duty().expect("on") - duty).abs() <= 0.5001 / DUTY_STEPS);
            assert!((row.angle() - angle).abs() <= 0.5001 / ANGLE_STEPS);
            assert!((row.speed() - speed).abs() <= 0.5001 / SPEED_STEPS);
        }
        let lost = Telemetry { angle: f32::NAN, speed: f32::INFINITY, ..Telemetry::default() };
        assert_eq!(
            PackedTick::new(AdcCode(5), &lost),
            PackedTick { code: 5, speed: i16::MAX, ..PackedTick::default() }
        );
    }

    #[test]
    fn a_batch_says_when_each_sample_was_taken() {
        let rows = [0, 1003, 998].map(|after_us| PackedTick::default().after(after_us));
        let batch = Batch {
            first_tick: 7,
            time_us: 5_000_000_000,
            state: State::Idle,
            fault: None,
            tracking: false,
            failed_sensor: None,
            battery_mv: 0,
            rows: rows.into_iter().collect(),
        };
        assert!(batch.times_us().eq([5_000_000_000, 5_000_001_003, 5_000_002_001]));
    }
}
