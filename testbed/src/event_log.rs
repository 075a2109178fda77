//! Everything that happens to a robot, with its time.

use std::cell::{Ref, RefCell};
use std::fmt::Write;
use std::rc::Rc;

use control::protocol::radio::Reset;
use control::{Actuation, AdcCode};
use shell::board::{Address, WatchdogTimeout};

use crate::time::now_us;

/// Event in a simulated device.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The processor started.
    Booted(Reset),
    /// Its supply went, or it was reset: the bridge is open.
    Fell,
    /// The wiper was converted.
    Converted(AdcCode),
    /// The bridge was told.
    Applied(Actuation),
    /// The watchdog was fed.
    Fed,
    /// The watchdog's patience was changed.
    Expected(WatchdogTimeout),
    /// The LED was switched.
    Lit(bool),
    /// A fault that was asked for begins: see [`shell::inject`].
    Injected,
    /// The receiving task took a frame.
    Heard {
        /// When it had come over the air, µs.
        arrived_us: u64,
        /// From whom, as it says.
        from: Address,
        /// Payload, bytes.
        payload: Vec<u8>,
    },
    /// The sending task began to send.
    Sending(Address, Vec<u8>),
    /// The radio is done with that.
    Sent(bool),
    /// The sending task let go of a frame before the radio was done with it.
    SendDropped,
    /// The flash began to write or to erase.
    Flashed,
}

/// How much is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// Nothing: for a simulation that runs for days.
    Nothing,
    /// When it started and fell, and what the bridge was told where that is not the same as before.
    Bridge,
    /// The same, the LED, and when a fault begins that was asked for: what an oscilloscope sees.
    Pins,
    /// Everything.
    #[default]
    Everything,
}

#[derive(Debug, Default)]
struct Book {
    detail: Detail,
    events: Vec<(u64, Event)>,
    applied: Option<Actuation>,
}

/// A log that every part of a robot writes. Clones write the same one.
#[derive(Clone, Debug, Default)]
pub struct EventLog(Rc<RefCell<Book>>);

impl EventLog {
    /// An empty one.
    #[must_use]
    pub fn new(detail: Detail) -> Self {
        Self(Rc::new(RefCell::new(Book { detail, ..Book::default() })))
    }

    /// Notes an event at the present time.
    pub fn note(&self, event: Event) {
        let mut book = self.0.borrow_mut();
        let keep = match (book.detail, &event) {
            (Detail::Nothing, _) => false,
            (Detail::Everything, _) => true,
            (Detail::Bridge | Detail::Pins, Event::Applied(told)) => book.applied != Some(*told),
            (_, Event::Booted(_) | Event::Fell) => true,
            (Detail::Bridge, _) => false,
            (Detail::Pins, event) => matches!(event, Event::Lit(_) | Event::Injected),
        };
        match event {
            Event::Applied(told) => book.applied = Some(told),
            Event::Fell => book.applied = None,
            _ => {}
        }
        if keep {
            book.events.push((now_us(), event));
        }
    }

    /// All events, oldest first.
    #[must_use]
    pub fn events(&self) -> Ref<'_, [(u64, Event)]> {
        Ref::map(self.0.borrow(), |book| book.events.as_slice())
    }

    /// Takes all events out, oldest first.
    #[must_use]
    pub fn take(&self) -> Vec<(u64, Event)> {
        std::mem::take(&mut self.0.borrow_mut().events)
    }
}

/// What the bridge was told, with the times; [`Event::Fell`] counts as off.
pub fn actuations(events: &[(u64, Event)]) -> impl DoubleEndedIterator<Item = (u64, Actuation)> {
    events.iter().filter_map(|(at_us, event)| match event {
        Event::Applied(told) => Some((*at_us, *told)),
        Event::Fell => Some((*at_us, Actuation::OFF)),
        _ => None,
    })
}

/// Every tick: when it was decided, µs, the wiper's code and what the bridge was told.
#[must_use]
pub fn ticks(events: &[(u64, Event)]) -> Vec<(u64, AdcCode, Actuation)> {
    let mut converted = None;
    let mut ticks = Vec::new();
    for (at_us, event) in events {
        match event {
            // The conversions of a tick all have the same code.
            Event::Converted(code) => converted = Some(*code),
            Event::Applied(told) => ticks.extend(converted.take().map(|code| (*at_us, code, *told))),
            _ => {}
        }
    }
    ticks
}

/// From when to when the bridge was on, µs; the end is missing where it still is.
#[must_use]
pub fn driven(events: &[(u64, Event)]) -> Vec<(u64, Option<u64>)> {
    let mut spans: Vec<(u64, Option<u64>)> = Vec::new();
    for (at_us, told) in actuations(events) {
        match spans.last_mut() {
            Some((_, end @ None)) if !told.enable => *end = Some(at_us),
            Some((_, None)) => {}
            _ if told.enable => spans.push((at_us, None)),
            _ => {}
        }
    }
    spans
}

/// One line an event.
#[must_use]
pub fn text(events: &[(u64, Event)]) -> String {
    let mut text = String::new();
    for (time_us, event) in events {
        // A String takes everything.
        let _ = writeln!(text, "{time_us} {event:?}");
    }
    text
}
