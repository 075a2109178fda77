//! A dongle on a line, and the robots behind it.

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, ErrorKind};
use std::time::Duration;

use control::Command;
use control::protocol::dongle::{self, Address, FromDongle, Payload, ToDongle};
use control::protocol::frame::{self, Deframer};
use control::protocol::radio::{Batch, FromRobot, Misread, Status};
use control::protocol::{VERSION, radio};

use super::{Line, LinkError};

/// A command is repeated so often while it shall hold: a tenth of the age at which the robot gives up.
const REPEAT: Duration = Duration::from_millis(50);
/// `Hello` is repeated so often until it is answered: opening the port may have restarted the dongle.
const HELLO: Duration = Duration::from_millis(200);
/// A dongle says of every message what became of it. Without any sign for so long it is gone; that is sooner than a
/// robot is given up, so that the right one is named.
const DONGLE_SILENT: Duration = Duration::from_millis(400);
/// What was heard of an address.
#[derive(Clone, Debug, Default)]
pub struct Station {
    /// Strength of the latest signal, dBm.
    pub rssi: i8,
    /// When it was last understood, on the line's clock.
    pub heard: Duration,
    /// Latest telemetry.
    pub telemetry: Option<Batch>,
    /// Latest status.
    pub status: Option<Status>,
    /// Number of its latest message.
    sequence: Option<u16>,
    /// Messages of its that are missing between those that came: lost on the air, dropped by the dongle, or for another
    /// host.
    pub lost: u32,
    /// Messages that are no robot's: another program on the same channel, or another host.
    pub misunderstood: u32,
    /// The version of the messages that it speaks, where it is another than ours.
    pub other_version: Option<u16>,
}

impl Station {
    /// Whether it has said something that only a robot says.
    pub(super) fn is_robot(&self) -> bool {
        self.telemetry.is_some() || self.status.is_some()
    }
}

/// A message of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard {
    /// Whose.
    pub from: Address,
    /// When it came out of the line, on the line's clock.
    pub at: Duration,
    /// What.
    pub message: FromRobot,
}

/// What a session counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Radio messages that the robot's radio acknowledged.
    pub acknowledged: u32,
    /// Radio messages that it did not.
    pub unacknowledged: u32,
    /// Greetings of the dongle in between: it restarted, or could not write for half a second.
    pub greetings: u32,
    /// Writes for which the dongle had no room.
    pub stuck_writes: u32,
    /// Frames of the dongle that could not be read.
    pub bad_frames: u32,
}

/// What a robot shall do until told otherwise.
struct Held {
    to: Address,
    command: Command,
    due: Duration,
}

/// A dongle that has said hello. Dropped while a robot drives, it tells the robot to stop first.
pub struct Session<L: Line> {
    line: L,
    deframer: Deframer,
    inbox: VecDeque<FromDongle>,
    bytes: u64,
    heard: Duration,
    address: Address,
    channel: u8,
    number: u16,
    sequence: u16,
    held: Option<Held>,
    pub(super) stations: BTreeMap<Address, Station>,
    counts: Counts,
    counted: Option<dongle::Counters>,
}

impl<L: Line> Session<L> {
    /// Says hello to the dongle until it answers.
    ///
    /// # Errors
    /// It does not answer in time, or is of another version; the line breaks.
    pub fn open(line: L, patience: Duration) -> Result<Self, LinkError> {
        let start = line.now();
        let mut session = Self {
            line,
            deframer: Deframer::default(),
            inbox: VecDeque::new(),
            bytes: 0,
            heard: start,
            address: [0; 6],
            channel: 0,
            number: 0,
            sequence: 0,
            held: None,
            stations: BTreeMap::new(),
            counts: Counts::default(),
            counted: None,
        };
        let mut due = start;
        while session.now().saturating_sub(start) < patience {
            if session.now() >= due {
                session.write(&ToDongle::Hello)?;
                due = session.now() + HELLO;
            }
            session.read()?;
            while let Some(message) = session.inbox.pop_front() {
                if let FromDongle::Hello { version, address, channel } = message {
                    if version != VERSION {
                        return Err(LinkError::Version { dongle: version });
                    }
                    (session.address, session.channel) = (address, channel);
                    return Ok(session);
                }
            }
        }
        Err(LinkError::NoDongle { bytes: session.bytes, bad_frames: session.deframer.bad() })
    }

    /// The dongle's own address.
    #[must_use]
    pub fn address(&self) -> Address {
        self.address
    }

    /// Its radio channel.
    #[must_use]
    pub fn channel(&self) -> u8 {
        self.channel
    }

    /// Time on the line's clock.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.line.now()
    }

    /// What was counted.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts { bad_frames: self.deframer.bad(), ..self.counts }
    }

    /// What is known about an address.
    #[must_use]
    pub fn station(&self, address: &Address) -> Option<&Station> {
        self.stations.get(address)
    }

    /// Gives a command now and repeats it with every [`Session::poll`] that is due, until the next one.
    ///
    /// # Errors
    /// The line breaks.
    pub fn hold(&mut self, to: Address, command: Command) -> Result<(), LinkError> {
        self.held = Some(Held { to, command, due: self.now() });
        self.repeat()
    }

    /// Reads for some milliseconds: the next message of a robot, or nothing yet.
    ///
    /// # Errors
    /// The line breaks, or the dongle is silent while it has commands to acknowledge.
    pub fn poll(&mut self) -> Result<Option<Heard>, LinkError> {
        self.repeat()?;
        if self.inbox.is_empty() {
            self.read()?;
        }
        while let Some(message) = self.inbox.pop_front() {
            if let Some(heard) = self.absorb(message) {
                return Ok(Some(heard));
            }
        }
        let silent = self.now().saturating_sub(self.heard);
        if self.held.is_some() && silent > DONGLE_SILENT {
            return Err(LinkError::DongleSilent { silent });
        }
        Ok(None)
    }

    /// The dongle's own counters, if it tells them in time.
    ///
    /// # Errors
    /// The line breaks.
    pub fn count(&mut self, patience: Duration) -> Result<Option<dongle::Counters>, LinkError> {
        self.counted = None;
        self.write(&ToDongle::Count)?;
        let start = self.now();
        while self.counted.is_none() && self.now().saturating_sub(start) < patience {
            self.poll()?;
        }
        Ok(self.counted)
    }

    /// Ends whatever a robot does and waits until it says so.
    /// False if it has not said so after `patience`; its own limit on the age of commands stops it then.
    pub fn stop(&mut self, robot: Address, patience: Duration, mut heard: impl FnMut(&Heard)) -> bool {
        // Three at once, because the line or the radio may be about to die.
        let told = (0..3).map(|_| self.hold(robot, Command::Idle)).filter(Result::is_ok).count();
        let start = self.now();
        while told > 0 && self.now().saturating_sub(start) < patience {
            match self.poll() {
                Ok(Some(message)) => {
                    heard(&message);
                    if message.from == robot
                        && let FromRobot::Telemetry(batch) = &message.message
                        && !batch.state.is_driving()
                    {
                        return true;
                    }
                }
                // A dongle may find its voice again.
                Ok(None) | Err(LinkError::DongleSilent { .. }) => {}
                Err(_) => return false,
            }
        }
        false
    }

    fn absorb(&mut self, message: FromDongle) -> Option<Heard> {
        match message {
            FromDongle::Hello { .. } => self.counts.greetings += 1,
            FromDongle::Sent { acknowledged: true, .. } => self.counts.acknowledged += 1,
            FromDongle::Sent { acknowledged: false, .. } => self.counts.unacknowledged += 1,
            FromDongle::Counted(counters) => self.counted = Some(counters),
            FromDongle::Received { from, rssi, payload } => {
                let at = self.now();
                let station = self.stations.entry(from).or_default();
                station.rssi = rssi;
                let message = match radio::decode::<FromRobot>(&payload) {
                    Ok((sequence, message)) => {
                        let before = station.sequence.replace(sequence);
                        let lost = before.and_then(|before| radio::missing(before, sequence));
                        station.lost += u32::from(lost.unwrap_or(0));
                        message
                    }
                    Err(Misread::OtherVersion(version)) => {
                        station.other_version = Some(version);
                        return None;
                    }
                    Err(Misread::OtherDirection | Misread::Rubbish) => {
                        station.misunderstood += 1;
                        return None;
                    }
                };
                station.heard = at;
                match &message {
                    FromRobot::Telemetry(batch) => station.telemetry = Some(batch.clone()),
                    FromRobot::Status(status) => station.status = Some(status.clone()),
                    FromRobot::Answer { .. } => {}
                }
                return Some(Heard { from, at, message });
            }
        }
        None
    }

    /// Sends the held command if it is due.
    fn repeat(&mut self) -> Result<(), LinkError> {
        let now = self.now();
        let Some(held) = self.held.as_mut().filter(|held| now >= held.due) else { return Ok(()) };
        held.due = now + REPEAT;
        let (to, command) = (held.to, held.command);
        self.send(to, command)
    }

    fn send(&mut self, to: Address, command: Command) -> Result<(), LinkError> {
        self.sequence = self.sequence.wrapping_add(1);
        self.number = self.number.wrapping_add(1);
        let mut bytes = [0; radio::LONGEST];
        // A command has a dozen bytes: it always fits.
        let Ok(encoded) = radio::encode(self.sequence, &command, &mut bytes) else { return Ok(()) };
        let payload = Payload::from_slice(encoded).unwrap_or_default();
        self.write(&ToDongle::Send { number: self.number, to, payload })
    }

    fn write(&mut self, message: &ToDongle) -> Result<(), LinkError> {
        let mut buffer = [0; frame::LONGEST + 1];
        let Ok(frame) = frame::encode(message, &mut buffer) else { return Ok(()) };
        // The first zero ends what a write that got stuck may have left.
        let written =
            self.line.write_all(&[0]).and_then(|()| self.line.write_all(frame)).and_then(|()| self.line.flush());
        match written {
            Ok(()) => Ok(()),
            Err(error) if is_wait(&error) => {
                // It does not read at the moment. If that lasts, its silence ends the session.
                self.counts.stuck_writes += 1;
                Ok(())
            }
            Err(error) => Err(LinkError::Line(error)),
        }
    }

    fn read(&mut self) -> Result<(), LinkError> {
        let mut buffer = [0; 1024];
        let count = match self.line.read(&mut buffer) {
            Ok(0) => return Err(LinkError::Line(io::Error::from(ErrorKind::UnexpectedEof))),
            Ok(count) => count,
            Err(error) if is_wait(&error) => return Ok(()),
            Err(error) => return Err(LinkError::Line(error)),
        };
        self.bytes += count as u64;
        for byte in &buffer[..count] {
            if let Some(Ok(message)) = self.deframer.push(*byte) {
                self.heard = self.line.now();
                self.inbox.push_back(message);
            }
        }
        Ok(())
    }
}

impl<L: Line> Drop for Session<L> {
    fn drop(&mut self) {
        if let Some(held) = &self.held
            && held.command.event() != control::supervisor::Event::Idle
        {
            let _ = self.send(held.to, Command::Idle);
        }
    }
}

/// Whether an error only says that there is nothing yet.
fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}
