//! Whole-system tests.

pub mod blind;
pub mod figures;
