//! A dongle with a host's cable on the one side and a radio on the other.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::{Future, poll_fn};
use std::rc::Rc;
use std::task::{Poll, Waker};

use control::protocol::VERSION;
use control::protocol::dongle::{Counters, FromDongle, ToDongle};
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::radio;
use embassy_time::Timer;
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use shell::board::{Address, Payload, Received, Receiver, Sender};
use shell::dongle::{self, Identity, Shared};

use crate::time::{World, now_us};

pub const ROBOT: Address = [2, 0, 0, 0, 0, 7];
const IDENTITY: Identity = Identity { address: [2, 0, 0, 0, 0, 1], channel: 6 };
pub const HELLO: FromDongle =
    FromDongle::Hello { version: VERSION, address: IDENTITY.address, channel: IDENTITY.channel };

/// What the host does with its end of the cable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cable {
    Reading,
    /// Plugged in, but no program reads.
    Idle,
    /// Unplugged: the driver tells.
    Broken,
    /// Unplugged: the driver waits for ever, and what is in its buffer is lost.
    Gone,
}

/// Bytes in the driver's buffer: USB's packet.
const BUFFER: usize = 64;

pub struct Wire {
    cable: Cable,
    /// Bytes after which the cable changes.
    pub change: Option<(usize, Cable)>,
    buffer: VecDeque<u8>,
    /// What the host has read.
    pub read: Vec<u8>,
    pub to_dongle: VecDeque<u8>,
    pub read_error: bool,
    wakers: Vec<Waker>,
}

#[derive(Clone)]
pub struct Usb(Rc<RefCell<Wire>>);

impl Usb {
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Wire {
            cable: Cable::Reading,
            change: None,
            buffer: VecDeque::new(),
            read: Vec::new(),
            to_dongle: VecDeque::new(),
            read_error: false,
            wakers: Vec::new(),
        })))
    }

    pub fn change<R>(&self, change: impl FnOnce(&mut Wire) -> R) -> R {
        let mut wire = self.0.borrow_mut();
        let result = change(&mut wire);
        wire.wakers.drain(..).for_each(Waker::wake);
        result
    }

    pub fn plug(&self, cable: Cable) {
        self.change(|wire| wire.set(cable));
    }

    pub fn say(&self, message: &ToDongle) {
        self.change(|wire| wire.to_dongle.extend(frame(message)));
    }

    pub fn heard(&self) -> (Vec<FromDongle>, u32) {
        decode(&self.0.borrow().read)
    }
}

impl Wire {
    fn set(&mut self, cable: Cable) {
        self.cable = cable;
        match cable {
            Cable::Reading => self.read.extend(self.buffer.drain(..)),
            Cable::Gone => self.buffer.clear(),
            Cable::Idle | Cable::Broken => {}
        }
    }

    /// Takes what there is room for; `None` to wait.
    fn take(&mut self, bytes: &[u8]) -> Option<Result<usize, ErrorKind>> {
        let room = match self.cable {
            Cable::Reading => BUFFER,
            Cable::Idle => BUFFER - self.buffer.len(),
            Cable::Broken => return Some(Err(ErrorKind::NotConnected)),
            Cable::Gone => 0,
        };
        let room = self.change.map_or(room, |(left, _)| room.min(left)).min(bytes.len());
        let cable = self.cable;
        let into: &mut dyn FnMut(u8) = if cable == Cable::Reading {
            &mut |byte| self.read.push(byte)
        } else {
            &mut |byte| self.buffer.push_back(byte)
        };
        bytes[..room].iter().copied().for_each(into);
        if let Some((left, cable)) = &mut self.change {
            *left -= room;
            if *left == 0 {
                let cable = *cable;
                self.change = None;
                self.set(cable);
            }
        }
        (room > 0).then_some(Ok(room))
    }
}

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

impl ErrorType for Usb {
    type Error = ErrorKind;
}

impl Read for Usb {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        poll_fn(|context| {
            let mut wire = self.0.borrow_mut();
            if std::mem::take(&mut wire.read_error) {
                return Poll::Ready(Err(ErrorKind::Other));
            }
            if wire.to_dongle.is_empty() {
                wire.wakers.push(context.waker().clone());
                return Poll::Pending;
            }
            let length = wire.to_dongle.len().min(bytes.len());
            bytes.iter_mut().zip(wire.to_dongle.drain(..length)).for_each(|(to, from)| *to = from);
            Poll::Ready(Ok(length))
        })
        .await
    }
}

impl Write for Usb {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        // About what full-speed USB manages.
        Timer::after_micros(64).await;
        poll_fn(|context| {
            let mut wire = self.0.borrow_mut();
            let taken = wire.take(bytes);
            if taken.is_none() {
                wire.wakers.push(context.waker().clone());
            }
            taken.map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        if self.0.borrow().cable == Cable::Broken { Err(ErrorKind::NotConnected) } else { Ok(()) }
    }
}

/// Messages that the radio itself holds, like ESP-NOW's driver.
const RADIO_QUEUE: usize = 10;

#[derive(Default)]
pub struct Air {
    arrived: VecDeque<Received>,
    waker: Option<Waker>,
    /// What the dongle sent: when its send began (µs), and what.
    pub sent: Vec<(u64, Payload)>,
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

/// Takes `fate(number)`: µs, acknowledged.
struct Sending<F>(Radio, F);

struct Underway(Radio);

impl Drop for Underway {
    fn drop(&mut self) {
        self.0.0.borrow_mut().abandoned += 1;
    }
}

impl<F: FnMut(u32) -> (u64, bool)> Sender for Sending<F> {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> bool {
        assert_eq!(*to, ROBOT);
        let payload = Payload::from_slice(payload).expect("short");
        let (takes_us, acknowledged) = (self.1)(number(&payload));
        self.0.0.borrow_mut().sent.push((now_us(), payload));
        let underway = Underway(self.0.clone());
        Timer::after_micros(takes_us).await;
        std::mem::forget(underway);
        acknowledged
    }
}

/// A dongle between a host and a radio, and a script.
pub struct Bench {
    pub usb: Usb,
    pub radio: Radio,
    shared: Shared,
}

impl Bench {
    pub fn new() -> Self {
        Self { usb: Usb::new(), radio: Radio::default(), shared: Shared::new() }
    }

    pub fn run(
        &self,
        until_us: u64,
        fate: impl FnMut(u32) -> (u64, bool),
        scripts: Vec<Box<dyn Future<Output = ()> + '_>>,
    ) {
        let mut world = World::new();
        let (usb, radio) = (self.usb.clone(), self.radio.clone());
        let sender = Sending(radio.clone(), fate);
        world.spawn(dongle::run(usb.clone(), usb, radio, sender, IDENTITY, &self.shared));
        for script in scripts {
            world.spawn(Box::into_pin(script));
        }
        world.run_until(until_us);
        assert_eq!(self.radio.0.borrow().abandoned, 0, "a send was not awaited to its end");
    }

    pub fn send(&self, number: u32) {
        self.usb.say(&ToDongle::Send { number: number as u16, to: ROBOT, payload: payload(number) });
    }

    /// Numbers from the radio, each every so many µs, for so long.
    pub async fn robot_talks(&self, every_us: u64, numbers: std::ops::Range<u32>) {
        for number in numbers {
            self.radio.arrive(number);
            Timer::after_micros(every_us).await;
        }
    }

    pub fn counters(&self) -> Counters {
        self.shared.counters()
    }
}
