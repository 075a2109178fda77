//! A robot on the test bed with a console, and what can be read from its event log afterwards.

pub mod plain;

use std::future::Future;
use std::path::Path;
use std::sync::LazyLock;

use control::protocol::radio::{Answer, Batch, Counters, Report, Request, Status, Uplink};
use control::protocol::secure::{HEAD, Kind, TAG, kind};
use control::{Actuation, Command};
use hal_sim::SimulatedRobot;
use hal_sim::radio::{AirCounts, Trouble};
use robot_file::robot::{Robot, Sensor};
use shell::board::Address;
use shell::robot::Settings;
use testbed::air::Ether;
use testbed::bench::Bench;
use testbed::console::{Console, ReceivedUplink, SentDownlink};
use testbed::event_log::{self, Event};
use testbed::injected_event::InjectedEvent;
use testbed::parts::ProcessorHold;
use testbed::setup::{DONGLE, Setup, fine, pairing};

/// The default robot of the project.
pub static ROBOT: LazyLock<Robot> = LazyLock::new(|| {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).expect("robot.toml is sound")
});

/// What it says to the shell.
pub static SETTINGS: LazyLock<Settings> =
    LazyLock::new(|| Setup::new(&ROBOT, 1, 1).expect("robot.toml has all").robots.remove(0).settings);

pub const DRIVE: Command = Command::Speed { omega: 44.0 };

/// An air on which everything arrives soon.
pub const CALM: Trouble = Trouble {
    loss_share: Some(0.0),
    quiet_loss_share: Some(0.0),
    duplicate_share: Some(0.0),
    corruption_share: Some(0.0),
    tail_share: Some(0.0),
    late_callback_share: Some(0.0),
    ..Trouble::NONE
};

/// The default robot without jitter: all its ticks take the same time.
pub fn punctual(seed: u64) -> SimulatedRobot {
    let mut robot = ROBOT.clone();
    let Sensor::Potentiometer(potentiometer) = &mut robot.sensor else { panic!("robot.toml has a potentiometer") };
    potentiometer.adc.jitter_s.value = 0.0;
    fine(&robot, seed)
}

/// A robot, the air, and what shall happen.
pub struct Trial {
    pub setup: Setup,
    pub air: Trouble,
    pub injected_events: Vec<(u64, InjectedEvent)>,
    /// When something below the control loop keeps it out, like a critical section of the radio.
    pub busy: Vec<ProcessorHold>,
}

impl Trial {
    /// The default robot on calm air.
    pub fn new(seed: u64) -> Self {
        let mut setup = Setup::new(&ROBOT, 1, seed).expect("robot.toml has all");
        setup.dongle = None;
        Self { setup, air: CALM, injected_events: Vec::new(), busy: Vec::new() }
    }

    /// The same without jitter, so that times are known to the microsecond.
    pub fn punctual(seed: u64) -> Self {
        let mut trial = Self::new(seed);
        trial.setup.robots[0].simulated = punctual(seed).into();
        trial
    }

    /// Runs all tasks from boot, with a console that does as its script says. What is due at the end itself is not begun.
    pub fn run<F: Future + 'static>(self, seconds: f64, script: impl FnOnce(Console) -> F) -> Run {
        self.run_besides(seconds, script, |_, _| std::future::ready(()))
    }

    /// The same with somebody besides on the air.
    pub fn run_besides<F: Future + 'static, G: Future + 'static>(
        self,
        seconds: f64,
        script: impl FnOnce(Console) -> F,
        besides: impl FnOnce(Console, Ether) -> G,
    ) -> Run {
        let Self { setup, air, injected_events, busy } = self;
        let (end_us, seed) = ((seconds * 1e6) as u64, setup.seed);
        let mut bench = Bench::new(setup);
        bench.ether.trouble(air);
        for (at_us, injected_event) in injected_events {
            bench.at(at_us, injected_event);
        }
        for hold in busy {
            bench.keep_busy(0, hold);
        }
        let console = Console::new(&mut bench, 0, pairing(DONGLE, seed, 0), seed + 1000);
        bench.spawn(script(console.clone()));
        bench.spawn(besides(console.clone(), bench.ether.clone()));
        bench.run_until(end_us - 1);
        let robot = &bench.robots[0];
        let events = robot.event_log.take();
        let (counters, air) = (robot.counters(), bench.ether.counts());
        let (said, told, notices) = (console.said().to_vec(), console.told().to_vec(), console.notices());
        Run { events, counters, air, said, told, notices }
    }
}

/// Begins a session and makes the robot ready: after boot it checks itself first.
pub async fn ready(console: &Console) {
    console.begin().await;
    embassy_time::Timer::after_millis(50).await;
    assert_eq!(give(console, Command::ClearFault).await, Some(Answer::Done(None)));
}

/// Gives a command until it is answered.
pub async fn give(console: &Console, command: Command) -> Option<Answer> {
    console.order(Request::Command(command)).await
}

/// Drives from the beginning until a time (s), and is silent from then on.
pub fn driving(until_s: f64) -> impl FnOnce(Console) -> std::pin::Pin<Box<dyn Future<Output = ()>>> {
    move |console| {
        Box::pin(async move {
            ready(&console).await;
            assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
            until(until_s).await;
            console.beat(false);
        })
    }
}

/// Waits for a time, s.
pub async fn until(at_s: f64) {
    testbed::time::until((at_s * 1e6) as u64).await;
}

/// What a robot sends.
#[derive(Clone, Debug, PartialEq)]
pub enum Frame {
    Welcome,
    Notice,
    Uplink(Box<Uplink>),
}

fn read(frame: &[u8]) -> Frame {
    match kind(frame).expect("the robot speaks its own language") {
        Kind::Welcome => Frame::Welcome,
        Kind::Notice => Frame::Notice,
        Kind::Uplink => {
            // Behind the counter, before the tag.
            let body = &frame[HEAD + 4..frame.len() - TAG];
            let (uplink, rest) = postcard::take_from_bytes(body).expect("an uplink");
            assert!(rest.is_empty());
            Frame::Uplink(Box::new(uplink))
        }
        kind => panic!("a robot does not send {kind:?}"),
    }
}

/// What happened.
pub struct Run {
    /// Everything, in order.
    pub events: Vec<(u64, Event)>,
    /// The robot's at the end.
    pub counters: Counters,
    pub air: AirCounts,
    /// What the console said, was told, and how often it was told of another version.
    pub said: Vec<SentDownlink>,
    pub told: Vec<ReceivedUplink>,
    pub notices: usize,
}

impl Run {
    /// What was sent, with the time at which sending began and whether it was acknowledged. The last is left out while it
    /// is underway.
    pub fn sent(&self) -> Vec<(u64, Frame, bool)> {
        let mut underway = None;
        let mut sent = Vec::new();
        for (time_us, event) in &self.events {
            match event {
                Event::Sending(to, bytes) => {
                    assert_eq!(*to, DONGLE, "to the paired console alone");
                    assert_eq!(underway.replace((*time_us, read(bytes))), None, "one send at a time");
                }
                Event::Sent(acknowledged) => {
                    let (time_us, frame) = underway.take().expect("it was begun");
                    sent.push((time_us, frame, *acknowledged));
                }
                // The frame that was underway is gone.
                Event::Fell => underway = None,
                _ => {}
            }
        }
        sent
    }

    /// What was told in these frames, with the times.
    pub fn messages(&self) -> Vec<(u64, Report)> {
        let told = self.sent().into_iter();
        told.filter_map(|(at, frame, _)| if let Frame::Uplink(told) = frame { Some((at, told.report)) } else { None })
            .collect()
    }

    /// Telemetry that was sent.
    pub fn batches(&self) -> Vec<Batch> {
        let told = self.messages().into_iter();
        told.filter_map(|(_, told)| if let Report::Telemetry(batch) = told { Some(batch) } else { None }).collect()
    }

    /// Status messages, with their times.
    pub fn statuses(&self) -> Vec<(u64, Status)> {
        let told = self.messages().into_iter();
        told.filter_map(|(at, told)| if let Report::Status(status) = told { Some((at, status)) } else { None })
            .collect()
    }

    /// Answers: time, number, answer.
    pub fn answers(&self) -> Vec<(u64, u16, Answer)> {
        let told = self.messages().into_iter();
        told.filter_map(|(at, told)| match told {
            Report::Answer { number, answer, .. } => Some((at, number, answer)),
            _ => None,
        })
        .collect()
    }

    /// What the bridge was told, tick by tick: the first entry, before the first tick, is left out.
    pub fn actuations(&self) -> Vec<(u64, Actuation)> {
        event_log::actuations(&self.events).skip(1).collect()
    }

    /// When the bridge was on last, µs.
    pub fn last_on_us(&self) -> Option<u64> {
        let on = event_log::actuations(&self.events).filter(|(_, told)| told.enable);
        on.map(|(at_us, _)| at_us).max()
    }

    /// When frames came from an address, µs.
    pub fn arrivals(&self, by: Address) -> Vec<u64> {
        let heard = self.events.iter();
        heard
            .filter_map(|(_, event)| match event {
                Event::Heard { arrived_us, from, .. } if *from == by => Some(*arrived_us),
                _ => None,
            })
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
}
