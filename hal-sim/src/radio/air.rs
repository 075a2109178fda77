//! The air: sending, receiving, and what goes wrong between.

use std::collections::VecDeque;

use robot_file::robot::Radio;

use super::airtime::Rate;
use super::figures::Figures;
use super::station::{Origin, Station};
use super::streams::{Streams, draw_tail, flip_bits};
use super::trouble::Trouble;
use super::{Address, AirCounts, BROADCAST, Delivery, LONGEST, LONGEST_HEARD, Overheard, Sent};

/// So many frames are kept for who listens; the oldest goes.
const OVERHEARD: usize = 256;

/// Why a try was not received.
enum Miss {
    Silenced,
    OutOfRange,
    Lost,
}

/// A frame on its way through the chips and the channel.
struct Frame<'p> {
    origin: Origin,
    /// When its sender's software is ready, µs.
    ready_us: u64,
    /// What the tail and the trouble add to its arrival and to its callback, µs.
    late_us: u64,
    payload: &'p [u8],
}

/// The air. See [the module](super).
#[derive(Clone, Debug, PartialEq)]
pub struct Air {
    file: Figures,
    figures: Figures,
    streams: Streams,
    stations: Vec<Station>,
    /// Until then somebody sends, µs.
    busy_until_us: u64,
    number: u64,
    overheard: VecDeque<Overheard>,
    counts: AirCounts,
}

impl Air {
    /// Still air without stations.
    #[must_use]
    pub fn new(radio: &Radio, seed: u64) -> Self {
        let figures = Figures::new(radio);
        Self {
            file: figures,
            figures,
            streams: Streams::new(seed),
            stations: Vec::new(),
            busy_until_us: 0,
            number: 0,
            overheard: VecDeque::new(),
            counts: AirCounts::default(),
        }
    }

    /// Switches a radio on, at 0 m when it is new. One that is on stays as it is.
    pub fn join(&mut self, station: Address) {
        self.joined(station);
    }

    /// Switches a radio off: what was on its way to it or waited in it is gone, and nobody reaches it until it joins again.
    pub fn leave(&mut self, station: &Address) {
        if let Some(place) = self.find(station) {
            self.stations[place].switch_off();
        }
    }

    /// Puts a station on a line, m; a new one joins. Two stations are as far apart as their positions, those nearer
    /// than 1 m as at 1 m.
    pub fn place(&mut self, station: Address, position_m: f64) {
        let place = self.find(&station).unwrap_or_else(|| self.joined(station));
        self.stations[place].position_m = position_m;
    }

    /// What differs from the robot file from now on.
    pub fn trouble(&mut self, trouble: Trouble) {
        self.figures = self.file.with(&trouble);
    }

    /// Sends a frame; the sender joins if it has not. A payload longer than [`LONGEST`] is refused at once, as by ESP-NOW.
    pub fn send(&mut self, now_us: u64, from: Address, to: Address, payload: &[u8]) -> Sent {
        self.counts.sent += 1;
        if payload.len() > LONGEST {
            self.counts.refused += 1;
            return Sent { done_us: now_us, acknowledged: false };
        }
        let sender = self.joined(from);
        self.settle(now_us);
        if self.overheard.len() == OVERHEARD {
            self.overheard.pop_front();
        }
        self.overheard.push_back(Overheard { sent_us: now_us, from, to, payload: payload.to_vec() });
        self.number += 1;
        let handling = self.streams.handling.uniform(self.figures.handling_least_us, self.figures.handling_most_us);
        let tail = draw_tail(&self.figures.tail, &mut self.streams.tail, &mut self.counts.delayed);
        let frame = Frame {
            origin: Origin { sender, number: self.number },
            ready_us: now_us + whole(handling),
            late_us: self.figures.extra_delay_us + tail,
            payload,
        };
        let acknowledged = if to == BROADCAST { self.broadcast(&frame) } else { self.unicast(&frame, &to) };
        let callback =
            draw_tail(&self.figures.late_callback, &mut self.streams.callback, &mut self.counts.late_callbacks);
        Sent { done_us: self.busy_until_us + frame.late_us + callback, acknowledged }
    }

    /// Sends a frame as an attacker does, in anybody's name. It comes from 1 m, reaches everybody that it is for unless there
    /// is silence, and takes no channel time from others.
    pub fn inject(&mut self, now_us: u64, from: Address, to: Address, payload: &[u8]) {
        self.counts.injected += 1;
        if self.figures.silence {
            self.counts.silenced += 1;
            return;
        }
        if payload.len() > LONGEST_HEARD {
            self.counts.refused += 1;
            return;
        }
        self.settle(now_us);
        let rate = if to == BROADCAST { self.figures.broadcast } else { self.figures.unicast };
        let arrived_us = now_us + whole(rate.frame_us(payload.len(), to != BROADCAST));
        let rssi = rounded(self.figures.strength_1m_dbm);
        for station in self.stations.iter_mut().filter(|station| station.on && station.address != from) {
            if to == BROADCAST || to == station.address {
                station.expect(None, Delivery { from, rssi, payload: payload.to_vec(), arrived_us });
            }
        }
    }

    /// When the next frame can be received, µs: a time gone by where one waits already.
    #[must_use]
    pub fn next_arrival_us(&self, station: &Address) -> Option<u64> {
        self.stations[self.find(station)?].next_arrival_us()
    }

    /// Takes the oldest frame that has arrived by now and was not dropped.
    pub fn receive(&mut self, now_us: u64, station: &Address) -> Option<Delivery> {
        let place = self.find(station)?;
        let station = &mut self.stations[place];
        station.settle(now_us, self.figures.receive_queue, &mut self.counts);
        station.take()
    }

    /// Frames that a station dropped since it was switched on, because its queue was full.
    #[must_use]
    pub fn overflowed(&self, station: &Address) -> u64 {
        self.find(station).map_or(0, |place| self.stations[place].overflowed)
    }

    /// What happened so far.
    #[must_use]
    pub fn counts(&self) -> AirCounts {
        self.counts
    }

    /// What was sent since the last call, lost or not, without what was injected: the newest 256 frames.
    pub fn overheard(&mut self) -> Vec<Overheard> {
        self.overheard.drain(..).collect()
    }

    fn find(&self, address: &Address) -> Option<usize> {
        self.stations.iter().position(|station| station.address == *address)
    }

    /// The place of a station, which is on from now on.
    fn joined(&mut self, address: Address) -> usize {
        let place = self.find(&address).unwrap_or_else(|| {
            self.stations.push(Station::new(address));
            self.stations.len() - 1
        });
        self.stations[place].on = true;
        place
    }

    fn settle(&mut self, now_us: u64) {
        for station in &mut self.stations {
            station.settle(now_us, self.figures.receive_queue, &mut self.counts);
        }
    }

    /// Tries until the acknowledgement comes; whether it came.
    fn unicast(&mut self, frame: &Frame<'_>, to: &Address) -> bool {
        let rate = self.figures.unicast;
        let sender = frame.origin.sender;
        let receiver = self.find(to).filter(|&place| place != sender && self.stations[place].on);
        let mut received = false;
        for tries_before in 0..=self.figures.retries {
            self.counts.retried += u64::from(tries_before > 0);
            let end_us = self.transmit(frame, rate, tries_before, true);
            self.busy_until_us = end_us + whole(rate.acknowledgement_us());
            let Some(receiver) = receiver else {
                self.counts.unheard += 1;
                continue;
            };
            let Some(rssi) = self.reach(end_us, sender, receiver) else { continue };
            if received {
                self.counts.suppressed += 1;
            } else {
                self.deliver(frame, receiver, end_us, rssi);
                received = true;
            }
            if self.try_to_reach(self.busy_until_us, receiver, sender).is_ok() {
                return true;
            }
            self.counts.acknowledgements_lost += 1;
        }
        self.counts.unacknowledged += 1;
        false
    }

    /// Tries once; ESP-NOW says that it went well.
    fn broadcast(&mut self, frame: &Frame<'_>) -> bool {
        let end_us = self.transmit(frame, self.figures.broadcast, 0, false);
        self.busy_until_us = end_us;
        for receiver in 0..self.stations.len() {
            if receiver == frame.origin.sender || !self.stations[receiver].on {
                continue;
            }
            if let Some(rssi) = self.reach(end_us, frame.origin.sender, receiver) {
                self.deliver(frame, receiver, end_us, rssi);
            }
        }
        true
    }

    /// Waits for the channel and for the backoff; when the frame has left, µs.
    fn transmit(&mut self, frame: &Frame<'_>, rate: Rate, tries_before: u32, encrypted: bool) -> u64 {
        let slots = self.streams.handling.below(rate.window(tries_before));
        let access_us = rate.spacing_us() + f64::from(slots) * rate.slot_us();
        let begin_us = self.busy_until_us.max(frame.ready_us);
        begin_us + whole(access_us + rate.frame_us(frame.payload.len(), encrypted))
    }

    /// The strength of a frame at a receiver, dBm; nothing, and counted, when it is not received.
    fn reach(&mut self, at_us: u64, from: usize, to: usize) -> Option<i8> {
        match self.try_to_reach(at_us, from, to) {
            Ok(rssi) => return Some(rssi),
            Err(Miss::Silenced) => self.counts.silenced += 1,
            Err(Miss::OutOfRange) => self.counts.out_of_range += 1,
            Err(Miss::Lost) => self.counts.lost += 1,
        }
        None
    }

    /// Draws the same whatever happens, so that one nuisance leaves the bits of the others alone.
    fn try_to_reach(&mut self, at_us: u64, from: usize, to: usize) -> Result<i8, Miss> {
        let distance_m = (self.stations[from].position_m - self.stations[to].position_m).abs();
        let fading_db = self.figures.fading_db * self.streams.fading.normal();
        let strength_dbm = self.figures.strength_dbm(distance_m) + fading_db;
        let lost = self.stations[to].bursts.lose(at_us, &self.figures.loss, &mut self.streams.loss);
        if self.figures.silence {
            Err(Miss::Silenced)
        } else if strength_dbm < self.figures.sensitivity_dbm {
            Err(Miss::OutOfRange)
        } else if lost {
            Err(Miss::Lost)
        } else {
            Ok(rounded(strength_dbm))
        }
    }

    /// Puts a received frame on its way through the receiver's driver. A copy comes right behind, with the right bits.
    fn deliver(&mut self, frame: &Frame<'_>, receiver: usize, end_us: u64, rssi: i8) {
        let (figures, streams, counts) = (&self.figures, &mut self.streams, &mut self.counts);
        let twice = streams.duplicate.uniform(0.0, 1.0) < figures.duplicate_share;
        let held = streams.reorder.uniform(0.0, 1.0) < figures.reorder_share;
        let corrupt = streams.corruption.uniform(0.0, 1.0) < figures.corruption_share && !frame.payload.is_empty();
        counts.delivered += 1;
        counts.duplicated += u64::from(twice);
        counts.held_back += u64::from(held);
        counts.corrupted += u64::from(corrupt);

        let hold_us = if held { figures.reorder_hold_us } else { 0 };
        let from = self.stations[frame.origin.sender].address;
        let arrived_us = end_us + frame.late_us + hold_us;
        let copy = Delivery { from, rssi, payload: frame.payload.to_vec(), arrived_us };
        let mut delivery = copy.clone();
        if corrupt {
            flip_bits(&mut delivery.payload, &mut streams.corruption);
        }
        let station = &mut self.stations[receiver];
        station.expect(Some(frame.origin), delivery);
        if twice {
            station.expect(Some(frame.origin), copy);
        }
    }
}

fn whole(us: f64) -> u64 {
    us.round() as u64
}

fn rounded(dbm: f64) -> i8 {
    // A cast of a float saturates.
    dbm.round() as i8
}
