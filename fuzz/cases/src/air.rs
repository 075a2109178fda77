//! What both ends of the air have in common: keys, nonces, and a memory of every frame that was ever made.

use control::protocol::VERSION;
use control::protocol::radio::LONGEST;
use control::protocol::secure::{HEAD, Key, Nonce};

use crate::bytes::Bytes;

/// Pairing key of robot and console.
pub const KEY: Key = Key([0x5A; 32]);
/// Pairing key of another robot.
pub const OTHER_KEY: Key = Key([0x5B; 32]);
/// Frames of one input at most.
pub const MOST_FRAMES: usize = 300;

/// Numbers that were never used before.
#[derive(Default)]
pub struct Nonces(u64);

impl Nonces {
    pub fn fresh(&mut self) -> Nonce {
        self.0 += 1;
        Nonce(self.0.to_le_bytes())
    }
}

/// The console's nonce in a `Hello` or a `Welcome`.
pub fn console_nonce(frame: &[u8]) -> [u8; 8] {
    frame[HEAD..HEAD + 8].try_into().expect("8 bytes")
}

/// The robot's in a `Welcome`: it names the session.
pub fn robot_nonce(frame: &[u8]) -> [u8; 8] {
    frame[HEAD + 8..HEAD + 16].try_into().expect("8 bytes")
}

/// A frame that somebody may have recorded.
#[derive(Clone)]
pub struct Frame<M> {
    pub bytes: Vec<u8>,
    /// What it is, where an end that may made it; an outsider's are nothing.
    pub made: Option<M>,
}

/// Every frame, from whomever.
pub struct Frames<M>(Vec<Frame<M>>);

impl<M: Clone> Frames<M> {
    pub fn new() -> Self {
        Self(Vec::new())
    }

    pub fn keep(&mut self, bytes: &[u8], made: Option<M>) {
        self.0.push(Frame { bytes: bytes.to_vec(), made });
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// What a frame is, if an end that may made exactly this one.
    pub fn made(&self, bytes: &[u8]) -> Option<M> {
        self.0.iter().find_map(|frame| frame.made.clone().filter(|_| frame.bytes == bytes))
    }

    fn any(&self, bytes: &mut Bytes) -> Vec<u8> {
        // From the last one backwards: small numbers mean what was just made.
        let back = bytes.u8();
        let index = self.0.len().checked_sub(1 + usize::from(back) % self.0.len().max(1));
        index.map(|index| self.0[index].bytes.clone()).unwrap_or_default()
    }

    /// What an attacker or a bad radio makes of what was on the air.
    pub fn attack(&self, bytes: &mut Bytes) -> Vec<u8> {
        let mut frame = match bytes.u8() % 8 {
            // Replayed or late, as it is.
            0 | 1 => return self.any(bytes),
            2 => {
                let mut frame = self.any(bytes);
                let bit = bytes.below(8 * frame.len().max(1));
                if let Some(byte) = frame.get_mut(bit / 8) {
                    *byte ^= 1 << (bit % 8);
                }
                frame
            }
            3 => {
                let mut frame = self.any(bytes);
                frame.truncate(bytes.below(frame.len() + 1));
                frame
            }
            4 => [self.any(bytes), bytes.some().to_vec()].concat(),
            5 => {
                let (one, other) = (self.any(bytes), self.any(bytes));
                let cut = bytes.below(one.len().min(other.len()) + 1);
                [&one[..cut], &other[cut..]].concat()
            }
            6 => [&VERSION.to_le_bytes(), bytes.some()].concat(),
            _ => bytes.some().to_vec(),
        };
        frame.truncate(LONGEST);
        frame
    }
}
