//! What can happen on a bench.

use control::protocol::radio::Reset;
use hal_sim::Fault;
use hal_sim::radio::Trouble;

use crate::serial::Cable;

/// Something that happens. Robots by their index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Incident {
    /// A robot's motor, sensor or supply breaks.
    Fault(usize, Fault),
    /// A robot's battery falls out.
    PowerCut(usize),
    /// A robot is reset and boots, whatever it does at the time.
    Boot(usize, Reset),
    /// A robot's control loop is held up in its next tick for so long, µs: a tick overrun.
    Hold(usize, u64),
    /// Something below the control loop keeps it out for so long from now on, µs.
    Busy(usize, u64),
    /// From now on a robot's ticks come late by up to so much, µs; 0 ends it.
    Jitter(usize, u64),
    /// A robot's clock leaps by so much, µs.
    Leap(usize, i64),
    /// A robot is put elsewhere, m from the dongle.
    Place(usize, f64),
    /// A robot's radio calls back so much later from now on, µs.
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
    /// From now on somebody sends everybody frames of so many bytes ([`hal_sim::radio::LONGEST_HEARD`] at the most) with any content
    /// and in anybody's name, one every so many µs; 0 ends it.
    Flood {
        /// µs from one to the next.
        every_us: u64,
        /// Bytes of each.
        length: usize,
    },
    /// A second talker forges and replays a frame every so many µs from now on; 0 ends it.
    Attack(u64),
}
