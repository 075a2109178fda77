//! Between the server's threads and the loop that has the console: what came from pages, and what they are to be told.

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Deserialize;

use super::driver::PageId;

/// Pages at once: somebody who opens more is sent away.
const MOST_PAGES: usize = 16;
/// Messages that a slow page may be behind, about two seconds; one that is slower is closed.
const MOST_BEHIND: usize = 64;
/// Messages from pages that wait for the loop; more than that are dropped.
const MOST_WAITING: usize = 256;

/// What a page says.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum FromPage {
    /// It is there and wants to know everything.
    #[serde(skip)]
    Came,
    /// It was closed.
    #[serde(skip)]
    Gone,
    /// It can be seen.
    Beat,
    /// Stop every robot.
    Stop,
    /// A line of the console.
    Command {
        /// As it was typed.
        text: String,
    },
}

/// What came, and from whom.
pub type Incoming = (PageId, FromPage);

/// A message to pages.
pub type Message = Arc<str>;

/// The pages. Shared between threads.
#[derive(Default)]
pub struct Hub(Mutex<State>);

#[derive(Default)]
struct State {
    pages: HashMap<PageId, SyncSender<Message>>,
    next: u64,
    incoming: Vec<Incoming>,
}

impl Hub {
    /// A page comes: its name, and where its messages are. None where there are too many.
    #[must_use]
    pub fn join(&self) -> Option<(PageId, Receiver<Message>)> {
        let mut state = self.state();
        if state.pages.len() >= MOST_PAGES {
            return None;
        }
        state.next += 1;
        let (page, (sender, receiver)) = (PageId(state.next), sync_channel(MOST_BEHIND));
        state.pages.insert(page, sender);
        state.incoming.push((page, FromPage::Came));
        Some((page, receiver))
    }

    /// A page has gone.
    pub fn leave(&self, page: PageId) {
        let mut state = self.state();
        state.pages.remove(&page);
        // Never dropped: it may be the one that drives.
        state.incoming.push((page, FromPage::Gone));
    }

    /// A page said something.
    pub fn say(&self, page: PageId, said: FromPage) {
        let mut state = self.state();
        // Of stopping there is no too much.
        if state.incoming.len() < MOST_WAITING || said == FromPage::Stop {
            state.incoming.push((page, said));
        }
    }

    /// What came since the last time, in this order.
    pub fn take(&self) -> Vec<Incoming> {
        std::mem::take(&mut self.state().incoming)
    }

    /// Tells one page.
    pub fn tell(&self, page: PageId, text: &str) {
        let mut state = self.state();
        if let Some(sender) = state.pages.get(&page)
            && sender.try_send(text.into()).is_err()
        {
            state.pages.remove(&page);
        }
    }

    /// Tells every page. One that does not keep up is closed: its thread finds the channel ended.
    pub fn tell_all(&self, text: &str) {
        let message: Message = text.into();
        self.state().pages.retain(|_, sender| sender.try_send(Arc::clone(&message)).is_ok());
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Nothing in here panics half-way.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_is_too_slow_is_closed_and_the_others_go_on() {
        let hub = Hub::default();
        let (_, slow) = hub.join().unwrap();
        let (_, quick) = hub.join().unwrap();
        for index in 0..=MOST_BEHIND {
            hub.tell_all(&index.to_string());
            assert_eq!(quick.try_recv().as_deref(), Ok(&*index.to_string()));
        }
        assert_eq!(slow.iter().count(), MOST_BEHIND, "the channel has ended");
    }

    #[test]
    fn there_is_an_end_to_pages_and_to_what_they_say() {
        let hub = Hub::default();
        let pages: Vec<_> = std::iter::from_fn(|| hub.join()).collect();
        assert_eq!(pages.len(), MOST_PAGES);
        let (page, _) = pages[0];
        for _ in 0..2 * MOST_WAITING {
            hub.say(page, FromPage::Beat);
        }
        hub.say(page, FromPage::Stop);
        hub.leave(page);
        let came = hub.take();
        assert_eq!(came.len(), MOST_WAITING + 2);
        assert_eq!(came[MOST_WAITING..], [(page, FromPage::Stop), (page, FromPage::Gone)]);
        assert!(hub.join().is_some(), "one has gone");
    }

    #[test]
    fn a_page_cannot_say_that_it_came_or_went() {
        let read = |text: &str| serde_json::from_str::<FromPage>(text);
        assert_eq!(read(r#"{"kind":"command","text":"freq 7"}"#).unwrap(), FromPage::Command { text: "freq 7".into() });
        assert_eq!(read(r#"{"kind":"stop"}"#).unwrap(), FromPage::Stop);
        for wrong in [r#"{"kind":"gone"}"#, r#"{"kind":"came"}"#, r#"{"kind":"command"}"#, "7"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
