//! What a board gives the tasks. One file a board in `firmware/src/board/`, and one for the host in `testbed/`.

use control::protocol::radio::Reset;
use control::protocol::secure::Nonce;
use control::{Actuation, AdcCode};

pub use control::protocol::dongle::{Address, Payload, RadioKey};

/// The analogue inputs. Codes are those of the converter's curve in the robot file, whatever the chip's own calibration.
/// A conversion blocks for its few microseconds; should it never end, the watchdog ends it.
pub trait Converter {
    /// One conversion of the wiper.
    fn angle(&mut self) -> AdcCode;
    /// One conversion of the second sensor's wiper; `None` on a board without one.
    fn second(&mut self) -> Option<AdcCode> {
        None
    }
    /// One conversion of the battery's divider.
    fn battery(&mut self) -> AdcCode;
}

/// The H-bridge.
pub trait Bridge {
    /// Drives it; `Actuation::OFF` opens every switch.
    fn apply(&mut self, actuation: Actuation);
}

/// Timeout of the hardware watchdog: time without a feed after which it resets the chip.
///
/// Each is as short as the longest pause that is no fault. The RTC's own oscillator counts it, which drifts with temperature and
/// supply: allow for a third.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WatchdogTimeout {
    /// The bridge is on. Nothing legitimate keeps the control loop out for as much as a period: flash is written with the bridge
    /// off only, and what masks interrupts (critical sections of the radio, transactions on the analogue bus, a queue's copy) takes
    /// some ten microseconds. Forty periods are what the rest is not worth arguing about: the motor turns by a third of a turn.
    Driving,
    /// The bridge is off. The longest legitimate pause is the erasing of one sector of flash, for which the chip stands still: 45 ms,
    /// at most 400 ms (W25Q32JV data sheet, tSE), plus what the oscillator may be off.
    Resting,
    /// Nothing feeds it yet, or nothing will: the radio starts (calibration, 0.2 s), six sectors of a damaged store are mended (each
    /// up to 400 ms), or the cause of a panic is printed. The bridge is off.
    Starting,
}

impl WatchdogTimeout {
    /// Timeout, µs.
    #[must_use]
    pub const fn us(self) -> u64 {
        match self {
            Self::Driving => 40_000,
            Self::Resting => 800_000,
            Self::Starting => 5_000_000,
        }
    }
}

/// The hardware watchdog, armed with [`WatchdogTimeout::Starting`] before the tasks start. One task alone feeds it: the robot's control
/// loop, or the dongle's guard.
pub trait Watchdog {
    /// Changes how long it waits; where that is a change, it counts anew from here. Before the bridge is switched on, and after it
    /// is off.
    fn expect(&mut self, patience: WatchdogTimeout);
    /// Puts its end off.
    fn feed(&mut self);
}

/// The status LED.
pub trait Led {
    /// Switches the LED.
    fn set(&mut self, on: bool);
}

/// A radio message that came in.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// Source address. It is not authenticated.
    pub from: Address,
    /// Strength of the signal, dBm.
    pub rssi: i8,
    /// Payload, at most 250 bytes.
    pub payload: Payload,
}

/// The receiving half of the radio.
pub trait Receiver {
    /// Waits for the next message.
    fn receive(&mut self) -> impl Future<Output = Received>;
}

/// What became of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    /// The other radio acknowledged it. A broadcast was sent.
    Acknowledged,
    /// It was sent, and nobody acknowledged it; or the radio does not know whom it is for.
    Unheard,
    /// The driver did not take it: it has no buffer left.
    Refused,
}

/// The sending half of the radio.
pub trait Sender {
    /// Sends and waits until the radio is done with it. The future is awaited to its end, or nothing is sent any more until the
    /// radio has been reset: a dropped one leaves the driver waiting for a callback that would be taken for the next message's.
    /// [`Bounded`](crate::bounded::Bounded) sees to that.
    fn send(&mut self, to: &Address, payload: &[u8]) -> impl Future<Output = Sent>;
}

/// What the radio's driver knows of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Readings {
    /// Frames longer than any of ours, dropped where they came in.
    pub too_long: u32,
    /// Frames dropped because the receiving task did not keep up.
    pub overrun: u32,
    /// The least that was free of the radio's memory since boot, bytes; 0 where it is not known.
    pub heap_least_free: u32,
}

/// The radio's driver, asked how it is.
pub trait Gauge {
    /// Reads the driver's counters.
    fn read(&self) -> Readings;
}

/// ESP-NOW's own encryption, on the sending half.
pub trait Encryption {
    /// The primary master key; forgets everybody who was met.
    fn primary(&mut self, key: &RadioKey);
    /// From now on messages to and from an address are encrypted with its local master key; false where the radio's list is
    /// full.
    fn meet(&mut self, address: &Address, local: &RadioKey) -> bool;
}

/// The chip's source of randomness.
pub trait Entropy {
    /// What nobody can guess.
    fn nonce(&mut self) -> Nonce;
}

/// The processor's reset.
pub trait Restart {
    /// Boots, and tells why afterwards; the bridge is open from then on.
    fn restart(&mut self, why: Reset) -> !;
}
