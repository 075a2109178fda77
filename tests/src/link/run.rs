//! One run of the campaign: a robot that does something, a fault, the console's end.

use std::collections::BTreeMap;
use std::time::Duration;

use control::protocol::radio::{Counters, Request};
use control::{Actuation, Fault as Cause, State};
use hal_sim::radio::AirCounts;
use link::{Counts, Event, Heard, RobotId};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use testbed::event_log::{self, actuations};

use super::fault::{Case, Host};
use super::mode::Mode;
use super::rig::{Rig, Template};

/// The first command comes at once, then the fault, not before this time, µs, and after it the end of the console.
const FAULT_FROM_US: u64 = 900_000;
/// Until the motor does what was commanded.
const SPUN_UP_US: u64 = 600_000;
/// The fault comes within this time: several turns.
const FAULT_WITHIN_US: u64 = 400_000;
/// Longer than every bound of the supervisor.
const WATCHED_US: u64 = 1_300_000;
/// Longer than the bound of a link that is lost.
const GONE_US: u64 = 650_000;
/// Length of a sleep.
const SLEEP_US: std::ops::Range<u64> = 700_000..2_500_000;
/// Time for which the console is watched after it.
const AWAKE_US: u64 = 500_000;
/// Time until the next command in [`Mode::Position`].
const MOVE_US: u64 = 100_000;
/// In [`Mode::Changing`] after this time at least, and sixteen times that at most.
const CHANGE_US: u64 = 60_000;
/// Time after which a person who insists gives the command again.
const INSIST_US: u64 = 200_000;
/// A virtual ms between two looks where nobody polls.
const LOOK: Duration = Duration::from_millis(1);
/// A frame is brought again so long after it was sent, as by [`hal_sim::radio::Adversary`].
const OLD_US: u64 = 300_000;

/// What a run was about.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// What the robot does.
    pub mode: Mode,
    /// Of everything that is drawn.
    pub seed: u64,
}

impl Task {
    /// In [`Mode::Changing`] a command stands for so long, µs: as likely short as long.
    #[must_use]
    pub fn change_us(self) -> u64 {
        let share = Pcg64::seed_from_u64(self.seed ^ 0xc4a6e).random_range(0.0..1.2);
        (CHANGE_US as f64 * 10f64.powf(share)) as u64
    }

    /// The time between two orders of somebody who moves the robot about, µs.
    fn move_us(self) -> Option<u64> {
        match self.mode {
            Mode::Position => Some(MOVE_US),
            Mode::Changing => Some(self.change_us()),
            _ => None,
        }
    }
}

/// What happened in a run.
#[derive(Clone, Debug)]
pub struct Trace {
    /// When the fault came, µs.
    pub fault_us: u64,
    /// When the console ended, µs.
    pub end_us: u64,
    /// What the bridge was told, where that is not what it was told before.
    pub told: Vec<(u64, Actuation)>,
    /// From when to when the bridge was on, µs.
    pub driven: Vec<(u64, Option<u64>)>,
    /// Code of the wiper by control period, as telemetry told it.
    pub codes: BTreeMap<u32, u16>,
    /// The cell, by the first control period of a message, mV.
    pub battery_mv: BTreeMap<u32, u16>,
    /// What the session counted, at the console's end.
    pub session: Option<Counts>,
    /// At the console's end.
    pub counters: Counters,
    /// At the console's end.
    pub air: AirCounts,
    /// Frames that counted: each came within a ms after this time, µs.
    pub valid_us: Vec<u64>,
    /// The first fault that the robot named after the fault's time.
    pub cause: Option<Cause>,
    /// State and bridge at the console's end.
    pub at_end: (Option<State>, bool),
    /// Mean speed of the shaft in the last quarter of a second before the console's end, rad/s.
    pub speed: f64,
    /// The session broke.
    pub broke: bool,
    /// Orders of the console after the first, µs.
    pub orders_us: Vec<u64>,
    /// Looks at which the bridge was on in `Fault`.
    pub on_in_fault: usize,
    /// Looks at which the robot did what nobody had commanded.
    pub not_ordered: usize,
    /// Commands that counted beyond those that the console sent.
    pub beyond: u32,
    /// When the robot was first seen in `Fault` after the fault's time, µs.
    pub faulted_us: Option<u64>,
}

/// A run under way.
struct Run<'c> {
    rig: Option<Rig>,
    end: testbed::host_end::HostEnd,
    case: Option<&'c Case>,
    task: Task,
    random: Pcg64,
    trace: Trace,
    received: u32,
    looked_us: u64,
    order_due_us: u64,
    orders: usize,
    /// Somebody gives the command repeatedly.
    insists: bool,
    quarter: Option<(u64, f64)>,
    replayed_us: u64,
}

/// Runs a case, or nothing but the task.
#[must_use]
pub fn run(template: &Template, task: Task, case: Option<&Case>) -> Trace {
    let mut random = Pcg64::seed_from_u64(task.seed);
    let drawn_us = random.random_range(0..FAULT_WITHIN_US);
    let mut rig = Rig::new(template.seeded(task.seed));
    if let Some(case) = case.filter(|case| case.early) {
        let now_us = rig.end.bench().now_us();
        inject(&rig, case, now_us, &mut random);
    }
    rig.meet();
    rig.order(0, task.mode.command(0));
    // Where the radio loses the first frames, a session takes a second to begin.
    let now_us = rig.end.bench().now_us();
    let fault_us = FAULT_FROM_US.max(now_us + SPUN_UP_US) + drawn_us;
    if let Some(case) = case.filter(|case| !case.early) {
        inject(&rig, case, fault_us, &mut random);
    }
    let mut run = Run::new(rig, case, task, random, fault_us);
    run.polled_until(fault_us);
    let end_us = run.through_the_fault(fault_us);
    run.polled_until(end_us);
    run.end_of_console()
}

fn inject(rig: &Rig, case: &Case, at_us: u64, random: &mut Pcg64) {
    let injected_events = (case.injected_events)(random);
    let mut bench = rig.end.bench();
    injected_events.into_iter().for_each(|(after_us, injected_event)| bench.at(at_us + after_us, injected_event));
}

impl<'c> Run<'c> {
    fn new(rig: Rig, case: Option<&'c Case>, task: Task, random: Pcg64, fault_us: u64) -> Self {
        let end = rig.end.clone();
        let looked_us = end.bench().now_us();
        let early = case.is_some_and(|case| case.early);
        let trace = Trace {
            fault_us: if early { 0 } else { fault_us },
            end_us: 0,
            told: Vec::new(),
            driven: Vec::new(),
            codes: BTreeMap::new(),
            battery_mv: BTreeMap::new(),
            session: None,
            counters: Counters::default(),
            air: AirCounts::default(),
            valid_us: Vec::new(),
            cause: None,
            at_end: (None, false),
            speed: 0.0,
            broke: false,
            orders_us: Vec::new(),
            on_in_fault: 0,
            not_ordered: 0,
            beyond: 0,
            faulted_us: None,
        };
        Self {
            rig: Some(rig),
            end,
            case,
            task,
            random,
            trace,
            received: 0,
            looked_us,
            order_due_us: looked_us + task.move_us().unwrap_or(MOVE_US),
            orders: 1,
            insists: task.seed % 2 == 1,
            quarter: None,
            replayed_us: 0,
        }
    }

    fn now_us(&self) -> u64 {
        self.end.bench().now_us()
    }

    /// The console goes on until a time, unless its line breaks.
    fn polled_until(&mut self, until_us: u64) {
        while self.now_us() < until_us {
            if self.quarter.is_none() && self.trace.end_us > 0 && self.now_us() + 250_000 >= self.trace.end_us {
                self.quarter = Some((self.now_us(), self.end.bench().robots[0].truth().angle));
            }
            self.order_again();
            match self.rig.as_mut().map(Rig::poll) {
                Some(Ok(heard)) => self.note(heard),
                Some(Err(_)) => {
                    self.trace.broke = true;
                    self.rig = None;
                }
                None => self.end.wait(LOOK),
            }
            self.look();
        }
    }

    /// Nobody polls until a time.
    fn unpolled_until(&mut self, until_us: u64) {
        while self.now_us() < until_us {
            self.end.wait(LOOK);
            self.look();
        }
    }

    /// What the console itself does at the fault's time; when it ends.
    fn through_the_fault(&mut self, fault_us: u64) -> u64 {
        let mut end_us = fault_us + WATCHED_US;
        match self.case.map_or(Host::Goes, |case| case.host) {
            Host::Goes | Host::IsReplayed => {}
            Host::Hangs => self.unpolled_until(end_us),
            Host::Killed => {
                self.kill();
                self.unpolled_until(end_us);
            }
            Host::Sleeps => {
                let awake_us = fault_us + self.random.random_range(SLEEP_US);
                self.unpolled_until(awake_us);
                end_us = awake_us + AWAKE_US;
            }
        }
        self.trace.end_us = end_us;
        end_us
    }

    fn kill(&mut self) {
        if let Some(rig) = self.rig.take() {
            rig.kill();
        }
    }

    /// A person who moves the robot about, or who insists. Nobody does where the console itself has trouble.
    fn order_again(&mut self) {
        let now_us = self.now_us();
        let moves = self.task.move_us();
        let (Some(rig), true) = (&mut self.rig, now_us >= self.order_due_us && (moves.is_some() || self.insists))
        else {
            return;
        };
        self.order_due_us = now_us + moves.unwrap_or(INSIST_US);
        if rig.session.robot(RobotId(0)).waiting() > 0 {
            return;
        }
        rig.session.request(RobotId(0), Request::Command(self.task.mode.command(self.orders)));
        self.orders += 1;
        self.trace.orders_us.push(now_us);
    }

    fn note(&mut self, heard: Option<Heard>) {
        if let Some(Heard { event: Event::Telemetry(batch), .. }) = heard {
            self.trace.battery_mv.insert(batch.first_tick, batch.battery_mv);
            let periods = batch.first_tick..;
            self.trace.codes.extend(periods.zip(batch.rows.iter().map(|row| row.code)));
        }
    }

    fn look(&mut self) {
        self.replay();
        let bench = self.end.bench();
        let robot = &bench.robots[0];
        let (now_us, told) = (bench.now_us(), robot.actuation());
        let received = robot.counters().received;
        if received > self.received {
            self.trace.valid_us.push(self.looked_us);
        }
        self.received = received;
        let state = robot.state();
        let faulted = matches!(state, Some((State::Fault, _)));
        if faulted && now_us >= self.trace.fault_us {
            self.trace.faulted_us.get_or_insert(now_us);
            self.trace.cause = self.trace.cause.or(state.and_then(|(_, cause)| cause));
        }
        self.trace.on_in_fault += usize::from(faulted && told.enable);
        let other_state = state.is_some_and(|(state, _)| state.is_driving() && !self.task.mode.leads_to(state));
        self.trace.not_ordered += usize::from(other_state || told.enable && !self.task.mode.allows(told.duty));
        self.looked_us = now_us;
    }

    /// Old commands come again, in the name of the console.
    fn replay(&mut self) {
        let now_us = self.now_us();
        let replayed = self.case.is_some_and(|case| case.host == Host::IsReplayed);
        if !replayed || now_us < self.trace.fault_us || now_us < self.replayed_us + 2000 {
            return;
        }
        self.replayed_us = now_us;
        let bench = self.end.bench();
        let robot = &bench.robots[0];
        let events = robot.event_log.events();
        let old = events.iter().filter_map(|(at_us, event)| match event {
            event_log::Event::Heard { from, payload, .. } if at_us + OLD_US < now_us => Some((*from, payload)),
            _ => None,
        });
        let old: Vec<_> = old.collect();
        if !old.is_empty() {
            let (from, payload) = old[self.random.random_range(0..old.len())];
            bench.ether.inject(from, robot.address(), payload);
        }
    }

    /// The console is killed, and the robot watched until it must have stopped.
    fn end_of_console(mut self) -> Trace {
        {
            let bench = self.end.bench();
            let robot = &bench.robots[0];
            self.trace.counters = robot.counters();
            self.trace.air = bench.ether.counts();
            self.trace.at_end = (robot.state().map(|(state, _)| state), robot.actuation().enable);
            if let Some((from_us, angle)) = self.quarter {
                self.trace.speed = (robot.truth().angle - angle) / ((bench.now_us() - from_us) as f64 * 1e-6);
            }
        }
        self.trace.session = self.rig.as_ref().map(|rig| rig.session.counts());
        self.trace.beyond = self.trace.session.map_or(0, |counts| {
            // Two may be under way.
            let sent = counts.acknowledged + counts.unacknowledged + counts.forgotten + 2;
            self.trace.counters.received.saturating_sub(sent)
        });
        self.kill();
        let gone_us = self.now_us() + GONE_US;
        self.unpolled_until(gone_us);
        let bench = self.end.bench();
        let events = bench.robots[0].event_log.events();
        self.trace.driven = event_log::driven(&events);
        self.trace.told = actuations(&events).collect();
        self.trace.told.dedup_by_key(|(_, told)| *told);
        self.trace
    }
}
