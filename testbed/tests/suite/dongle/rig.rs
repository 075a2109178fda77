//! A dongle with a host's cable on the one side and a scripted radio on the other.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Poll, Waker};

use control::protocol::VERSION;
use control::protocol::dongle::{Counters, FromDongle, RadioKey, ToDongle};
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::radio::{self, Reset};
use embassy_time::Timer;
use shell::board::{Address, Encryption, Gauge, Payload, Readings, Received, Receiver, Sender, Sent};
use shell::dongle::{self, Identity, Parts, Shared};
use testbed::parts::SimulatedWatchdog;
use testbed::power::Power;
use testbed::serial::Serial;
use testbed::time::{World, now_us};

pub const ROBOT: Address = [2, 0, 0, 0, 0, 7];
const IDENTITY: Identity = Identity { address: [2, 0, 0, 0, 0, 1], channel: 6 };
pub const HELLO: FromDongle =
    FromDongle::Hello { version: VERSION, address: IDENTITY.address, channel: IDENTITY.channel };

pub fn frame(message: &ToDongle) -> Vec<u8> {
    let mut buffer = [0; LONGEST + 1];
    [&[0], encode(message, &mut buffer).expect("short")].concat()
}

/// The messages, and how many frames held none.
pub fn decode(bytes: &[u8]) -> (Vec<FromDongle>, u32) {
    let mut deframer = Deframer::default();
    let messages = bytes.iter().filter_map(|byte| deframer.push(*byte)?.ok()).collect();
    (messages, deframer.bad())
}

/// Messages that the radio itself holds, like ESP-NOW's driver.
const RADIO_QUEUE: usize = 10;
/// Robots that it has room for.
pub const MET: usize = 2;

/// What the radio was told to do.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "most of them are the largest")]
pub enum Done {
    /// When its send began, µs, and what.
    Sent(u64, Payload),
    Primary(RadioKey),
    Met(Address, RadioKey),
}

#[derive(Default)]
pub struct Air {
    arrived: VecDeque<Received>,
    waker: Option<Waker>,
    pub done: Vec<Done>,
    /// Send futures that were dropped early.
    abandoned: u32,
}

#[derive(Clone, Default)]
pub struct Radio(pub Rc<RefCell<Air>>);

impl Radio {
    fn arrive(&self, number: u32) {
        let mut air = self.0.borrow_mut();
        let rssi = -40 - i8::try_from(number % 50).expect("small");
        air.arrived.push_back(Received { from: ROBOT, rssi, payload: payload(number) });
        assert!(air.arrived.len() <= RADIO_QUEUE, "the dongle does not listen to its radio");
        air.waker.take().into_iter().for_each(Waker::wake);
    }

    /// What was sent, and when, µs.
    pub fn sent(&self) -> Vec<(u64, Payload)> {
        let air = self.0.borrow();
        let sent = air.done.iter();
        sent.filter_map(
            |done| if let Done::Sent(at_us, payload) = done { Some((*at_us, payload.clone())) } else { None },
        )
        .collect()
    }
}

/// Of every length, and full of zeros, which frames must bear.
pub fn payload(number: u32) -> Payload {
    let length = 4 + number as usize % (radio::LONGEST - 3);
    number.to_le_bytes().into_iter().chain(std::iter::repeat(number as u8 & 3)).take(length).collect()
}

pub fn number(payload: &Payload) -> u32 {
    let number = u32::from_le_bytes(*payload.first_chunk().expect("four bytes"));
    assert_eq!(*payload, self::payload(number));
    number
}

impl Receiver for Radio {
    async fn receive(&mut self) -> Received {
        poll_fn(|context| {
            let mut air = self.0.borrow_mut();
            air.waker = Some(context.waker().clone());
            air.arrived.pop_front().map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }
}

/// What becomes of the message of a number, after how many µs.
pub type Fate = fn(u32) -> (u64, Sent);

#[derive(Clone)]
struct Sending(Radio, Fate);

struct Underway(Radio);

impl Drop for Underway {
    fn drop(&mut self) {
        self.0.0.borrow_mut().abandoned += 1;
    }
}

impl Sender for Sending {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> Sent {
        assert_eq!(*to, ROBOT);
        let payload = Payload::from_slice(payload).expect("short");
        let (takes_us, sent) = (self.1)(number(&payload));
        self.0.0.borrow_mut().done.push(Done::Sent(now_us(), payload));
        let underway = Underway(self.0.clone());
        Timer::after_micros(takes_us).await;
        std::mem::forget(underway);
        sent
    }
}

impl Encryption for Sending {
    fn primary(&mut self, key: &RadioKey) {
        self.0.0.borrow_mut().done.push(Done::Primary(*key));
    }

    fn meet(&mut self, address: &Address, local: &RadioKey) -> bool {
        let mut air = self.0.0.borrow_mut();
        let room = air.done.iter().filter(|done| matches!(done, Done::Met(..))).count() < MET;
        if room {
            air.done.push(Done::Met(*address, *local));
        }
        room
    }
}

/// What the driver says of itself.
pub const READINGS: Readings = Readings { too_long: 3, overrun: 2, heap_least_free: 1 };

impl Gauge for Sending {
    fn read(&self) -> Readings {
        READINGS
    }
}

/// What somebody does meanwhile.
pub type Script = Pin<Box<dyn Future<Output = ()>>>;

/// How it stands at the end.
pub struct End {
    /// When its watchdog would bite, µs.
    pub bites_us: u64,
    /// Why it wants to boot.
    pub reset: Option<Reset>,
}

/// A dongle between a host and a radio, and a script. Clones are the same one.
#[derive(Clone)]
pub struct DongleRig {
    pub usb: Serial,
    pub radio: Radio,
    /// Its processor.
    pub power: Power,
    shared: Rc<Shared>,
}

impl DongleRig {
    pub fn new() -> Self {
        let (power, shared) = (Power::new(|| {}), Rc::new(Shared::new()));
        power.rise();
        // Everything that is read stays to be looked at.
        Self { usb: Serial::with_room(usize::MAX), radio: Radio::default(), power, shared }
    }

    /// Runs it. It is not booted again.
    pub fn run(&self, until_us: u64, fate: Fate, scripts: Vec<Script>) -> End {
        let mut world = World::new();
        let sender = Sending(self.radio.clone(), fate);
        let dog = SimulatedWatchdog::default();
        let parts = Parts {
            from_host: self.usb.clone(),
            to_host: self.usb.clone(),
            receiver: self.radio.clone(),
            sender: sender.clone(),
            gauge: sender,
            watchdog: dog.clone(),
            restart: self.power.clone(),
        };
        let (processor, shared) = (world.processor(), Rc::clone(&self.shared));
        world.spawn(processor, self.power.run(async move { dongle::run(parts, IDENTITY, &shared).await }));
        for script in scripts {
            let processor = world.processor();
            world.spawn(processor, script);
        }
        world.run_until(until_us);
        let allowed = u32::from(!self.power.is_running());
        assert!(self.radio.0.borrow().abandoned <= allowed, "a send was not awaited to its end, and it goes on");
        End { bites_us: dog.bites_us(), reset: self.power.wanted() }
    }

    pub fn say(&self, message: &ToDongle) {
        self.write(&frame(message));
    }

    pub fn write(&self, bytes: &[u8]) {
        assert_eq!(self.usb.write(bytes).ok(), Some(bytes.len()), "the dongle reads");
    }

    pub fn send(&self, number: u32) {
        self.say(&ToDongle::Send { number: number as u16, to: ROBOT, payload: payload(number) });
    }

    pub fn heard(&self) -> (Vec<FromDongle>, u32) {
        decode(&self.usb.seen())
    }

    /// Numbers from the radio, each every so many µs, for so long.
    pub fn robot_talks(&self, every_us: u64, numbers: std::ops::Range<u32>) -> Script {
        let radio = self.radio.clone();
        Box::pin(async move {
            for number in numbers {
                radio.arrive(number);
                Timer::after_micros(every_us).await;
            }
        })
    }

    pub fn counters(&self) -> Counters {
        self.shared.counters()
    }
}
