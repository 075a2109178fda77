//! The console in a browser while the robots run: one page, served on one address, that shows what the [console's
//! engine](crate::console::Engine) knows and, of a simulated robot, how its body moves.
//!
//! [`server`] answers requests, [`access`] says to whom, [`hub`] stands between its threads and the loop, [`told`] makes what
//! the page is told, and [`run`] is the loop: it polls the engine, which sends the heartbeats, hands on what came from pages
//! that may drive, and stops the robots when such a page goes away ([`driver`]).

pub mod access;
pub mod driver;
pub mod hub;
pub mod server;
pub mod told;

use std::sync::mpsc::Receiver;
use std::time::Duration;

use hal_sim::body::Snapshot;
use link::LinkError;

use crate::console::check_remote;
use crate::console::model::Level;
use crate::console::screen::Console;
use driver::{Driver, PageId};
use hub::{FromPage, Hub, Incoming};
use told::Told;

/// Time between two messages to the pages.
const FRAME: Duration = Duration::from_millis(40);
/// A dongle that is silent for less is waited for: whoever looks on shall not lose the page to a busy computer. Its robots stop by
/// themselves meanwhile, and are told to stop when it is back.
const DONGLE_PATIENCE: Duration = Duration::from_secs(5);

/// Which pages there are and what they may.
pub struct Live<'a> {
    /// The pages.
    pub hub: &'a Hub,
    /// Whether their commands are taken.
    pub drive: bool,
    /// How the body of the first robot moves, where it is simulated.
    pub bodies: Option<Receiver<Vec<Snapshot>>>,
}

/// Shows a console to the pages until `ended` says so. The robots are told to stop when a page that drives goes away; at the
/// end that is the caller's ([`Console::finish`]).
///
/// # Errors
/// Nobody to talk to any more: the line broke, or the dongle has been silent for 5 s.
pub fn run(console: &mut impl Console, live: &Live<'_>, ended: &dyn Fn() -> bool) -> Result<(), LinkError> {
    let mut driver = Driver::default();
    let mut told = Told::default();
    let mut due = Duration::ZERO;
    let mut was_silent = false;
    while !ended() && !console.wants_to_quit() {
        match console.poll() {
            Err(LinkError::DongleSilent { silent }) if silent < DONGLE_PATIENCE => was_silent = true,
            polled => {
                polled?;
                if std::mem::take(&mut was_silent) {
                    stop(console, "the dongle was silent for a moment: the robots are told to stop");
                }
            }
        }
        for incoming in live.hub.take() {
            take(console, live, &mut driver, &told, incoming);
        }
        let now = console.model().now;
        if driver.has_gone(now) {
            stop(console, "the page that drives is closed, hidden or silent: the robots are told to stop");
        }
        if let Some(bodies) = &live.bodies {
            told.bodies(bodies.try_iter());
        }
        if now >= due {
            due = now + FRAME;
            live.hub.tell_all(&told.news(console.model()));
        }
    }
    Ok(())
}

/// Stops every robot, and says why in the log and the recording.
fn stop(console: &mut impl Console, why: &str) {
    console.stop_all();
    // A note is never wrong.
    let _ = console.submit(&format!("note {why}"));
}

fn take(console: &mut impl Console, live: &Live<'_>, driver: &mut Driver, told: &Told, (page, incoming): Incoming) {
    let now = console.model().now;
    match incoming {
        FromPage::Came => live.hub.tell(page, &told.all(console.model())),
        FromPage::Gone => driver.gone(page),
        FromPage::Beat => driver.beat(page, now),
        FromPage::Stop | FromPage::Command { .. } if !live.drive => {
            live.hub.tell(page, &told::refused("this page only looks on: `scram view --live --drive` takes commands"));
        }
        FromPage::Stop => console.stop_all(),
        FromPage::Command { text } => {
            let done = check_remote(&text).and_then(|()| console.submit(&text));
            match done {
                Ok(()) => driver.commands(page, now),
                Err(problem) => live.hub.tell(page, &told::refused(&problem)),
            }
        }
    }
}

/// Of a line of the log, as the page's style sheet calls it.
fn level(level: Level) -> &'static str {
    match level {
        Level::Note => "note",
        Level::Good => "good",
        Level::Warning => "warning",
        Level::Bad => "bad",
    }
}

/// Tells a page from another.
pub type Page = PageId;
