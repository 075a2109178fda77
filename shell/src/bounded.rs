//! Sends that end: in time, or the radio with them.
//!
//! A driver may never call back, and may run out of buffers for good: ESP-NOW is reported to leak one now and then, until after
//! some 78 000 broadcasts every send is refused and only a restart of the radio helps (espressif/esp-idf#18682, open). What is
//! advised there is done here: one frame in flight, clocked by its callback, and a limit behind it. A send that nobody acknowledged
//! is no fault: the other end has gone, or is far.

use embassy_time::{Duration, Instant, with_timeout};

use crate::board::{Address, Sender, Sent};

/// A send takes no longer. The driver's callbacks come within 10 ms, and now and then 10 to 50 ms late; while it waits for the channel
/// of a busy neighbour it tries up to seven times.
pub const LIMIT: Duration = Duration::from_secs(1);
/// Time for which a driver may refuse everything: after it, it does not recover. A burst that has taken all buffers drains within a tenth.
pub const REFUSED: Duration = Duration::from_secs(2);

/// The radio sends nothing any more until it is reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Broken;

/// A sender that is used no more once it is broken.
#[derive(Debug)]
pub struct Bounded<S> {
    sender: S,
    refused_since: Option<Instant>,
    broken: bool,
}

impl<S: Sender> Bounded<S> {
    /// A radio that works.
    pub fn new(sender: S) -> Self {
        Self { sender, refused_since: None, broken: false }
    }

    /// Sends, and waits until the radio is done with it.
    ///
    /// # Errors
    /// It has not called back in time, or has refused everything for long, now or before: nothing was sent.
    pub async fn send(&mut self, to: &Address, payload: &[u8]) -> Result<Sent, Broken> {
        if self.broken {
            return Err(Broken);
        }
        let Ok(sent) = with_timeout(LIMIT, self.sender.send(to, payload)).await else {
            self.broken = true;
            return Err(Broken);
        };
        let now = Instant::now();
        if sent != Sent::Refused {
            self.refused_since = None;
        } else if now.saturating_duration_since(*self.refused_since.get_or_insert(now)) >= REFUSED {
            self.broken = true;
        }
        Ok(sent)
    }

    /// Whether it is broken.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        self.broken
    }

    /// The radio, for everything but sending.
    pub fn radio(&mut self) -> &mut S {
        &mut self.sender
    }
}
