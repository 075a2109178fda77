//! Whole-system tests.

pub mod blind;
pub mod body;
pub mod figures;
pub mod fuzz;
pub mod journal;
pub mod link;
pub mod own;
pub mod page;
pub mod pil;
pub mod row;
pub mod safety;
pub mod seeds;
pub mod walks;
