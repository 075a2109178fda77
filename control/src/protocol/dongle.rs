//! What passes between the host and the dongle, a radio on a USB serial line.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::radio;

/// A radio address.
pub type Address = [u8; 6];
/// A radio message as bytes.
pub type Payload = Vec<u8, { radio::LONGEST }>;
/// A key of ESP-NOW's own encryption (CCMP).
pub type RadioKey = [u8; 16];

/// From the host. Its `Debug` shows no key.
#[derive(Clone, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap, and few messages exist at a time")]
pub enum ToDongle {
    /// Who is there?
    Hello,
    /// Send a radio message; answered by `Sent` of the same number.
    Send {
        /// Chosen by the host.
        number: u16,
        /// Destination address; `ff:ff:ff:ff:ff:ff` is broadcast.
        to: Address,
        /// ESP-NOW payload, at most 250 bytes.
        payload: Payload,
    },
    /// Requests the counters: answered with `Counted`.
    Count,
    /// The primary master key, which protects the others on the chip: the same on both sides. Forgets everybody.
    Primary(RadioKey),
    /// From now on messages to and from an address are encrypted with its local master key.
    Meet {
        /// Address of the robot.
        address: Address,
        /// Local master key (LMK) of the link to that robot.
        local: RadioKey,
    },
}

impl core::fmt::Debug for ToDongle {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Hello => f.write_str("Hello"),
            Self::Send { number, to, payload } => {
                write!(f, "Send {{ number: {number}, to: {to:02x?}, {} bytes }}", payload.len())
            }
            Self::Count => f.write_str("Count"),
            Self::Primary(_) => f.write_str("Primary(secret)"),
            Self::Meet { address, .. } => write!(f, "Meet {{ address: {address:02x?}, local: secret }}"),
        }
    }
}

/// Message from the dongle to the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap, and few messages exist at a time")]
pub enum FromDongle {
    /// To `Hello`, at boot, and when the host reads again after it had stopped.
    Hello {
        /// [`super::VERSION`] of the dongle.
        version: u32,
        /// Address of the dongle.
        address: Address,
        /// Wi-Fi channel, 1 … 13.
        channel: u8,
    },
    /// A radio message came in.
    Received {
        /// Source address. It is not authenticated.
        from: Address,
        /// Strength of the signal, dBm.
        rssi: i8,
        /// ESP-NOW payload, at most 250 bytes.
        payload: Payload,
    },
    /// What became of a message.
    Sent {
        /// Number that the host gave the frame in `Send`.
        number: u16,
        /// The other radio acknowledged it. That says nothing about the program behind it. False, too, when the dongle
        /// never sent it: see [`Counters::send_dropped`].
        acknowledged: bool,
    },
    /// Answer to `Count`.
    Counted(Counters),
}

/// What the dongle counts, since boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
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
    /// Robots that the radio's list had no room for.
    pub not_met: u32,
    /// Messages that the radio's driver did not take: it has no buffer left. They count as not acknowledged, too.
    pub send_refused: u32,
    /// Frames longer than any of ours, dropped where they came in: somebody else's, or a flood.
    pub too_long: u32,
    /// Frames dropped because the dongle did not keep up with the radio: the oldest go first.
    pub overrun: u32,
    /// The least that was free of the radio's memory, bytes; 0 where it is not known.
    pub heap_least_free: u32,
}
