//! Robots in real time on the far end of a pseudo-terminal.

use std::path::Path;
use std::time::Duration;

use testbed::injected_event::InjectedEvent;
use testbed::realtime::{Options, Simulation};
use testbed::setup::{DONGLE, pairing};

use super::bench::keys;
use super::robot;

/// Starts paired robots, with what happens to the first one at once, and puts their keys into `keys.toml` of a directory.
pub fn start(robots: usize, seed: u64, injected_events: &[InjectedEvent], keys_in: &Path) -> Simulation {
    let injected_events = injected_events.iter().map(|injected_event| (Duration::ZERO, *injected_event)).collect();
    let pairings = (0..robots).map(|index| Some(pairing(DONGLE, seed, index))).collect();
    let options = Options { robots, seed, pairings, injected_events, ..Options::default() };
    let simulation = Simulation::start(&robot(), options).expect("a pseudo-terminal");
    keys(robots, seed).save(&keys_in.join("keys.toml")).expect("writes");
    simulation
}
