//! What `scram hil` says about the chip, beside the run itself.

use control::protocol::lockstep::Target;
use scram::hil::{Remote, Transport};
use serde::Serialize;

/// What is said about the chip.
#[derive(Serialize)]
pub struct OnChip {
    target: &'static str,
    cost_unit: &'static str,
    cost_median: u32,
    cost_worst: u32,
    stack_bytes: u32,
    controller_bytes: u32,
    requests_resent: u32,
    resynchronised: u32,
    bad_frames_here: u32,
    bad_frames_there: u32,
    bytes_lost: u64,
}

/// The target and the unit of its costs.
fn named(target: Target) -> (&'static str, &'static str) {
    match target {
        Target::Rv32 => ("RV32IMC in QEMU", "instructions"),
        Target::Esp32c3 => ("ESP32-C3", "cycles"),
        Target::Esp32 => ("ESP32", "cycles"),
        Target::Host => ("this computer", "(not measured)"),
    }
}

impl OnChip {
    /// What a run on it has shown.
    pub fn of<T: Transport>(chip: &Remote<T>) -> Self {
        let (cost_median, cost_worst) = chip.ticks().median_and_worst().unwrap_or_default();
        let (target, cost_unit) = named(chip.hello().target);
        let counts = chip.counts();
        Self {
            target,
            cost_unit,
            cost_median,
            cost_worst,
            stack_bytes: chip.ticks().stack,
            controller_bytes: chip.hello().controller_bytes,
            requests_resent: counts.resent,
            resynchronised: counts.resynchronised,
            bad_frames_here: counts.bad_here,
            bad_frames_there: counts.bad_there,
            bytes_lost: counts.lost_bytes,
        }
    }

    /// For the table.
    pub fn facts(&self) -> Vec<(&str, String)> {
        let stack = match self.stack_bytes {
            0 => "not measured".to_owned(),
            bytes => format!("{bytes} bytes"),
        };
        vec![
            ("decided by", self.target.to_owned()),
            ("a tick, median / worst", format!("{} / {} {}", self.cost_median, self.cost_worst, self.cost_unit)),
            ("its stack at most", stack),
            ("the controller in RAM", format!("{} bytes", self.controller_bytes)),
            ("requests sent again", self.requests_resent.to_string()),
            ("bad frames here / there", format!("{} / {}", self.bad_frames_here, self.bad_frames_there)),
            ("resynchronised", format!("{} times, {} bytes lost", self.resynchronised, self.bytes_lost)),
        ]
    }
}
