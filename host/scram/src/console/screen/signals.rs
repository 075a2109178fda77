//! The end from outside: `kill`, a closed terminal window, a cut SSH connection.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The loop takes notice of a signal within milliseconds, and stopping the robots takes a second at most.
const PATIENCE: Duration = Duration::from_secs(3);

/// Whether the process was asked to end. While this exists, it ends even if its terminal does not answer any more.
pub struct Signals {
    asked: Arc<AtomicBool>,
    done: Arc<AtomicBool>,
}

impl Signals {
    /// Listens for SIGINT, SIGTERM and SIGHUP.
    ///
    /// # Errors
    /// The system refuses.
    pub fn listen() -> Result<Self, ctrlc::Error> {
        let signals = Self { asked: Arc::default(), done: Arc::default() };
        let (asked, done) = (Arc::clone(&signals.asked), Arc::clone(&signals.done));
        ctrlc::set_handler(move || {
            asked.store(true, Ordering::Relaxed);
            // A loop that waits for a terminal that is gone sends no heartbeats, so the robots have stopped; but it would
            // wait for ever.
            std::thread::sleep(PATIENCE);
            if !done.load(Ordering::Relaxed) {
                std::process::exit(1);
            }
        })?;
        Ok(signals)
    }

    /// The process was asked to end.
    #[must_use]
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }
}

impl Drop for Signals {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Relaxed);
    }
}
