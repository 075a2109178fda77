//! What passes between the host and the dongle, a radio on a USB serial line.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::radio;

/// A radio address.
pub type Address = [u8; 6];
/// A radio message as bytes.
pub type Payload = Vec<u8, { radio::LONGEST }>;

/// From the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(clippy::large_enum_variant, reason = "there is no heap, and few messages exist at a time")]
pub enum ToDongle {
    /// Who is there?
    Hello,
    /// Send a radio message; answered by `Sent` of the same number.
    Send {
        /// Chosen by the host.
        number: u16,
        /// To whom.
        to: Address,
        /// What.
        payload: Payload,
    },
    /// Tell the counters.
    Count,
}

/// To the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(clippy::large_enum_variant, reason = "there is no heap, and few messages exist at a time")]
pub enum FromDongle {
    /// To `Hello`, at boot, and when the host reads again after it had stopped.
    Hello {
        /// [`super::VERSION`] of the dongle.
        version: u16,
        /// Its own address.
        address: Address,
        /// Radio channel.
        channel: u8,
    },
    /// A radio message came in.
    Received {
        /// From whom.
        from: Address,
        /// Strength of the signal, dBm.
        rssi: i8,
        /// What.
        payload: Payload,
    },
    /// What became of a message.
    Sent {
        /// The host's number.
        number: u16,
        /// The other radio acknowledged it. That says nothing about the program behind it. False, too, when the dongle
        /// never sent it: see [`Counters::send_dropped`].
        acknowledged: bool,
    },
    /// To `Count`.
    Counted(Counters),
}

/// What the dongle counts, since boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Radio messages received.
    pub received: u32,
    /// Radio messages dropped because the host did not read.
    pub received_dropped: u32,
    /// Radio messages sent and acknowledged.
    pub sent: u32,
    /// Radio messages sent and not acknowledged.
    pub send_failed: u32,
    /// Messages of the host dropped because the radio did not keep up.
    pub send_dropped: u32,
    /// `Sent` dropped because the host did not read.
    pub answers_dropped: u32,
    /// Frames of the host that could not be read.
    pub bad_frames: u32,
}
