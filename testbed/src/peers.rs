//! What some tests need and not every machine has: QEMU, MuJoCo, a browser, `script`; a disk of its own, others' recordings.

use std::io::Write;

/// Where it is 1, as in `.ci/run`, nothing may be skipped.
pub const ALL_PEERS: &str = "SCRAM_ALL_PEERS";

/// Whether every peer must be there.
#[must_use]
pub fn all_wanted() -> bool {
    std::env::var(ALL_PEERS).is_ok_and(|value| value == "1")
}

/// Says that a test asserts nothing here, and why: on stderr itself, which a test that passes does not swallow.
///
/// # Panics
/// Where every peer must be there ([`all_wanted`]).
pub fn skip(why: &str) {
    assert!(!all_wanted(), "{why}, and with {ALL_PEERS}=1 nothing may be skipped");
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}

/// The same for what no installation brings, others' recordings and the right to mount: it may be skipped everywhere.
pub fn skip_anywhere(why: &str) {
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}
