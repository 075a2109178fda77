//! One radio: what is on its way to it, and what waits for its program.

use std::collections::VecDeque;

use super::loss::Bursts;
use super::{Address, AirCounts, Delivery};

/// Which frame of which sender: the station's place in the air's list, and a number that grows with every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Origin {
    pub sender: usize,
    pub number: u64,
}

#[derive(Clone, Debug, PartialEq)]
struct Arrival {
    /// Nothing for what an attacker injected.
    origin: Option<Origin>,
    delivery: Delivery,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Station {
    pub address: Address,
    /// Place on a line, m.
    pub position_m: f64,
    pub on: bool,
    pub bursts: Bursts,
    /// By time of arrival.
    coming: VecDeque<Arrival>,
    queue: VecDeque<Delivery>,
    /// Dropped since it was switched on, because the queue was full.
    pub overflowed: u64,
    /// The newest frame of each sender that has arrived, by the sender's place in the air's list.
    newest: Vec<u64>,
}

impl Station {
    pub fn new(address: Address) -> Self {
        Self {
            address,
            position_m: 0.0,
            on: true,
            bursts: Bursts::default(),
            coming: VecDeque::new(),
            queue: VecDeque::new(),
            overflowed: 0,
            newest: Vec::new(),
        }
    }

    /// Off: what was on its way and what waited is gone.
    pub fn switch_off(&mut self) {
        self.on = false;
        self.coming.clear();
        self.queue.clear();
        self.overflowed = 0;
    }

    /// Puts a frame on its way. Of frames that arrive together, the one put first is first.
    pub fn expect(&mut self, origin: Option<Origin>, delivery: Delivery) {
        let place = self.coming.partition_point(|other| other.delivery.arrived_us <= delivery.arrived_us);
        self.coming.insert(place, Arrival { origin, delivery });
    }

    /// Takes what has arrived by now into the queue. Done before anything is put on its way, so that a radio that nobody
    /// reads does not gather frames.
    pub fn settle(&mut self, now_us: u64, longest: usize, counts: &mut AirCounts) {
        while self.coming.front().is_some_and(|arrival| arrival.delivery.arrived_us <= now_us) {
            let Some(Arrival { origin, delivery }) = self.coming.pop_front() else { break };
            if let Some(Origin { sender, number }) = origin {
                if self.newest.len() <= sender {
                    self.newest.resize(sender + 1, 0);
                }
                counts.reordered += u64::from(number < self.newest[sender]);
                self.newest[sender] = self.newest[sender].max(number);
            }
            self.queue.push_back(delivery);
            while self.queue.len() > longest {
                self.queue.pop_front();
                counts.overflowed += 1;
                self.overflowed += 1;
            }
        }
    }

    pub fn take(&mut self) -> Option<Delivery> {
        self.queue.pop_front()
    }

    pub fn next_arrival_us(&self) -> Option<u64> {
        let waiting = self.queue.front();
        waiting.or_else(|| self.coming.front().map(|arrival| &arrival.delivery)).map(|delivery| delivery.arrived_us)
    }
}
