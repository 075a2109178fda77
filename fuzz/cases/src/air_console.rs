//! Any sequence of frames at a console: at a call that waits for its answer, and at a session.
//!
//! The bytes are commands, as in [`crate::air_robot`]. The console believes exactly what its robot has sealed in this
//! session, each uplink newer than the last.

use std::collections::HashSet;

use control::protocol::radio::{Downlink, Echo, LONGEST, Report, Status, Uplink};
use control::protocol::secure::{Accepted, Caller, Opened, Opener, Rejected, Sealer, SessionReceiver};

use crate::air::{Frames, KEY, MOST_FRAMES, Nonces, OTHER_KEY, console_nonce, robot_nonce};
use crate::bytes::Bytes;

/// Names a session.
type Session = [u8; 8];

#[derive(Clone, Debug)]
enum Made {
    Welcome { console: [u8; 8], session: Session },
    Uplink { session: Session, counter: u32, body: Vec<u8> },
}

/// Runs the commands.
pub fn air_console(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let mut air = Air::new();
    while air.frames.len() < MOST_FRAMES
        && let Some(command) = bytes.next()
    {
        air.step(command, &mut bytes);
    }
}

struct Live {
    sealer: Sealer,
    opener: Opener,
    session: Session,
    expected: u32,
}

struct Air {
    receiver: SessionReceiver,
    robot: Option<(Sealer, Session)>,
    nonces: Nonces,
    caller: Caller,
    /// The call has no answer yet.
    calling: bool,
    live: Option<Live>,
    frames: Frames<Made>,
    believed: HashSet<(Session, u32)>,
}

impl Air {
    fn new() -> Self {
        let mut nonces = Nonces::default();
        let mut air = Self {
            receiver: SessionReceiver::new(KEY),
            robot: None,
            caller: Caller::new(KEY, nonces.fresh()),
            nonces,
            calling: true,
            live: None,
            frames: Frames::new(),
            believed: HashSet::new(),
        };
        // Most inputs are about a session that lives.
        let welcome = air.call();
        air.deliver(&welcome);
        air.order();
        air
    }

    fn step(&mut self, command: u8, bytes: &mut Bytes) {
        match command % 12 {
            0..=2 => {
                if let Some(frame) = self.tell(bytes) {
                    self.deliver(&frame);
                }
            }
            3 => drop(self.tell(bytes)),
            4 => {
                self.caller = Caller::new(KEY, self.nonces.fresh());
                self.calling = true;
                self.live = None;
                self.call();
            }
            5 => {
                let welcome = self.call();
                self.deliver(&welcome);
            }
            6 => self.order(),
            7 => self.outsider(bytes),
            _ => {
                let frame = self.frames.attack(bytes);
                self.deliver(&frame);
            }
        }
    }

    /// The robot hears the call, as it is or replayed; its answer.
    fn call(&mut self) -> Vec<u8> {
        let Ok(Accepted::Hello(welcome)) =
            self.receiver.accept::<Downlink>(&self.caller.hello(), || self.nonces.fresh())
        else {
            panic!("a good call")
        };
        let (console, session) = (console_nonce(&welcome), robot_nonce(&welcome));
        self.frames.keep(&welcome, Some(Made::Welcome { console, session }));
        welcome.to_vec()
    }

    /// The console commands something, and the robot begins the session with it.
    fn order(&mut self) {
        let Some(live) = &mut self.live else { return };
        let mut buffer = [0; LONGEST];
        let (frame, _) = live.sealer.seal(&Downlink::Stop, &mut buffer).expect("it fits");
        self.frames.keep(frame, None);
        if let Ok(Accepted::Downlink { began: Some(key), .. }) =
            self.receiver.accept::<Downlink>(frame, || panic!("no call"))
        {
            self.robot = Some((Sealer::robot(key), live.session));
        }
    }

    fn tell(&mut self, bytes: &mut Bytes) -> Option<Vec<u8>> {
        let (sealer, session) = self.robot.as_mut()?;
        let uplink = bytes.message().unwrap_or_else(status);
        let mut buffer = [0; LONGEST];
        let (frame, counter) = sealer.seal(&uplink, &mut buffer).expect("every uplink fits");
        self.frames.keep(frame, Some(Made::Uplink { session: *session, counter, body: plain(&uplink) }));
        Some(frame.to_vec())
    }

    /// A robot of another console.
    fn outsider(&mut self, bytes: &mut Bytes) {
        let caller = Caller::new(OTHER_KEY, self.nonces.fresh());
        let mut receiver = SessionReceiver::new(OTHER_KEY);
        let Ok(Accepted::Hello(welcome)) = receiver.accept::<Downlink>(&caller.hello(), || self.nonces.fresh()) else {
            panic!("a good call")
        };
        let mut buffer = [0; LONGEST];
        let uplink: Uplink = bytes.message().unwrap_or_else(status);
        let (uplink, _) = Sealer::robot(OTHER_KEY).seal(&uplink, &mut buffer).expect("every uplink fits");
        for frame in [&welcome[..], uplink] {
            self.frames.keep(frame, None);
            self.deliver(frame);
        }
    }

    /// A frame comes to the console, and what it believes is what it may.
    fn deliver(&mut self, frame: &[u8]) {
        let made = self.frames.made(frame);
        if self.calling {
            self.answer(frame, made.as_ref());
        }
        let Some(live) = &mut self.live else { return };
        let opened = live.opener.open::<Uplink>(frame);
        match made {
            Some(Made::Uplink { session, counter, body }) if session == live.session && counter >= live.expected => {
                let Ok(Opened { body: read, counter: read_counter, missing }) = opened else {
                    panic!("a good uplink got {opened:?}")
                };
                assert_eq!((read_counter, missing), (counter, counter - live.expected));
                assert_eq!(plain(&read), body, "another uplink than was sealed: {read:?}");
                assert!(self.believed.insert((session, counter)), "uplink {counter} was believed twice");
                live.expected = counter + 1;
            }
            _ => assert!(opened.is_err(), "believed what nobody said now: {opened:?}"),
        }
    }

    fn answer(&mut self, frame: &[u8], made: Option<&Made>) {
        let own = console_nonce(&self.caller.hello());
        match (self.caller.welcomed(frame), made) {
            (Ok((sealer, opener)), Some(Made::Welcome { console, session })) if *console == own => {
                self.live = Some(Live { sealer, opener, session: *session, expected: 0 });
                self.calling = false;
            }
            (Ok(_), _) => panic!("an answer that the robot did not give to this call"),
            (Err(error), Some(Made::Welcome { console, .. })) => {
                assert!(*console != own && error == Rejected::Outdated, "the robot's answer got {error:?}");
            }
            (Err(_), _) => {}
        }
    }
}

fn status() -> Uplink {
    Uplink { uptime_ms: 1, echo: Echo::default(), report: Report::Status(Status::default()) }
}

/// As bytes: a NaN is not equal to itself.
fn plain(uplink: &Uplink) -> Vec<u8> {
    postcard::to_slice(uplink, &mut [0; LONGEST]).expect("short").to_vec()
}
