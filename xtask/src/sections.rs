//! How an ELF file divides into flash and RAM.

use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr};
use object::{Object, ObjectSection, SectionFlags, SectionKind, elf};

use crate::chip::{Chip, Memory};

/// Bytes of each kind that a binary takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Sections {
    /// Code that runs from flash
    pub flash_code: u64,
    /// Constants that are read from flash
    pub flash_data: u64,
    /// Code that runs from RAM
    pub ram_code: u64,
    /// Variables with an initial value
    pub ram_data: u64,
    /// Variables that start as zero or undefined, the heap among them
    pub ram_zeroed: u64,
    /// The RTC's RAM
    pub rtc: u64,
    /// What is left of the main RAM for the stack
    pub stack: u64,
}

impl Sections {
    /// RAM that is taken before the first function runs.
    pub fn static_ram(&self) -> u64 {
        self.ram_code + self.ram_data + self.ram_zeroed
    }

    /// Reads the section table of a linked binary.
    pub fn read(chip: Chip, file: &Path) -> Result<Self> {
        let bytes = std::fs::read(file).into_diagnostic().wrap_err_with(|| file.display().to_string())?;
        Self::parse(chip, &bytes)
            .wrap_err_with(|| format!("{} is not an ELF file for the {}", file.display(), chip.name()))
    }

    fn parse(chip: Chip, bytes: &[u8]) -> Result<Self> {
        let elf = object::File::parse(bytes).into_diagnostic()?;
        let mut sections = Self::default();
        for section in elf.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            let name = section.name().into_diagnostic()?;
            if sh_flags & u64::from(elf::SHF_ALLOC) == 0 {
                continue;
            }
            sections.add(chip.memory(section.address()), name, section.kind(), section.size());
        }
        Ok(sections)
    }

    fn add(&mut self, memory: Option<Memory>, name: &str, kind: SectionKind, size: u64) {
        // The linker script leaves room with sections named `…_dummy` where the same memory, or the same page of flash,
        // is already in use under another address.
        if name.ends_with("_dummy") {
            return;
        }
        let zeroed = kind == SectionKind::UninitializedData;
        let total = match memory {
            Some(Memory::RamData) if name == ".stack" => &mut self.stack,
            Some(Memory::RamData) if zeroed => &mut self.ram_zeroed,
            Some(Memory::RamData) => &mut self.ram_data,
            Some(Memory::RamCode) => &mut self.ram_code,
            Some(Memory::FlashCode) => &mut self.flash_code,
            Some(Memory::FlashData) => &mut self.flash_data,
            Some(Memory::Rtc) => &mut self.rtc,
            None => return,
        };
        *total += size;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_section_is_counted_where_it_lies() {
        let chip = Chip::Esp32c3;
        let mut sections = Sections::default();
        for (address, name, kind, size) in [
            (0x4038_0000, ".trap", SectionKind::Text, 1),
            (0x4038_0700, ".rwtext", SectionKind::Text, 2),
            (0x3FC8_0000, ".rwdata_dummy", SectionKind::UninitializedData, 256),
            (0x3FC8_1968, ".data", SectionKind::Data, 4),
            (0x3FC8_1F30, ".bss", SectionKind::UninitializedData, 8),
            (0x3FC9_4194, ".stack", SectionKind::UninitializedData, 16),
            (0x3C00_0120, ".rodata", SectionKind::ReadOnlyData, 32),
            (0x4201_0020, ".text", SectionKind::Text, 64),
            (0x5000_0000, ".rtc_fast.persistent", SectionKind::UninitializedData, 128),
        ] {
            sections.add(chip.memory(address), name, kind, size);
        }
        let expected =
            Sections { flash_code: 64, flash_data: 32, ram_code: 3, ram_data: 4, ram_zeroed: 8, rtc: 128, stack: 16 };
        assert_eq!(sections, expected);
        assert_eq!(sections.static_ram(), 15);
    }

    #[test]
    fn a_file_that_is_no_elf_is_refused() {
        assert!(Sections::parse(Chip::Esp32c3, b"#!/bin/sh").is_err());
    }
}
