//! What the host's crates share.
pub mod conventions;
