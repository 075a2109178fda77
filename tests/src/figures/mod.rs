//! The figures on control that the project promises: campaigns over seeds, each row with what is required and what was
//! measured. `figures` (the binary) prints them all; smaller versions of every row run as ordinary tests.

pub mod calibration;
pub mod ceiling;
pub mod comparison;
pub mod mismatch;
pub mod oscillation;
pub mod run;
pub mod speed;
pub mod supervision;

use serde_json::Value;

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was tried.
    pub what: String,
    /// What is required; empty for a row that only informs.
    pub required: String,
    /// What was measured.
    pub measured: String,
    /// Whether it holds; `None` for a row that only informs.
    pub holds: Option<bool>,
    /// The measured numbers, for machines.
    pub numbers: Value,
}

impl Row {
    /// A row with a requirement.
    #[must_use]
    pub fn new(what: &str, required: &str, measured: String, holds: bool, numbers: Value) -> Self {
        Self { what: what.into(), required: required.into(), measured, holds: Some(holds), numbers }
    }

    /// A row that stands beside another for comparison.
    #[must_use]
    pub fn beside(what: &str, measured: String, numbers: Value) -> Self {
        Self { what: what.into(), required: String::new(), measured, holds: None, numbers }
    }
}

/// One campaign: its name, and what makes its rows for a number of seeds.
pub type Campaign = (&'static str, fn(&run::Bench, u64) -> Vec<Row>);

/// Every campaign.
pub const CAMPAIGNS: [Campaign; 7] = [
    ("speed", speed::rows),
    ("calibrated", calibration::rows),
    ("ceiling", ceiling::rows),
    ("oscillation", oscillation::rows),
    ("mismatch", mismatch::rows),
    ("comparison", comparison::rows),
    ("faults", supervision::rows),
];
