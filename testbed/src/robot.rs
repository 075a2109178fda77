//! A robot on the bench: the tasks of its firmware on simulated parts.

use std::cell::{Cell, RefCell};
use std::future::Future;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use control::protocol::pairing::Pairing;
use control::protocol::radio::{Counters, Reset};
use control::protocol::secure::SessionReceiver;
use control::{Actuation, Fault, Parameters, State};
use hal_sim::Truth;
use hal_sim::body::Snapshot;
use shell::board::{Address, Encryption, Readings, Sender, Sent};
use shell::inject;
use shell::robot::{
    Booted, Identity, Parts, Settings, Shared, Shown, boot, control_loop, led, pair, persistence_task, receive, send,
};
use shell::store;

use crate::air::{Ether, HostSender};
use crate::broken::Broken;
use crate::event_log::{Detail, Event, EventLog};
use crate::flash::Flash;
use crate::parts::{Board, Plant, ProcessorHold, SeededEntropy, StatusLed};
use crate::power::Power;
use crate::serial::Serial;
use crate::simulated::Simulated;
use crate::time::{Processor, World, now_us, until};

/// A robot before it is on the bench.
#[derive(Clone, Debug)]
pub struct Member {
    /// ESP-NOW (MAC) address.
    pub address: Address,
    /// Whom it obeys; nobody until it is paired over its serial line.
    pub pairing: Option<Pairing>,
    /// Built into its firmware.
    pub settings: Settings,
    /// Parameters in its flash.
    pub stored: Option<Parameters>,
    /// Motor, bridge, sensor, or the whole robot on the ground; with the faults that it shall have.
    pub simulated: Simulated,
    /// How long a conversion takes, µs.
    pub conversion_us: u64,
    /// Place on a line, m; the dongle is at 0.
    pub position_m: f64,
    /// Why it boots at the beginning.
    pub reset: Reset,
    /// Its image makes faults on request.
    pub injectable: bool,
    /// What is wrong with its board.
    pub broken: Vec<Broken>,
}

/// A robot on the bench.
pub struct Robot {
    /// What happens to it.
    pub event_log: EventLog,
    /// Its serial line, over which it is paired.
    pub line: Serial,
    address: Address,
    settings: Settings,
    plant: Rc<RefCell<Plant>>,
    flash: Flash,
    entropy: SeededEntropy,
    power: Power,
    board: Board,
    processor: Processor,
    shared: Rc<Shared>,
    injectable: bool,
    /// Largest delay of its ticks, µs.
    jitter_us: Rc<Cell<u64>>,
    ether: Ether,
}

impl Robot {
    /// Its flash is written; it has not booted.
    pub(crate) fn new(member: Member, seed: u64, detail: Detail, world: &mut World, ether: &Ether) -> Self {
        let event_log = EventLog::new(detail);
        let flash = prepared(&member);
        let plant = Plant::new(member.simulated, member.settings.conversions, member.conversion_us);
        let plant = plant.with(member.broken);
        let plant = Rc::new(RefCell::new(plant));
        let power = {
            let (plant, event_log, ether, address) =
                (Rc::clone(&plant), event_log.clone(), ether.clone(), member.address);
            Power::new(move || {
                plant.borrow_mut().cut();
                ether.leave(&address);
                event_log.note(Event::Fell);
                if plant.borrow().actuation().enable {
                    event_log.note(Event::Applied(plant.borrow().actuation()));
                }
            })
        };
        ether.place(member.address, member.position_m);
        Self {
            board: Board::new(&plant, &power, &event_log),
            flash: flash.with(&event_log),
            event_log,
            line: Serial::default(),
            address: member.address,
            settings: member.settings,
            plant,
            entropy: SeededEntropy::new(seed),
            power,
            processor: world.processor(),
            shared: Rc::new(Shared::new()),
            injectable: member.injectable,
            jitter_us: Rc::new(Cell::new(0)),
            ether: ether.clone(),
        }
    }

    /// Starts its firmware, as `firmware/src/bin/robot.rs` does.
    pub(crate) fn boot(&mut self, reset: Reset, world: &mut World, ether: &Ether) {
        self.power.fall();
        world.reset(self.processor);
        self.power.rise();
        self.line.reset();
        self.event_log.note(Event::Booted(reset));
        self.board = Board::new(&self.plant, &self.power, &self.event_log);
        self.shared = Rc::new(if self.injectable { Shared::injectable() } else { Shared::new() });
        let reset = if self.has(Broken::ResetCause) { Reset::PowerOn } else { reset };
        if self.has(Broken::Flash) {
            let at = Flash::partitions().parameters;
            let kept = at_once(store::parameters::reset(&mut self.flash, at));
            assert_eq!(kept, Ok(()), "a flash in memory forgets");
        }
        let booted = at_once(boot(&mut self.flash.clone(), &Flash::partitions(), &self.settings, reset));
        self.spawn(booted, world, ether);
    }

    /// In the order of their priority.
    fn spawn(&self, booted: Booted, world: &mut World, ether: &Ether) {
        let Booted { about, controller, pairing } = booted;
        let mut start = |task: std::pin::Pin<Box<dyn Future<Output = ()>>>| {
            world.spawn(self.processor, self.power.run(task));
        };
        let (settings, shared) = (self.settings.clone(), Rc::clone(&self.shared));
        let board = &self.board;
        if let Ok(controller) = controller {
            let (converter, bridge, watchdog) = (board.clone(), board.clone(), board.clone());
            if self.injectable {
                let injector = board.clone();
                start(Box::pin(async move {
                    let converter = inject::Converter::new(converter, injector, &shared);
                    let parts = Parts { converter, bridge, watchdog };
                    control_loop(parts, controller, &settings, &shared).await
                }));
            } else {
                let parts = Parts { converter, bridge, watchdog };
                start(Box::pin(async move { control_loop(parts, controller, &settings, &shared).await }));
            }
        }
        let name = about.name.clone();
        let console = pairing.as_ref().ok().map(|pairing| pairing.console);
        // Paired with nobody, it says nothing on the air.
        if let Ok(Pairing { console, primary, local, key }) = pairing {
            let (receiver, mut sender, gauge) = ether.join(self.address, &self.power, &self.event_log);
            sender.primary(&primary);
            sender.meet(&console, &local);
            let (entropy, shared) = (self.entropy.clone(), Rc::clone(&self.shared));
            start(Box::pin(
                async move { receive(receiver, SessionReceiver::new(key), console, entropy, &shared).await },
            ));
            let (restart, shared) = (self.power.clone(), Rc::clone(&self.shared));
            let sender = Radio { sender, deaf: self.has(Broken::Acknowledgement) };
            if self.injectable {
                let injector = board.clone();
                start(Box::pin(async move {
                    let sender = inject::Sender::new(sender, injector, &shared);
                    send(sender, gauge, restart, console, &about, &shared).await
                }));
            } else {
                start(Box::pin(async move { send(sender, gauge, restart, console, &about, &shared).await }));
            }
        }
        let (flash, factory, shared) = (self.flash.clone(), self.settings.parameters, Rc::clone(&self.shared));
        start(Box::pin(async move { persistence_task(flash, &Flash::partitions(), &factory, &shared).await }));
        let (line, power, shared) = (self.line.clone(), self.power.clone(), Rc::clone(&self.shared));
        let identity = Identity { address: self.address, name, console };
        start(Box::pin(async move { pair(line.clone(), line, power, &identity, &shared).await }));
        let (light, shared) = (StatusLed::new(&self.event_log), Rc::clone(&self.shared));
        start(Box::pin(async move { led(light, &shared).await }));
        if self.jitter_us.get() > 0 {
            start(Box::pin(disturb(Rc::clone(&self.jitter_us), self.entropy.clone(), board.clone())));
        }
    }

    /// Boots it where one of its tasks asked for that, or where its control loop waits for something that does not come.
    pub(crate) fn restart_if_wanted(&mut self, world: &mut World, ether: &Ether) {
        let hungry = self.power.is_running() && self.board.is_hungry();
        if let Some(reset) = self.power.wanted().or(hungry.then_some(Reset::Watchdog)) {
            self.boot(reset, world, ether);
        }
    }

    /// Without supply the bridge is open.
    pub(crate) fn cut_power(&self) {
        self.power.fall();
    }

    /// Delays its ticks by at most `most_us` from now on, µs.
    pub(crate) fn jitter(&self, most_us: u64, world: &mut World) {
        if self.jitter_us.replace(most_us) == 0 && most_us > 0 && self.power.is_running() {
            let task = disturb(Rc::clone(&self.jitter_us), self.entropy.clone(), self.board.clone());
            world.spawn(self.processor, self.power.run(task));
        }
    }

    /// Something below the control loop, like a critical section of the radio, keeps it out from a time on, µs.
    pub(crate) fn keep_busy(&self, hold: ProcessorHold, world: &mut World) {
        let board = self.board.clone();
        let task = async move {
            until(hold.at_us).await;
            board.block(hold.for_us);
        };
        world.spawn(self.processor, self.power.run(task));
    }

    /// Steps the robot's clock by `by_us`, µs.
    pub(crate) fn leap(&self, by_us: i64, world: &mut World) {
        world.leap(self.processor, by_us);
    }

    fn has(&self, broken: Broken) -> bool {
        self.plant.borrow().has(broken)
    }

    /// Motor, bridge, sensor.
    pub fn plant<R>(&self, work: impl FnOnce(&mut Plant) -> R) -> R {
        work(&mut self.plant.borrow_mut())
    }

    /// What really is, now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        self.plant(|plant| {
            plant.advance();
            plant.robot.truth()
        })
    }

    /// What really is with its body, now; none on a bench.
    #[must_use]
    pub fn snapshot(&self) -> Option<Snapshot> {
        self.plant(|plant| {
            plant.advance();
            plant.robot.snapshot()
        })
    }

    /// What the bridge is told at present.
    #[must_use]
    pub fn actuation(&self) -> Actuation {
        self.plant.borrow().actuation()
    }

    /// ESP-NOW (MAC) address.
    #[must_use]
    pub fn address(&self) -> Address {
        self.address
    }

    /// What is built into its firmware.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What its LED shows; nothing before its control loop has started or without supply.
    #[must_use]
    pub fn state(&self) -> Option<(State, Option<Fault>)> {
        match self.shared.shown() {
            Shown::State(state, fault) if self.power.is_running() => Some((state, fault)),
            _ => None,
        }
    }

    /// Its counters since it booted, as it tells them.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let Readings { too_long, overrun, heap_least_free } = self.ether.readings(&self.address);
        Counters { too_long, overrun, heap_least_free, ..self.shared.counters() }
    }
}

/// The radio's sending half, which may not hear that its frames were received.
struct Radio {
    sender: HostSender,
    deaf: bool,
}

impl Sender for Radio {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> Sent {
        match self.sender.send(to, payload).await {
            Sent::Acknowledged if self.deaf => Sent::Unheard,
            sent => sent,
        }
    }
}

/// A flash with what a robot shall find in it.
fn prepared(member: &Member) -> Flash {
    let (mut flash, at) = (Flash::blank(&EventLog::new(Detail::Nothing)), Flash::partitions());
    if let Some(pairing) = &member.pairing {
        let kept = at_once(store::pairing::save(&mut flash, at.pairing, pairing));
        assert_eq!(kept, Ok(()), "a blank flash keeps a pairing");
    }
    if let Some(stored) = &member.stored {
        let factory = &member.settings.parameters;
        let kept = at_once(store::parameters::save(&mut flash, at.parameters, factory, stored));
        assert_eq!(kept, Ok(()), "a blank flash keeps sound parameters");
    }
    flash
}

/// What waits for nothing. Time stands still meanwhile: it is before the bench begins, or a boot, which takes its own.
fn at_once<T>(work: impl Future<Output = T>) -> T {
    let before_us = now_us();
    let done = pin!(work).poll(&mut Context::from_waker(Waker::noop()));
    crate::time::turn_back(before_us);
    match done {
        Poll::Ready(done) => done,
        Poll::Pending => unreachable!("a flash in memory makes nobody wait"),
    }
}

/// Keeps the control loop out for a random time around every ms.
async fn disturb(most_us: Rc<Cell<u64>>, entropy: SeededEntropy, board: Board) {
    const BEFORE_US: u64 = 20;
    while most_us.get() > 0 {
        until(((now_us() + BEFORE_US) / 1000 + 1) * 1000 - BEFORE_US).await;
        board.block(BEFORE_US + entropy.up_to(most_us.get()));
    }
}
