//! Time and memory of what runs.

use std::process;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::{HANG, keep};

/// How often it is looked.
const LOOK: Duration = Duration::from_millis(100);

struct Running {
    target: &'static str,
    input: Vec<u8>,
    since: Instant,
}

/// Ends the program with 1 when an input takes longer than [`HANG`]: a thread that hangs cannot be ended.
#[derive(Clone, Default)]
pub struct Watch(Arc<Mutex<Option<Running>>>);

impl Watch {
    /// Begins to watch.
    #[must_use]
    pub fn start() -> Self {
        let watch = Self::default();
        let watched = watch.clone();
        thread::spawn(move || {
            loop {
                thread::sleep(LOOK);
                watched.look();
            }
        });
        watch
    }

    pub(super) fn begin(&self, target: &'static str, input: &[u8]) {
        *self.lock() = Some(Running { target, input: input.to_vec(), since: Instant::now() });
    }

    pub(super) fn end(&self) {
        *self.lock() = None;
    }

    fn lock(&self) -> MutexGuard<'_, Option<Running>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn look(&self) {
        let running = self.lock();
        if let Some(Running { target, input, since }) = &*running
            && since.elapsed() > HANG
        {
            match keep(target, input) {
                Ok(path) => eprintln!("{target}: hangs on {}", path.display()),
                Err(error) => eprintln!("{target}: hangs on an input that cannot be kept ({error}): {input:02x?}"),
            }
            process::exit(1);
        }
    }
}

/// Memory of this process, bytes; `None` where the system does not tell.
#[must_use]
pub fn resident() -> Option<u64> {
    status("VmRSS:")
}

/// The most since [`forget_peak`].
#[must_use]
pub fn peak() -> Option<u64> {
    status("VmHWM:")
}

/// From now on the peak counts anew (Linux, proc(5), `clear_refs`).
pub fn forget_peak() {
    // Where that is not to be had, the peak is the whole program's.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

fn status(key: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<u64>().ok()? * 1024)
}
