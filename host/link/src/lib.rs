//! Robots through a dongle: a [`Session`] on a serial line carries commands out and telemetry in, with the [`Keys`] of the
//! robots that obey this console; a [`Recorder`] makes a recording of the telemetry, and [`spin`] is one run at constant duty
//! that ends with the bridge off. The protocol: `docs/link.md`.
//!
//! Nothing here reads a clock: a [`Line`] brings its own, so that tests run whole sessions in virtual time.
//!
//! ```
//! use std::path::Path;
//! use std::time::Duration;
//!
//! use control::Command;
//! use control::protocol::radio::Request;
//! use link::{Keys, KnownRobot, Outcome, Session, nonces};
//! use testbed::bench::Bench;
//! use testbed::host_end::HostEnd;
//! use testbed::setup::{DONGLE, Setup, address, pairing};
//!
//! // A simulated dongle and robot; of real ones `SerialLine::open` is the line and `Keys::load` has the keys.
//! let robot = robot_file::Robot::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml")))?;
//! let line = HostEnd::new(Bench::new(Setup::new(&robot, 1, 5)?));
//! let known = KnownRobot { name: "scram-1".into(), address: address(0), pairing: pairing(DONGLE, 5, 0) };
//! let keys = Keys::of(pairing(DONGLE, 5, 0).primary, vec![known]);
//!
//! let patience = Duration::from_secs(3);
//! let mut session = Session::open(line, &keys, nonces()?, patience)?;
//! let robot = session.find(None, patience)?;
//! assert_eq!(session.ask(robot, Request::Command(Command::ClearFault), |_| ())?, Outcome::Done(None));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It has no commands for people and no screen: the console of `scram` has.
//! * It keeps nothing going by itself: heartbeats are sent from [`Session::poll`] alone, so that a program that hangs lets its
//!   robots stop.
//! * It flashes nothing: `cargo flash-robot` does.

mod error;
mod find;
mod keys;
mod pair;
mod quality;
mod recorder;
mod robot;
pub mod serial;
mod session;
mod spin;
mod words;

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use control::protocol::secure::Nonce;
use serialport::SerialPort;

pub use error::LinkError;
pub use keys::{Keys, KeysError, KnownRobot, random};
pub use pair::{Cabled, dongle_address};
pub use quality::Quality;
pub use recorder::Recorder;
pub use recording::fault;
pub use robot::{Event, Outcome, Robot};
pub use session::{BROADCAST, Counts, Heard, RobotId, Session};
pub use spin::{Spin, spin};
pub use words::{address, outcome, parse_address, refusal, reset, robot, source, state};

use serial::SerialError;

/// A serial line to a dongle. A read waits a few milliseconds at most and then fails with [`io::ErrorKind::TimedOut`] or
/// [`io::ErrorKind::WouldBlock`].
pub trait Line: Read + Write {
    /// Time since a fixed moment.
    fn now(&self) -> Duration;
}

impl Line for Box<dyn Line> {
    fn now(&self) -> Duration {
        (**self).now()
    }
}

/// Nonces from the operating system's random generator. It is asked once, at the beginning, whether it answers.
///
/// # Errors
/// It does not.
pub fn nonces() -> Result<Box<dyn FnMut() -> Nonce + Send>, KeysError> {
    let mut last: [u8; 8] = random()?;
    Ok(Box::new(move || {
        // Should it fall silent later, a number that was not used before is still better than none.
        last = random().unwrap_or_else(|_| u64::from_le_bytes(last).wrapping_add(1).to_le_bytes());
        Nonce(last)
    }))
}

/// A dongle on the test bench, in virtual time.
impl Line for testbed::host_end::HostEnd {
    fn now(&self) -> Duration {
        self.now()
    }
}

/// How long a read of a [`SerialLine`] waits.
const READ_TIMEOUT: Duration = Duration::from_millis(2);

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
