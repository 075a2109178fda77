//! The library under the `scram` command.
pub mod bring_up;
pub mod console;
pub mod hil;
pub mod progress;
pub mod replay;
