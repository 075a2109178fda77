//! Mean speeds of robots whose walk has an effect that their file lacks, or none, to be diagnosed (`cargo blind-walks`).
//!
//! No speed is this simulator's: MuJoCo's multibody walks under laws of the feet that `tests/mujoco/feet.c` has for itself. The tables are
//! in `tests/walks`, since they take an hour to make; what is hidden in which follows from its number alone (`truth`).

pub mod score;
pub mod tables;
pub mod truth;
pub mod visible;

pub use score::{Outcome, rows};
pub use tables::{make, table};
pub use truth::{Hidden, Truth, robot_file, truths};
