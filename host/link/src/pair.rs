//! Pairing: once, with the robot on a cable.

use std::time::Duration;

use control::protocol::VERSION;
use control::protocol::dongle::Address;
use control::protocol::frame::{self, Deframer};
use control::protocol::pairing::{Pairing, PairingReply, PairingRequest};

use super::session::{greet, is_wait};
use super::{Line, LinkError};

/// Interval at which `Hello` is repeated: opening the port may have restarted the robot.
const HELLO: Duration = Duration::from_millis(300);
/// Keeping a pairing may erase two pages of the flash, 400 ms each.
const KEEPING: Duration = Duration::from_secs(3);

/// The address of the dongle on a line.
///
/// # Errors
/// None answers, or one of another version; the line breaks.
pub fn dongle_address(line: impl Line, patience: Duration) -> Result<Address, LinkError> {
    greet(line, patience).map(|opened| opened.address)
}

/// A robot on its own cable.
pub struct Cabled<L> {
    line: L,
    deframer: Deframer,
    /// ESP-NOW (MAC) address.
    pub address: Address,
    /// Its name.
    pub name: String,
    /// The dongle that it obeys so far.
    pub console: Option<Address>,
}

impl<L: Line> Cabled<L> {
    /// Says hello until the robot answers.
    ///
    /// # Errors
    /// It does not in time, or is of another version; the line breaks.
    pub fn open(line: L, patience: Duration) -> Result<Self, LinkError> {
        let deframer = Deframer::default();
        let mut robot = Self { line, deframer, address: [0; 6], name: String::new(), console: None };
        let start = robot.line.now();
        while robot.line.now().saturating_sub(start) < patience {
            match robot.exchange(&PairingRequest::Hello, HELLO)? {
                Some(PairingReply::Hello { version, .. }) if version != VERSION => {
                    return Err(LinkError::CabledVersion { robot: version });
                }
                Some(PairingReply::Hello { address, name, console, .. }) => {
                    (robot.address, robot.name, robot.console) = (address, name.as_str().to_owned(), console);
                    return Ok(robot);
                }
                _ => {}
            }
        }
        Err(LinkError::NoCabledRobot)
    }

    /// Makes the robot obey the console of a pairing. It boots then.
    ///
    /// # Errors
    /// It drives, or its flash keeps nothing; the line breaks.
    pub fn pair(mut self, pairing: &Pairing) -> Result<(), LinkError> {
        self.keep(&PairingRequest::Pair(pairing.clone()))
    }

    /// Makes the robot obey nobody. It boots then.
    ///
    /// # Errors
    /// As [`Cabled::pair`].
    pub fn forget(mut self) -> Result<(), LinkError> {
        self.keep(&PairingRequest::Forget)
    }

    fn keep(&mut self, request: &PairingRequest) -> Result<(), LinkError> {
        match self.exchange(request, KEEPING)? {
            Some(PairingReply::Kept) => Ok(()),
            Some(PairingReply::NotKept) => Err(LinkError::NotPaired { address: self.address }),
            _ => Err(LinkError::NoCabledRobot),
        }
    }

    /// Asks, and waits for an answer of the kind; answers to earlier questions are passed over.
    fn exchange(&mut self, request: &PairingRequest, patience: Duration) -> Result<Option<PairingReply>, LinkError> {
        let mut buffer = [0; frame::LONGEST + 1];
        let Ok(bytes) = frame::encode(request, &mut buffer) else { return Ok(None) };
        // The first zero ends what the robot may have taken for the beginning of a frame.
        let written =
            self.line.write_all(&[0]).and_then(|()| self.line.write_all(bytes)).and_then(|()| self.line.flush());
        if let Err(error) = written
            && !is_wait(&error)
        {
            return Err(LinkError::Line(error));
        }
        let start = self.line.now();
        while self.line.now().saturating_sub(start) < patience {
            let mut bytes = [0; 256];
            let count = match self.line.read(&mut bytes) {
                Ok(count) => count,
                Err(error) if is_wait(&error) => 0,
                Err(error) => return Err(LinkError::Line(error)),
            };
            for byte in &bytes[..count] {
                let Some(Ok(answer)) = self.deframer.push::<PairingReply>(*byte) else { continue };
                if matches!(answer, PairingReply::Hello { .. }) == matches!(request, PairingRequest::Hello) {
                    return Ok(Some(answer));
                }
            }
        }
        Ok(None)
    }
}
