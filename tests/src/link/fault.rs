//! The faults of the campaign: what happens, and what must come of it.

use control::Fault as Cause;
use control::protocol::radio::Reset;
use hal_sim::Fault;
use hal_sim::radio::{LONGEST_HEARD, Trouble};
use rand::RngExt;
use rand_pcg::Pcg64;
use testbed::injected_event::InjectedEvent;
use testbed::serial::Cable;

use super::mode::Mode;

/// What must come of a fault while the robot drives. In every case: no bridge that is on in `Fault`, none that comes on again
/// by itself, nothing driven but what was commanded, and the bridge off after the console has gone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Must {
    /// The supervisor finds it: bridge off within the bound of what it calls it, one of these, or of what it is, the first.
    Found(&'static [Cause]),
    /// The link is gone: bridge off within `command_bound_s` of the last frame that counted.
    LinkLost,
    /// Everything comes too late to count but commands, until their deadline: bridge off within `command_bound_s` of that, or
    /// of the fault.
    HeldBack,
    /// The bridge opens with the fault itself.
    AtOnce,
    /// The watchdog ends it.
    Bitten,
    /// The bridge is off within this time, s, whoever ends it.
    Bounded(f64),
    /// The robot goes on with what was commanded.
    GoOn,
    /// It goes on, or stops: either is safe.
    Either,
}

/// What the console does from the fault on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Host {
    /// It goes on.
    Goes,
    /// It polls no more.
    Hangs,
    /// It is killed: the line is closed without a word.
    Killed,
    /// It sleeps for some seconds and goes on where it was.
    Sleeps,
    /// It goes on, and somebody else brings old frames of it to the robot again.
    IsReplayed,
}

/// A fault of the campaign.
pub struct Case {
    /// Its name, for the table and for `--fault`.
    pub name: &'static str,
    /// What happens, how many µs after the fault's time.
    pub injected_events: fn(&mut Pcg64) -> Vec<(u64, InjectedEvent)>,
    /// What the console does.
    pub host: Host,
    /// What must come of it.
    pub must: Must,
    /// It begins before the first command, so that there is something to replay.
    pub early: bool,
    /// With the bridge off it need not show: no current tells of the motor, and the wiper of a shaft that stands may rest in
    /// the gap or at an end, where its reading cannot change. Such runs are counted apart.
    pub hides_at_rest: bool,
}

const NONE: Trouble = Trouble::NONE;
/// A starved loop, from its beginning.
const STARVED_S: f64 = 0.2;

/// A shaft that does not turn, or turns as nobody expects, with a wiper that may rest on insulation: nothing tells some
/// causes from others there.
const STILL: &[Cause] = &[Cause::Stall, Cause::SensorOpen, Cause::SensorFrozen, Cause::SensorShorted, Cause::Runaway];
/// The same, the fault itself first.
const OPEN: &[Cause] = &[Cause::SensorOpen, Cause::Stall, Cause::SensorFrozen, Cause::SensorShorted, Cause::Runaway];
const STUCK: &[Cause] = &[Cause::SensorFrozen, Cause::SensorShorted, Cause::Stall, Cause::SensorOpen, Cause::Runaway];
const REVERSED: &[Cause] = &[Cause::Runaway, Cause::SensorOpen];

const fn case(name: &'static str, must: Must, injected_events: fn(&mut Pcg64) -> Vec<(u64, InjectedEvent)>) -> Case {
    Case { name, injected_events, host: Host::Goes, must, early: false, hides_at_rest: false }
}

const fn part(name: &'static str, must: Must, injected_events: fn(&mut Pcg64) -> Vec<(u64, InjectedEvent)>) -> Case {
    Case { hides_at_rest: true, ..case(name, must, injected_events) }
}

const fn host(name: &'static str, host: Host, must: Must) -> Case {
    Case { host, ..case(name, must, |_| Vec::new()) }
}

fn now(injected_event: InjectedEvent) -> Vec<(u64, InjectedEvent)> {
    vec![(0, injected_event)]
}

fn broken(fault: Fault) -> Vec<(u64, InjectedEvent)> {
    now(InjectedEvent::Fault(0, fault))
}

fn air(trouble: Trouble) -> Vec<(u64, InjectedEvent)> {
    now(InjectedEvent::Air(trouble))
}

/// Frames of a length from somebody else, one every 50 µs to 1 ms, until the end.
fn flood(random: &mut Pcg64, length: usize) -> Vec<(u64, InjectedEvent)> {
    now(InjectedEvent::Flood { every_us: random.random_range(50..1000), length })
}

/// Length of a silence, µs.
fn silence(for_us: u64) -> Vec<(u64, InjectedEvent)> {
    vec![(0, InjectedEvent::Air(Trouble { silence: true, ..NONE })), (for_us, InjectedEvent::Air(NONE))]
}

/// Every fault.
pub const CASES: [Case; 44] = [
    part("sensor open", Must::Found(OPEN), |_| broken(Fault::SensorOpen)),
    part("sensor shorted low", Must::Found(&[Cause::SensorShorted]), |_| broken(Fault::SensorShortLow)),
    part("sensor shorted high", Must::Found(&[Cause::SensorShorted]), |_| broken(Fault::SensorShortHigh)),
    part("sensor stuck", Must::Found(STUCK), |_| broken(Fault::SensorFrozen)),
    part("sensor noisy", Must::GoOn, |random| broken(Fault::SensorNoisy { share: random.random_range(0.005..0.02) })),
    part("sensor drifting", Must::Either, |random| {
        broken(Fault::SensorDrifting { share_per_s: random.random_range(-0.2..0.2) })
    }),
    part("converter saturated", Must::Either, |random| {
        broken(Fault::AdcSaturated { factor: random.random_range(1.2..2.0) })
    }),
    part("motor stalled", Must::Found(STILL), |_| broken(Fault::Stalled)),
    part("motor reversed", Must::Found(REVERSED), |_| broken(Fault::MotorReversed)),
    part("motor lead open", Must::Found(STILL), |_| broken(Fault::MotorOpen)),
    part("bridge's supply sags to 2 V", Must::Found(STILL), |_| broken(Fault::RailLow { rail_v: 2.0 })),
    case("battery low", Must::Found(&[Cause::SupplyLow]), |random| {
        broken(Fault::BatteryLow { open_circuit_v: random.random_range(2.5..3.2) })
    }),
    case("radio: loss of 20 %", Must::GoOn, |_| air(Trouble { loss_share: Some(0.2), burst_us: Some(20_000), ..NONE })),
    case("radio: a burst of 50 to 200 ms", Must::GoOn, |random| silence(random.random_range(50_000..200_000))),
    case("radio: a burst of 300 to 450 ms", Must::Either, |random| silence(random.random_range(300_000..450_000))),
    case("radio: lost", Must::LinkLost, |_| air(Trouble { silence: true, ..NONE })),
    case("radio: half of the frames twice", Must::GoOn, |_| air(Trouble { duplicate_share: Some(0.5), ..NONE })),
    case("radio: a third out of order", Must::GoOn, |_| {
        air(Trouble { reorder_share: Some(0.3), reorder_hold_us: Some(60_000), ..NONE })
    }),
    case("radio: delays up to 50 ms", Must::GoOn, |random| {
        let extra_delay_us = random.random_range(0..10_000);
        air(Trouble { extra_delay_us, tail_share: Some(0.3), tail_most_us: Some(50_000), ..NONE })
    }),
    // A heartbeat is as old as what the console had heard when it sent it.
    case("radio: everything held back for 0.3 to 1 s", Must::HeldBack, |random| {
        air(Trouble { extra_delay_us: random.random_range(300_000..1_000_000), ..NONE })
    }),
    // More than the radio can hand over, of the longest that the driver knows and of any length.
    case("radio: flood of the longest frames", Must::Either, |random| flood(random, LONGEST_HEARD)),
    case("radio: flood of frames of any length", Must::Either, |random| {
        let length = random.random_range(1..LONGEST_HEARD);
        flood(random, length)
    }),
    // What the robot hears then is as old as what it last said: heartbeats count no more.
    case("radio: a send never ends", Must::HeldBack, |_| now(InjectedEvent::RadioStuck(0))),
    case("radio: no buffers left to send", Must::HeldBack, |_| now(InjectedEvent::RadioFull(0))),
    case("dongle's sends never end", Must::LinkLost, |_| now(InjectedEvent::DongleRadioStuck)),
    case("radio: a tenth corrupted", Must::GoOn, |_| air(Trouble { corruption_share: Some(0.1), ..NONE })),
    Case { host: Host::IsReplayed, ..case("radio: orders replayed", Must::GoOn, |_| Vec::new()) },
    Case {
        early: true,
        ..case("radio: frames forged and replayed", Must::GoOn, |random| {
            now(InjectedEvent::Attack(random.random_range(1_000..4_000)))
        })
    },
    host("console hangs", Host::Hangs, Must::LinkLost),
    host("console killed", Host::Killed, Must::LinkLost),
    host("laptop asleep, and awake again", Host::Sleeps, Must::LinkLost),
    case("dongle unplugged", Must::LinkLost, |random| {
        now(InjectedEvent::Cable(if random.random() { Cable::Broken } else { Cable::Gone }))
    }),
    case("dongle hangs", Must::LinkLost, |_| now(InjectedEvent::DongleHangs)),
    case("dongle reboots", Must::Either, |random| {
        vec![(0, InjectedEvent::DongleHangs), (random.random_range(0..600_000), InjectedEvent::DongleBoots)]
    }),
    case("robot out of range", Must::LinkLost, |_| now(InjectedEvent::Place(0, 5000.0))),
    case("tick overrun of 2 to 15 ms", Must::GoOn, |random| {
        now(InjectedEvent::ProcessorHold(0, random.random_range(2_000..15_000)))
    }),
    case("tick overrun of 20 to 90 ms", Must::Either, |random| {
        now(InjectedEvent::ProcessorHold(0, random.random_range(20_000..90_000)))
    }),
    case("control loop starved over and over", Must::Bounded(STARVED_S), |random| {
        let (hung_us, good_us) = (random.random_range(30_000..95_000), random.random_range(5_000..40_000));
        (0..40).map(|round| (round * (hung_us + good_us), InjectedEvent::ProcessorHold(0, hung_us))).collect()
    }),
    case("control loop hangs", Must::Bitten, |_| now(InjectedEvent::ProcessorHold(0, 10_000_000))),
    case("clock jitter up to 0.4 ms", Must::GoOn, |random| {
        now(InjectedEvent::Jitter(0, random.random_range(100..400)))
    }),
    case("clock leaps ahead", Must::Either, |random| {
        now(InjectedEvent::Leap(0, random.random_range(5_000..2_000_000)))
    }),
    case("clock leaps back", Must::Either, |random| now(InjectedEvent::Leap(0, -random.random_range(5_000..600_000)))),
    case("reset in motion", Must::AtOnce, |random| {
        let resets = [Reset::BrownOut, Reset::PowerOn, Reset::Panic, Reset::External, Reset::Software];
        now(InjectedEvent::Boot(0, resets[random.random_range(0..resets.len())]))
    }),
    case("power cut, and back", Must::AtOnce, |random| {
        let back_us = random.random_range(50_000..500_000);
        vec![(0, InjectedEvent::PowerCut(0)), (back_us, InjectedEvent::Boot(0, Reset::PowerOn))]
    }),
];

/// Nothing happens.
pub const NOTHING: Case = case("none, for comparison", Must::GoOn, |_| Vec::new());

impl Case {
    /// Whether it can show in a mode.
    #[must_use]
    pub fn shows(&self, mode: Mode) -> bool {
        !(self.hides_at_rest && mode == Mode::Idle)
    }
}
