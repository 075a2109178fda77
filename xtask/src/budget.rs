//! How large a binary may be: `firmware/budgets.toml`.

use std::collections::BTreeMap;
use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::Deserialize;

use crate::chip::Chip;

/// The limits of one binary.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Application image in flash
    pub image_bytes: u64,
    /// RAM taken before the first function runs
    pub static_ram_bytes: u64,
    /// What must be left of the radio's heap in the worst case; nothing for a program without a radio
    pub heap_least_free_bytes: Option<u64>,
}

/// The limits of every binary, by chip and name.
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub struct Budgets(BTreeMap<String, BTreeMap<String, Budget>>);

impl Budgets {
    /// Reads the budget file.
    pub fn read(file: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(file).into_diagnostic().wrap_err_with(|| file.display().to_string())?;
        Self::parse(&text).wrap_err_with(|| file.display().to_string())
    }

    fn parse(text: &str) -> Result<Self> {
        toml::from_str(text).map_err(|error| miette!("{}", error.to_string().trim_end()))
    }

    /// The limits of one binary.
    pub fn of(&self, chip: Chip, binary: &str) -> Result<Budget> {
        self.0.get(chip.name()).and_then(|binaries| binaries.get(binary)).copied().ok_or_else(|| {
            miette!(
                "the budget file has no table [{}.{binary}] with image_bytes and static_ram_bytes: add it",
                chip.name()
            )
        })
    }
}

/// Says by how much a size goes over its limit, or nothing.
pub fn over(what: &str, used: u64, limit: u64) -> Option<String> {
    let excess = used.checked_sub(limit).filter(|excess| *excess > 0)?;
    Some(format!("{what} {} bytes, budget {}: {} over", grouped(used), grouped(limit), grouped(excess)))
}

/// A number with its digits in groups of three.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "[esp32c3.robot]\nimage_bytes = 500_000\nstatic_ram_bytes = 150_000\n";

    #[test]
    fn a_budget_is_found_by_chip_and_binary() {
        let budgets = Budgets::parse(GOOD).expect("a budget");
        let robot = budgets.of(Chip::Esp32c3, "robot").expect("the robot's");
        assert_eq!(robot, Budget { image_bytes: 500_000, static_ram_bytes: 150_000, heap_least_free_bytes: None });
    }

    #[test]
    fn a_missing_budget_names_the_table_to_add() {
        let budgets = Budgets::parse(GOOD).expect("a budget");
        let error = budgets.of(Chip::Esp32c3, "dongle").expect_err("none").to_string();
        assert!(error.contains("[esp32c3.dongle]"), "{error}");
    }

    #[test]
    fn a_mistake_is_told_with_its_line() {
        for (text, told) in [
            ("[esp32c3.robot]\nimage_bytes = -1\nstatic_ram_bytes = 1\n", "line 2"),
            ("[esp32c3.robot]\nimage_bytes = 1\nram = 1\n", "unknown field `ram`"),
            ("[esp32c3.robot]\nimage_bytes = 1\n", "missing field `static_ram_bytes`"),
        ] {
            let error = Budgets::parse(text).expect_err(text).to_string();
            assert!(error.contains(told), "{error}");
        }
    }

    #[test]
    fn exactly_the_budget_is_allowed_and_one_more_is_not() {
        assert_eq!(over("image", 500_000, 500_000), None);
        assert_eq!(
            over("image", 512_345, 500_000).as_deref(),
            Some("image 512 345 bytes, budget 500 000: 12 345 over")
        );
        assert_eq!(over("image", 500_001, 500_000).as_deref(), Some("image 500 001 bytes, budget 500 000: 1 over"));
    }

    #[test]
    fn digits_are_grouped_from_the_right() {
        assert_eq!([7, 999, 1000, 1_234_567].map(grouped), ["7", "999", "1 000", "1 234 567"]);
    }
}
