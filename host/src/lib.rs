//! The library under the `scram` command.
pub mod bring_up;
pub mod console;
pub mod diagnose;
pub mod edge;
pub mod hil;
pub mod identify;
pub mod link;
pub mod mjcf;
pub mod plot;
pub mod recording;
pub mod replay;
pub mod report;
pub mod serial;
pub mod sim;
pub mod sweep;
pub mod view;
