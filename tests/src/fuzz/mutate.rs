//! Inputs from a seed: bytes of any length, and seeds of the corpus with something changed, without any knowledge of which
//! branches they reach. libFuzzer has that; this runs on every toolchain and gives the same inputs everywhere.

use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Longest input without a seed, bytes.
const LONGEST: usize = 512;
/// What decoders often stumble over.
const EDGES: [&[u8]; 14] = [
    &[0],
    &[0xFF],
    &[0x7F],
    &[0x80],
    &[0xFF; 4],
    &[0; 8],
    &[0xFF; 8],
    &[0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01],
    // NaN, infinity and a denormal as f32, little endian.
    &[0, 0, 0xC0, 0x7F],
    &[0, 0, 0x80, 0x7F],
    &[1, 0, 0, 0],
    b"nan",
    b"-1e308",
    b"\n",
];

/// An endless supply of inputs.
pub struct Inputs<'s> {
    seeds: &'s [Vec<u8>],
    random: Pcg64Mcg,
}

impl<'s> Inputs<'s> {
    /// The same inputs for the same seed.
    #[must_use]
    pub fn new(seeds: &'s [Vec<u8>], seed: u64) -> Self {
        Self { seeds, random: Pcg64Mcg::seed_from_u64(seed) }
    }

    fn any(&mut self) -> Vec<u8> {
        let mut bytes = vec![0; self.random.random_range(0..LONGEST)];
        self.random.fill_bytes(&mut bytes);
        // Short commands and indices are small numbers more often than not.
        if self.random.random() {
            let below = self.random.random_range(2..32);
            bytes.iter_mut().filter(|byte| **byte & 1 == 0).for_each(|byte| *byte %= below);
        }
        bytes
    }

    fn change(&mut self, bytes: &mut Vec<u8>) {
        let at = self.random.random_range(0..=bytes.len());
        let end = (at + self.random.random_range(0..64)).min(bytes.len());
        match self.random.random_range(0..7) {
            0 | 1 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << self.random.random_range(0..8);
                }
            }
            2 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = self.random.random();
                }
            }
            3 => {
                let edge = EDGES.choose(&mut self.random).copied().unwrap_or_default();
                let end = if self.random.random() { (at + edge.len()).min(bytes.len()) } else { at };
                bytes.splice(at..end, edge.iter().copied());
            }
            4 => drop(bytes.drain(at..end)),
            5 => {
                let part = bytes[at..end].to_vec();
                let to = self.random.random_range(0..=bytes.len());
                bytes.splice(to..to, part);
            }
            _ => {
                let Some(other) = self.seeds.choose(&mut self.random) else { return };
                let from = self.random.random_range(0..=other.len());
                bytes.truncate(at);
                bytes.extend(&other[from..]);
            }
        }
    }
}

impl Iterator for Inputs<'_> {
    type Item = Vec<u8>;

    fn next(&mut self) -> Option<Vec<u8>> {
        let seed = self.seeds.choose(&mut self.random).cloned();
        let mut bytes = match seed {
            Some(seed) if self.random.random_bool(0.8) => seed,
            _ => self.any(),
        };
        for _ in 0..self.random.random_range(0..6) {
            self.change(&mut bytes);
        }
        Some(bytes)
    }
}
