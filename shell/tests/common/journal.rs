//! Everything that happens, with its time.

use std::cell::RefCell;
use std::fmt::Write;
use std::rc::Rc;

use control::{Actuation, AdcCode};
use shell::board::Address;

use super::time::now_us;

/// What can happen.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The wiper was converted.
    Converted(AdcCode),
    /// The bridge was told.
    Applied(Actuation),
    /// The watchdog was fed.
    Fed,
    /// The LED was switched.
    Lit(bool),
    /// A message came over the air into the radio's queue.
    Arrived(u32),
    /// The radio's queue was full: it forgot its oldest.
    Overflowed,
    /// The receiving task took a message.
    Heard(u32),
    /// The sending task began to send.
    Sending(Address, Vec<u8>),
    /// The radio is done with that.
    Sent(bool),
    /// The sending task let go of a message before the radio was done with it.
    SendDropped,
}

/// A log that every part of the bench writes.
#[derive(Clone, Debug, Default)]
pub struct Journal(Rc<RefCell<Vec<(u64, Event)>>>);

impl Journal {
    /// Notes an event at the present time.
    pub fn note(&self, event: Event) {
        self.0.borrow_mut().push((now_us(), event));
    }

    /// Takes all events out, oldest first.
    pub fn take(&self) -> Vec<(u64, Event)> {
        self.0.take()
    }
}

/// One line an event.
pub fn text(events: &[(u64, Event)]) -> String {
    let mut text = String::new();
    for (time_us, event) in events {
        writeln!(text, "{time_us} {event:?}").expect("a String takes everything");
    }
    text
}
