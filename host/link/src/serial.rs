//! Serial ports by name, with errors that say what to do.

use std::io;
use std::path::Path;
use std::time::Duration;

use miette::Diagnostic;
use serialport::{ErrorKind, SerialPort, SerialPortType};
use thiserror::Error;

pub use control::protocol::frame::BAUD;

/// Why a port does not open.
#[derive(Debug, Error, Diagnostic)]
pub enum SerialError {
    /// There is none of this name.
    #[error("there is no serial port {port}; {there}")]
    #[diagnostic(help("plug the board in with a cable that carries data, and name its port with --port"))]
    Missing {
        /// Name of the port, as given.
        port: String,
        /// What there is, in words.
        there: String,
    },
    /// This user may not open it.
    #[error("{port}: no permission to open it")]
    #[diagnostic(help(
        "on Linux serial ports belong to the group dialout (uucp on Arch): `sudo usermod -aG dialout $USER`, then log \
         out and in again"
    ))]
    Permission {
        /// Name of the port, as given.
        port: String,
    },
    /// Another program has it.
    #[error("{port}: another program has it open")]
    #[diagnostic(help("close the monitor, terminal or flasher that uses the port"))]
    Busy {
        /// Name of the port, as given.
        port: String,
    },
    /// A cause that the chip does not name.
    #[error("{port}: it does not open as a serial port: {detail}")]
    #[diagnostic(help("{there}"))]
    Other {
        /// Name of the port, as given.
        port: String,
        /// What the system says.
        detail: String,
        /// What there is, in words.
        there: String,
    },
}

/// Opens a port for this program alone, 8 bits without parity or flow control. A read waits for `timeout` at most and
/// then fails with [`io::ErrorKind::TimedOut`].
///
/// # Errors
/// The port is missing, forbidden, in use, or no serial port.
pub fn open(port: &str, baud: u32, timeout: Duration) -> Result<Box<dyn SerialPort>, SerialError> {
    let builder = serialport::new(port, baud).timeout(timeout);
    let opened = builder.open().map_err(|error| explain(port, &error))?;
    // What a board said before this program listened is half a message at best.
    let _ = opened.clear(serialport::ClearBuffer::Input);
    Ok(opened)
}

fn explain(port: &str, error: &serialport::Error) -> SerialError {
    let name = port.to_owned();
    let known = available().iter().any(|(known, _)| known.eq_ignore_ascii_case(port));
    let there = || in_words(&available());
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => SerialError::Permission { port: name },
        ErrorKind::Io(io::ErrorKind::NotFound) => SerialError::Missing { port: name, there: there() },
        ErrorKind::NoDevice if known || Path::new(port).exists() => SerialError::Busy { port: name },
        ErrorKind::NoDevice => SerialError::Missing { port: name, there: there() },
        _ => SerialError::Other { port: name, detail: error.to_string(), there: there() },
    }
}

/// The ports of this machine and what is known about each, those on USB first.
#[must_use]
pub fn available() -> Vec<(String, Option<String>)> {
    // The library panics on a Linux without it.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Vec::new();
    }
    let mut ports: Vec<(String, Option<String>)> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| {
            let product = match port.port_type {
                SerialPortType::UsbPort(usb) => {
                    Some(usb.product.unwrap_or_else(|| format!("USB {:04x}:{:04x}", usb.vid, usb.pid)))
                }
                _ => None,
            };
            (port.port_name, product)
        })
        .collect();
    ports.sort_by_key(|(name, product)| (product.is_none(), name.clone()));
    ports
}

/// `there are /dev/ttyUSB0 (CP2102 USB to UART Bridge Controller) and /dev/ttyS0`
fn in_words(ports: &[(String, Option<String>)]) -> String {
    let named = |(name, product): &(String, Option<String>)| match product {
        Some(product) => format!("{name} ({product})"),
        None => name.clone(),
    };
    match ports {
        [] => "this machine has none".to_owned(),
        [one] => format!("there is {}", named(one)),
        [first @ .., last] => {
            format!("there are {} and {}", first.iter().map(named).collect::<Vec<_>>().join(", "), named(last))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_that_is_not_there_is_told_with_those_that_are() {
        let error = open("/dev/no-such-port", BAUD, Duration::from_millis(1)).map(|_| ()).expect_err("no port");
        assert!(matches!(&error, SerialError::Missing { .. }), "{error}");
        assert!(error.to_string().starts_with("there is no serial port /dev/no-such-port; th"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_is_no_port() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let name = file.path().display().to_string();
        let error = open(&name, BAUD, Duration::from_millis(1)).map(|_| ()).expect_err("no port");
        assert!(matches!(&error, SerialError::Other { .. }), "{error:?}");
    }

    #[cfg(unix)]
    #[test]
    fn a_port_in_use_is_busy() {
        let (_master, slave) = serialport::TTYPort::pair().expect("a pseudo-terminal");
        let name = slave.name().expect("the slave has a name");
        drop(slave);
        let held = open(&name, BAUD, Duration::from_millis(1)).expect("opens once");
        let error = open(&name, BAUD, Duration::from_millis(1)).map(|_| ()).expect_err("but not twice");
        assert!(matches!(&error, SerialError::Busy { .. }), "{error:?}");
        drop(held);
    }

    #[test]
    fn ports_are_listed_as_a_sentence() {
        let port = |name: &str, product: Option<&str>| (name.to_owned(), product.map(str::to_owned));
        assert_eq!(in_words(&[]), "this machine has none");
        assert_eq!(in_words(&[port("COM3", None)]), "there is COM3");
        let three = [port("/dev/ttyUSB0", Some("CP2102")), port("/dev/ttyS0", None), port("/dev/ttyS1", None)];
        assert_eq!(in_words(&three), "there are /dev/ttyUSB0 (CP2102), /dev/ttyS0 and /dev/ttyS1");
    }
}
