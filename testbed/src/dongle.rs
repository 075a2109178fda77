//! A dongle on the bench: the tasks of its firmware between a serial line and the air.

use std::rc::Rc;

use control::protocol::dongle::Counters;
use shell::board::Readings;
use shell::dongle::{Identity, Parts, Shared, run};

use crate::air::Ether;
use crate::event_log::{Detail, EventLog};
use crate::parts::SimulatedWatchdog;
use crate::power::Power;
use crate::serial::Serial;
use crate::time::{Processor, World, now_us, pass};

/// Longer than any simulation, µs.
const FOR_EVER_US: u64 = 1 << 60;

/// A dongle on the bench.
pub struct Dongle {
    /// Its serial line.
    pub line: Serial,
    identity: Identity,
    power: Power,
    processor: Processor,
    shared: Rc<Shared>,
    dog: SimulatedWatchdog,
    boots: u32,
    ether: Ether,
}

impl Dongle {
    /// It has not booted.
    pub(crate) fn new(identity: Identity, world: &mut World, ether: &Ether) -> Self {
        let its_ether = ether.clone();
        Self {
            line: Serial::default(),
            identity,
            power: Power::new(move || its_ether.leave(&identity.address)),
            processor: world.processor(),
            shared: Rc::new(Shared::new()),
            dog: SimulatedWatchdog::default(),
            boots: 0,
            ether: ether.clone(),
        }
    }

    /// Starts its firmware, as `firmware/src/bin/dongle.rs` does.
    pub(crate) fn boot(&mut self, world: &mut World, ether: &Ether) {
        self.power.fall();
        world.reset(self.processor);
        self.power.rise();
        self.line.reset();
        self.shared = Rc::new(Shared::new());
        self.dog = SimulatedWatchdog::default();
        self.boots += 1;
        let (receiver, sender, gauge) = ether.join(self.identity.address, &self.power, &EventLog::new(Detail::Nothing));
        let parts = Parts {
            from_host: self.line.clone(),
            to_host: self.line.clone(),
            receiver,
            sender,
            gauge,
            watchdog: self.dog.clone(),
            restart: self.power.clone(),
        };
        let (identity, shared) = (self.identity, Rc::clone(&self.shared));
        world.spawn(self.processor, self.power.run(async move { run(parts, identity, &shared).await }));
    }

    /// Boots it where its program asked for that, or where the watchdog was not fed.
    pub(crate) fn restart_if_wanted(&mut self, world: &mut World, ether: &Ether) {
        let hungry = self.power.is_running() && now_us() >= self.dog.bites_us();
        if self.power.wanted().is_some() || hungry {
            self.boot(world, ether);
        }
    }

    /// Its processor stands still for good, and its watchdog with it.
    pub(crate) fn hang(&self) {
        self.power.fall();
    }

    /// Its program comes to nothing any more.
    pub(crate) fn spin(&self, world: &mut World) {
        world.spawn(self.processor, self.power.run(async { pass(FOR_EVER_US) }));
    }

    /// How often it has booted.
    #[must_use]
    pub fn boots(&self) -> u32 {
        self.boots
    }

    /// Who it is.
    #[must_use]
    pub fn identity(&self) -> Identity {
        self.identity
    }

    /// Its counters since it booted, as it tells them.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let Readings { too_long, overrun, heap_least_free } = self.ether.readings(&self.identity.address);
        Counters { too_long, overrun, heap_least_free, ..self.shared.counters() }
    }
}
