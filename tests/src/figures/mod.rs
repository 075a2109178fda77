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
pub mod two_sensors;

pub use crate::row::FigureRow;

/// One campaign: its name, and what makes its rows for a number of seeds.
pub type Campaign = (&'static str, fn(&run::DesignedRobot, u64) -> Vec<FigureRow>);

/// Every campaign with its name for `--only`.
pub const CAMPAIGNS: [Campaign; 8] = [
    ("speed", speed::rows),
    ("calibrated", calibration::rows),
    ("ceiling", ceiling::rows),
    ("oscillation", oscillation::rows),
    ("mismatch", mismatch::rows),
    ("comparison", comparison::rows),
    ("faults", supervision::rows),
    ("two-sensors", two_sensors::rows),
];
