//! The host as a board.

pub mod bench;
pub mod journal;
pub mod parts;
pub mod radio;
pub mod time;
