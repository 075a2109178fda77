//! The air between robots and a dongle: ESP-NOW with its delays, losses and an attacker.
//!
//! An [`Air`] is a value without tasks: frames are put in at a time and taken out at a time, in µs, and times do not go
//! back from one call to the next. The same seed and the same calls give the same bits; a clone goes on equally. Every
//! nuisance has its own random stream.
//!
//! What is modelled, with the numbers of `[radio]` in the robot file:
//! - One channel for all: a frame waits for the one before it, then a random backoff ([`airtime`]).
//! - A frame to one station is tried again until its acknowledgement comes, as the MAC does, up to `retries` times.
//! - A frame to everybody is tried once and acknowledged by nobody; the sender is told that it was sent, as ESP-NOW does.
//! - Tries are lost in bursts, at each receiver by itself ([`loss`]), and beyond the reach of the signal. So are
//!   acknowledgements: a sender may be told "no" about a frame that arrived.
//! - A lost acknowledgement makes the MAC send a copy, which the receiver's MAC drops: 802.11 has a retry bit and a sequence
//!   number for that (IEEE 802.11-2020, 10.3.2.14). What gets through nevertheless is `duplicate_share`.
//! - The chips' software delays a frame, at times long (the tail), and the sender's callback longer. The channel is free
//!   meanwhile.
//! - The receiver's driver keeps the newest `receive_queue` frames; older ones are dropped in silence.
//!
//! Not modelled: the encryption of ESP-NOW (CCMP). Its bytes take time on the air, but everybody reads and forges what
//! passes: the attacker ([`Adversary`]) is assumed past it, so that what stops him is the protocol alone. Nor are
//! hidden stations and collisions, other channels, or the time that an attacker keeps the channel busy (jamming is
//! [`Trouble::silence`]).

mod adversary;
mod air;
pub mod airtime;
mod figures;
pub mod loss;
mod station;
mod streams;
mod trouble;

pub use adversary::{Adversary, Attack, Forgery, OLD_US};
pub use air::Air;
pub use trouble::Trouble;

/// A radio's address.
pub type Address = [u8; 6];

/// Broadcast address.
pub const BROADCAST: Address = [0xff; 6];

/// Longest payload of ESP-NOW's first version, bytes.
pub const LONGEST: usize = 250;
/// Longest payload that a radio hears, ESP-NOW's second version: sent by nobody but an attacker.
pub const LONGEST_HEARD: usize = 1470;

/// What the sender's callback says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// When it comes, µs.
    pub done_us: u64,
    /// The receiver's MAC acknowledged the frame; always true for one to everybody.
    pub acknowledged: bool,
}

/// A frame that a radio received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Delivery {
    /// From whom, as the frame says.
    pub from: Address,
    /// Strength of the signal, dBm.
    pub rssi: i8,
    /// Payload, bytes.
    pub payload: Vec<u8>,
    /// When it arrived at the radio, µs.
    pub arrived_us: u64,
}

/// A frame that anybody near could have recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Overheard {
    /// When it was sent, µs.
    pub sent_us: u64,
    /// Source address that the frame claims.
    pub from: Address,
    /// Destination address; `ff:ff:ff:ff:ff:ff` is broadcast.
    pub to: Address,
    /// Payload, bytes.
    pub payload: Vec<u8>,
}

/// What happened so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AirCounts {
    /// Frames handed over for sending.
    pub sent: u64,
    /// Frames refused because they are longer than [`LONGEST`], injected ones than [`LONGEST_HEARD`].
    pub refused: u64,
    /// Tries beyond the first of a frame.
    pub retried: u64,
    /// Frames to one station whose sender got no acknowledgement.
    pub unacknowledged: u64,
    /// Tries lost in or out of a burst, at each receiver.
    pub lost: u64,
    /// Tries too weak at a receiver.
    pub out_of_range: u64,
    /// Tries in a silence, at each receiver, and injected frames.
    pub silenced: u64,
    /// Tries to a station that is not there.
    pub unheard: u64,
    /// Acknowledgements that did not reach the sender.
    pub acknowledgements_lost: u64,
    /// Copies that the receiver's MAC dropped.
    pub suppressed: u64,
    /// Frames received by a station's radio, without duplicates and injected ones.
    pub delivered: u64,
    /// Of them, those that arrived twice.
    pub duplicated: u64,
    /// Of them, those held back.
    pub held_back: u64,
    /// Of them, those with wrong bits.
    pub corrupted: u64,
    /// Frames in the tail.
    pub delayed: u64,
    /// Late callbacks.
    pub late_callbacks: u64,
    /// Frames that arrived after a later one of the same sender.
    pub reordered: u64,
    /// Frames dropped because a receiver's queue was full.
    pub overflowed: u64,
    /// Frames that an attacker injected.
    pub injected: u64,
}
