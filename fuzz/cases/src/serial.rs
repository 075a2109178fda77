//! Frames on a serial line, of every kind of message.
//!
//! The first byte says which kind, and how the rest comes: as it is on the line, or as the body of a good frame, which is
//! how it gets past the CRC.

use std::fmt::Debug;

use control::protocol::frame::{Deframer, FrameError, LONGEST, LONGEST_MESSAGE, encode};
use control::protocol::{dongle, lockstep, pairing, radio};
use serde::de::DeserializeOwned;
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Any bytes on the line: nothing panics, and what is read is written and read again as the same.
pub fn serial(data: &[u8]) {
    let Some((selector, data)) = data.split_first() else { return };
    let framed = selector & 0x80 != 0;
    let read = match selector & 0x7f {
        0 => messages::<dongle::ToDongle>,
        1 => messages::<dongle::FromDongle>,
        2 => messages::<pairing::PairingRequest>,
        3 => messages::<pairing::PairingReply>,
        4 => messages::<lockstep::QuestionFrame>,
        5 => messages::<lockstep::AnswerFrame>,
        // These travel in radio frames, and have the same decoder.
        6 => messages::<radio::Downlink>,
        _ => messages::<radio::Uplink>,
    };
    if framed {
        let body = &data[..data.len().min(LONGEST_MESSAGE)];
        let mut buffer = [0; LONGEST + 1];
        read(encode(&Body(body), &mut buffer).expect("no longer than the longest"), true);
    } else {
        read(data, false);
    }
}

/// Reads the line. A good frame holds a message or another's, but is never broken.
fn messages<T: Serialize + DeserializeOwned + Debug>(line: &[u8], good: bool) {
    let mut deframer = Deframer::default();
    let (mut bad, mut frames) = (0, 0);
    for byte in line {
        match deframer.push::<T>(*byte) {
            None => continue,
            Some(Ok(message)) => comes_back(&message),
            Some(Err(error)) => {
                assert!(!good || error == FrameError::Message, "a good frame is {error:?}");
                bad += 1;
            }
        }
        frames += 1;
    }
    assert_eq!(deframer.bad(), bad);
    assert!(!good || frames == 1, "one frame was read as {frames}");
    // Whatever was before, after a zero the next frame is read.
    deframer.push::<T>(0);
    let mut buffer = [0; LONGEST + 1];
    let next = encode(&dongle::ToDongle::Count, &mut buffer).expect("short");
    let read: Vec<_> = next.iter().filter_map(|byte| deframer.push(*byte)).collect();
    assert_eq!(read, [Ok(dongle::ToDongle::Count)]);
}

/// As bytes: a NaN is not equal to itself.
fn comes_back<T: Serialize + DeserializeOwned + Debug>(message: &T) {
    let (mut buffer, mut again) = ([0; LONGEST + 1], [0; LONGEST + 1]);
    let frame = encode(message, &mut buffer).expect("it came in a frame");
    let mut deframer = Deframer::default();
    let read: Vec<Result<T, _>> = frame.iter().filter_map(|byte| deframer.push(*byte)).collect();
    let [Ok(read)] = read.as_slice() else { panic!("{message:?} comes back as {read:?}") };
    assert_eq!(encode(read, &mut again), Ok(frame), "{message:?} comes back as {read:?}");
}

/// Bytes as they are.
struct Body<'b>(&'b [u8]);

impl Serialize for Body<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut body = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| body.serialize_element(byte))?;
        body.end()
    }
}
