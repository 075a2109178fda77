//! Where the radio's driver puts what comes in: a fixed number of messages of a fixed size, without a heap.
//!
//! Anybody in range can send frames of 1470 bytes (ESP-NOW's second version), as many as the air carries. So a frame is judged
//! by its length before it takes any memory, and a full inbox lets go of its oldest message.

use core::sync::atomic::Ordering;

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::{Channel, TrySendError};
use portable_atomic::AtomicU32;

use crate::board::{Address, Payload, Received};

/// Messages that wait for the receiving task: 0.1 s of telemetry.
pub const WAITING: usize = 10;

/// Messages that have come in. For a `static`.
pub struct Inbox {
    waiting: Channel<CriticalSectionRawMutex, Received, WAITING>,
    too_long: AtomicU32,
    overrun: AtomicU32,
}

impl Default for Inbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Inbox {
    /// Nothing has come in.
    #[must_use]
    pub const fn new() -> Self {
        Self { waiting: Channel::new(), too_long: AtomicU32::new(0), overrun: AtomicU32::new(0) }
    }

    /// From the driver's callback: takes a frame in, or drops it and counts it.
    pub fn offer(&self, from: Address, rssi: i8, frame: &[u8]) {
        let Ok(payload) = Payload::from_slice(frame) else {
            self.too_long.fetch_add(1, Ordering::Relaxed);
            return;
        };
        let mut newest = Received { from, rssi, payload };
        // The newest says how things are now.
        while let Err(TrySendError::Full(back)) = self.waiting.try_send(newest) {
            newest = back;
            if self.waiting.try_receive().is_ok() {
                self.overrun.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// Waits for the next message.
    pub async fn receive(&self) -> Received {
        self.waiting.receive().await
    }

    /// The next message, if one waits.
    #[must_use]
    pub fn try_receive(&self) -> Option<Received> {
        self.waiting.try_receive().ok()
    }

    /// Frames dropped for their length.
    #[must_use]
    pub fn too_long(&self) -> u32 {
        self.too_long.load(Ordering::Relaxed)
    }

    /// Frames dropped because nobody took them out.
    #[must_use]
    pub fn overrun(&self) -> u32 {
        self.overrun.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_longer_than_ours_takes_no_place() {
        let inbox = Inbox::new();
        inbox.offer([1; 6], -40, &[7; 250]);
        for length in [251, 252, 1470, 65_535] {
            inbox.offer([2; 6], -40, &std::vec![0; length]);
        }
        assert_eq!((inbox.too_long(), inbox.overrun()), (4, 0));
        let received = inbox.try_receive().expect("the longest of ours");
        assert_eq!((received.from, received.payload.len()), ([1; 6], 250));
        assert_eq!(inbox.try_receive(), None);
    }

    #[test]
    fn a_full_inbox_lets_go_of_the_oldest() {
        let inbox = Inbox::new();
        for number in 0..=WAITING as u8 + 2 {
            inbox.offer([number; 6], 0, &[]);
        }
        assert_eq!((inbox.too_long(), inbox.overrun()), (0, 3));
        let left: std::vec::Vec<u8> = core::iter::from_fn(|| inbox.try_receive()).map(|one| one.from[0]).collect();
        assert_eq!(left, (3..=WAITING as u8 + 2).collect::<std::vec::Vec<_>>());
    }
}
