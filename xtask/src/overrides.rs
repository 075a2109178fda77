//! Whether the linked image really uses the functions by which the firmware overrides weak ones of the radio's library.
//!
//! A weak function that wins does nothing, and nothing complains: the image links, boots and sends.

use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use object::{Object, ObjectSection, ObjectSymbol};

use crate::chip::{Chip, Memory, has_radio};

/// The first instruction of a function that only returns, RISC-V: `ret`, compressed.
const RISCV_RETURN: [u8; 2] = [0x82, 0x80];

impl Chip {
    /// What the firmware overrides (firmware/src/analog_bus.rs, firmware/src/analog_power.rs).
    fn overrides(self) -> &'static [&'static str] {
        match self {
            Self::Esp32 => &["set_xpd_sar"],
            Self::Esp32c3 => &["phy_i2c_enter_critical", "phy_i2c_exit_critical"],
        }
    }
}

/// Fails where a program with a radio has not got them, or has the weak ones.
pub fn check(chip: Chip, binary: &str, file: &Path) -> Result<()> {
    if !has_radio(binary) {
        return Ok(());
    }
    let bytes = std::fs::read(file).into_diagnostic().wrap_err_with(|| file.display().to_string())?;
    let elf = object::File::parse(bytes.as_slice()).into_diagnostic().wrap_err_with(|| file.display().to_string())?;
    let wrong: Vec<String> = chip.overrides().iter().filter_map(|name| fault(chip, &elf, name)).collect();
    if wrong.is_empty() {
        return Ok(());
    }
    Err(miette!(
        help = "the radio and the converter would share hardware without knowing of each other: \
                see firmware/src/analog_bus.rs and firmware/src/analog_power.rs",
        "{binary} for the {} does not override the radio's library: {}",
        chip.name(),
        wrong.join("; ")
    ))
}

/// What is wrong with a function; nothing if the firmware's own is linked.
fn fault(chip: Chip, elf: &object::File<'_>, name: &str) -> Option<String> {
    let mut found = elf.symbols().filter(|symbol| symbol.name() == Ok(name) && symbol.is_definition());
    let Some(symbol) = found.next() else { return Some(format!("`{name}` is not in the image")) };
    if found.next().is_some() {
        return Some(format!("`{name}` is in the image twice"));
    }
    if symbol.is_weak() {
        return Some(format!("`{name}` is the library's own, which is weak"));
    }
    if chip.memory(symbol.address()) != Some(Memory::RamCode) {
        return Some(format!("`{name}` is not in RAM, and is called while the flash is busy"));
    }
    if chip == Chip::Esp32c3 && first_instruction(elf, &symbol) == Some(RISCV_RETURN) {
        return Some(format!("`{name}` does nothing"));
    }
    None
}

/// The first two bytes of a function.
fn first_instruction<'e>(elf: &object::File<'e>, symbol: &impl ObjectSymbol<'e>) -> Option<[u8; 2]> {
    let section = elf.section_by_index(symbol.section_index()?).ok()?;
    section.data_range(symbol.address(), 2).ok()??.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use object::write::{Object as Written, StandardSection, Symbol, SymbolSection};
    use object::{Architecture, BinaryFormat, Endianness, SymbolFlags, SymbolKind, SymbolScope};

    const NAME: &str = "phy_i2c_enter_critical";

    /// An object file whose code lies at 0, in no memory of the chip.
    fn elf(weak: bool) -> Vec<u8> {
        let mut file = Written::new(BinaryFormat::Elf, Architecture::Riscv32, Endianness::Little);
        let section = file.section_id(StandardSection::Text);
        let value = file.append_section_data(section, &RISCV_RETURN, 2);
        file.add_symbol(Symbol {
            name: NAME.into(),
            value,
            size: 2,
            kind: SymbolKind::Text,
            scope: SymbolScope::Linkage,
            weak,
            section: SymbolSection::Section(section),
            flags: SymbolFlags::None,
        });
        file.write().expect("an object file")
    }

    fn told(bytes: &[u8], name: &str) -> Option<String> {
        fault(Chip::Esp32c3, &object::File::parse(bytes).expect("it is one"), name)
    }

    #[test]
    fn a_function_that_is_missing_weak_or_in_flash_is_told() {
        assert!(told(&elf(true), NAME).expect("weak").contains("weak"));
        assert!(told(&elf(false), "set_xpd_sar").expect("missing").contains("not in the image"));
        assert!(told(&elf(false), NAME).expect("elsewhere").contains("not in RAM"));
    }

    #[test]
    fn the_first_instruction_is_found() {
        let bytes = elf(false);
        let file = object::File::parse(bytes.as_slice()).expect("it is one");
        let symbol = file.symbols().find(|symbol| symbol.name() == Ok(NAME)).expect("it is there");
        assert_eq!(first_instruction(&file, &symbol), Some(RISCV_RETURN));
    }
}
