//! The most memory that a piece of work holds beyond what the process had before it.
//!
//! Linux keeps a process's highest resident set (`VmHWM` of `/proc/self/status`) and takes it back to the present one when `5` is
//! written to `/proc/self/clear_refs` (proc(5)). Elsewhere nothing is measured. What an allocator kept from earlier work and uses
//! again is not counted: a data set that follows larger ones shows less than it needs.

use std::fs;

/// Bytes in a MB.
const MB: f64 = 1e6;

/// Runs a piece of work; with its result comes the most memory that it held, MB, or `None` where this machine does not say.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, Option<f64>) {
    let before = reset();
    let result = work();
    let peak = before.and_then(|before| Some((field("VmHWM:")? - before).max(0.0)));
    (result, peak)
}

/// Takes the peak back to what is resident now, and returns that, MB.
fn reset() -> Option<f64> {
    fs::write("/proc/self/clear_refs", "5").ok()?;
    field("VmHWM:")
}

/// A size in `/proc/self/status`, MB.
fn field(name: &str) -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let words = status.lines().find_map(|line| line.strip_prefix(name))?;
    let kib: f64 = words.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024.0 / MB)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pages that are touched and given back count, and what was there before does not.
    #[test]
    #[cfg(target_os = "linux")]
    fn the_peak_is_what_the_work_held_at_most() {
        const HELD: usize = 300_000_000;
        let kept = vec![1u8; HELD / 2];
        let hold = || std::hint::black_box(vec![1u8; HELD]).len();
        let (length, peak) = measured(hold);
        assert_eq!(length, HELD);
        let peak = peak.expect("Linux says how much");
        assert!((peak - 300.0).abs() < 40.0, "{peak} MB");
        let (_, after) = measured(|| std::hint::black_box(kept.len()));
        assert!(after.expect("Linux says how much") < 60.0, "the peak before counts no more: {after:?}");
    }
}
