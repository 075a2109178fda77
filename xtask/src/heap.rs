//! The radio's heap as the firmware computes it: how large it is, and what can be on it at the same time.

use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use object::{Object, ObjectSection, ObjectSymbol};

use crate::budget::grouped;

/// Two numbers of four bytes, little-endian: firmware/src/memory.rs.
const SYMBOL: &str = "SCRAM_RADIO_HEAP";

/// The heap of one program.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Heap {
    /// All of it
    pub bytes: u64,
    /// What can be on it at the same time
    pub worst_case: u64,
}

impl Heap {
    /// Reads it from a linked program; nothing where it does not say.
    pub fn read(file: &Path) -> Result<Option<Self>> {
        let bytes = std::fs::read(file).into_diagnostic().wrap_err_with(|| file.display().to_string())?;
        Self::parse(&bytes).wrap_err_with(|| file.display().to_string())
    }

    fn parse(bytes: &[u8]) -> Result<Option<Self>> {
        let elf = object::File::parse(bytes).into_diagnostic()?;
        let Some(symbol) = elf.symbols().find(|symbol| symbol.name() == Ok(SYMBOL)) else { return Ok(None) };
        let section = symbol.section_index().and_then(|index| elf.section_by_index(index).ok());
        let data = section.and_then(|section| section.data_range(symbol.address(), symbol.size()).ok().flatten());
        let Some(([bytes, worst_case], [])) = data.map(<[u8]>::as_chunks::<4>) else {
            return Err(miette!(
                "`{SYMBOL}` is not two numbers of four bytes: firmware/src/memory.rs and xtask differ"
            ));
        };
        let number = |bytes: &[u8; 4]| u64::from(u32::from_le_bytes(*bytes));
        Ok(Some(Self { bytes: number(bytes), worst_case: number(worst_case) }))
    }

    /// What is left in the worst case.
    pub fn least_free(self) -> u64 {
        self.bytes.saturating_sub(self.worst_case)
    }
}

/// What is wrong with a program's heap; nothing if its budget holds.
pub fn violation(heap: Option<Heap>, budget: Option<u64>) -> Option<String> {
    match (heap, budget) {
        (None, None) => None,
        (Some(_), None) => Some("radio's heap has no budget: add heap_least_free_bytes".to_owned()),
        (None, Some(_)) => Some(format!("heap_least_free_bytes is in the budget, and the image has no `{SYMBOL}`")),
        (Some(heap), Some(budget)) => (heap.least_free() < budget).then(|| {
            let (free, budget) = (grouped(heap.least_free()), grouped(budget));
            format!("radio's heap: {free} bytes left in the worst case, budget {budget} at the least")
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use object::write::{Object as Written, StandardSection, Symbol, SymbolSection};
    use object::{Architecture, BinaryFormat, Endianness, SymbolFlags, SymbolKind, SymbolScope};

    fn elf(name: &str, data: &[u8]) -> Vec<u8> {
        let mut file = Written::new(BinaryFormat::Elf, Architecture::Riscv32, Endianness::Little);
        let section = file.section_id(StandardSection::ReadOnlyData);
        let value = file.append_section_data(section, data, 4);
        file.add_symbol(Symbol {
            name: name.into(),
            value,
            size: data.len() as u64,
            kind: SymbolKind::Data,
            scope: SymbolScope::Linkage,
            weak: false,
            section: SymbolSection::Section(section),
            flags: SymbolFlags::None,
        });
        file.write().expect("an object file")
    }

    #[test]
    fn the_two_numbers_are_read_from_the_image() {
        let data = [73_728_u32.to_le_bytes(), 70_000_u32.to_le_bytes()].concat();
        let heap = Heap::parse(&elf(SYMBOL, &data)).expect("readable");
        assert_eq!(heap, Some(Heap { bytes: 73_728, worst_case: 70_000 }));
        assert_eq!(heap.map(Heap::least_free), Some(3728));
        assert_eq!(Heap::parse(&elf("other", &data)).expect("readable"), None);
        assert!(Heap::parse(&elf(SYMBOL, &data[..7])).is_err());
    }

    #[test]
    fn the_budget_is_what_must_be_left_and_every_radio_has_one() {
        let heap = Some(Heap { bytes: 73_728, worst_case: 70_000 });
        assert_eq!(violation(heap, Some(3728)), None);
        assert!(violation(heap, Some(3729)).expect("too little").contains("3 728 bytes left"));
        assert!(violation(heap, None).is_some() && violation(None, Some(1)).is_some());
        assert_eq!(violation(None, None), None);
        assert!(violation(Some(Heap { bytes: 1, worst_case: 2 }), Some(1)).is_some());
    }
}
