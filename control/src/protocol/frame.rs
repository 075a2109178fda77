//! Frames on a serial line: `COBS(postcard message, CRC-32 of it, little endian) 0x00`.
//!
//! A zero byte ends a frame and occurs nowhere else, so that a receiver that starts in the middle, or has lost bytes,
//! is in step again at the next zero.

use cobs::{DecodeResult, DecoderState};
use crc::{CRC_32_ISO_HDLC, Crc, Table};
use serde::{Serialize, de::DeserializeOwned};

/// Speed of a serial line that frames go over, baud. A chip with its own USB ignores it; a USB-to-UART bridge needs it.
pub const BAUD: u32 = 921_600;
/// Longest frame without its final zero, bytes: the largest message is the parameter set.
pub const LONGEST: usize = 1024;
/// Longest message, bytes: COBS adds one byte in 254 and one more, the CRC is 4.
pub const LONGEST_MESSAGE: usize = LONGEST - LONGEST / 254 - 1 - CRC_BYTES;

const CRC_BYTES: usize = 4;
const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Why a frame or message is not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

/// Why what came between two zeros is no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// More bytes than [`LONGEST`].
    TooLong,
    /// Not COBS, or shorter than its CRC.
    Malformed,
    /// The CRC differs.
    Crc,
    /// Intact, but not this message: another version of the protocol.
    Message,
}

/// Writes the frame of a message, its final zero included; the bytes of `buffer` to send.
///
/// # Errors
/// The message is longer than [`LONGEST_MESSAGE`].
pub fn encode<'b, T: Serialize>(message: &T, buffer: &'b mut [u8; LONGEST + 1]) -> Result<&'b [u8], TooLong> {
    let mut body = [0; LONGEST_MESSAGE + CRC_BYTES];
    let room = body.get_mut(..LONGEST_MESSAGE).ok_or(TooLong)?;
    let length = postcard::to_slice(message, room).map_err(|_| TooLong)?.len();
    let crc = CRC.checksum(body.get(..length).ok_or(TooLong)?).to_le_bytes();
    let end = length.saturating_add(CRC_BYTES);
    body.get_mut(length..end).ok_or(TooLong)?.copy_from_slice(&crc);
    let length = cobs::try_encode(body.get(..end).ok_or(TooLong)?, buffer).map_err(|_| TooLong)?;
    *buffer.get_mut(length).ok_or(TooLong)? = 0;
    buffer.get(..=length).ok_or(TooLong)
}

/// Collects bytes into frames.
#[derive(Debug)]
pub struct Deframer {
    cobs: DecoderState,
    /// The frame so far, decoded.
    bytes: [u8; LONGEST_MESSAGE + CRC_BYTES],
    filled: usize,
    overflowed: bool,
    bad: u32,
}

impl Default for Deframer {
    fn default() -> Self {
        let bytes = [0; LONGEST_MESSAGE + CRC_BYTES];
        Self { cobs: DecoderState::Idle, bytes, filled: 0, overflowed: false, bad: 0 }
    }
}

impl Deframer {
    /// Takes in a byte; at the end of a frame the message in it, or why there is none. An empty frame (two zeros in a
    /// row) is nothing: senders may begin with a zero to be in step.
    pub fn push<T: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<T, FrameError>> {
        let whole = match self.cobs.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataStart) => {
                self.filled = 0;
                self.overflowed = false;
                return None;
            }
            Ok(DecodeResult::DataContinue(byte)) => {
                self.keep(byte);
                return None;
            }
            Ok(DecodeResult::DataComplete) => true,
            // The zero came too early.
            Err(_) => false,
        };
        let result = match (self.overflowed, whole) {
            (true, _) => Err(FrameError::TooLong),
            (false, false) => Err(FrameError::Malformed),
            (false, true) => self.decode(),
        };
        if result.is_err() {
            self.bad = self.bad.wrapping_add(1);
        }
        Some(result)
    }

    /// Frames that held no message, since the start.
    #[must_use]
    pub fn bad(&self) -> u32 {
        self.bad
    }

    fn keep(&mut self, byte: u8) {
        match self.bytes.get_mut(self.filled) {
            Some(slot) => {
                *slot = byte;
                self.filled = self.filled.saturating_add(1);
            }
            None => self.overflowed = true,
        }
    }

    fn decode<T: DeserializeOwned>(&self) -> Result<T, FrameError> {
        let body = self.bytes.get(..self.filled).ok_or(FrameError::TooLong)?;
        let (message, crc) = body.split_last_chunk::<CRC_BYTES>().ok_or(FrameError::Malformed)?;
        if CRC.checksum(message) != u32::from_le_bytes(*crc) {
            return Err(FrameError::Crc);
        }
        match postcard::take_from_bytes(message) {
            Ok((message, [])) => Ok(message),
            _ => Err(FrameError::Message),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn decode_all(bytes: &[u8]) -> Vec<Result<(u32, f32), FrameError>> {
        let mut deframer = Deframer::default();
        bytes.iter().filter_map(|byte| deframer.push(*byte)).collect()
    }

    fn frame(message: (u32, f32)) -> Vec<u8> {
        encode(&message, &mut [0; LONGEST + 1]).expect("short").to_vec()
    }

    #[test]
    fn a_message_comes_back() {
        for message in [(0, 0.0), (1, -1.5), (u32::MAX, f32::MIN_POSITIVE)] {
            assert_eq!(decode_all(&frame(message)), [Ok(message)]);
        }
    }

    #[test]
    fn every_single_wrong_bit_is_seen_and_the_next_frame_is_read() {
        let good = frame((70_000, 2.0));
        for index in 0..good.len() - 1 {
            for bit in 0..8 {
                let mut bytes = good.clone();
                bytes[index] ^= 1 << bit;
                bytes.extend(&good);
                let read = decode_all(&bytes);
                assert!(read.iter().filter(|r| r.is_ok()).count() == 1, "byte {index}, bit {bit}: {read:?}");
                assert_eq!(read.last(), Some(&Ok((70_000, 2.0))));
            }
        }
    }

    #[test]
    fn a_receiver_that_starts_in_the_middle_loses_one_frame() {
        let one = frame((5, 6.0));
        let bytes: Vec<u8> = one.iter().chain(&one).copied().collect();
        for start in 1..one.len() - 1 {
            let read = decode_all(&bytes[start..]);
            assert!(read.len() == 2 && read[0].is_err() && read[1] == Ok((5, 6.0)), "{start}: {read:?}");
        }
    }

    #[test]
    fn a_line_that_never_ends_a_frame_is_borne() {
        let mut bytes = [7; 5 * LONGEST].to_vec();
        bytes.push(0);
        bytes.extend(frame((1, 1.0)));
        assert_eq!(decode_all(&bytes), [Err(FrameError::TooLong), Ok((1, 1.0))]);
    }

    #[test]
    fn another_message_is_not_this_one() {
        let bytes = encode(&(1u32, 2u32, 3u32, 4u32, 5u32, 6u32, 7u32), &mut [0; LONGEST + 1]).expect("short").to_vec();
        assert_eq!(decode_all(&bytes), [Err(FrameError::Message)]);
    }

    #[test]
    fn the_longest_message_fits_and_a_longer_one_is_refused() {
        let mut buffer = [0; LONGEST + 1];
        // Two bytes tell the length.
        let longest = std::vec![1u8; LONGEST_MESSAGE - 2];
        assert_eq!(encode(&longest.as_slice(), &mut buffer).map(|frame| frame.len()), Ok(LONGEST + 1));
        assert_eq!(encode(&std::vec![1u8; LONGEST_MESSAGE - 1].as_slice(), &mut buffer), Err(TooLong));
    }
}
