//! The library under the `scram` command.
pub mod diagnose;
pub mod edge;
pub mod identify;
pub mod plot;
pub mod recording;
pub mod report;
pub mod sim;
