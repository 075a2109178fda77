//! The parameters in flash: whatever happens to the supply, the robot finds the old set or the new one, whole.
//!
//! The range is cut into two halves, each a wear-levelled map of [`sequential_storage`], and sets are written in turn:
//! the half that holds the newest set is neither written to nor erased. So nothing in the other half matters until its
//! record is complete, not even an interrupted erase that leaves a page with old or random contents, which a single map
//! takes for data (it brings back a set from long ago). The intact record with the highest sequence number counts.
//!
//! A record is `layout u32, factory u32, sequence u32, postcard of the parameters, CRC-32 of all before`, little endian.
//! Without parameters it says that the factory's count again. [`layout`](layout::layout) changes by itself with the
//! fields of [`Parameters`]. `factory` is the CRC-32 of the set that was built in when the record was stored: a stored
//! set corrects that one, and beside another robot's, or the same one's after a calibration, it would be wrong.
//!
//! # Wear
//! A record takes 572 bytes, a page of 4096 bytes 7 of them, and every page is erased once in `7 × pages` saves. SPI
//! flash lasts 100 000 erasures a sector (e.g. Winbond W25Q32JV, "Endurance"): a partition of 24 KiB, 6 pages, takes 4.2
//! million saves, one every ten minutes for 80 years. A set equal to the stored one is not written again.
//!
//! # When
//! Only with the bridge off: the chip runs from the same flash, and stands still while a page is erased (W25Q32JV: 45 ms,
//! at most 400 ms). The watchdog's period must be longer.

use core::ops::Range;

use control::protocol::radio::Source;
use control::{ParameterError, Parameters};
use crc::{CRC_32_ISO_HDLC, Crc, Table};
use embedded_storage_async::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage, SerializationError, Value};

pub mod layout;

/// Why a set was not saved. The one before still counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StoreError {
    /// No controller can run on it.
    Refused(ParameterError),
    /// The range is not two times two or more whole pages of the flash.
    Range,
    /// What the flash said.
    Flash(NorFlashErrorKind),
    /// What was written does not come back: the flash is worn out.
    NotKept,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Refused(why) => write!(f, "parameters refused: {why}"),
            Self::Range => f.write_str("the partition must be four or more whole pages of the flash"),
            Self::Flash(kind) => write!(f, "the flash failed: {kind}"),
            Self::NotKept => f.write_str("the flash does not keep what is written: it is worn out, replace the board"),
        }
    }
}

impl core::error::Error for StoreError {}

/// The stored parameters, or else the factory's, and why. The store is usable afterwards, whatever is in the flash.
pub async fn load<F: NorFlash>(flash: &mut F, range: Range<u32>, factory: &Parameters) -> (Parameters, Source) {
    let source = match newest(flash, &range).await {
        Ok(Some((_, record))) => match record.contents {
            Contents::Stored(_) | Contents::Refused if record.factory != checksum(factory) => {
                Source::FactoryOtherVersion
            }
            Contents::Stored(parameters) => return (parameters, Source::Stored),
            Contents::Factory => Source::Factory,
            Contents::OtherVersion => Source::FactoryOtherVersion,
            Contents::Refused => Source::FactoryDamaged,
        },
        Ok(None) if is_blank(flash, range).await => Source::Factory,
        Ok(None) | Err(_) => Source::FactoryDamaged,
    };
    (*factory, source)
}

/// Stores a set in place of the factory's. Interrupted at any point, [`load`] gives the old set or this one.
///
/// # Errors
/// See [`StoreError`].
pub async fn save<F: NorFlash>(
    flash: &mut F,
    range: Range<u32>,
    factory: &Parameters,
    parameters: &Parameters,
) -> Result<(), StoreError> {
    parameters.check().map_err(StoreError::Refused)?;
    store(flash, &range, checksum(factory), Contents::Stored(*parameters)).await
}

/// Lets the factory's parameters count again.
///
/// # Errors
/// See [`StoreError`].
pub async fn reset<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Result<(), StoreError> {
    // Whichever set that is.
    store(flash, &range, 0, Contents::Factory).await
}

async fn store<F: NorFlash>(
    flash: &mut F,
    range: &Range<u32>,
    factory: u32,
    contents: Contents,
) -> Result<(), StoreError> {
    let (half, sequence) = match newest(flash, range).await? {
        Some((_, record)) if record.contents == contents && record.factory == factory => return Ok(()),
        Some((half, record)) => (half.other(), record.sequence.wrapping_add(1)),
        None => (Half::Lower, 0),
    };
    let record = Record { factory, sequence, contents };
    let part = half.of::<F>(range)?;
    if write(flash, &part, &record).await? {
        return Ok(());
    }
    // Rubbish that the library can neither use nor repair. The set that counts is in the other half: this one may go.
    flash.erase(part.start, part.end).await.map_err(|error| StoreError::Flash(error.kind()))?;
    if write(flash, &part, &record).await? { Ok(()) } else { Err(StoreError::NotKept) }
}

/// Whether the record is what [`read`] gives from now on.
async fn write<F: NorFlash>(flash: &mut F, part: &Range<u32>, record: &Record) -> Result<bool, StoreError> {
    match map(flash, part)?.store_item(&mut Buffer::default().0, &(), record).await {
        Ok(()) => Ok(read(flash, part).await?.as_ref() == Some(record)),
        Err(error) => unless_flash(error).map(|()| false),
    }
}

/// The record that counts, and where it is.
async fn newest<F: NorFlash>(flash: &mut F, range: &Range<u32>) -> Result<Option<(Half, Record)>, StoreError> {
    let lower = read(flash, &Half::Lower.of::<F>(range)?).await?;
    let upper = read(flash, &Half::Upper.of::<F>(range)?).await?;
    Ok(match (lower, upper) {
        (Some(lower), Some(upper)) if upper.sequence > lower.sequence => Some((Half::Upper, upper)),
        (None, Some(upper)) => Some((Half::Upper, upper)),
        (lower, _) => lower.map(|lower| (Half::Lower, lower)),
    })
}

/// The record of a half. Where the library finds nothing that it can read, there is none.
async fn read<F: NorFlash>(flash: &mut F, part: &Range<u32>) -> Result<Option<Record>, StoreError> {
    match map(flash, part)?.fetch_item(&mut Buffer::default().0, &()).await {
        Ok(record) => Ok(record),
        Err(error) => unless_flash(error).map(|()| None),
    }
}

fn unless_flash<E: NorFlashError>(error: Error<E>) -> Result<(), StoreError> {
    match error {
        Error::Storage { value } => Err(StoreError::Flash(value.kind())),
        _ => Ok(()),
    }
}

type Map<'f, F> = MapStorage<(), &'f mut F, Cache<Uncached, Uncached, Uncached, ()>>;

fn map<'f, F: NorFlash>(flash: &'f mut F, part: &Range<u32>) -> Result<Map<'f, F>, StoreError> {
    let config = MapConfig::try_new(part.clone()).map_err(|_| StoreError::Range)?;
    Ok(MapStorage::new(flash, config, Cache::new_uncached()))
}

async fn is_blank<F: NorFlash>(flash: &mut F, range: Range<u32>) -> bool {
    let mut chunk = Buffer::default();
    let step = F::ERASE_SIZE.min(CHUNK);
    for address in range.step_by(step) {
        let Some(bytes) = chunk.0.get_mut(..step) else { return false };
        if flash.read(address, bytes).await.is_err() || bytes.iter().any(|byte| *byte != 0xFF) {
            return false;
        }
    }
    true
}

#[derive(Clone, Copy)]
enum Half {
    Lower,
    Upper,
}

impl Half {
    fn other(self) -> Self {
        match self {
            Self::Lower => Self::Upper,
            Self::Upper => Self::Lower,
        }
    }

    /// Its part of the range: whole pages, of which the library needs two.
    fn of<F: NorFlash>(self, range: &Range<u32>) -> Result<Range<u32>, StoreError> {
        let page = u32::try_from(F::ERASE_SIZE).map_err(|_| StoreError::Range)?;
        let whole = range.end.checked_sub(range.start).filter(|length| length % page == 0).ok_or(StoreError::Range)?;
        let length = whole / page / 2 * page;
        match self {
            Self::Lower => Ok(range.start..range.start + length),
            Self::Upper => Ok(range.start + length..range.start + 2 * length),
        }
    }
}

/// Bytes before the parameters: layout, factory, sequence.
const HEAD: usize = 12;
/// Those, and the CRC behind.
const OVERHEAD: usize = HEAD + 4;
/// `postcard` takes at most 3 bytes for 2, a `u16`, and never more than the size for the rest.
const LONGEST: usize = OVERHEAD + size_of::<Parameters>().div_ceil(2) * 3;
/// Bytes read at a time; every page is a multiple.
const CHUNK: usize = 256;

/// Room for a record. Aligned, or the flash driver copies everything through a page on the stack.
#[repr(align(4))]
struct Buffer([u8; LONGEST.next_multiple_of(CHUNK)]);

impl Default for Buffer {
    fn default() -> Self {
        Self([0; _])
    }
}

const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// CRC-32 of a set.
fn checksum(parameters: &Parameters) -> u32 {
    let mut buffer = Buffer::default();
    // There is room: see `LONGEST`.
    postcard::to_slice(parameters, &mut buffer.0).map_or(0, |bytes| CRC.checksum(bytes))
}

#[derive(Clone, Debug, PartialEq)]
struct Record {
    /// [`checksum`] of the set that was built in.
    factory: u32,
    /// One more than the record before. Flash wears out long before it comes round.
    sequence: u32,
    contents: Contents,
}

#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is no heap, and few records exist at a time")]
enum Contents {
    Stored(Parameters),
    /// The factory's parameters count again.
    Factory,
    /// Intact, of a firmware with another layout.
    OtherVersion,
    /// Intact, and yet nothing that a controller can run on.
    Refused,
}

fn own_layout() -> Result<u32, SerializationError> {
    layout::layout::<Parameters>().map_err(|_| SerializationError::InvalidFormat)
}

impl Value<'_> for Record {
    fn serialize_into(&self, buffer: &mut [u8]) -> Result<usize, SerializationError> {
        let (head, rest) = buffer.split_first_chunk_mut::<HEAD>().ok_or(SerializationError::BufferTooSmall)?;
        let [layout, factory, sequence] = [own_layout()?, self.factory, self.sequence].map(u32::to_le_bytes);
        head[..4].copy_from_slice(&layout);
        head[4..8].copy_from_slice(&factory);
        head[8..].copy_from_slice(&sequence);
        let body = match &self.contents {
            Contents::Stored(parameters) => {
                postcard::to_slice(parameters, rest).map_err(|_| SerializationError::BufferTooSmall)?.len()
            }
            Contents::Factory => 0,
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
        let (layout, rest) = message.split_first_chunk::<4>().ok_or(SerializationError::InvalidFormat)?;
        let (factory, rest) = rest.split_first_chunk::<4>().ok_or(SerializationError::InvalidFormat)?;
        let (sequence, body) = rest.split_first_chunk::<4>().ok_or(SerializationError::InvalidFormat)?;
        let contents = if body.is_empty() {
            Contents::Factory
        } else if u32::from_le_bytes(*layout) != own_layout()? {
            Contents::OtherVersion
        } else {
            match postcard::take_from_bytes::<Parameters>(body) {
                Ok((parameters, [])) if parameters.check().is_ok() => Contents::Stored(parameters),
                _ => Contents::Refused,
            }
        };
        let [factory, sequence] = [factory, sequence].map(|number| u32::from_le_bytes(*number));
        Ok((Self { factory, sequence, contents }, buffer.len()))
    }
}
