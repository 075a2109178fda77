//! A console's session with simulated robots, in virtual time. What ends a console can happen to it: it falls silent, it is
//! killed, it sleeps.

use std::cell::Cell;
use std::io::{self, ErrorKind, Read, Write};
use std::rc::Rc;
use std::time::Duration;

use control::protocol::radio::Request;
use control::protocol::secure::Nonce;
use control::{Command, Parameters, State};
use link::{Event, Heard, Keys, KnownRobot, Line, LinkError, Outcome, RobotId, Session};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use robot_file::Robot;
use testbed::bench::Bench;
use testbed::event_log::Detail;
use testbed::host_end::HostEnd;
use testbed::serial::Cable;
use testbed::setup::{Setup, fine};

/// A healthy dongle and healthy robots answer within this time.
const PATIENCE: Duration = Duration::from_secs(3);

/// What is put on every bench, but for the seed: the controller is designed once.
#[derive(Clone, Debug)]
pub struct Template {
    file: Robot,
    setup: Setup,
}

impl Template {
    /// So many robots of a file.
    ///
    /// # Panics
    /// The file makes no bench: there is nothing to measure then.
    #[must_use]
    pub fn new(file: &Robot, robots: usize, detail: Detail) -> Self {
        let mut setup = Setup::new(file, robots, 1).unwrap_or_else(|error| panic!("{error}"));
        setup.detail = detail;
        Self { file: file.clone(), setup }
    }

    /// With a seed for everything that is drawn.
    #[must_use]
    pub fn seeded(&self, seed: u64) -> Setup {
        let mut setup = self.setup.clone();
        setup.seed = seed;
        for (index, member) in (0_u64..).zip(&mut setup.robots) {
            member.simulated = fine(&self.file, seed.wrapping_mul(101).wrapping_add(index)).into();
        }
        setup
    }

    /// What the robots' firmware is built with.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        self.setup.robots[0].settings.parameters
    }
}

/// The line to the dongle, which can be closed from this side.
#[derive(Clone)]
pub struct Cord {
    end: HostEnd,
    closed: Rc<Cell<bool>>,
}

impl Cord {
    fn open(&self) -> io::Result<()> {
        if self.closed.get() { Err(io::Error::from(ErrorKind::NotConnected)) } else { Ok(()) }
    }
}

impl Read for Cord {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.open()?;
        self.end.read(buffer)
    }
}

impl Write for Cord {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.open()?;
        self.end.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for Cord {
    fn now(&self) -> Duration {
        self.end.now()
    }
}

/// A console with its dongle and robots.
pub struct Rig {
    /// The console's session.
    pub session: Session<Cord>,
    /// The bench and its time.
    pub end: HostEnd,
    cord: Cord,
}

impl Rig {
    /// A session with a dongle that has just been switched on.
    ///
    /// # Panics
    /// The dongle does not answer.
    #[must_use]
    pub fn new(setup: Setup) -> Self {
        let known = setup.robots.iter().map(|member| KnownRobot {
            name: member.settings.name.as_str().to_owned(),
            address: member.address,
            pairing: member.pairing.clone().expect("every robot of a setup is paired"),
        });
        let known: Vec<KnownRobot> = known.collect();
        let keys = Keys::of(known[0].pairing.primary, known);
        let mut random = Pcg64::seed_from_u64(setup.seed);
        let end = HostEnd::new(Bench::new(setup));
        let cord = Cord { end: end.clone(), closed: Rc::default() };
        let nonces = Box::new(move || Nonce(random.random()));
        let session = Session::open(cord.clone(), &keys, nonces, PATIENCE).expect("a healthy dongle");
        Self { session, end, cord }
    }

    /// Waits for every robot.
    ///
    /// # Panics
    /// One does not come.
    pub fn meet(&mut self) {
        let start = self.session.now();
        let met =
            |session: &Session<Cord>| session.robots().all(|(_, robot)| robot.is_present() && robot.status().is_some());
        while !met(&self.session) {
            assert!(self.session.now() - start < PATIENCE, "a robot does not come");
            self.poll().expect("a healthy line");
        }
    }

    /// Commands something and waits for its end.
    ///
    /// # Panics
    /// The line breaks.
    pub fn ask(&mut self, robot: usize, request: Request) -> Outcome {
        self.session.ask(RobotId(robot), request, |_| {}).expect("a healthy line")
    }

    /// A person clears the fault of a robot that has just started, and commands something: repeatedly, until it is done.
    ///
    /// # Panics
    /// The robot refuses.
    pub fn order(&mut self, robot: usize, command: Command) {
        for command in [Command::ClearFault, command] {
            let done = (0..20).any(|_| {
                matches!(self.ask(robot, Request::Command(command)), Outcome::Done(_)) || {
                    self.meet();
                    false
                }
            });
            assert!(done, "{command:?} is refused");
        }
    }

    /// One look at the line.
    ///
    /// # Errors
    /// The line broke, or the dongle is silent.
    pub fn poll(&mut self) -> Result<Option<Heard>, LinkError> {
        self.session.poll()
    }

    /// Polls for a time.
    ///
    /// # Panics
    /// The line breaks.
    pub fn run(&mut self, time: Duration) {
        let end = self.session.now() + time;
        while self.session.now() < end {
            self.poll().expect("a healthy line");
        }
    }

    /// Polls until a robot that was told to stop says so; whether it did.
    ///
    /// # Panics
    /// The line breaks.
    pub fn wait_for_stop(&mut self, robot: usize) -> bool {
        let start = self.session.now();
        while self.session.now() - start < PATIENCE {
            match self.poll().expect("a healthy line") {
                Some(Heard { robot: RobotId(of), event: Event::Stopped, .. }) if of == robot => return true,
                _ if !self.session.robot(RobotId(robot)).is_stopping() => return false,
                _ => {}
            }
        }
        false
    }

    /// The console is killed: not a word more, and nobody reads the line.
    pub fn kill(&self) {
        self.cord.closed.set(true);
        if let Some(dongle) = &self.end.bench().dongle {
            dongle.line.plug(Cable::Idle);
        }
    }

    /// State of a robot as its LED shows it; nothing without supply.
    #[must_use]
    pub fn state(&self, robot: usize) -> Option<State> {
        self.end.bench().robots[robot].state().map(|(state, _)| state)
    }
}
