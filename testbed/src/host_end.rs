//! The host's end of the dongle's serial line in virtual time, which passes while the host waits.

use std::cell::{RefCell, RefMut};
use std::io::{self, ErrorKind, Read, Write};
use std::rc::Rc;
use std::time::Duration;

use crate::bench::Bench;

/// Time that a read without data takes, µs.
const WAIT_US: u64 = 1000;
/// Interval at which it looks meanwhile, µs.
const LOOK_US: u64 = 100;

/// Reads and writes bytes, and brings its clock. Clones are the same one: one for the program, another for whoever watches.
#[derive(Clone)]
pub struct HostEnd(Rc<RefCell<Bench>>);

impl HostEnd {
    /// Of a bench with a dongle.
    #[must_use]
    pub fn new(bench: Bench) -> Self {
        Self(Rc::new(RefCell::new(bench)))
    }

    /// The bench behind it.
    #[must_use]
    pub fn bench(&self) -> RefMut<'_, Bench> {
        self.0.borrow_mut()
    }

    /// Virtual time since the bench's beginning.
    #[must_use]
    pub fn now(&self) -> Duration {
        Duration::from_micros(self.0.borrow().now_us())
    }

    /// Runs the test bed for `time`.
    pub fn wait(&self, time: Duration) {
        let mut bench = self.0.borrow_mut();
        let end_us = bench.now_us() + time.as_micros() as u64;
        bench.run_until(end_us);
    }
}

fn no_dongle() -> io::Error {
    io::Error::from(ErrorKind::NotConnected)
}

impl Read for HostEnd {
    /// What there is at once; else what comes within a ms; else [`ErrorKind::TimedOut`].
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut bench = self.0.borrow_mut();
        let end_us = bench.now_us() + WAIT_US;
        loop {
            let line = bench.dongle.as_ref().ok_or_else(no_dongle)?.line.clone();
            match line.read(buffer)? {
                0 if bench.now_us() >= end_us => return Err(io::Error::from(ErrorKind::TimedOut)),
                0 => {
                    let look_us = bench.now_us() + LOOK_US;
                    bench.run_until(look_us.min(end_us));
                }
                count => return Ok(count),
            }
        }
    }
}

impl Write for HostEnd {
    /// As many bytes as there is room for; [`ErrorKind::TimedOut`] without any.
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let bench = self.0.borrow();
        match bench.dongle.as_ref().ok_or_else(no_dongle)?.line.write(buffer)? {
            0 => Err(io::Error::from(ErrorKind::TimedOut)),
            count => Ok(count),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
