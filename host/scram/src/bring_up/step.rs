//! One line of `firmware/UNVERIFIED.md` as something to do.

use serde::Serialize;

use super::rig::{Halt, Rig};

/// A board's chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Chip {
    /// ESP32.
    Esp32,
    /// ESP32-C3.
    Esp32c3,
}

impl Chip {
    /// As people write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Esp32 => "ESP32",
            Self::Esp32c3 => "ESP32-C3",
        }
    }
}

/// How the board is wired during a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wiring {
    /// Bridge logic supply only, motor unplugged.
    Bare,
    /// The same, and a constant 1.65 V in place of the potentiometer's wiper.
    Constant,
    /// Motor plugged in, shaft free.
    Motor,
}

/// Step of the bring-up: a claim about the board and how it is checked.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Its number in `firmware/UNVERIFIED.md`.
    pub number: u16,
    /// What is claimed, in a few words.
    pub title: &'static str,
    /// The chip that it is about, if only one.
    pub chip: Option<Chip>,
    /// How the board is wired.
    pub wiring: Wiring,
    /// What a person needs for it; empty where the program does all of it.
    pub needs: &'static str,
    /// What happens.
    pub about: &'static str,
    /// Does it and notes what it measures.
    pub(super) run: fn(&mut Rig) -> Result<(), Halt>,
}

/// Result of a step or of one of its checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StepResult {
    /// Every part is within its bound.
    Passed,
    /// At least one part is outside its bound.
    Failed,
    /// Not measured, or the operator could not tell.
    NotChecked,
}

impl StepResult {
    /// For people.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "FAILED",
            Self::NotChecked => "not checked",
        }
    }

    /// Of parts: one that failed fails the whole, and what nobody looked at leaves it open.
    #[must_use]
    pub fn of(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut whole = None;
        for part in parts {
            whole = Some(match (whole, part) {
                (Some(Self::Failed), _) | (_, Self::Failed) => Self::Failed,
                (Some(Self::NotChecked), _) | (_, Self::NotChecked) => Self::NotChecked,
                _ => Self::Passed,
            });
        }
        whole.unwrap_or(Self::NotChecked)
    }
}

/// A part of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// What was looked at.
    pub what: String,
    /// What was found, with its unit; or why nobody looked.
    pub found: String,
    /// What was expected.
    pub expected: String,
    /// What became of it.
    pub verdict: StepResult,
}

/// A step that was done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Checked {
    /// Its number.
    pub number: u16,
    /// What is claimed.
    pub title: &'static str,
    /// What a person needs for it.
    pub needs: &'static str,
    /// What became of it.
    pub verdict: StepResult,
    /// Its parts.
    pub checks: Vec<Check>,
}

impl Checked {
    /// From its parts.
    #[must_use]
    pub fn new(step: &Step, checks: Vec<Check>) -> Self {
        let verdict = StepResult::of(checks.iter().map(|check| check.verdict));
        Self { number: step.number, title: step.title, needs: step.needs, verdict, checks }
    }
}

#[cfg(test)]
mod tests {
    use super::StepResult::{Failed, NotChecked, Passed};
    use super::*;

    #[test]
    fn only_what_was_looked_at_in_all_its_parts_has_passed() {
        for (parts, whole) in [
            (&[][..], NotChecked),
            (&[Passed, Passed], Passed),
            (&[Passed, NotChecked, Passed], NotChecked),
            (&[NotChecked, Failed, Passed], Failed),
            (&[Failed, NotChecked], Failed),
        ] {
            assert_eq!(StepResult::of(parts.iter().copied()), whole, "{parts:?}");
        }
    }
}
