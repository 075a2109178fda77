//! A robot on the bench: all its tasks in virtual time, and what can be read from the journal afterwards.

use std::path::Path;
use std::sync::LazyLock;

use control::protocol::radio::{Batch, Counters, FromRobot, Reset, Row, Status, decode};
use control::{Actuation, Command, Controller, Refusal, Telemetry};
use description::design::design;
use description::robot::{Robot, Sensor};
use embassy_time::{Instant, Timer};
use hal_sim::SimulatedRobot;
use shell::board::Address;
use shell::robot::{About, Parts, Settings, Shared, control_loop, led, receive, send};

use super::journal::{Event, Journal};
use super::parts::{Hold, HostLed, HostParts, HostWatchdog};
use super::radio::{Arrival, Fate, radio};
use super::time::{World, pass};

/// The default robot of the project.
static ROBOT: LazyLock<Robot> = LazyLock::new(|| {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).expect("robot.toml is sound")
});

/// What it says to the shell.
pub static SETTINGS: LazyLock<Settings> = LazyLock::new(|| Settings {
    name: ROBOT.name.as_str().try_into().expect("short"),
    parameters: design(&ROBOT).expect("the default robot has a controller").parameters,
    conversions: 3,
    outlier_lsb: 100,
});

/// A robot and what shall happen to it.
pub struct Bench {
    /// Built into its firmware.
    pub settings: Settings,
    /// What decides.
    pub controller: Controller,
    /// Told in its status.
    pub about: About,
    /// Motor, bridge, sensor; with the faults that it shall have.
    pub robot: SimulatedRobot,
    /// A conversion's duration, µs.
    pub conversion_us: u64,
    /// When the converter keeps the control loop waiting.
    pub holds: Vec<Hold>,
    /// When something below the control loop keeps it out, like a critical section of the radio.
    pub busy: Vec<Hold>,
    /// What comes in over the radio.
    pub arrivals: Vec<Arrival>,
    /// What becomes of its own messages.
    pub fate: Fate,
}

/// The default robot, its draws made by a seed.
pub fn simulated(seed: u64) -> SimulatedRobot {
    SimulatedRobot::new(&ROBOT, seed)
}

/// The default robot without jitter: all its ticks take the same time.
pub fn punctual(seed: u64) -> SimulatedRobot {
    let mut robot = ROBOT.clone();
    let Sensor::Potentiometer(potentiometer) = &mut robot.sensor else { panic!("robot.toml has a potentiometer") };
    potentiometer.adc.jitter_s.value = 0.0;
    SimulatedRobot::new(&robot, seed)
}

impl Bench {
    /// The default robot, ready to drive, with a radio on which everything arrives after 1.5 ms.
    pub fn new(seed: u64, arrivals: Vec<Arrival>) -> Self {
        let settings = SETTINGS.clone();
        let about = About {
            name: settings.name.clone(),
            reset: Reset::PowerOn,
            parameters: control::protocol::radio::Source::Factory,
        };
        Self {
            controller: Controller::new(&settings.parameters).expect("the parameters are sound"),
            settings,
            about,
            robot: simulated(seed),
            conversion_us: 37,
            holds: Vec::new(),
            busy: Vec::new(),
            arrivals,
            fate: Box::new(|_| (1500, true)),
        }
    }

    /// Runs all tasks from boot. What is due at the end itself is not begun; the journal ends there, whatever blocks.
    pub fn run(self, seconds: f64) -> Run {
        let end_us = (seconds * 1e6) as u64;
        let journal = Journal::default();
        let shared = Shared::new();
        let host = HostParts::new(self.robot, self.settings.conversions, self.conversion_us, &self.holds, &journal);
        let parts = Parts { converter: host.clone(), bridge: host.clone(), watchdog: HostWatchdog(journal.clone()) };
        let (receiver, sender) = radio(&self.arrivals, self.fate, &journal);
        let mut world = World::new();
        world.spawn(control_loop(parts, self.controller, &self.settings, &shared));
        world.spawn(receive(receiver, &shared));
        world.spawn(send(sender, &self.about, &shared));
        world.spawn(led(HostLed(journal.clone(), None), &shared));
        world.spawn(keep_busy(self.busy));
        world.run_until(end_us - 1);
        let mut events = journal.take();
        // A message that is underway when the bench is switched off is nobody's fault: it is not in here, because the
        // world is dropped only now.
        drop(world);
        events.retain(|(time_us, _)| *time_us <= end_us);
        Run { end_us, events, counters: shared.counters() }
    }
}

async fn keep_busy(times: Vec<Hold>) {
    for hold in times {
        Timer::at(Instant::from_micros(hold.at_us)).await;
        pass(hold.for_us);
    }
}

/// What happened.
pub struct Run {
    /// Length, µs.
    pub end_us: u64,
    /// Everything, in order.
    pub events: Vec<(u64, Event)>,
    /// At the end.
    pub counters: Counters,
}

impl Run {
    /// What was sent, with the time at which sending began and whether it was acknowledged. The last is left out while it
    /// is underway.
    pub fn sent(&self) -> Vec<(u64, Address, FromRobot, bool)> {
        let mut underway = None;
        let mut sent = Vec::new();
        for (time_us, event) in &self.events {
            match event {
                Event::Sending(to, bytes) => {
                    let (_, message) = decode(bytes).expect("the robot speaks its own language");
                    assert_eq!(underway.replace((*time_us, *to, message)), None, "one send at a time");
                }
                Event::Sent(acknowledged) => {
                    let (time_us, to, message) = underway.take().expect("it was begun");
                    sent.push((time_us, to, message, *acknowledged));
                }
                _ => {}
            }
        }
        sent
    }

    /// Telemetry messages that arrived.
    pub fn batches(&self) -> Vec<Batch> {
        let told = self.sent().into_iter().filter(|(.., acknowledged)| *acknowledged);
        told.filter_map(|(_, _, told, _)| if let FromRobot::Telemetry(batch) = told { Some(batch) } else { None })
            .collect()
    }

    /// Status messages, with their times.
    pub fn statuses(&self) -> Vec<(u64, Status)> {
        let told = self.sent().into_iter();
        told.filter_map(|(at, _, told, _)| if let FromRobot::Status(status) = told { Some((at, status)) } else { None })
            .collect()
    }

    /// Answers: time, sequence number, outcome.
    pub fn answers(&self) -> Vec<(u64, u16, Result<(), Refusal>)> {
        let told = self.sent().into_iter();
        told.filter_map(|(at, _, told, _)| match told {
            FromRobot::Answer { sequence, outcome } => Some((at, sequence, outcome)),
            _ => None,
        })
        .collect()
    }

    /// What the bridge was told, tick by tick: the first entry, before the first tick, is left out.
    pub fn actuations(&self) -> Vec<(u64, Actuation)> {
        let told = self.events.iter();
        told.filter_map(
            |(at, event)| if let Event::Applied(actuation) = event { Some((*at, *actuation)) } else { None },
        )
        .skip(1)
        .collect()
    }

    /// How often something happened.
    pub fn count(&self, what: impl Fn(&Event) -> bool) -> usize {
        self.events.iter().filter(|(_, event)| what(event)).count()
    }

    /// Times of something, µs.
    pub fn times(&self, what: impl Fn(&Event) -> bool) -> Vec<u64> {
        self.events.iter().filter(|(_, event)| what(event)).map(|(time_us, _)| *time_us).collect()
    }

    /// When a watchdog of this period (µs) would have reset the processor.
    pub fn bitten(&self, period_us: u64) -> Option<u64> {
        let mut feeds = self.times(|event| *event == Event::Fed);
        feeds.insert(0, 0);
        feeds.push(self.end_us);
        feeds.windows(2).find(|pair| pair[1] - pair[0] > period_us).map(|pair| pair[0] + period_us)
    }
}

/// A tick of the loop without tasks.
pub struct PlainTick {
    /// What the bridge was told.
    pub actuation: Actuation,
    /// What the controller said.
    pub telemetry: Telemetry,
    /// As telemetry over the radio has it.
    pub row: Row,
}

/// Controller and simulated robot without a shell: what `scram sim` does. A command is given before the first tick that
/// begins after its arrival. The middle of a tick's conversions is `middle_us` after its beginning.
pub fn plain(
    mut controller: Controller,
    mut robot: SimulatedRobot,
    middle_us: u64,
    heard: &[(u64, Command)],
    ticks: u64,
) -> Vec<PlainTick> {
    let mut heard = heard.iter().peekable();
    let tick = |_| {
        let mut sample = robot.sample();
        sample.time_us += middle_us;
        while let Some((at_us, command)) = heard.next_if(|(at_us, _)| *at_us < sample.time_us) {
            let _ = controller.command(*command, *at_us);
        }
        let actuation = controller.tick(&sample);
        robot.advance(actuation);
        let telemetry = controller.telemetry();
        PlainTick { actuation, telemetry, row: Row::new(sample.angle, &telemetry) }
    };
    (0..ticks).map(tick).collect()
}
