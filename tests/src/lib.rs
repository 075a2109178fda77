//! Whole-system tests.

pub mod blind;
pub mod figures;
pub mod pil;
