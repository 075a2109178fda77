//! A board on a serial port.

use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

use serialport::SerialPort;

use super::{HilError, Transport};
use link::serial;

/// An open serial port.
pub struct Port {
    port: Box<dyn SerialPort>,
    timeout: Duration,
}

impl Port {
    /// Opens a port by its name.
    ///
    /// # Errors
    /// As [`serial::open`].
    pub fn open(name: &str) -> Result<Self, HilError> {
        let timeout = Duration::from_millis(100);
        Ok(Self { port: serial::open(name, serial::BAUD, timeout)?, timeout })
    }
}

impl Transport for Port {
    fn send(&mut self, bytes: &[u8]) -> Result<(), HilError> {
        self.port.write_all(bytes).map_err(HilError::Line)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, HilError> {
        if timeout != self.timeout {
            self.port.set_timeout(timeout).map_err(|error| HilError::Line(error.into()))?;
            self.timeout = timeout;
        }
        match self.port.read(buffer) {
            Ok(0) => Err(HilError::Line(ErrorKind::UnexpectedEof.into())),
            Ok(count) => Ok(count),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => Ok(0),
            Err(error) if error.kind() == ErrorKind::Interrupted => self.receive(buffer, timeout),
            Err(error) => Err(HilError::Line(error)),
        }
    }
}
