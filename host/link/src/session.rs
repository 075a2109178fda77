//! A dongle on a line, and the robots behind it that are paired with this console.
//!
//! Everything happens in [`Session::poll`]: reading, heartbeats, repetitions. There is no thread. A console that hangs polls
//! no more, its heartbeats end, and its robots stop.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::time::Duration;

use control::protocol::VERSION;
use control::protocol::dongle::{self, Address, FromDongle, Payload, ToDongle};
use control::protocol::frame::{self, Deframer};
use control::protocol::radio::Request;
use control::protocol::secure::Nonce;

use super::robot::{Event, Robot, Urgency};
use super::{Keys, Line, LinkError};

/// Everybody. Only `Stop` is sent to it.
pub const BROADCAST: Address = [0xff; 6];

/// Interval at which `Hello` is repeated until it is answered: opening the port may have restarted the dongle.
const HELLO: Duration = Duration::from_millis(200);
/// Silence after which the dongle is gone: it says of every frame what became of it.
const DONGLE_SILENT: Duration = Duration::from_millis(400);
/// Frames that the dongle has at a time: with more of them a `Stop` would wait behind heartbeats.
const IN_FLIGHT: usize = 2;
/// Time after which a frame that the dongle has not reported on is forgotten.
const FORGOTTEN: Duration = Duration::from_millis(150);

/// Which robot of a session: its place among the keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RobotId(pub usize);

/// Event with its robot and time.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard {
    /// Robot that it concerns.
    pub robot: RobotId,
    /// When it came out of the line, on the line's clock.
    pub at: Duration,
    /// The event.
    pub event: Event,
}

/// What a session counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames that a robot's radio acknowledged.
    pub acknowledged: u32,
    /// Frames that it did not.
    pub unacknowledged: u32,
    /// Frames of which the dongle did not say what became of them.
    pub forgotten: u32,
    /// Greetings of the dongle in between: it restarted, or could not write for half a second.
    pub greetings: u32,
    /// Writes for which the dongle had no room.
    pub stuck_writes: u32,
    /// Frames of the dongle that could not be read.
    pub bad_frames: u32,
    /// Radio frames from addresses that belong to no robot of ours.
    pub strangers: u32,
}

/// A dongle that has said hello. Dropped while a robot drives, it tells the robot to stop first.
pub struct Session<L: Line> {
    line: L,
    deframer: Deframer,
    inbox: VecDeque<FromDongle>,
    bytes: u64,
    /// When it was sent something after it was last heard.
    unanswered: Option<Duration>,
    address: Address,
    channel: u8,
    nonce: Box<dyn FnMut() -> Nonce + Send>,
    robots: Vec<Robot>,
    primary: dongle::RadioKey,
    /// Whose keys the dongle has, as far as one knows.
    met: Vec<bool>,
    number: u16,
    in_flight: VecDeque<(u16, Duration)>,
    events: VecDeque<Heard>,
    counts: Counts,
    counted: Option<dongle::Counters>,
}

/// A dongle that answers, and who it is.
pub(super) struct Opened<L> {
    pub line: L,
    pub deframer: Deframer,
    pub inbox: VecDeque<FromDongle>,
    pub address: Address,
    pub channel: u8,
}

/// Says hello to a dongle until it answers.
pub(super) fn greet<L: Line>(mut line: L, patience: Duration) -> Result<Opened<L>, LinkError> {
    let (mut deframer, mut inbox, mut bytes) = (Deframer::default(), VecDeque::new(), 0);
    let start = line.now();
    let mut due = start;
    while line.now().saturating_sub(start) < patience {
        if line.now() >= due {
            write(&mut line, &ToDongle::Hello)?;
            due = line.now() + HELLO;
        }
        bytes += read(&mut line, &mut deframer, &mut inbox)?;
        while let Some(message) = inbox.pop_front() {
            if let FromDongle::Hello { version, address, channel } = message {
                if version != VERSION {
                    return Err(LinkError::Version { dongle: version });
                }
                return Ok(Opened { line, deframer, inbox, address, channel });
            }
        }
    }
    Err(LinkError::NoDongle { bytes, bad_frames: deframer.bad() })
}

impl<L: Line> Session<L> {
    /// Says hello to the dongle until it answers, and begins to call every robot of the keys. `nonce` makes numbers that
    /// nobody can guess, e.g. [`super::nonces`].
    ///
    /// # Errors
    /// The dongle does not answer in time, is of another version, or is not the one that the robots obey; the line breaks.
    pub fn open(
        line: L,
        keys: &Keys,
        mut nonce: Box<dyn FnMut() -> Nonce + Send>,
        patience: Duration,
    ) -> Result<Self, LinkError> {
        let Opened { line, deframer, inbox, address, channel } = greet(line, patience)?;
        let now = line.now();
        let known = keys.robots.iter().cloned();
        let robots: Vec<Robot> =
            known.map(|robot| Robot::new(robot.name, robot.address, robot.pairing, nonce(), now)).collect();
        if let Some(robot) = robots.first()
            && robots.iter().all(|robot| robot.console() != address)
        {
            return Err(LinkError::OtherDongle { dongle: address, paired: robot.console() });
        }
        let mut session = Self {
            line,
            deframer,
            inbox,
            bytes: 0,
            unanswered: None,
            address,
            channel,
            nonce,
            robots,
            primary: keys.primary(),
            met: Vec::new(),
            number: 0,
            in_flight: VecDeque::new(),
            events: VecDeque::new(),
            counts: Counts::default(),
            counted: None,
        };
        session.introduce()?;
        Ok(session)
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

    /// Every robot of the keys.
    pub fn robots(&self) -> impl ExactSizeIterator<Item = (RobotId, &Robot)> {
        self.robots.iter().enumerate().map(|(index, robot)| (RobotId(index), robot))
    }

    /// One of them.
    ///
    /// # Panics
    /// It is another session's.
    #[must_use]
    pub fn robot(&self, id: RobotId) -> &Robot {
        &self.robots[id.0]
    }

    /// Commands something: the number of the [`Event::Answered`] that will come, within a second. Orders of a robot are
    /// served one after the other.
    pub fn request(&mut self, id: RobotId, request: Request) -> u16 {
        let mut events = Vec::new();
        let number = self.robots[id.0].request(request, &mut events);
        self.note(id, events);
        number
    }

    /// Stops a robot, before everything else: it is told until its telemetry says that the bridge is off.
    ///
    /// # Errors
    /// The line breaks.
    pub fn stop(&mut self, id: RobotId) -> Result<(), LinkError> {
        let (now, mut events) = (self.now(), Vec::new());
        self.robots[id.0].stop(now, &mut events);
        self.note(id, events);
        self.send_due()
    }

    /// Stops every robot.
    ///
    /// # Errors
    /// The line breaks.
    pub fn stop_all(&mut self) -> Result<(), LinkError> {
        (0..self.robots.len()).try_for_each(|index| self.stop(RobotId(index)))
    }

    /// Does what is due, and reads for some milliseconds: the next thing that happened, or nothing yet.
    ///
    /// # Errors
    /// The line breaks, or the dongle is silent while it has frames to tell about.
    pub fn poll(&mut self) -> Result<Option<Heard>, LinkError> {
        self.age();
        self.send_due()?;
        if self.events.is_empty() && self.inbox.is_empty() {
            self.bytes += self.read()?;
        }
        while self.events.is_empty()
            && let Some(message) = self.inbox.pop_front()
        {
            self.absorb(message)?;
        }
        self.send_due()?;
        if let Some(heard) = self.events.pop_front() {
            return Ok(Some(heard));
        }
        match self.unanswered.map(|since| self.now().saturating_sub(since)) {
            Some(silent) if silent > DONGLE_SILENT => Err(LinkError::DongleSilent { silent }),
            _ => Ok(None),
        }
    }

    /// The dongle's own counters, if it tells them in time. What happens meanwhile is kept for [`Session::poll`].
    ///
    /// # Errors
    /// The line breaks.
    pub fn count(&mut self, patience: Duration) -> Result<Option<dongle::Counters>, LinkError> {
        self.counted = None;
        write(&mut self.line, &ToDongle::Count)?;
        let start = self.now();
        let mut happened = VecDeque::new();
        while self.counted.is_none() && self.now().saturating_sub(start) < patience {
            happened.extend(self.poll()?);
        }
        happened.append(&mut self.events);
        self.events = happened;
        Ok(self.counted)
    }

    fn read(&mut self) -> Result<u64, LinkError> {
        let before = self.inbox.len();
        let bytes = read(&mut self.line, &mut self.deframer, &mut self.inbox)?;
        if self.inbox.len() > before {
            self.unanswered = None;
        }
        Ok(bytes)
    }

    fn note(&mut self, robot: RobotId, events: Vec<Event>) {
        let at = self.line.now();
        self.events.extend(events.into_iter().map(|event| Heard { robot, at, event }));
    }

    /// Tells the dongle the key of all; those of the robots follow with what is sent to them. It has forgotten them when it
    /// has booted, and what it was about to send.
    fn introduce(&mut self) -> Result<(), LinkError> {
        self.met = vec![false; self.robots.len()];
        self.in_flight.clear();
        write(&mut self.line, &ToDongle::Primary(self.primary))
            .map(|stuck| self.counts.stuck_writes += u32::from(stuck))
    }

    fn age(&mut self) {
        let now = self.line.now();
        while self.in_flight.pop_front_if(|(_, sent)| now.saturating_sub(*sent) > FORGOTTEN).is_some() {
            self.counts.forgotten += 1;
        }
        for index in 0..self.robots.len() {
            let mut events = Vec::new();
            self.robots[index].age(now, &mut *self.nonce, &mut events);
            self.note(RobotId(index), events);
        }
    }

    /// Sends the most urgent frames, as many as the dongle shall have at a time; what stops a robot goes at once.
    fn send_due(&mut self) -> Result<(), LinkError> {
        let now = self.line.now();
        for index in 0..self.robots.len() {
            while self.robots[index].stops_first(now) {
                self.send_to(index, Urgency::Stop)?;
            }
        }
        while self.in_flight.len() < IN_FLIGHT {
            let urgent = |(index, robot): (usize, &Robot)| robot.urgency(now).map(|(what, due)| (what, due, index));
            let Some((urgency, _, index)) = self.robots.iter().enumerate().filter_map(urgent).min() else { break };
            // A robot that is not there takes the radio twenty ms of retries, and the radio may be done with a heartbeat 50 ms
            // late: a `Stop` shall find one of them before it at most.
            if urgency >= Urgency::Heartbeat && !self.in_flight.is_empty() {
                break;
            }
            self.send_to(index, urgency)?;
        }
        Ok(())
    }

    fn send_to(&mut self, index: usize, urgency: Urgency) -> Result<(), LinkError> {
        let now = self.line.now();
        // With every call anew: the key may have got lost on the way to the dongle.
        if urgency == Urgency::Hello || !self.met[index] {
            let robot = &self.robots[index];
            let meet = ToDongle::Meet { address: robot.address(), local: robot.local() };
            let stuck = write(&mut self.line, &meet)?;
            self.met[index] = !stuck;
            self.counts.stuck_writes += u32::from(stuck);
        }
        match self.robots[index].frame(urgency, now) {
            Some((to, payload)) => self.send(to, payload),
            None => Ok(()),
        }
    }

    fn send(&mut self, to: Address, payload: Payload) -> Result<(), LinkError> {
        self.number = self.number.wrapping_add(1);
        let now = self.line.now();
        self.unanswered.get_or_insert(now);
        if write(&mut self.line, &ToDongle::Send { number: self.number, to, payload })? {
            self.counts.stuck_writes += 1;
        } else {
            self.in_flight.push_back((self.number, now));
        }
        Ok(())
    }

    fn absorb(&mut self, message: FromDongle) -> Result<(), LinkError> {
        match message {
            FromDongle::Hello { version, .. } if version != VERSION => {
                return Err(LinkError::Version { dongle: version });
            }
            FromDongle::Hello { .. } => {
                self.counts.greetings += 1;
                self.introduce()?;
            }
            FromDongle::Sent { number, acknowledged } => {
                self.in_flight.retain(|(sent, _)| *sent != number);
                let counter =
                    if acknowledged { &mut self.counts.acknowledged } else { &mut self.counts.unacknowledged };
                *counter += 1;
            }
            FromDongle::Counted(counters) => self.counted = Some(counters),
            FromDongle::Received { from, rssi, payload } => {
                let now = self.line.now();
                match self.robots.iter().position(|robot| robot.address() == from) {
                    Some(index) => {
                        let mut events = Vec::new();
                        self.robots[index].hear(&payload, rssi, now, &mut events);
                        self.note(RobotId(index), events);
                    }
                    None => self.counts.strangers += 1,
                }
            }
        }
        Ok(())
    }
}

impl<L: Line> Drop for Session<L> {
    fn drop(&mut self) {
        // Whoever may be driving, and whoever one only thinks is not: the first stops wait for nothing.
        let _ = self.stop_all();
    }
}

/// Whether the line had no room for it.
fn write<L: Line>(line: &mut L, message: &ToDongle) -> Result<bool, LinkError> {
    let mut buffer = [0; frame::LONGEST + 1];
    let Ok(frame) = frame::encode(message, &mut buffer) else { return Ok(false) };
    // The first zero ends what a write that got stuck may have left.
    let written = line.write_all(&[0]).and_then(|()| line.write_all(frame)).and_then(|()| line.flush());
    match written {
        Ok(()) => Ok(false),
        // It does not read at the moment. If that lasts, its silence ends the session.
        Err(error) if is_wait(&error) => Ok(true),
        Err(error) => Err(LinkError::Line(error)),
    }
}

/// Reads what is there; how many bytes.
fn read<L: Line>(line: &mut L, deframer: &mut Deframer, inbox: &mut VecDeque<FromDongle>) -> Result<u64, LinkError> {
    let mut buffer = [0; 1024];
    let count = match line.read(&mut buffer) {
        Ok(0) => return Err(LinkError::Line(io::Error::from(ErrorKind::UnexpectedEof))),
        Ok(count) => count,
        Err(error) if is_wait(&error) => return Ok(0),
        Err(error) => return Err(LinkError::Line(error)),
    };
    for byte in &buffer[..count] {
        if let Some(Ok(message)) = deframer.push(*byte) {
            inbox.push_back(message);
        }
    }
    Ok(count as u64)
}

/// Whether an error only says that there is nothing yet.
pub(super) fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}
