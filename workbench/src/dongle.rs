//! A dongle on the bench: the tasks of its firmware between a serial line and the air.

use std::rc::Rc;

use control::protocol::dongle::Counters;
use shell::dongle::{Identity, Shared, run};

use crate::air::Ether;
use crate::journal::{Detail, Journal};
use crate::power::Power;
use crate::serial::Serial;
use crate::time::{Processor, World};

/// A dongle on the bench.
pub struct Dongle {
    /// Its serial line.
    pub line: Serial,
    identity: Identity,
    power: Power,
    processor: Processor,
    shared: Rc<Shared>,
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
        }
    }

    /// Starts its firmware, as `firmware/src/bin/dongle.rs` does.
    pub(crate) fn boot(&mut self, world: &mut World, ether: &Ether) {
        self.power.fall();
        world.reset(self.processor);
        self.power.rise();
        self.line.reset();
        self.shared = Rc::new(Shared::new());
        let (line, identity, shared) = (self.line.clone(), self.identity, Rc::clone(&self.shared));
        let (receiver, sender) = ether.join(identity.address, &self.power, &Journal::new(Detail::Nothing));
        let task = async move { run(line.clone(), line, receiver, sender, identity, &shared).await };
        world.spawn(self.processor, self.power.run(task));
    }

    /// Its processor stands still.
    pub(crate) fn hang(&self) {
        self.power.fall();
    }

    /// Who it is.
    #[must_use]
    pub fn identity(&self) -> Identity {
        self.identity
    }

    /// Its counters since it booted.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.shared.counters()
    }
}
