//! Robots in real time on the far end of a pseudo-terminal.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use control::{Fault, State};
use testbed::injected_event::InjectedEvent;
use testbed::realtime::{Options, Simulation};
use testbed::setup::{DONGLE, pairing};

use super::bench::keys;
use super::{robot, robot_file};

/// What [`OnTty`] draws everything from, its keys too.
pub const SEED: u64 = 1;

/// Starts paired robots, with what happens to the first one at once, and puts their keys into `keys.toml` of a directory.
pub fn start(robots: usize, seed: u64, injected_events: &[InjectedEvent], keys_in: &Path) -> Simulation {
    let injected_events = injected_events.iter().map(|injected_event| (Duration::ZERO, *injected_event)).collect();
    let pairings = (0..robots).map(|index| Some(pairing(DONGLE, seed, index))).collect();
    let options = Options { robots, seed, pairings, injected_events, ..Options::default() };
    let simulation = Simulation::start(&robot(), options).expect("a pseudo-terminal");
    keys(robots, seed).save(&keys_in.join("keys.toml")).expect("writes");
    simulation
}

/// Robots in real time behind a serial device, and the keys to them.
pub struct OnTty {
    pub simulation: Simulation,
    pub directory: tempfile::TempDir,
}

impl OnTty {
    /// So many robots that are switched on.
    pub fn new(robots: usize) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        Self { simulation: start(robots, SEED, &[], directory.path()), directory }
    }

    /// What a command of `scram` at these robots begins with; `--out` is not among it.
    pub fn words(&self, command: &str) -> Vec<OsString> {
        let keys = self.directory.path().join("keys.toml");
        let mut words: Vec<OsString> = vec![env!("CARGO_BIN_EXE_scram").into()];
        words.extend(command.split(' ').map(OsString::from));
        words.extend(["--port".into(), self.simulation.port().into(), "--keys".into(), keys.into()]);
        words.extend(["--robot".into(), robot_file().into()]);
        words
    }

    /// A command of `scram` at these robots that writes into their directory.
    pub fn command(&self, command: &str, arguments: &[&str]) -> Command {
        let words = self.words(command);
        let mut program = Command::new(&words[0]);
        program.args(&words[1..]).arg("--out").arg(self.directory.path()).args(arguments);
        program
    }

    /// What was recorded there, the newest.
    pub fn recording(&self) -> PathBuf {
        let listed = std::fs::read_dir(self.directory.path()).expect("a directory");
        let mut files: Vec<PathBuf> = listed.flatten().map(|entry| entry.path()).collect();
        files.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
        files.sort();
        files.pop().expect("a recording")
    }

    /// The state of each robot and why it stands still.
    pub fn states(&self) -> Vec<(State, Option<Fault>)> {
        let booting = (State::Fault, Some(Fault::Restarted));
        self.simulation.robots().iter().map(|robot| robot.state.unwrap_or(booting)).collect()
    }

    /// Waits for what is to come about, and gives how long that took.
    pub fn wait_until(&self, what: &str, holds: impl Fn(&Self) -> bool) -> Duration {
        let start = Instant::now();
        while !holds(self) {
            assert!(start.elapsed() < Duration::from_secs(20), "not within 20 s: {what}; {:?}", self.states());
            std::thread::sleep(Duration::from_millis(5));
        }
        start.elapsed()
    }
}
