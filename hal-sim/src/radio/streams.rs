//! The air's random draws.

use super::figures::Tail;
use crate::random::{Source, Stream};

/// One random stream for every nuisance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Streams {
    pub handling: Stream,
    pub tail: Stream,
    pub callback: Stream,
    pub loss: Stream,
    pub fading: Stream,
    pub duplicate: Stream,
    pub reorder: Stream,
    pub corruption: Stream,
}

impl Streams {
    pub fn new(seed: u64) -> Self {
        let stream = |source| Stream::new(seed, source);
        Self {
            handling: stream(Source::RadioHandling),
            tail: stream(Source::RadioTail),
            callback: stream(Source::RadioCallback),
            loss: stream(Source::RadioLoss),
            fading: stream(Source::RadioFading),
            duplicate: stream(Source::RadioDuplicate),
            reorder: stream(Source::RadioReorder),
            corruption: stream(Source::RadioCorruption),
        }
    }
}

/// A tail's delay, µs: 0 for most. Always draws twice.
pub(super) fn draw_tail(tail: &Tail, stream: &mut Stream, count: &mut u64) -> u64 {
    let (share, delay_us) = (stream.uniform(0.0, 1.0), stream.uniform(tail.least_us, tail.most_us));
    if share >= tail.share {
        return 0;
    }
    *count += 1;
    delay_us.round() as u64
}

/// Flips one to eight bits of a payload that is not empty.
pub(super) fn flip_bits(payload: &mut [u8], stream: &mut Stream) {
    let flips = 1 + stream.below(8);
    let mut bits: Vec<usize> = (0..flips).map(|_| stream.below(8 * payload.len() as u32) as usize).collect();
    // A bit that is drawn twice would be right again.
    bits.sort_unstable();
    bits.dedup();
    for bit in bits {
        payload[bit / 8] ^= 1 << (bit % 8);
    }
}
