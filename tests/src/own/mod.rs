//! The simulator's own recordings, diagnosed with the simulator's own file: the same plant on both sides, so there is
//! nothing to explain; and with one listed effect taken out of the file, that effect is what is missing.
//!
//! This shows that `scram sim` and `scram diagnose` run one plant. It says nothing about whether that plant is right: the
//! blind campaign, whose world shares no code with the simulator, is there for that. And effects that steady recordings cannot
//! tell apart, with the experiment that does.

mod drives;
mod pairs;
mod set;

pub use drives::KINDS;
pub use pairs::{PairOutcome, examine_pair};
pub use set::{Expected, Outcome, Set, examine, sets, walks};
