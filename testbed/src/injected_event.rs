//! Events that can be injected into a simulated bench.

use control::protocol::radio::Reset;
use hal_sim::Fault;
use hal_sim::radio::Trouble;

use crate::serial::Cable;

/// Event that a test or a person injects. Robots by their index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InjectedEvent {
    /// A robot's motor, sensor or supply breaks.
    Fault(usize, Fault),
    /// A robot's battery falls out.
    PowerCut(usize),
    /// A robot is reset and boots, whatever it does at the time.
    Boot(usize, Reset),
    /// A robot's control loop is held up in its next tick for this time, µs: a tick overrun.
    ProcessorHold(usize, u64),
    /// Something with a higher priority keeps the control loop out for this time from now on, µs.
    Busy(usize, u64),
    /// A robot's ticks come late by at most this time from now on, µs; 0 ends it.
    Jitter(usize, u64),
    /// Steps a robot's clock, µs.
    Leap(usize, i64),
    /// A robot is put elsewhere, m from the dongle.
    Place(usize, f64),
    /// Delays the callbacks of a robot's radio from now on, µs.
    SlowRadio(usize, u64),
    /// A robot's radio never calls back any more, until its processor is reset: a send that does not end.
    RadioStuck(usize),
    /// A robot's radio has no buffer left for anything to send, until its processor is reset.
    RadioFull(usize),
    /// The dongle's processor stands still for good, and its watchdog with it.
    DongleHangs,
    /// The dongle's program comes to nothing any more; its watchdog is left.
    DongleSpins,
    /// The dongle's radio never calls back any more, until its processor is reset.
    DongleRadioStuck,
    /// The dongle's radio has no buffer left for anything to send, until its processor is reset.
    DongleRadioFull,
    /// The dongle is reset and boots.
    DongleBoots,
    /// The dongle's cable.
    Cable(Cable),
    /// The host's reads of the line fail from now on, its writes do not.
    ReadsFail,
    /// The air differs from the robot file from now on.
    Air(Trouble),
    /// Broadcast frames of `length` bytes (at most [`hal_sim::radio::LONGEST_HEARD`]) arrive from now on, with any content
    /// and any source address, one every `every_us`, µs; 0 ends it.
    Flood {
        /// Interval between two frames, µs.
        every_us: u64,
        /// Length of each frame, bytes.
        length: usize,
    },
    /// The adversary forges or replays a frame at this interval from now on, µs; 0 ends it.
    Attack(u64),
}
