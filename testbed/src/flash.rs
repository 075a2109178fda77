//! A NOR flash in memory: what it holds outlives a reset.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use shell::store::Partitions;

use crate::event_log::{Event, EventLog};
use crate::time::pass;

/// Bytes of a page.
const PAGE: usize = 4096;
/// Pages of the partitions, as in the firmware's table (`firmware/partitions.csv`).
const PARAMETER_PAGES: usize = 6;
const PAIRING_PAGES: usize = 4;
const GAIT_PAGES: usize = 4;
const PAGES: usize = PARAMETER_PAGES + PAIRING_PAGES + GAIT_PAGES;
/// How long the chip stands still while a page is erased, and for every 256 bytes that are written, µs (W25Q32JV data
/// sheet, typical).
const ERASE_US: u64 = 45_000;
const WRITE_US: u64 = 700;

/// The flash of a robot; clones are the same one.
#[derive(Clone)]
pub struct Flash {
    bytes: Rc<RefCell<Vec<u8>>>,
    event_log: EventLog,
}

impl Flash {
    /// Where what is kept.
    #[must_use]
    pub fn partitions() -> Partitions {
        let [pairing, gait, end] =
            [PARAMETER_PAGES, PARAMETER_PAGES + PAIRING_PAGES, PAGES].map(|page| (page * PAGE) as u32);
        Partitions { parameters: 0..pairing, pairing: pairing..gait, gait: gait..end }
    }

    /// Blank.
    #[must_use]
    pub fn blank(event_log: &EventLog) -> Self {
        Self { bytes: Rc::new(RefCell::new(vec![0xFF; PAGES * PAGE])), event_log: event_log.clone() }
    }

    /// The same one, with another journal.
    pub(crate) fn with(self, event_log: &EventLog) -> Self {
        Self { event_log: event_log.clone(), ..self }
    }

    /// The start of a stretch as an index, unless it is not in units of `unit`.
    fn index(&self, offset: u32, length: usize, unit: usize) -> Result<usize, NorFlashErrorKind> {
        let offset = offset as usize;
        match () {
            () if !offset.is_multiple_of(unit) || !length.is_multiple_of(unit) => Err(NorFlashErrorKind::NotAligned),
            () if offset + length > self.bytes.borrow().len() => Err(NorFlashErrorKind::OutOfBounds),
            () => Ok(offset),
        }
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 4;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let offset = self.index(offset, bytes.len(), Self::READ_SIZE)?;
        bytes.copy_from_slice(&self.bytes.borrow()[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.borrow().len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let length = to.saturating_sub(from) as usize;
        let from = self.index(from, length, PAGE)?;
        self.event_log.note(Event::Flashed);
        self.bytes.borrow_mut()[from..from + length].fill(0xFF);
        pass((length / PAGE) as u64 * ERASE_US);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let offset = self.index(offset, bytes.len(), Self::WRITE_SIZE)?;
        self.event_log.note(Event::Flashed);
        // Only an erase sets bits.
        self.bytes.borrow_mut()[offset..].iter_mut().zip(bytes).for_each(|(cell, byte)| *cell &= byte);
        pass(bytes.len().div_ceil(256) as u64 * WRITE_US);
        Ok(())
    }
}
