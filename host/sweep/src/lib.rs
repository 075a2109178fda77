//! Experiments by the hundred: the thesis's conditions or any other, repeated over seeds, run over all cores.
//!
//! An [`Axis`] is what is varied, a [`Design`] the points and seeds, a [`Workshop`] makes the robots, a [`Campaign`] runs
//! them into a table that a kill cannot spoil. [`Conditions`] are means and spreads, [`claims`] judges what the thesis says,
//! `plot::figures` draws.

mod axis;
mod campaign;
pub mod claims;
mod design;
mod journal;
mod lock;
mod measure;
mod measured;
mod search;
mod table;
mod trial;
mod variant;

pub use axis::{Axis, AxisError, What, significant};
pub use campaign::{Campaign, Run, SweepError, Swept, Target};
pub use design::{ALPHAS, Design, FREQUENCIES, MORE_FRICTION, MOST_RUNS, USUAL_F_HZ};
pub use journal::JournalError;
pub use lock::{Lock, LockError};
pub use measure::Measures;
pub use measured::{Measured, MeasuredError};
pub use search::{Found, Search};
pub use table::{Component, Condition, Conditions, Robustness, SENSITIVITY_FLOOR, Stat, error_percent};
pub use trial::{DriveKind, INTERVAL_S, RunSettings, TrialError};
pub use variant::{Variant, Workshop};
