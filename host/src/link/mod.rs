//! A robot through a dongle: a [`Session`] on a serial line carries commands out and telemetry in, a [`Recorder`] makes
//! a recording of the telemetry, and [`spin`] is one run at constant duty that ends with the bridge off.
//!
//! Nothing here reads a clock: a [`Line`] brings its own, so that tests run whole sessions in virtual time.

mod error;
mod find;
mod recorder;
mod session;
mod spin;
mod words;

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use serialport::SerialPort;

pub use error::LinkError;
pub use find::BROADCAST;
pub use recorder::Recorder;
pub use session::{Counts, Heard, Session, Station};
pub use spin::{Spin, spin};
pub use words::{address, fault, parse_address, reset, source, station};

use crate::serial::{self, SerialError};

/// A serial line to a dongle. A read waits a few milliseconds at most and then fails with [`io::ErrorKind::TimedOut`] or
/// [`io::ErrorKind::WouldBlock`].
pub trait Line: Read + Write {
    /// Time since a fixed moment.
    fn now(&self) -> Duration;
}

/// How long a read of a [`SerialLine`] waits.
const READ_TIMEOUT: Duration = Duration::from_millis(10);

/// A real serial port.
pub struct SerialLine {
    port: Box<dyn SerialPort>,
    opened: Instant,
}

impl SerialLine {
    /// Opens a port by its name.
    ///
    /// # Errors
    /// As [`serial::open`].
    pub fn open(port: &str) -> Result<Self, SerialError> {
        Ok(Self { port: serial::open(port, serial::BAUD, READ_TIMEOUT)?, opened: Instant::now() })
    }
}

impl Read for SerialLine {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.port.read(buffer)
    }
}

impl Write for SerialLine {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.port.write(buffer)
    }

    /// Bytes leave without being asked; waiting until all have would block while a dongle does not read.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for SerialLine {
    fn now(&self) -> Duration {
        self.opened.elapsed()
    }
}
