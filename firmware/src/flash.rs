//! The flash as `shell::store` wants it. While it is written or erased the processor cannot run from it and stands
//! still, the control loop too: so that happens with the bridge off, or not at all.

use core::ops::Range;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use esp_bootloader_esp_idf::partitions::{PARTITION_TABLE_MAX_LEN, read_partition_table};
use esp_hal::peripherals::FLASH;
use esp_storage::{FlashStorage, FlashStorageError};

use crate::board;

/// Label of the parameters' partition in partitions.csv.
pub const PARAMETERS: &str = "params";
/// Label of the pairing's partition.
pub const PAIRING: &str = "pairing";
/// Label of the gait's partition.
pub const GAIT: &str = "gait";
/// Bytes at a time: a page of the flash, so that interrupts wait for no more than that (W25Q32JV: 0.4 ms, at most 3 ms).
const CHUNK: usize = 256;

/// The whole flash.
pub struct Flash(FlashStorage<'static>);

/// Why the flash was not touched or failed.
#[derive(Clone, Copy, Debug)]
pub enum FlashError {
    /// The bridge drives: stop first.
    Driving,
    /// What the driver said.
    Driver(FlashStorageError),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Driver(FlashStorageError::NotAligned) => NorFlashErrorKind::NotAligned,
            Self::Driver(FlashStorageError::OutOfBounds) => NorFlashErrorKind::OutOfBounds,
            Self::Driving | Self::Driver(_) => NorFlashErrorKind::Other,
        }
    }
}

impl Flash {
    /// Takes the flash.
    #[must_use]
    pub fn new(flash: FLASH<'static>) -> Self {
        Self(FlashStorage::new(flash))
    }

    /// Where a partition is, from the flash's partition table. `None`: it has no such partition; it was flashed without
    /// this project's partitions.csv.
    pub fn partition(&mut self, label: &str) -> Option<Range<u32>> {
        let mut buffer = Chunk([0; PARTITION_TABLE_MAX_LEN]);
        let table = read_partition_table(&mut self.0, &mut buffer.0).ok()?;
        let found = table.iter().find(|partition| partition.label_as_str() == label)?;
        Some(found.offset()..found.offset().checked_add(found.len())?)
    }
}

/// Bytes that the driver takes without a copy on the stack.
#[repr(align(4))]
struct Chunk<const N: usize>([u8; N]);

/// Runs `write` with the bridge off, and nothing else until it is done.
fn while_off(write: impl FnOnce() -> Result<(), FlashStorageError>) -> Result<(), FlashError> {
    critical_section::with(|_| {
        if !board::bridge_is_off() {
            return Err(FlashError::Driving);
        }
        // With the bridge off the watchdog bears with the longest of them.
        write().map_err(FlashError::Driver)
    })
}

/// Chunks of a write or read with their addresses.
fn addresses(offset: u32) -> impl Iterator<Item = u32> {
    (offset..).step_by(CHUNK)
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = FlashStorage::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let mut chunk = Chunk([0; CHUNK]);
        for (address, part) in addresses(offset).zip(bytes.chunks_mut(CHUNK)) {
            let read = &mut chunk.0[..part.len()];
            self.0.read_nor(address, read).map_err(FlashError::Driver)?;
            part.copy_from_slice(read);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        embedded_storage::nor_flash::ReadNorFlash::capacity(&self.0)
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = FlashStorage::WRITE_SIZE;
    const ERASE_SIZE: usize = FlashStorage::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        // A sector at a time: what waits for the processor runs in between.
        for sector in (from..to).step_by(Self::ERASE_SIZE) {
            while_off(|| self.0.erase(sector, sector + FlashStorage::SECTOR_SIZE))?;
            embassy_futures::yield_now().await;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let mut chunk = Chunk([0; CHUNK]);
        for (address, part) in addresses(offset).zip(bytes.chunks(CHUNK)) {
            let written = &mut chunk.0[..part.len()];
            written.copy_from_slice(part);
            while_off(|| self.0.write_nor(address, written))?;
        }
        Ok(())
    }
}
