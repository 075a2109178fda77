//! A/B slots: two halves of a partition, written in turn.

use core::ops::Range;

use embedded_storage_async::nor_flash::{NorFlash, NorFlashError};
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use super::record::{Buffer, CHUNK, Contents, Record};
use super::{Kept, StoreError};

/// What is in a partition.
pub enum Found<T> {
    /// The record that counts.
    Record(Record<T>),
    /// Nothing was ever written.
    Blank,
    /// Nothing that can be read.
    Damaged,
}

/// Looks. The store is usable afterwards, whatever is in the flash.
pub async fn find<T: Kept, F: NorFlash>(flash: &mut F, range: Range<u32>) -> Found<T> {
    match newest(flash, &range).await {
        Ok(Some((_, record))) => Found::Record(record),
        Ok(None) if is_blank(flash, range).await => Found::Blank,
        Ok(None) | Err(_) => Found::Damaged,
    }
}

/// Stores. Interrupted at any point, [`find`] gives what was there before or this.
pub async fn store<T: Kept, F: NorFlash>(
    flash: &mut F,
    range: &Range<u32>,
    origin: u32,
    contents: Contents<T>,
) -> Result<(), StoreError> {
    let (half, sequence) = match newest(flash, range).await? {
        Some((_, record)) if record.contents == contents && record.origin == origin => return Ok(()),
        Some((half, record)) => (half.other(), record.sequence.wrapping_add(1)),
        None => (Half::Lower, 0),
    };
    let record = Record { origin, sequence, contents };
    let part = half.of::<F>(range)?;
    if write(flash, &part, &record).await? {
        return Ok(());
    }
    // Rubbish that the library can neither use nor repair. The record that counts is in the other half: this one may go.
    flash.erase(part.start, part.end).await.map_err(|error| StoreError::Flash(error.kind()))?;
    if write(flash, &part, &record).await? { Ok(()) } else { Err(StoreError::NotKept) }
}

/// Whether the record is what [`read`] gives from now on.
async fn write<T: Kept, F: NorFlash>(flash: &mut F, part: &Range<u32>, record: &Record<T>) -> Result<bool, StoreError> {
    match map(flash, part)?.store_item(&mut Buffer::default().0, &(), record).await {
        Ok(()) => Ok(read(flash, part).await?.as_ref() == Some(record)),
        Err(error) => unless_flash(error).map(|()| false),
    }
}

/// The record that counts, and where it is.
async fn newest<T: Kept, F: NorFlash>(
    flash: &mut F,
    range: &Range<u32>,
) -> Result<Option<(Half, Record<T>)>, StoreError> {
    let lower: Option<Record<T>> = read(flash, &Half::Lower.of::<F>(range)?).await?;
    let upper: Option<Record<T>> = read(flash, &Half::Upper.of::<F>(range)?).await?;
    Ok(match (lower, upper) {
        (Some(lower), Some(upper)) if upper.sequence > lower.sequence => Some((Half::Upper, upper)),
        (None, Some(upper)) => Some((Half::Upper, upper)),
        (lower, _) => lower.map(|lower| (Half::Lower, lower)),
    })
}

/// The record of a half. Where the library finds nothing that it can read, there is none.
async fn read<T: Kept, F: NorFlash>(flash: &mut F, part: &Range<u32>) -> Result<Option<Record<T>>, StoreError> {
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
