//! Ctrl-C: a call's work is done in a thread of its own while the caller's looks for signals.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use pyo3::prelude::*;

use crate::errors::ScramError;

/// How long a signal waits at most.
const LOOKS_EVERY: Duration = Duration::from_millis(50);

/// Says that nobody waits for the work any more.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// The flag itself.
    pub fn flag(&self) -> &AtomicBool {
        &self.0
    }

    /// For work that tells its progress: it is unwound the next time that it does.
    pub fn progress(&self) -> common::Progress {
        let stop = self.clone();
        Arc::new(move |_: &str, _: f64| {
            if stop.0.load(Ordering::Relaxed) {
                // Not a panic: nothing is wrong, and no message is printed.
                resume_unwind(Box::new("stopped"));
            }
        })
    }
}

/// Does work without holding Python's lock. A signal (Ctrl-C) raises its exception at once; the work is told to stop and ends by itself.
///
/// # Errors
/// What a signal's handler raises, or there is no thread to be had.
pub fn interruptible<T: Send + 'static>(py: Python<'_>, work: impl FnOnce(&Stop) -> T + Send + 'static) -> PyResult<T> {
    let stop = Stop::default();
    let told = stop.clone();
    let (sender, mut receiver) = mpsc::channel();
    let work = move || {
        // Nobody listens any more after a signal.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(|| work(&told))));
    };
    std::thread::Builder::new()
        .name("scram".into())
        .spawn(work)
        .map_err(|error| ScramError::new_err(format!("no thread to work in: {error}")))?;
    loop {
        let received;
        (receiver, received) = py.detach(move || {
            let received = receiver.recv_timeout(LOOKS_EVERY);
            (receiver, received)
        });
        match received {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals().inspect_err(|_| stop.0.store(true, Ordering::Relaxed))?;
            }
            Err(RecvTimeoutError::Disconnected) => return Err(ScramError::new_err("the work ended without a result")),
        }
    }
}
