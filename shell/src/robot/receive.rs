//! The receiving task: waits for nothing but the radio.

use control::Command;
use control::protocol::radio::{self, Counters, Misread};
use embassy_time::{Duration, Instant};
use heapless::Vec;

use super::Shared;
use super::shared::Order;
use crate::board::{Address, Received, Receiver};

/// Hands commands to the control loop. What is not understood, or older than what was heard before, changes nothing but
/// counters.
pub async fn receive(mut receiver: impl Receiver, shared: &Shared) -> ! {
    let mut speakers = Speakers::default();
    loop {
        let message = receiver.receive().await;
        take(&message, &mut speakers, shared);
    }
}

fn take(message: &Received, speakers: &mut Speakers, shared: &Shared) {
    let now = Instant::now();
    match radio::decode::<Command>(&message.payload) {
        Ok((sequence, command)) => {
            shared.count(|c| add(&mut c.received, 1));
            let Some(lost) = speakers.hear(message.from, sequence, now) else {
                return shared.count(|c| add(&mut c.outdated, 1));
            };
            shared.count(|c| add(&mut c.lost, u32::from(lost)));
            shared.set_peer(message.from);
            shared.order(Order { from: message.from, sequence, command, received_us: now.as_micros() });
        }
        Err(misread) => shared.count(|c| add(counter(c, misread), 1)),
    }
}

/// Whoever was silent for so long may have started anew: its numbers count from where they are. The radio delivers no
/// message as late as that.
const RENEWAL: Duration = Duration::from_secs(1);
/// More than so many at a time command no robot; of more, the longest silent is forgotten.
const SPEAKERS: usize = 4;

/// Who has commanded lately, with which number, and when: the latest last.
#[derive(Default)]
struct Speakers(Vec<(Address, u16, Instant), SPEAKERS>);

impl Speakers {
    /// How many messages of the sender are missing before this one; `None` if it is not newer than one before. That one
    /// does not count as a sign of life, so that a sender that has started anew is heard after a second at the latest.
    fn hear(&mut self, from: Address, sequence: u16, now: Instant) -> Option<u16> {
        let known = self.0.iter().position(|(address, ..)| *address == from);
        let lost = match known.and_then(|index| self.0.get(index)) {
            None => 0,
            Some((_, before, at)) => match radio::missing(*before, sequence) {
                None if now.saturating_duration_since(*at) < RENEWAL => return None,
                lost => lost.unwrap_or(0),
            },
        };
        if let Some(index) = known.or_else(|| self.0.is_full().then_some(0)) {
            self.0.remove(index);
        }
        // There is room: somebody has just been forgotten.
        let _ = self.0.push((from, sequence, now));
        Some(lost)
    }
}

fn counter(counters: &mut Counters, misread: Misread) -> &mut u32 {
    match misread {
        Misread::OtherVersion(_) => &mut counters.other_version,
        Misread::OtherDirection | Misread::Rubbish => &mut counters.misunderstood,
    }
}

fn add(counter: &mut u32, more: u32) {
    *counter = counter.wrapping_add(more);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Messages of (ms, sender, number), and what each is taken for.
    fn heard<const N: usize>(messages: [(u64, u8, u16); N]) -> [Option<u16>; N] {
        let mut speakers = Speakers::default();
        messages.map(|(ms, from, sequence)| speakers.hear([from; 6], sequence, Instant::from_millis(ms)))
    }

    #[test]
    fn what_is_not_newer_is_ignored_until_its_sender_was_silent_for_a_second() {
        let messages = [(0, 1, 7), (50, 1, 7), (60, 1, 6), (100, 1, 9), (150, 1, 8), (200, 1, 0x8009), (999, 1, 0)];
        assert_eq!(heard(messages), [Some(0), None, None, Some(1), None, None, None]);
        assert_eq!(heard([(0, 1, 7), (999, 1, 1), (1000, 1, 2), (1050, 1, 3)]), [Some(0), None, Some(0), Some(0)]);
    }

    #[test]
    fn numbers_come_round() {
        let messages = [(0, 1, 0xFFFE), (1, 1, 0xFFFF), (2, 1, 0), (3, 1, 0xFFFF), (4, 1, 2), (5, 1, 0)];
        assert_eq!(heard(messages), [Some(0), Some(0), Some(0), None, Some(1), None]);
    }

    #[test]
    fn everybody_has_numbers_of_their_own() {
        let messages = [(0, 1, 500), (1, 2, 7), (2, 1, 501), (3, 2, 8), (4, 1, 500), (5, 2, 10), (6, 2, 7)];
        assert_eq!(heard(messages), [Some(0), Some(0), Some(0), Some(0), None, Some(1), None]);
    }

    #[test]
    fn of_too_many_speakers_the_longest_silent_is_forgotten() {
        let messages = [(0, 1, 9), (1, 2, 9), (2, 3, 9), (3, 1, 10), (4, 4, 9), (5, 5, 9), (6, 1, 8), (7, 2, 8)];
        let some = Some(0);
        assert_eq!(heard(messages), [some, some, some, some, some, some, None, some]);
    }
}
