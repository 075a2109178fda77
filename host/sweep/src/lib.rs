//! Experiments by the hundred: the thesis's conditions or any other, repeated over seeds, run over all cores.
//!
//! An [`Axis`] is what is varied, a [`Design`] the points and seeds, a [`VariantBuilder`] makes the robots, a [`Campaign`] runs
//! them into a table that a kill cannot spoil. [`Conditions`] are means and spreads, [`claims`] judges what the thesis says,
//! `plot::figures` draws.
//!
//! ```
//! use std::path::Path;
//!
//! use robot_file::edit::Document;
//! use hal_sim::body::Precision;
//! use sweep::{Axis, Campaign, Component, Conditions, Design, DriveKind, RunSettings, Target, VariantBuilder};
//!
//! let document = Document::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml")))?;
//! let robot = document.robot()?;
//! let builder = VariantBuilder::new(document, robot)?;
//! // The robot with an ideal motor, at two frequencies.
//! let design = Design::product(Axis::parse_all(&["f=6,8".to_owned()])?, vec![1]);
//! let settings = RunSettings { drive: DriveKind::Exact, seconds: 0.5, step_s: 1e-4, precision: Precision::Double };
//! let directory = tempfile::tempdir()?;
//! let target = Target { directory: directory.path(), stem: "sweep", paths: false, fresh: true };
//! let swept = Campaign::new(&builder, design, settings)?.run(&target, Some(1), &mut |_, _| ())?;
//! let conditions = Conditions::new(&swept.design, &swept.runs);
//! assert!(conditions.means(Component::Longitudinal).iter().all(Option::is_some));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It draws nothing: `plot::figures` draws what a campaign has found.
//! * It talks to no other computer: [`Campaign::run`] uses one's cores, and a lock keeps a second one out. Who has rows made elsewhere,
//!   as `scram.cluster` does in Python, has [`Campaign::of_checked`] and [`Campaign::rows`].
//! * It measures nothing: [`Measured`] reads what others have measured.

mod arguments;
mod axis;
mod campaign;
pub mod claims;
mod design;
mod draw;
mod journal;
mod lock;
mod measure;
mod measured;
mod search;
mod setting;
mod table;
mod trial;
mod variant;

pub use arguments::{ArgumentError, SweepArguments, Turns};
pub use axis::{Axis, AxisError, Factor, significant};
pub use campaign::{Campaign, Ledger, Row, Run, SweepError, Swept, Target};
pub use design::{ALPHAS, Design, FREQUENCIES, MORE_FRICTION, MOST_RUNS, USUAL_F_HZ};
pub use journal::JournalError;
pub use lock::{Lock, LockError};
pub use measure::Measures;
pub use measured::{Measured, MeasuredError};
pub use search::{Found, Search};
pub use setting::SettingError;
pub use table::{Component, Condition, Conditions, Robustness, SENSITIVITY_FLOOR, Scatter, Stat, error_percent};
pub use trial::{DriveKind, INTERVAL_S, PATH_POINTS, RunSettings, SIDE_BY_SIDE, StepError, TrialError};
pub use variant::{Variant, VariantBuilder};
