//! Radios on the simulated air, with the habits of ESP-NOW's: a send takes its time and may not be let go of.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::{Poll, Waker};

use hal_sim::radio::{Adversary, Air, AirCounts, Trouble};
use shell::board::{Address, Encryption, Gauge, RadioKey, Readings, Received, Receiver, Sender, Sent};
use shell::inbox::Inbox;

use crate::event_log::{Event, EventLog};
use crate::power::Power;
use crate::time::{now_us, until, wake_at};

/// Encrypted peers that a radio's list has room for (ESP-NOW: 17 at most).
const MOST_MET: usize = 17;

/// What a radio encrypts with, to and from another one.
type Keys = (RadioKey, RadioKey);

/// How a radio's driver takes what is to be sent, until its processor is reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Driver {
    /// As it should.
    #[default]
    Works,
    /// It sends, and never calls back.
    Stuck,
    /// It has no buffer left.
    Full,
}

#[derive(Default)]
struct Radio {
    inbox: Inbox,
    driver: Driver,
    waker: Option<Waker>,
    primary: RadioKey,
    met: BTreeMap<Address, RadioKey>,
    /// So much later than the air says it calls back, µs.
    callback_us: u64,
    /// Frames that it could not decrypt.
    unreadable: u64,
}

impl Radio {
    fn keys(&self, other: &Address) -> Option<Keys> {
        self.met.get(other).map(|local| (self.primary, *local))
    }
}

struct Inner {
    air: Air,
    radios: BTreeMap<Address, Radio>,
}

/// The air between everybody on the bench. Clones are the same one.
#[derive(Clone)]
pub struct Ether(Rc<RefCell<Inner>>);

impl Ether {
    /// Nobody on it.
    #[must_use]
    pub fn new(air: Air) -> Self {
        Self(Rc::new(RefCell::new(Inner { air, radios: BTreeMap::new() })))
    }

    /// Switches a radio on, without keys. `event_log` hears what it sends and receives.
    #[must_use]
    pub fn join(&self, address: Address, power: &Power, event_log: &EventLog) -> (HostReceiver, HostSender, HostGauge) {
        let mut inner = self.0.borrow_mut();
        inner.air.join(address);
        let radio = inner.radios.entry(address).or_default();
        *radio = Radio { callback_us: radio.callback_us, unreadable: radio.unreadable, ..Radio::default() };
        let half = Half { ether: self.clone(), address, power: power.clone(), event_log: event_log.clone() };
        (HostReceiver(half.clone()), HostSender(half.clone()), HostGauge(half))
    }

    /// Switches a radio off.
    pub fn leave(&self, address: &Address) {
        self.0.borrow_mut().air.leave(address);
    }

    /// What differs from the robot file from now on.
    pub fn trouble(&self, trouble: Trouble) {
        self.0.borrow_mut().air.trouble(trouble);
    }

    /// Puts a radio somewhere on a line, m.
    pub fn place(&self, address: Address, position_m: f64) {
        let mut inner = self.0.borrow_mut();
        inner.air.place(address, position_m);
    }

    /// Delays the callbacks of a radio by `by_us` from now on, µs.
    pub fn delay_callbacks(&self, address: Address, by_us: u64) {
        self.0.borrow_mut().radios.entry(address).or_default().callback_us = by_us;
    }

    /// From now on a radio's driver is broken, until its processor is reset.
    pub(crate) fn break_driver(&self, address: Address, driver: Driver) {
        self.0.borrow_mut().radios.entry(address).or_default().driver = driver;
    }

    /// Brings a frame to a radio in anybody's name.
    pub fn inject(&self, from: Address, to: Address, payload: &[u8]) {
        let mut inner = self.0.borrow_mut();
        inner.air.inject(now_us(), from, to, payload);
        inner.wake();
    }

    /// The second talker records what was sent, and sends something of its own.
    pub(crate) fn attack(&self, adversary: &mut Adversary) {
        let mut inner = self.0.borrow_mut();
        adversary.listen(&mut inner.air);
        if adversary.act(now_us(), &mut inner.air).is_some() {
            inner.wake();
        }
    }

    /// What happened so far.
    #[must_use]
    pub fn counts(&self) -> AirCounts {
        self.0.borrow().air.counts()
    }

    /// What a radio's driver says of itself. There is no heap here.
    #[must_use]
    pub fn readings(&self, address: &Address) -> Readings {
        let inner = self.0.borrow();
        let too_long = inner.radios.get(address).map_or(0, |radio| radio.inbox.too_long());
        let overrun = u32::try_from(inner.air.overflowed(address)).unwrap_or(u32::MAX);
        Readings { too_long, overrun, heap_least_free: 0 }
    }

    /// Frames that a radio received and could not decrypt.
    #[must_use]
    pub fn unreadable(&self, address: &Address) -> u64 {
        self.0.borrow().radios.get(address).map_or(0, |radio| radio.unreadable)
    }
}

impl Inner {
    /// Everybody looks when the next frame comes.
    fn wake(&mut self) {
        self.radios.values_mut().filter_map(|radio| radio.waker.take()).for_each(Waker::wake);
    }

    /// The next frame for a radio. What is encrypted for other keys than its own never comes out of it, though its hardware
    /// has acknowledged it. What does goes through the same inbox as on a chip.
    fn receive(&mut self, address: &Address) -> Option<(u64, Received)> {
        loop {
            let delivery = self.air.receive(now_us(), address)?;
            let theirs = self.radios.get(&delivery.from).and_then(|radio| radio.keys(address));
            let radio = self.radios.get_mut(address)?;
            if radio.keys(&delivery.from) != theirs {
                radio.unreadable += 1;
                continue;
            }
            radio.inbox.offer(delivery.from, delivery.rssi, &delivery.payload);
            if let Some(received) = radio.inbox.try_receive() {
                return Some((delivery.arrived_us, received));
            }
        }
    }
}

#[derive(Clone)]
struct Half {
    ether: Ether,
    address: Address,
    power: Power,
    event_log: EventLog,
}

/// The receiving half.
pub struct HostReceiver(Half);

impl Receiver for HostReceiver {
    async fn receive(&mut self) -> Received {
        let Half { ether, address, event_log, .. } = &self.0;
        poll_fn(|context| {
            let mut inner = ether.0.borrow_mut();
            if let Some((arrived_us, received)) = inner.receive(address) {
                let Received { from, payload, .. } = &received;
                event_log.note(Event::Heard { arrived_us, from: *from, payload: payload.to_vec() });
                return Poll::Ready(received);
            }
            if let Some(radio) = inner.radios.get_mut(address) {
                radio.waker = Some(context.waker().clone());
            }
            if let Some(next_us) = inner.air.next_arrival_us(address) {
                wake_at(next_us, context.waker());
            }
            Poll::Pending
        })
        .await
    }
}

/// The sending half.
pub struct HostSender(Half);

/// Tells on whoever lets go of a frame too early.
struct Underway<'h>(&'h Half);

impl Drop for Underway<'_> {
    fn drop(&mut self) {
        // A processor that falls is not to blame.
        if self.0.power.is_running() {
            self.0.event_log.note(Event::SendDropped);
        }
    }
}

impl Sender for HostSender {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> Sent {
        let half = &self.0;
        half.event_log.note(Event::Sending(*to, payload.to_vec()));
        let (done_us, sent) = half.hand_over(to, payload);
        let underway = Underway(half);
        until(done_us).await;
        std::mem::forget(underway);
        half.event_log.note(Event::Sent(sent == Sent::Acknowledged));
        sent
    }
}

impl Half {
    /// When the driver calls back, µs, and what it says.
    fn hand_over(&self, to: &Address, payload: &[u8]) -> (u64, Sent) {
        let mut inner = self.ether.0.borrow_mut();
        let (driver, callback_us) =
            inner.radios.get(&self.address).map_or((Driver::Works, 0), |radio| (radio.driver, radio.callback_us));
        if driver == Driver::Full {
            return (now_us(), Sent::Refused);
        }
        let sent = inner.air.send(now_us(), self.address, *to, payload);
        inner.wake();
        let done_us = if driver == Driver::Stuck { u64::MAX } else { sent.done_us.saturating_add(callback_us) };
        (done_us, if sent.acknowledged { Sent::Acknowledged } else { Sent::Unheard })
    }
}

/// The driver, asked how it is.
pub struct HostGauge(Half);

impl Gauge for HostGauge {
    fn read(&self) -> Readings {
        self.0.ether.readings(&self.0.address)
    }
}

impl Encryption for HostSender {
    fn primary(&mut self, key: &RadioKey) {
        if let Some(radio) = self.0.ether.0.borrow_mut().radios.get_mut(&self.0.address) {
            radio.primary = *key;
            radio.met.clear();
        }
    }

    fn meet(&mut self, address: &Address, local: &RadioKey) -> bool {
        let mut inner = self.0.ether.0.borrow_mut();
        let Some(radio) = inner.radios.get_mut(&self.0.address) else { return false };
        let room = radio.met.contains_key(address) || radio.met.len() < MOST_MET;
        if room {
            radio.met.insert(*address, *local);
        }
        room
    }
}
