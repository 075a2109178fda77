//! Once, over a cable: who the robot obeys from now on. The frames are those of [`super::frame`], on the robot's own serial
//! line. Whoever can plug in a cable may pair the robot: it is in their hands.

use heapless::String;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::dongle::{Address, RadioKey};
use super::radio::NAME;
use super::secure::Key;

/// The one console that a robot obeys.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Pairing {
    /// Address of the console's dongle.
    pub console: Address,
    /// ESP-NOW's primary master key, the same for every robot of the console.
    pub primary: RadioKey,
    /// ESP-NOW's local master key, this robot's alone.
    pub local: RadioKey,
    /// What the frames on the air are signed with, this robot's alone.
    pub key: Key,
}

impl core::fmt::Debug for Pairing {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Pairing with {:02x?} (keys secret)", self.console)
    }
}

/// Request to a robot over its USB cable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum PairingRequest {
    /// Who is there?
    Hello,
    /// Obey this console, from the next boot on, and boot.
    Pair(Pairing),
    /// Obey nobody, from the next boot on, and boot.
    Forget,
}

/// Reply of a robot over its USB cable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum PairingReply {
    /// To `Hello`. The layout up to `version` stays for ever.
    Hello {
        /// [`super::VERSION`] of the robot.
        version: u32,
        /// ESP-NOW (MAC) address.
        address: Address,
        /// Its name, from its robot file.
        name: String<NAME>,
        /// Address of the paired console; `None` before pairing.
        console: Option<Address>,
    },
    /// Kept; the robot boots now.
    Kept,
    /// The flash did not keep it: the pairing is as before.
    NotKept,
}
