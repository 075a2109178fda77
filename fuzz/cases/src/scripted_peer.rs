//! A console on a serial line with a dongle and one robot that say what the bytes tell them to.

use std::cell::{RefCell, RefMut};
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::rc::Rc;
use std::time::Duration;

use control::protocol::VERSION;
use control::protocol::dongle::{Address, FromDongle, Payload, ToDongle};
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::pairing::Pairing;
use control::protocol::radio::{self, Downlink, Uplink};
use control::protocol::secure::{Accepted, Sealer, SessionReceiver};
use link::{Keys, KnownRobot, Line, Session};
use scram::console::Engine;

use crate::air::{KEY, Nonces};

/// Address of the robot.
pub const ROBOT: Address = [0x7c, 0xdf, 0xa1, 0, 0x11, 0x22];
const DONGLE: Address = [2, 0, 0, 0, 0, 1];
/// What a read waits.
const READ: Duration = Duration::from_millis(2);

/// Far end of the serial line: a dongle and a robot that follow the script in the input's bytes.
pub struct ScriptedPeer {
    now: Duration,
    to_host: VecDeque<u8>,
    from_host: Deframer,
    receiver: SessionReceiver,
    robot: Option<Sealer>,
    nonces: Nonces,
}

impl ScriptedPeer {
    fn new() -> Self {
        Self {
            now: Duration::ZERO,
            to_host: VecDeque::new(),
            from_host: Deframer::default(),
            receiver: SessionReceiver::new(KEY),
            robot: None,
            nonces: Nonces::default(),
        }
    }

    /// Delivers raw bytes to the host.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.to_host.extend(bytes);
    }

    /// Delivers a well-formed frame of the dongle to the host.
    pub fn dongle(&mut self, message: &FromDongle) {
        let mut buffer = [0; LONGEST + 1];
        self.to_host.extend(encode(message, &mut buffer).expect("every message fits"));
    }

    /// Delivers a radio frame of the robot to the host.
    pub fn radio(&mut self, frame: &[u8]) {
        let payload = Payload::from_slice(&frame[..frame.len().min(radio::LONGEST)]).expect("cut to length");
        self.dongle(&FromDongle::Received { from: ROBOT, rssi: -60, payload });
    }

    /// What the robot tells, once a session lives.
    pub fn robot(&mut self, uplink: &Uplink) {
        let mut buffer = [0; radio::LONGEST];
        let frame = self.robot.as_mut().and_then(|robot| robot.seal(uplink, &mut buffer).ok());
        if let Some((frame, _)) = frame {
            let frame = frame.to_vec();
            self.radio(&frame);
        }
    }

    /// Advances the clock.
    pub fn wait(&mut self, time: Duration) {
        self.now += time;
    }

    fn hear(&mut self, message: ToDongle) {
        match message {
            ToDongle::Hello => {
                self.dongle(&FromDongle::Hello { version: VERSION, address: DONGLE, channel: 1 });
            }
            ToDongle::Send { number, to, payload } => {
                self.dongle(&FromDongle::Sent { number, acknowledged: true });
                if to == ROBOT {
                    self.order(&payload);
                }
            }
            ToDongle::Count | ToDongle::Primary(_) | ToDongle::Meet { .. } => {}
        }
    }

    fn order(&mut self, frame: &[u8]) {
        match self.receiver.accept::<Downlink>(frame, || self.nonces.fresh()) {
            Ok(Accepted::Hello(welcome)) => self.radio(&welcome),
            Ok(Accepted::Downlink { began: Some(key), .. }) => self.robot = Some(Sealer::robot(key)),
            Ok(Accepted::Downlink { .. }) => {}
            Err(error) => panic!("the console's own frame is {error:?}"),
        }
    }
}

/// The console's end of the line, and a hold on the other.
#[derive(Clone)]
pub struct Cable(Rc<RefCell<ScriptedPeer>>);

impl Cable {
    /// What is at the far end.
    pub fn scripted_peer(&self) -> RefMut<'_, ScriptedPeer> {
        self.0.borrow_mut()
    }
}

impl Read for Cable {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut scripted_peer = self.scripted_peer();
        scripted_peer.now += READ;
        if scripted_peer.to_host.is_empty() {
            Err(ErrorKind::TimedOut.into())
        } else {
            scripted_peer.to_host.read(buffer)
        }
    }
}

impl Write for Cable {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut scripted_peer = self.scripted_peer();
        for byte in bytes {
            if let Some(message) = scripted_peer.from_host.push(*byte) {
                scripted_peer.hear(message.expect("the console's own frame"));
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for Cable {
    fn now(&self) -> Duration {
        self.0.borrow().now
    }
}

/// A console, its robot not heard yet, and its cable.
pub fn console() -> (Engine<Cable>, Cable) {
    let pairing = Pairing { console: DONGLE, primary: [1; 16], local: [2; 16], key: KEY };
    let keys = Keys::of([1; 16], vec![KnownRobot { name: "one".to_owned(), address: ROBOT, pairing }]);
    let mut nonces = Nonces::default();
    let cable = Cable(Rc::new(RefCell::new(ScriptedPeer::new())));
    let session = Session::open(cable.clone(), &keys, Box::new(move || nonces.fresh()), Duration::from_secs(1));
    (Engine::new(session.expect("the dongle answers"), "any"), cable)
}
