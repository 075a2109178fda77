//! Robots on the bench and the keys to them.

use std::time::Duration;

use control::protocol::secure::Nonce;
use link::{Keys, KnownRobot, Session};
use testbed::bench::Bench;
use testbed::host_end::HostEnd;
use testbed::setup::{DONGLE, Setup, address, pairing};

use super::robot;

pub const PATIENCE: Duration = Duration::from_secs(3);

/// Keys of the robots of [`Setup::new`].
pub fn keys(robots: usize, seed: u64) -> Keys {
    let known = |index| KnownRobot {
        name: format!("robot-{index}"),
        address: address(index),
        pairing: pairing(DONGLE, seed, index),
    };
    Keys::of(pairing(DONGLE, seed, 0).primary, (0..robots).map(known).collect())
}

/// Robots and a dongle, and what happens to them.
pub fn bench(robots: usize, seed: u64, prepare: impl FnOnce(&mut Setup)) -> HostEnd {
    let mut setup = Setup::new(&robot(), robots, seed).expect("a bench");
    prepare(&mut setup);
    HostEnd::new(Bench::new(setup))
}

pub fn nonces() -> Box<dyn FnMut() -> Nonce + Send> {
    let mut next = 0_u64;
    Box::new(move || {
        next += 1;
        Nonce(next.to_le_bytes())
    })
}

/// A console on a bench.
pub fn session(line: &HostEnd, robots: usize, seed: u64) -> Session<HostEnd> {
    Session::open(line.clone(), &keys(robots, seed), nonces(), PATIENCE).expect("a dongle")
}
