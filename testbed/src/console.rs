//! A small console in virtual time, for tests of the robot's tasks: it begins a session, gives commands, keeps a heartbeat
//! and notes what it is told. It takes the place of the dongle on the air and has no host behind it.

use std::cell::{Cell, Ref, RefCell};
use std::rc::Rc;

use control::protocol::dongle::Address;
use control::protocol::pairing::Pairing;
use control::protocol::radio::{Answer, Downlink, LONGEST, Report, Request, RequestFrame, Uplink};
use control::protocol::secure::{Caller, Kind, Nonce, Opener, Sealer, kind};
use hal_sim::radio::BROADCAST;
use shell::board::{Encryption, Receiver, Sender, Sent};

use crate::air::HostSender;
use crate::bench::Bench;
use crate::event_log::{Detail, Event, EventLog};
use crate::parts::SeededEntropy;
use crate::power::Power;
use crate::time::{now_us, until};

/// Between two heartbeats, and between two repetitions of a command, µs.
const PERIOD_US: u64 = 50_000;

/// Downlink that the console sent.
#[derive(Clone, Debug, PartialEq)]
pub struct SentDownlink {
    /// Time of sending, µs.
    pub at_us: u64,
    /// The message.
    pub order: Downlink,
    /// Sealed frame, as sent.
    pub frame: Vec<u8>,
}

/// Uplink that the console received.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedUplink {
    /// When it took it from its radio, µs.
    pub at_us: u64,
    /// The message.
    pub uplink: Uplink,
    /// Tellings missing before it.
    pub missing: u32,
}

struct Inner {
    robot: Address,
    pairing: Pairing,
    entropy: SeededEntropy,
    sender: RefCell<Option<HostSender>>,
    caller: RefCell<Option<Caller>>,
    session: RefCell<Option<(Sealer, Opener)>>,
    number: Cell<u16>,
    beats: Cell<bool>,
    said: RefCell<Vec<SentDownlink>>,
    told: RefCell<Vec<ReceivedUplink>>,
    notices: Cell<usize>,
    event_log: EventLog,
}

/// A console of one robot. Clones are the same one.
#[derive(Clone)]
pub struct Console(Rc<Inner>);

impl Console {
    /// Puts the paired console of a robot on a bench without a dongle.
    ///
    /// # Panics
    /// There is a dongle.
    #[must_use]
    pub fn new(bench: &mut Bench, robot: usize, pairing: Pairing, seed: u64) -> Self {
        assert!(bench.dongle.is_none(), "a console takes the dongle's place");
        let event_log = EventLog::new(Detail::Everything);
        let power = Power::new(|| {});
        power.rise();
        let (mut receiver, mut sender, _) = bench.ether.join(pairing.console, &power, &event_log);
        let robot = bench.robots[robot].address();
        sender.primary(&pairing.primary);
        sender.meet(&robot, &pairing.local);
        let console = Self(Rc::new(Inner {
            robot,
            pairing,
            entropy: SeededEntropy::new(seed),
            sender: RefCell::new(Some(sender)),
            caller: RefCell::new(None),
            session: RefCell::new(None),
            number: Cell::new(u16::MAX - 2),
            beats: Cell::new(true),
            said: RefCell::default(),
            told: RefCell::default(),
            notices: Cell::new(0),
            event_log,
        }));
        let ear = console.clone();
        bench.spawn(async move {
            loop {
                let received = receiver.receive().await;
                ear.hear(&received.payload);
            }
        });
        let heart = console.clone();
        bench.spawn(async move {
            loop {
                if heart.0.beats.get() {
                    heart.say(heart.heartbeat()).await;
                }
                until((now_us() / PERIOD_US + 1) * PERIOD_US).await;
            }
        });
        console
    }

    fn hear(&self, frame: &[u8]) {
        if kind(frame) == Ok(Kind::Notice) {
            self.0.notices.set(self.0.notices.get() + 1);
        }
        let begun = self.0.caller.borrow().as_ref().and_then(|caller| caller.welcomed(frame).ok());
        if begun.is_some() {
            *self.0.session.borrow_mut() = begun;
            *self.0.caller.borrow_mut() = None;
            return;
        }
        let mut session = self.0.session.borrow_mut();
        let Some((_, opener)) = session.as_mut() else { return };
        if let Ok(opened) = opener.open::<Uplink>(frame) {
            let told = ReceivedUplink { at_us: now_us(), uplink: opened.body, missing: opened.missing };
            self.0.told.borrow_mut().push(told);
        }
    }

    /// Sends bytes as they are; whether the robot's radio acknowledged them.
    pub async fn send(&self, to: Address, frame: &[u8]) -> bool {
        // One at a time, as the driver wants it.
        let mut sender = loop {
            match self.0.sender.take() {
                Some(sender) => break sender,
                None => until(now_us() + 50).await,
            }
        };
        let sent = sender.send(&to, frame).await;
        *self.0.sender.borrow_mut() = Some(sender);
        sent == Sent::Acknowledged
    }

    /// Begins a session: calls until it is welcomed, and gives signs of life until it is told something, such as the time on
    /// the robot's clock.
    pub async fn begin(&self) {
        let caller = Caller::new(self.0.pairing.key.clone(), Nonce(self.0.entropy.bytes()));
        let hello = caller.hello();
        *self.0.caller.borrow_mut() = Some(caller);
        while self.0.caller.borrow().is_some() {
            self.send(self.0.robot, &hello).await;
            until(now_us() + PERIOD_US / 2).await;
        }
        let begun = self.0.told.borrow().len();
        while self.0.told.borrow().len() == begun {
            self.say(self.heartbeat()).await;
            until(now_us() + PERIOD_US / 2).await;
        }
    }

    /// The frame of a command in this session, which is not sent.
    #[must_use]
    pub fn seal(&self, order: Downlink) -> Option<Vec<u8>> {
        self.sealed(order, |sealer, buffer| sealer.seal(&order, buffer).ok().map(|(frame, _)| frame.len()))
    }

    fn sealed(
        &self,
        order: Downlink,
        seal: impl FnOnce(&mut Sealer, &mut [u8; LONGEST]) -> Option<usize>,
    ) -> Option<Vec<u8>> {
        let mut session = self.0.session.borrow_mut();
        let (sealer, _) = session.as_mut()?;
        let mut buffer = [0; LONGEST];
        let length = seal(sealer, &mut buffer)?;
        let frame = &buffer[..length];
        self.0.said.borrow_mut().push(SentDownlink { at_us: now_us(), order, frame: frame.to_vec() });
        Some(frame.to_vec())
    }

    /// Says something once, if there is a session; whether the robot's radio acknowledged it.
    pub async fn say(&self, order: Downlink) -> bool {
        match self.seal(order) {
            Some(frame) => self.send(self.0.robot, &frame).await,
            None => false,
        }
    }

    /// Says stop, to the robot and to everybody, until telemetry says that the bridge is off.
    pub async fn stop(&self) {
        let begun_us = now_us();
        while !self.is_off_since(begun_us) {
            self.say(Downlink::Stop).await;
            let to_all = self.sealed(Downlink::Stop, |sealer, buffer| {
                sealer.seal_to_all(&Downlink::Stop, buffer).ok().map(|(frame, _)| frame.len())
            });
            if let Some(frame) = to_all {
                self.send(BROADCAST, &frame).await;
            }
            until(now_us() + 10_000).await;
        }
    }

    fn is_off_since(&self, begun_us: u64) -> bool {
        let told = self.0.told.borrow();
        told.last().is_some_and(|told| {
            let Report::Telemetry(batch) = &told.uplink.report else { return false };
            told.at_us > begun_us && !batch.state.is_driving()
        })
    }

    /// A number for a command that was not used before.
    #[must_use]
    pub fn number(&self) -> u16 {
        self.0.number.replace(self.0.number.get().wrapping_add(1))
    }

    /// The robot's clock at a time of the bench, µs, as its last uplink has it; ms.
    #[must_use]
    pub fn robot_ms(&self, at_us: u64) -> u32 {
        let told = self.0.told.borrow();
        told.last()
            .map_or(0, |told| told.uplink.uptime_ms.wrapping_add((at_us.saturating_sub(told.at_us) / 1000) as u32))
    }

    /// Commands something that may be done within a second, and repeats it until it is answered; nothing where no answer comes
    /// in two.
    pub async fn order(&self, request: Request) -> Option<Answer> {
        let wanted = RequestFrame { number: self.number(), deadline_ms: self.robot_ms(now_us() + 1_000_000), request };
        let begun = self.0.told.borrow().len();
        let last_us = now_us() + 2_000_000;
        while now_us() < last_us {
            self.say(Downlink::Request(wanted)).await;
            let again_us = now_us() + PERIOD_US;
            while now_us() < again_us {
                if let Some(answer) = self.answer(wanted.number, begun) {
                    return Some(answer);
                }
                until(now_us() + 500).await;
            }
        }
        None
    }

    fn answer(&self, wanted: u16, begun: usize) -> Option<Answer> {
        self.0.told.borrow()[begun..].iter().find_map(|told| match told.uplink.report {
            Report::Answer { number, answer, .. } if number == wanted => Some(answer),
            _ => None,
        })
    }

    /// A heartbeat that says what was heard last.
    #[must_use]
    pub fn heartbeat(&self) -> Downlink {
        let told = self.0.told.borrow();
        Downlink::Heartbeat { heard_ms: told.last().map(|told| told.uplink.uptime_ms) }
    }

    /// Gives or withholds the heartbeat.
    pub fn beat(&self, beats: bool) {
        self.0.beats.set(beats);
    }

    /// Downlinks sent so far.
    #[must_use]
    pub fn said(&self) -> Ref<'_, [SentDownlink]> {
        Ref::map(self.0.said.borrow(), Vec::as_slice)
    }

    /// Uplinks received so far, in all sessions.
    #[must_use]
    pub fn told(&self) -> Ref<'_, [ReceivedUplink]> {
        Ref::map(self.0.told.borrow(), Vec::as_slice)
    }

    /// How often it was told that the robot speaks another version.
    #[must_use]
    pub fn notices(&self) -> usize {
        self.0.notices.get()
    }

    /// What its radio sent and received.
    #[must_use]
    pub fn radio(&self) -> Ref<'_, [(u64, Event)]> {
        self.0.event_log.events()
    }
}
