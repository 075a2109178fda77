//! Time that a thread has had of a processor: what else the machine does does not count.

use std::time::Instant;

/// Started when it is made.
pub struct Stopwatch {
    wall: Instant,
    busy_s: Option<f64>,
}

impl Stopwatch {
    /// Starts.
    #[must_use]
    pub fn start() -> Self {
        Self { busy_s: busy_s(), wall: Instant::now() }
    }

    /// Processor time of this thread since the start, s; wall time where the system does not tell.
    #[must_use]
    pub fn busy_s(&self) -> f64 {
        match (self.busy_s, busy_s()) {
            (Some(then), Some(now)) => now - then,
            _ => self.wall_s(),
        }
    }

    /// Wall time since the start, s.
    #[must_use]
    pub fn wall_s(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }
}

/// Linux's account of this thread: nanoseconds on a processor come first. They are brought up to date when the thread lets
/// go of its processor, and else a few milliseconds late.
fn busy_s() -> Option<f64> {
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split(' ').next()?.parse().ok()?;
    Some(1e-9 * nanoseconds)
}
