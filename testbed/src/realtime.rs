//! The bench behind a pseudo-terminal, in real time: to a program it is a dongle on a serial port.

use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use std::thread::JoinHandle;
use std::time::Duration;

use control::protocol::pairing::Pairing;
use hal_sim::body::Snapshot;
use robot_file::Robot;

use crate::injected_event::InjectedEvent;

/// What is simulated.
#[derive(Clone, Debug)]
pub struct Options {
    /// How many robots; as many as there are keys where those are given.
    pub robots: usize,
    /// Of everything that is drawn.
    pub seed: u64,
    /// Whom each robot obeys. Empty: keys from the seed, see [`crate::setup::pairing`].
    pub pairings: Vec<Option<Pairing>>,
    /// What happens, and when, since the start.
    pub injected_events: Vec<(Duration, InjectedEvent)>,
    /// Whether the robots stand on the ground with their bodies; otherwise their motors are alone.
    pub on_ground: bool,
    /// Who is told how the bodies move, [`BODY_RATE_HZ`] times a second of the bench's time: a snapshot a robot.
    pub watcher: Option<Sender<Vec<Snapshot>>>,
}

/// Of [`Options::watcher`].
pub const BODY_RATE_HZ: f64 = 100.0;

impl Default for Options {
    fn default() -> Self {
        Self { robots: 1, seed: 1, pairings: Vec::new(), injected_events: Vec::new(), on_ground: false, watcher: None }
    }
}

/// How the robots stand, as their LEDs and bridges show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotStatus {
    /// State and fault; nothing where the robot has no supply.
    pub state: Option<(control::State, Option<control::Fault>)>,
    /// What the bridge is told.
    pub actuation: control::Actuation,
    /// Ticks so far that drove.
    pub driven: u64,
}

/// A bench on a thread of its own. It ends when this is dropped.
#[derive(Debug)]
pub struct Simulation {
    port: PathBuf,
    orders: Option<Sender<ThreadMessage>>,
    thread: Option<JoinHandle<()>>,
}

enum ThreadMessage {
    Apply(InjectedEvent),
    Look(Sender<Vec<RobotStatus>>),
}

impl Simulation {
    /// The serial device at which a program finds the dongle.
    #[must_use]
    pub fn port(&self) -> &Path {
        &self.port
    }

    /// Lets something happen now. Nothing does after the plug was pulled.
    pub fn apply(&self, injected_event: InjectedEvent) {
        self.tell(ThreadMessage::Apply(injected_event));
    }

    /// How the robots stand; nothing where the simulation has ended.
    #[must_use]
    pub fn robots(&self) -> Vec<RobotStatus> {
        let (asked, answer) = std::sync::mpsc::channel();
        self.tell(ThreadMessage::Look(asked));
        answer.recv().unwrap_or_default()
    }

    /// Pulls the plug: the device goes, and with it the bench.
    pub fn unplug(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the bench has been printed.
            let _ = thread.join();
        }
    }

    fn tell(&self, order: ThreadMessage) {
        if let Some(orders) = &self.orders {
            // It has ended: there is nobody to tell.
            let _ = orders.send(order);
        }
    }
}

impl Drop for Simulation {
    fn drop(&mut self) {
        self.unplug();
    }
}

#[cfg(not(unix))]
impl Simulation {
    /// Not on this system: it has no pseudo-terminals.
    ///
    /// # Errors
    /// Always.
    pub fn start(_file: &Robot, _options: Options) -> std::io::Result<Self> {
        use std::io;
        let why = "a simulated serial port needs the pseudo-terminals of Unix (Linux, macOS): use it there";
        Err(io::Error::new(io::ErrorKind::Unsupported, why))
    }
}

#[cfg(unix)]
mod unix {
    use std::io::{self, ErrorKind, Read, Write};
    use std::path::PathBuf;
    use std::sync::mpsc::{Receiver, TryRecvError, channel};
    use std::time::{Duration, Instant};

    use serialport::{SerialPort, TTYPort};

    use super::{BODY_RATE_HZ, Options, Robot, RobotStatus, Sender, Simulation, Snapshot, ThreadMessage};
    use crate::bench::Bench;
    use crate::event_log::Detail;
    use crate::setup::Setup;

    /// How long a look at the line waits for bytes.
    const LOOK: Duration = Duration::from_millis(1);
    /// Virtual time at most between two looks: a thread that was kept off catches up and yet hears who says stop.
    const STRIDE_US: u64 = 20_000;

    impl Simulation {
        /// Starts it. The thread catches up with real time where it fell behind.
        ///
        /// # Errors
        /// The robot file makes no bench, or there is no pseudo-terminal.
        pub fn start(file: &Robot, options: Options) -> io::Result<Self> {
            let setup = setup(file, &options)?;
            // A pair of them is in raw mode.
            let (mut far, near) = TTYPort::pair()?;
            far.set_timeout(LOOK)?;
            let port =
                near.name().map(PathBuf::from).ok_or_else(|| io::Error::other("the pseudo-terminal has no name"))?;
            let (orders, ordered) = channel();
            let thread = std::thread::Builder::new().name("bench".to_owned()).spawn(move || {
                let mut bench = Bench::new(setup);
                for (at, injected_event) in options.injected_events {
                    bench.at(at.as_micros() as u64, injected_event);
                }
                // The near end stays open between one program's use of it and the next one's.
                let _near = near;
                let mut watch = Watch { watcher: options.watcher, due_us: 0 };
                keep_pace(&mut bench, &mut far, &ordered, &mut watch);
            })?;
            Ok(Self { port, orders: Some(orders), thread: Some(thread) })
        }
    }

    fn setup(file: &Robot, options: &Options) -> io::Result<Setup> {
        let robots = if options.pairings.is_empty() { options.robots } else { options.pairings.len() };
        let mut setup = Setup::new(file, robots, options.seed).map_err(io::Error::other)?;
        if options.on_ground {
            setup = setup.on_ground(file).map_err(io::Error::other)?;
        }
        setup.detail = Detail::Nothing;
        for (member, pairing) in setup.robots.iter_mut().zip(&options.pairings) {
            member.pairing.clone_from(pairing);
        }
        // A console that was given its keys expects its own dongle.
        let console = options.pairings.iter().flatten().next().map(|pairing| pairing.console);
        if let (Some(dongle), Some(console)) = (&mut setup.dongle, console) {
            dongle.address = console;
        }
        Ok(setup)
    }

    /// Who is told of the bodies, and when next.
    struct Watch {
        watcher: Option<Sender<Vec<Snapshot>>>,
        due_us: u64,
    }

    impl Watch {
        /// Runs the bench to a time, µs, and tells of the bodies on the way.
        fn run(&mut self, bench: &mut Bench, end_us: u64) {
            while let Some(watcher) = self.watcher.as_ref().filter(|_| self.due_us <= end_us) {
                bench.run_until(self.due_us);
                let snapshots = bench.robots.iter().filter_map(crate::robot::Robot::snapshot).collect();
                // Nobody looks any more: the robots go on.
                if watcher.send(snapshots).is_err() {
                    self.watcher = None;
                }
                self.due_us += (1e6 / BODY_RATE_HZ) as u64;
            }
            bench.run_until(end_us);
        }
    }

    /// Until nobody holds the other end of the commands, or the pseudo-terminal fails.
    fn keep_pace(bench: &mut Bench, far: &mut TTYPort, ordered: &Receiver<ThreadMessage>, watch: &mut Watch) {
        let start = Instant::now();
        let mut bytes = [0; 4096];
        // What the pseudo-terminal had no room for, as nobody reads: the dongle waits then, like a real one.
        let mut waiting: Vec<u8> = Vec::new();
        loop {
            match ordered.try_recv() {
                Ok(ThreadMessage::Apply(injected_event)) => bench.apply(injected_event),
                Ok(ThreadMessage::Look(asked)) => drop(asked.send(statuses(bench))),
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return,
            }
            let Some(line) = bench.dongle.as_ref().map(|dongle| dongle.line.clone()) else { return };
            match far.read(&mut bytes) {
                // What does not fit is lost, as on a chip's own serial line.
                Ok(count) => drop(line.write(&bytes[..count])),
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                Err(_) => return,
            }
            let due_us = start.elapsed().as_micros() as u64;
            if bench.now_us() < due_us {
                watch.run(bench, due_us.min(bench.now_us() + STRIDE_US));
            }
            if waiting.is_empty() {
                match line.read(&mut bytes) {
                    Ok(count) => waiting.extend(&bytes[..count]),
                    // The cable was unplugged on the bench: so it is here.
                    Err(_) => return,
                }
            }
            if waiting.is_empty() {
                continue;
            }
            match far.write(&waiting) {
                Ok(count) => drop(waiting.drain(..count)),
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => {}
                Err(_) => return,
            }
        }
    }

    fn statuses(bench: &Bench) -> Vec<RobotStatus> {
        let standing = |robot: &crate::robot::Robot| RobotStatus {
            state: robot.state(),
            actuation: robot.actuation(),
            driven: robot.plant(|plant| plant.driven()),
        };
        bench.robots.iter().map(standing).collect()
    }
}
