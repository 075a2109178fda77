//! A record as bytes.

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use postcard_schema::key::Key;
use sequential_storage::map::{SerializationError, Value};

use super::Kept;
use super::parameters::Parameters;

/// Bytes before the content: layout, origin, sequence.
const HEAD: usize = 16;
/// Those, and the CRC behind.
const OVERHEAD: usize = HEAD + 4;
/// Of the largest that is kept.
const LONGEST: usize = longest::<Parameters>();
/// Bytes read at a time; every page is a multiple.
pub const CHUNK: usize = 256;

pub const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Longest record of a type. `postcard` takes at most 3 bytes for 2, a `u16`, and never more than the size for the rest.
const fn longest<T>() -> usize {
    OVERHEAD + size_of::<T>().div_ceil(2) * 3
}

/// Room for a record. Aligned, or the flash driver copies everything through a page on the stack.
#[repr(align(4))]
pub struct Buffer(pub [u8; LONGEST.next_multiple_of(CHUNK)]);

impl Default for Buffer {
    fn default() -> Self {
        Self([0; _])
    }
}

#[derive(Clone, PartialEq)]
pub struct Record<T> {
    pub origin: u32,
    /// One more than the record before. Flash wears out long before it comes round.
    pub sequence: u32,
    pub contents: Contents<T>,
}

#[derive(Clone, PartialEq)]
pub enum Contents<T> {
    Stored(T),
    /// What was stored is gone.
    Nothing,
    /// Intact, of a firmware with another layout.
    OtherVersion,
    /// Intact, and yet nothing that the robot can run on.
    Refused,
}

/// Changes with every field or variant of `T` and of what is in it: added, removed, renamed, moved, of another type.
const fn layout<T: Kept>() -> [u8; 8] {
    Key::for_path::<T>(T::MEANING).to_bytes()
}

impl<T: Kept> Value<'_> for Record<T> {
    fn serialize_into(&self, buffer: &mut [u8]) -> Result<usize, SerializationError> {
        const { assert!(longest::<T>() <= LONGEST, "the buffer is too small") };
        let (head, rest) = buffer.split_first_chunk_mut::<HEAD>().ok_or(SerializationError::BufferTooSmall)?;
        head[..8].copy_from_slice(&const { layout::<T>() });
        head[8..12].copy_from_slice(&self.origin.to_le_bytes());
        head[12..].copy_from_slice(&self.sequence.to_le_bytes());
        let body = match &self.contents {
            Contents::Stored(kept) => {
                postcard::to_slice(kept, rest).map_err(|_| SerializationError::BufferTooSmall)?.len()
            }
            Contents::Nothing => 0,
            Contents::OtherVersion | Contents::Refused => return Err(SerializationError::InvalidData),
        };
        let end = HEAD + body;
        let (message, rest) = buffer.split_at_mut_checked(end).ok_or(SerializationError::BufferTooSmall)?;
        let crc = rest.first_chunk_mut::<4>().ok_or(SerializationError::BufferTooSmall)?;
        *crc = CRC.checksum(message).to_le_bytes();
        Ok(end + 4)
    }

    fn deserialize_from(buffer: &[u8]) -> Result<(Self, usize), SerializationError> {
        let (message, crc) = buffer.split_last_chunk::<4>().ok_or(SerializationError::InvalidFormat)?;
        if CRC.checksum(message) != u32::from_le_bytes(*crc) {
            return Err(SerializationError::InvalidData);
        }
        let (found, rest) = message.split_first_chunk::<8>().ok_or(SerializationError::InvalidFormat)?;
        let (origin, rest) = rest.split_first_chunk::<4>().ok_or(SerializationError::InvalidFormat)?;
        let (sequence, body) = rest.split_first_chunk::<4>().ok_or(SerializationError::InvalidFormat)?;
        let contents = if body.is_empty() {
            Contents::Nothing
        } else if *found != const { layout::<T>() } {
            Contents::OtherVersion
        } else {
            match postcard::take_from_bytes::<T>(body) {
                Ok((kept, [])) if kept.is_sound() => Contents::Stored(kept),
                _ => Contents::Refused,
            }
        };
        let [origin, sequence] = [origin, sequence].map(|number| u32::from_le_bytes(*number));
        Ok((Self { origin, sequence, contents }, buffer.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use postcard_schema::Schema;
    use serde::{Deserialize, Serialize};

    /// Fields of a set; fields of a struct in it; variants of an enum in that.
    macro_rules! number {
        ($meaning:literal, $($field:ident: $type:ty),*; $($inner:ident: $inner_type:ty),*; $($variant:ident)*) => {{
            #[derive(Clone, PartialEq, Serialize, Deserialize, Schema)]
            struct Set { $($field: $type),* }
            #[derive(Clone, PartialEq, Serialize, Deserialize, Schema)]
            struct Part { $($inner: $inner_type),* }
            #[derive(Clone, PartialEq, Serialize, Deserialize, Schema)]
            enum Kind { $($variant),* }
            impl Kept for Set {
                const MEANING: &'static str = $meaning;

                fn is_sound(&self) -> bool {
                    true
                }
            }
            layout::<Set>()
        }};
    }

    #[test]
    fn every_change_of_the_fields_changes_the_layout() {
        let numbers = [
            number!("1", a: f32, b: Part; c: [u16; 2], d: Kind; X Y),
            number!("2", a: f32, b: Part; c: [u16; 2], d: Kind; X Y),
            number!("1", a: f32, b: Part, more: f32; c: [u16; 2], d: Kind; X Y),
            number!("1", b: Part, a: f32; c: [u16; 2], d: Kind; X Y),
            number!("1", renamed: f32, b: Part; c: [u16; 2], d: Kind; X Y),
            number!("1", a: f64, b: Part; c: [u16; 2], d: Kind; X Y),
            number!("1", a: f32, b: Part; c: [u16; 3], d: Kind; X Y),
            number!("1", a: f32, b: Part; c: [i16; 2], d: Kind; X Y),
            number!("1", a: f32, b: Part; c: [u16; 2], renamed: Kind; X Y),
            number!("1", a: f32, b: Part; c: [u16; 2], d: Kind; Y X),
            number!("1", a: f32, b: Part; c: [u16; 2], d: Kind; X Y Z),
            number!("1", a: f32, b: Part; c: Option<u16>, d: Kind; X Y),
        ];
        for (index, number) in numbers.iter().enumerate() {
            assert!(!numbers[..index].contains(number), "{index}: {numbers:x?}");
        }
    }

    #[test]
    fn the_same_fields_have_the_same_layout() {
        let once = number!("1", a: f32, b: Part; c: u8, d: Kind; X);
        assert_eq!(number!("1", a: f32, b: Part; c: u8, d: Kind; X), once);
    }
}
