//! The robot's own serial line: who it obeys, as [`control::protocol::pairing`] has it.
//!
//! The line also carries text for people, what the robot prints at boot. A frame begins with a zero, so that text before it
//! is one bad frame to the other end and spoils nothing. Keys are never printed and never sent back.

use control::protocol::VERSION;
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::pairing::{PairingReply, PairingRequest};
use control::protocol::radio::{NAME, Reset};
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use heapless::String;

use super::Shared;
use super::shared::Work;
use crate::board::{Address, Restart};

/// After a failed read: short, because a UART that has lost bytes fails, too, and more are coming.
const READ_AGAIN: Duration = Duration::from_millis(1);
/// A host that takes longer for an answer has gone. The longest takes 1 ms at 921 600 baud.
const GONE: Duration = Duration::from_millis(500);

/// Who the robot is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// ESP-NOW (MAC) address.
    pub address: Address,
    /// Its name.
    pub name: String<NAME>,
    /// Address of the paired console; `None` before pairing.
    pub console: Option<Address>,
}

/// Serves whoever is at the other end of the cable. A pairing counts from the next boot on, which follows it at once.
pub async fn pair(
    mut from_host: impl Read,
    to_host: impl Write,
    mut restart: impl Restart,
    identity: &Identity,
    shared: &Shared,
) -> ! {
    let mut line = Line { to_host, buffer: [0; _] };
    let mut deframer = Deframer::default();
    let mut bytes = [0; 64];
    loop {
        match from_host.read(&mut bytes).await {
            Ok(read @ 1..) => {
                for byte in bytes.iter().take(read) {
                    // What is no message is not answered: the host asks again.
                    let Some(Ok(message)) = deframer.push(*byte) else { continue };
                    let answer = answer(message, identity, shared).await;
                    line.write(&answer).await;
                    if answer == PairingReply::Kept {
                        restart.restart(Reset::Software);
                    }
                }
            }
            // Unplugged, or bytes are lost: what comes next does not belong to what came before.
            Ok(0) | Err(_) => {
                let _ = deframer.push::<PairingRequest>(0);
                Timer::after(READ_AGAIN).await;
            }
        }
    }
}

async fn answer(message: PairingRequest, identity: &Identity, shared: &Shared) -> PairingReply {
    let pairing = match message {
        PairingRequest::Hello => {
            let Identity { address, name, console } = identity.clone();
            return PairingReply::Hello { version: VERSION, address, name, console };
        }
        PairingRequest::Pair(pairing) => Some(pairing),
        PairingRequest::Forget => None,
    };
    // Whatever was kept before is no answer to this.
    shared.paired.reset();
    if shared.hand_over(Work::Pair(pairing)).is_ok() && shared.paired.wait().await {
        PairingReply::Kept
    } else {
        PairingReply::NotKept
    }
}

struct Line<W> {
    to_host: W,
    buffer: [u8; LONGEST + 2],
}

impl<W: Write> Line<W> {
    /// Writes a frame, as far as the host takes it: one that has gone hears nothing, and what follows is done all the same.
    async fn write(&mut self, message: &PairingReply) {
        let [zero, rest @ ..] = &mut self.buffer;
        *zero = 0;
        // Every message to the host is short enough.
        let length = encode(message, rest).map_or(0, |frame| 1 + frame.len());
        let frame = self.buffer.get(..length).unwrap_or_default();
        let _ = with_timeout(GONE, async {
            self.to_host.write_all(frame).await?;
            self.to_host.flush().await
        })
        .await;
    }
}
