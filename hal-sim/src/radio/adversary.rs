//! An adversary within radio range (Dolev–Yao without the keys): hears every frame and sends any frame with any source address.
//!
//! It knows no key and no protocol: frames are bytes to it. It changes their beginning (where versions and kinds stand),
//! numbers (counters), their end (where tags stand) and anything between.

use std::collections::VecDeque;

use super::streams::flip_bits;
use super::{Address, Air, BROADCAST, LONGEST, Overheard};
use crate::random::{Source, Stream};

/// Least age of a replayed frame, µs. A younger one may be one that was lost on its way: to bring it is to deliver
/// it late, which nobody can tell from a slow radio.
pub const OLD_US: u64 = 1_000_000;

/// Frames that are remembered; the oldest is dropped.
const MEMORY: usize = 1024;
/// Addresses that are remembered; the first ones stay.
const ADDRESSES: usize = 64;
/// Bytes from the beginning within which a changed number begins; it has four bytes.
const NUMBERS_WITHIN: usize = 16;
/// Bytes of the beginning, one of which is changed.
const BEGINNING: usize = 8;
/// Bytes of a changed end.
const END: usize = 16;

/// A way to attack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Attack {
    /// Sends an old frame again, unchanged.
    Replay,
    /// A frame back to its sender, in the name of its receiver.
    Reflect,
    /// A frame to another station than its own.
    Misdirect,
    /// One to eight wrong bits.
    FlipBits,
    /// The end is missing.
    Truncate,
    /// Random bytes behind the end.
    Extend,
    /// One of the first bytes is another.
    Beginning,
    /// A number of four bytes, little-endian, near the beginning is greater by 1 to 1000.
    Number,
    /// Other bytes at the end.
    End,
    /// Random bytes of any length.
    Random,
}

impl Attack {
    /// Every way to attack.
    pub const ALL: [Self; 10] = [
        Self::Replay,
        Self::Reflect,
        Self::Misdirect,
        Self::FlipBits,
        Self::Truncate,
        Self::Extend,
        Self::Beginning,
        Self::Number,
        Self::End,
        Self::Random,
    ];
}

/// A frame that was injected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Forgery {
    /// How it was made.
    pub attack: Attack,
    /// Source address that the attacker claims.
    pub from: Address,
    /// Destination address; `ff:ff:ff:ff:ff:ff` is broadcast.
    pub to: Address,
    /// Payload, bytes.
    pub payload: Vec<u8>,
}

/// Attacker: remembers what it hears and injects forgeries of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Adversary {
    stream: Stream,
    memory: VecDeque<Overheard>,
    addresses: Vec<Address>,
}

impl Adversary {
    /// One that has heard nothing yet.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { stream: Stream::new(seed, Source::Adversary), memory: VecDeque::new(), addresses: Vec::new() }
    }

    /// Records what was sent since it listened last.
    pub fn listen(&mut self, air: &mut Air) {
        for frame in air.overheard() {
            for address in [frame.from, frame.to] {
                if address != BROADCAST && !self.addresses.contains(&address) && self.addresses.len() < ADDRESSES {
                    self.addresses.push(address);
                }
            }
            if self.memory.len() == MEMORY {
                self.memory.pop_front();
            }
            self.memory.push_back(frame);
        }
    }

    /// Listens, then attacks in any way that it can. Nothing while it has not heard two stations.
    pub fn act(&mut self, now_us: u64, air: &mut Air) -> Option<Forgery> {
        self.listen(air);
        let attack = Attack::ALL[self.stream.below(Attack::ALL.len() as u32) as usize];
        self.attack(now_us, attack, air).or_else(|| self.attack(now_us, Attack::Random, air))
    }

    /// Attacks in one way with a frame that it recorded; nothing where it drew none that will do.
    pub fn attack(&mut self, now_us: u64, attack: Attack, air: &mut Air) -> Option<Forgery> {
        let forgery = self.forge(now_us, attack)?;
        air.inject(now_us, forgery.from, forgery.to, &forgery.payload);
        Some(forgery)
    }

    fn forge(&mut self, now_us: u64, attack: Attack) -> Option<Forgery> {
        if attack == Attack::Random {
            return self.random();
        }
        let oldest_first = self.memory.iter();
        let count = match attack {
            Attack::Replay => oldest_first.take_while(|frame| frame.sent_us.saturating_add(OLD_US) <= now_us).count(),
            _ => self.memory.len(),
        };
        let drawn = self.below(count)?;
        let Overheard { from, to, mut payload, .. } = self.memory.get(drawn)?.clone();
        let (from, to) = match attack {
            Attack::Reflect if to == BROADCAST => (self.anybody_but(&[from])?, from),
            Attack::Reflect => (to, from),
            Attack::Misdirect => (from, self.anybody_but(&[from, to])?),
            _ => (from, to),
        };
        self.change(attack, &mut payload)?;
        Some(Forgery { attack, from, to, payload })
    }

    fn anybody_but(&mut self, unwanted: &[Address]) -> Option<Address> {
        let others: Vec<Address> =
            self.addresses.iter().filter(|address| !unwanted.contains(address)).copied().collect();
        let drawn = self.below(others.len())?;
        others.get(drawn).copied()
    }

    fn random(&mut self) -> Option<Forgery> {
        let from = self.anybody_but(&[])?;
        let to = self.anybody_but(&[from])?;
        let length = self.stream.below(LONGEST as u32 + 1);
        let payload = (0..length).map(|_| self.byte()).collect();
        Some(Forgery { attack: Attack::Random, from, to, payload })
    }

    /// Changes the payload; nothing where it is too short or too long for that. What is changed differs from what it was.
    fn change(&mut self, attack: Attack, payload: &mut Vec<u8>) -> Option<()> {
        match attack {
            Attack::Replay | Attack::Reflect | Attack::Misdirect | Attack::Random => {}
            Attack::FlipBits if payload.is_empty() => return None,
            Attack::FlipBits => flip_bits(payload, &mut self.stream),
            Attack::Truncate => {
                let shorter = self.below(payload.len())?;
                payload.truncate(shorter);
            }
            Attack::Extend => {
                let more = 1 + self.below(LONGEST.checked_sub(payload.len())?.min(END))?;
                payload.extend((0..more).map(|_| self.byte()));
            }
            Attack::Beginning => {
                let place = self.below(payload.len().min(BEGINNING))?;
                payload[place] ^= self.change_of_byte();
            }
            Attack::Number => {
                let place = self.below((payload.len() + 1).checked_sub(4)?.min(NUMBERS_WITHIN))?;
                let number = payload[place..].first_chunk_mut::<4>()?;
                *number = u32::from_le_bytes(*number).wrapping_add(1 + self.stream.below(1000)).to_le_bytes();
            }
            Attack::End => {
                let begin = payload.len().saturating_sub(END);
                self.below(payload.len())?;
                for byte in &mut payload[begin..] {
                    *byte ^= self.change_of_byte();
                }
            }
        }
        Some(())
    }

    /// Uniform below; nothing below 0.
    fn below(&mut self, count: usize) -> Option<usize> {
        (count > 0).then(|| self.stream.below(count as u32) as usize)
    }

    fn byte(&mut self) -> u8 {
        self.stream.below(256) as u8
    }

    fn change_of_byte(&mut self) -> u8 {
        1 + self.stream.below(255) as u8
    }
}
