//! Any sequence of frames at a robot's ear.
//!
//! The bytes are commands to a console that is paired with the robot, and to an attacker who records and changes what is
//! on the air. Beside the robot runs what it must do: it obeys exactly the frames that the console sealed in the
//! session that counts, each newer than the last.

use std::collections::HashSet;

use control::protocol::radio::{self, Downlink, LONGEST};
use control::protocol::secure::{Accepted, Caller, Key, Nonce, Rejected, Sealer, SessionReceiver};

use crate::air::{Frames, KEY, MOST_FRAMES, Nonces, OTHER_KEY, console_nonce, robot_nonce};
use crate::bytes::Bytes;

/// Names a session: the console's nonce and the robot's.
type Session = ([u8; 8], [u8; 8]);

#[derive(Clone, Debug)]
enum Made {
    Hello { console: [u8; 8] },
    Downlink { session: Session, counter: u32, body: Vec<u8> },
}

/// Runs the commands.
pub fn air_robot(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let mut air = Air::new();
    while air.frames.len() < MOST_FRAMES
        && let Some(command) = bytes.next()
    {
        air.step(command, &mut bytes);
    }
}

/// A session that counts, and the counter that is new enough in it.
struct Present {
    session: Session,
    expected: u32,
}

struct Air {
    receiver: SessionReceiver,
    nonces: Nonces,
    caller: Caller,
    sealer: Option<(Sealer, Session)>,
    welcome: Option<Vec<u8>>,
    robot: Option<Sealer>,
    frames: Frames<Made>,
    present: Option<Present>,
    /// The nonce that the robot answers every call with, until a session begins with it.
    offered: Option<[u8; 8]>,
    obeyed: HashSet<(Session, u32)>,
}

impl Air {
    fn new() -> Self {
        let mut nonces = Nonces::default();
        let caller = Caller::new(KEY, nonces.fresh());
        let receiver = SessionReceiver::new(KEY);
        let mut air = Self {
            receiver,
            nonces,
            caller,
            sealer: None,
            welcome: None,
            robot: None,
            frames: Frames::new(),
            present: None,
            offered: None,
            obeyed: HashSet::new(),
        };
        // Most inputs are about a session that lives.
        air.call();
        air.answered();
        air
    }

    fn step(&mut self, command: u8, bytes: &mut Bytes) {
        match command % 12 {
            0..=2 => {
                if let Some(frame) = self.downlink(bytes) {
                    self.deliver(&frame);
                }
            }
            // Lost, or late.
            3 => drop(self.downlink(bytes)),
            4 => {
                self.caller = Caller::new(KEY, self.nonces.fresh());
                self.call();
            }
            5 => self.call(),
            6 => self.answered(),
            7 => self.outsider(OTHER_KEY, bytes),
            8 => self.reflect(),
            _ => {
                let frame = self.frames.attack(bytes);
                self.deliver(&frame);
            }
        }
    }

    fn call(&mut self) {
        let hello = self.caller.hello();
        self.frames.keep(&hello, Some(Made::Hello { console: console_nonce(&hello) }));
        self.deliver(&hello);
    }

    /// The console hears the robot's answer. It ends its call with it: the same session never begins twice.
    fn answered(&mut self) {
        let Some(welcome) = self.welcome.take() else { return };
        match self.caller.welcomed(&welcome) {
            Ok((sealer, _)) => {
                let session = (console_nonce(&welcome), robot_nonce(&welcome));
                if self.sealer.as_ref().is_none_or(|(_, before)| *before != session) {
                    self.sealer = Some((sealer, session));
                }
            }
            Err(error) => assert_eq!(error, Rejected::Outdated, "the robot's own answer"),
        }
    }

    fn downlink(&mut self, bytes: &mut Bytes) -> Option<Vec<u8>> {
        let (sealer, session) = self.sealer.as_mut()?;
        let downlink: Downlink = bytes.message().unwrap_or(Downlink::Stop);
        let mut buffer = [0; LONGEST];
        let (frame, counter) = sealer.seal(&downlink, &mut buffer).expect("an order fits");
        self.frames.keep(frame, Some(Made::Downlink { session: *session, counter, body: plain(&downlink) }));
        Some(frame.to_vec())
    }

    /// A console and a robot of another pairing, whom the robot hears.
    fn outsider(&mut self, key: Key, bytes: &mut Bytes) {
        let caller = Caller::new(key.clone(), self.nonces.fresh());
        let mut receiver = SessionReceiver::new(key);
        let Ok(Accepted::Hello(welcome)) = receiver.accept::<Downlink>(&caller.hello(), || self.nonces.fresh()) else {
            panic!("a good call")
        };
        let (mut sealer, _) = caller.welcomed(&welcome).expect("a good answer");
        let mut buffer = [0; LONGEST];
        let downlink: Downlink = bytes.message().unwrap_or(Downlink::Stop);
        let (downlink, _) = sealer.seal(&downlink, &mut buffer).expect("an order fits");
        for frame in [&caller.hello()[..], &welcome, downlink] {
            self.frames.keep(frame, None);
            self.deliver(frame);
        }
    }

    /// The robot hears what it says itself.
    fn reflect(&mut self) {
        let mut buffer = [0; LONGEST];
        let uplink = radio::Uplink {
            uptime_ms: 1,
            echo: radio::Echo::default(),
            report: radio::Report::Status(radio::Status::default()),
        };
        if let Some(robot) = &mut self.robot
            && let Ok((frame, _)) = robot.seal(&uplink, &mut buffer)
        {
            self.frames.keep(frame, None);
            self.deliver(frame);
        }
    }

    /// A frame comes to the robot, and what it does is what it must do.
    fn deliver(&mut self, frame: &[u8]) {
        let mut offered = None;
        let heard = self.receiver.accept::<Downlink>(frame, || {
            let nonce = self.nonces.fresh();
            offered = Some(nonce);
            nonce
        });
        match self.frames.made(frame) {
            None => assert!(heard.is_err(), "obeyed what nobody sealed: {heard:?}"),
            Some(Made::Hello { console }) => {
                let Ok(Accepted::Hello(welcome)) = heard else { panic!("a good call got {heard:?}") };
                self.hello(console, offered, &welcome);
            }
            Some(Made::Downlink { session, counter, body }) => {
                self.accepted(session, counter, &body, heard);
            }
        }
    }

    fn hello(&mut self, console: [u8; 8], fresh: Option<Nonce>, welcome: &[u8]) {
        assert_eq!(console_nonce(welcome), console, "the answer to another call");
        match (self.offered, fresh) {
            (Some(offered), None) => assert_eq!(offered, robot_nonce(welcome), "another answer before a session began"),
            (Some(_), Some(_)) => panic!("a call has displaced what was offered"),
            (None, fresh) => assert!(fresh.is_some(), "a session without a nonce of the robot"),
        }
        self.offered = Some(robot_nonce(welcome));
        self.welcome = Some(welcome.to_vec());
    }

    fn accepted(&mut self, session: Session, counter: u32, body: &[u8], heard: Result<Accepted<Downlink>, Rejected>) {
        let expected = match &self.present {
            Some(present) if present.session == session => Some((present.expected, false)),
            _ if self.offered == Some(session.1) => Some((0, true)),
            _ => None,
        };
        let Some((expected, begins)) = expected.filter(|(expected, _)| counter >= *expected) else {
            assert!(heard.is_err(), "order {counter} of session {session:?} was obeyed, and is over: {heard:?}");
            return;
        };
        let Ok(Accepted::Downlink { downlink, began }) = heard else { panic!("a good order got {heard:?}") };
        assert_eq!((downlink.counter, downlink.missing), (counter, counter - expected));
        assert_eq!(plain(&downlink.body), body, "another order than was sealed: {:?}", downlink.body);
        assert!(self.obeyed.insert((session, counter)), "order {counter} was obeyed twice");
        assert_eq!(began.is_some(), begins, "a session that lives does not begin");
        if let Some(key) = began {
            self.robot = Some(Sealer::robot(key));
            self.offered = None;
        }
        self.present = Some(Present { session, expected: counter + 1 });
    }
}

/// As bytes: a NaN is not equal to itself.
fn plain(downlink: &Downlink) -> Vec<u8> {
    postcard::to_slice(downlink, &mut [0; LONGEST]).expect("short").to_vec()
}
