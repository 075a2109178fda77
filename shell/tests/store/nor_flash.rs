//! A NOR flash that remembers what was done to it, and what is left when the power fails in the middle.

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use rand::{Rng, RngExt};

/// Bytes that one program command takes, W25Q32JV: its bits are cleared together, not byte by byte.
const PROGRAM: usize = 256;

/// What was done.
#[derive(Clone)]
pub enum Operation {
    Write { offset: usize, bytes: Vec<u8> },
    Erase { offset: usize },
}

/// Pages of `PAGE` bytes, words of 4, bits that a write only clears and an erase only sets.
#[derive(Clone)]
pub struct Flash<const PAGE: usize> {
    pub bytes: Vec<u8>,
    pub log: Vec<Operation>,
    /// How often each page was erased.
    pub erasures: Vec<u32>,
    /// From now on the flash answers every command with an error.
    pub failing: bool,
    /// From now on writing and erasing change nothing.
    pub worn: bool,
}

impl<const PAGE: usize> Flash<PAGE> {
    pub fn blank(pages: usize) -> Self {
        Self { bytes: vec![0xFF; pages * PAGE], log: Vec::new(), erasures: vec![0; pages], failing: false, worn: false }
    }

    pub fn range(&self) -> std::ops::Range<u32> {
        0..self.bytes.len() as u32
    }

    /// What has been done since the last call.
    pub fn take_log(&mut self) -> Vec<Operation> {
        std::mem::take(&mut self.log)
    }

    pub fn apply(&mut self, operation: &Operation) {
        match operation {
            _ if self.worn => {}
            Operation::Write { offset, bytes } => self.program(*offset, bytes),
            Operation::Erase { offset } => {
                self.bytes[*offset..offset + PAGE].fill(0xFF);
                self.erasures[offset / PAGE] += 1;
            }
        }
    }

    /// The start of a stretch as an index, unless it is not in units of `unit`.
    fn index(&self, offset: u32, length: usize, unit: usize) -> Result<usize, NorFlashErrorKind> {
        let offset = offset as usize;
        match () {
            () if self.failing => Err(NorFlashErrorKind::Other),
            () if !offset.is_multiple_of(unit) || !length.is_multiple_of(unit) => Err(NorFlashErrorKind::NotAligned),
            () if offset + length > self.bytes.len() => Err(NorFlashErrorKind::OutOfBounds),
            () => Ok(offset),
        }
    }

    fn program(&mut self, offset: usize, bytes: &[u8]) {
        self.bytes[offset..].iter_mut().zip(bytes).for_each(|(cell, byte)| *cell &= byte);
    }

    /// The power fails in a write, after `whole` of its bytes: the next is left with some of its bits, and perhaps so
    /// are those that are programmed together with it.
    pub fn cut_write(&mut self, offset: usize, bytes: &[u8], whole: usize, random: &mut impl Rng) {
        self.program(offset, &bytes[..whole]);
        let together = PROGRAM - (offset + whole) % PROGRAM;
        let torn = if random.random() { 1 } else { together };
        for (cell, byte) in self.bytes[offset + whole..].iter_mut().zip(&bytes[whole..]).take(torn) {
            *cell &= byte | random.random::<u8>();
        }
    }

    /// The power fails in an erase: some bits are set already, or the page is programmed to zero first, or anything.
    pub fn cut_erase(&mut self, offset: usize, random: &mut impl Rng) {
        let page = &mut self.bytes[offset..offset + PAGE];
        let middle = random.random_range(0..=PAGE);
        match random.random_range(0..7) {
            0 => page[..middle].fill(0xFF),
            1 => page[middle..].fill(0xFF),
            2 => page[..middle].fill(0),
            3 => random.fill_bytes(page),
            4 => {
                page.fill(0xFF);
                (0..random.random_range(1..8)).for_each(|_| page[random.random_range(0..PAGE)] = random.random());
            }
            5 => {
                let (kept, erased) = page.split_at_mut(middle);
                kept.iter_mut().for_each(|cell| *cell |= random.random::<u8>() & random.random::<u8>());
                erased.fill(0xFF);
            }
            _ => {
                let share = random.random();
                page.iter_mut()
                    .for_each(|cell| (0..8).for_each(|bit| *cell |= u8::from(random.random_bool(share)) << bit));
            }
        }
    }
}

impl<const PAGE: usize> ErrorType for Flash<PAGE> {
    type Error = NorFlashErrorKind;
}

impl<const PAGE: usize> ReadNorFlash for Flash<PAGE> {
    const READ_SIZE: usize = 4;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let offset = self.index(offset, bytes.len(), Self::READ_SIZE)?;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const PAGE: usize> NorFlash for Flash<PAGE> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let from = self.index(from, to.saturating_sub(from) as usize, PAGE)?;
        for offset in (from..to as usize).step_by(PAGE) {
            let operation = Operation::Erase { offset };
            self.apply(&operation);
            self.log.push(operation);
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let offset = self.index(offset, bytes.len(), Self::WRITE_SIZE)?;
        let operation = Operation::Write { offset, bytes: bytes.to_vec() };
        self.apply(&operation);
        self.log.push(operation);
        Ok(())
    }
}
