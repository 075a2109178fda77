//! What a board gives the tasks. One file a board in `firmware/src/board/`, and one for the host in `workbench/`.

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

/// The hardware watchdog, armed before the tasks start. The control loop alone feeds it.
pub trait Watchdog {
    /// Puts its end off.
    fn feed(&mut self);
}

/// The status LED.
pub trait Led {
    /// On or off.
    fn set(&mut self, on: bool);
}

/// A radio message that came in.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// From whom.
    pub from: Address,
    /// Strength of the signal, dBm.
    pub rssi: i8,
    /// What.
    pub payload: Payload,
}

/// The receiving half of the radio.
pub trait Receiver {
    /// Waits for the next message.
    fn receive(&mut self) -> impl Future<Output = Received>;
}

/// The sending half of the radio.
pub trait Sender {
    /// Sends and waits for the radio's acknowledgement; false without one. The future must be awaited to its end: a
    /// dropped one leaves the driver waiting for a callback that belongs to the next message.
    fn send(&mut self, to: &Address, payload: &[u8]) -> impl Future<Output = bool>;
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
    /// Boots; the bridge is open from then on.
    fn restart(&mut self) -> !;
}
