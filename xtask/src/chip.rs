//! The two chips: their names in cargo, in espflash, and where their memories lie.

use clap::ValueEnum;

/// The programs that a chip can run.
pub const BINARIES: [&str; 3] = ["robot", "dongle", "hil"];

/// Whether a program has a radio.
pub fn has_radio(binary: &str) -> bool {
    binary != "hil"
}

/// A chip that the firmware is written for.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Chip {
    /// The thesis's board, ESP32-WROOM-32: Xtensa, linked by Espressif's toolchain only
    Esp32,
    /// The second board, ESP32-C3: RISC-V, linked by any Rust toolchain
    Esp32c3,
}

/// What kind of memory an address belongs to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Memory {
    /// Constants in flash, read through the cache
    FlashData,
    /// Code in flash, run through the cache
    FlashCode,
    /// Static RAM on the data bus
    RamData,
    /// Static RAM on the instruction bus
    RamCode,
    /// The RTC's RAM, which a reset leaves as it is
    Rtc,
}

/// The C3's address ranges: ESP32-C3 technical reference manual 1.1, table 3-1.
const ESP32C3: [(u64, u64, Memory); 5] = [
    (0x3C00_0000, 0x3C80_0000, Memory::FlashData),
    (0x4200_0000, 0x4280_0000, Memory::FlashCode),
    (0x3FC8_0000, 0x3FCE_0000, Memory::RamData),
    (0x4037_C000, 0x403E_0000, Memory::RamCode),
    (0x5000_0000, 0x5000_2000, Memory::Rtc),
];

/// The ESP32's address ranges: ESP32 technical reference manual 5.2, tables 1.3-1 … 1.3-4.
const ESP32: [(u64, u64, Memory); 7] = [
    (0x3F40_0000, 0x3F80_0000, Memory::FlashData),
    (0x400C_2000, 0x40C0_0000, Memory::FlashCode),
    (0x3FFA_E000, 0x4000_0000, Memory::RamData),
    (0x4007_0000, 0x400C_0000, Memory::RamCode),
    (0x3FF8_0000, 0x3FF8_2000, Memory::Rtc),
    (0x400C_0000, 0x400C_2000, Memory::Rtc),
    (0x5000_0000, 0x5000_2000, Memory::Rtc),
];

impl Chip {
    /// The name that cargo's features, espflash and the budget file use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Esp32 => "esp32",
            Self::Esp32c3 => "esp32c3",
        }
    }

    /// The compiler's target.
    pub fn target(self) -> &'static str {
        match self {
            Self::Esp32 => "xtensa-esp32-none-elf",
            Self::Esp32c3 => "riscv32imc-unknown-none-elf",
        }
    }

    /// The memory that an address belongs to, if the firmware may use it.
    pub fn memory(self, address: u64) -> Option<Memory> {
        let map: &[_] = match self {
            Self::Esp32 => &ESP32,
            Self::Esp32c3 => &ESP32C3,
        };
        map.iter().find(|(from, to, _)| (*from..*to).contains(&address)).map(|(_, _, memory)| *memory)
    }
}
