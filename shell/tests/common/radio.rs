//! A radio with the habits of ESP-NOW's: a receive queue of 10 that forgets its oldest in silence, sends that take their
//! time and may not be let go of.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;

use control::Command;
use control::protocol::radio::{LONGEST, encode};
use embassy_time::Timer;
use hal_sim::random::{Source, Stream};
use shell::board::{Address, Payload, Received, Receiver, Sender};

use super::journal::{Event, Journal};
use super::time::now_us;

/// The host's radio address.
pub const HOST: Address = [2, 0, 0, 0, 0, 1];

/// Messages that the radio holds.
const QUEUE: usize = 10;

/// A message on its way to the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// When it arrives, µs.
    pub at_us: u64,
    /// Which it is, for the journal.
    pub number: u32,
    /// From whom.
    pub from: Address,
    /// Its bytes.
    pub payload: Payload,
}

impl Arrival {
    /// A command from the host.
    pub fn command(at_us: u64, sequence: u16, command: Command) -> Self {
        let mut buffer = [0; LONGEST];
        let bytes = encode(sequence, &command, &mut buffer).expect("it fits");
        let payload = Payload::from_slice(bytes).expect("it fits");
        Self { at_us, number: u32::from(sequence), from: HOST, payload }
    }
}

/// What the host sends, in the order of its times: when it arrives (µs), what, and whether it gets lost on its way.
pub type Script = Vec<(u64, Command, bool)>;

/// What a console sends: the latest of `orders` (s, command) every 50 ms until `until_s`, 1 to 5 ms on its way; nothing
/// where the latest is `None`. `loss` is the share that never arrives.
pub fn console(orders: &[(f64, Option<Command>)], until_s: f64, loss: f64, seed: u64) -> Script {
    let mut delay = Stream::new(seed, Source::Jitter);
    let mut fate = Stream::new(seed, Source::Spikes);
    let times = (0..).map(|repeat| f64::from(repeat) * 0.05).take_while(|time| *time < until_s);
    times
        .filter_map(|time| {
            let command = orders.iter().rev().find(|(from, _)| *from <= time)?.1?;
            let at_us = ((time + delay.uniform(1e-3, 5e-3)) * 1e6) as u64;
            Some((at_us, command, fate.uniform(0.0, 1.0) < loss))
        })
        .collect()
}

/// Numbers the messages one after the other from 65 000 on, so that the number comes round; those that get lost have one,
/// too.
pub fn numbered(mut script: Script) -> Vec<Arrival> {
    script.sort_by_key(|(at_us, ..)| *at_us);
    let numbers = (0..).map(|index| 65_000_u16.wrapping_add(index));
    let arriving = script.into_iter().zip(numbers).filter(|((_, _, lost), _)| !lost);
    arriving.map(|((at_us, command, _), number)| Arrival::command(at_us, number, command)).collect()
}

/// What becomes of a message sent at a time (µs): how long it takes (µs), and whether it is acknowledged.
pub type Fate = Box<dyn FnMut(u64) -> (u64, bool)>;

struct Air {
    coming: VecDeque<Arrival>,
    queue: VecDeque<Arrival>,
    fate: Fate,
}

impl Air {
    /// Moves what has arrived into the radio's queue.
    fn arrive(&mut self, journal: &Journal) {
        while let Some(message) = self.coming.pop_front_if(|message| message.at_us <= now_us()) {
            journal.note(Event::Arrived(message.number));
            if self.queue.len() == QUEUE {
                self.queue.pop_front();
                journal.note(Event::Overflowed);
            }
            self.queue.push_back(message);
        }
    }
}

/// Both halves of a radio, to which these messages come.
pub fn radio(arrivals: &[Arrival], fate: Fate, journal: &Journal) -> (HostReceiver, HostSender) {
    let mut coming: Vec<Arrival> = arrivals.to_vec();
    coming.sort_by_key(|arrival| arrival.at_us);
    let air = Rc::new(RefCell::new(Air { coming: coming.into(), queue: VecDeque::new(), fate }));
    (HostReceiver(air.clone(), journal.clone()), HostSender(air, journal.clone()))
}

/// The receiving half.
pub struct HostReceiver(Rc<RefCell<Air>>, Journal);

impl Receiver for HostReceiver {
    async fn receive(&mut self) -> Received {
        poll_fn(|context| {
            let mut air = self.0.borrow_mut();
            air.arrive(&self.1);
            if let Some(Arrival { number, from, payload, .. }) = air.queue.pop_front() {
                self.1.note(Event::Heard(number));
                return Poll::Ready(Received { from, rssi: -50, payload });
            }
            if let Some(next) = air.coming.front() {
                embassy_time_driver::schedule_wake(next.at_us, context.waker());
            }
            Poll::Pending
        })
        .await
    }
}

/// The sending half.
pub struct HostSender(Rc<RefCell<Air>>, Journal);

/// Tells on whoever lets go of a message too early.
struct Underway<'j>(&'j Journal);

impl Drop for Underway<'_> {
    fn drop(&mut self) {
        self.0.note(Event::SendDropped);
    }
}

impl Sender for HostSender {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> bool {
        let (takes_us, acknowledged) = (self.0.borrow_mut().fate)(now_us());
        self.1.note(Event::Sending(*to, payload.to_vec()));
        let underway = Underway(&self.1);
        Timer::after_micros(takes_us).await;
        std::mem::forget(underway);
        self.1.note(Event::Sent(acknowledged));
        acknowledged
    }
}
