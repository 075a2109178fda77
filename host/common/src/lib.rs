//! What the crates of the host share: angles on the circle, order statistics, files that are written whole, how progress is
//! told, and the conventions of units and signs towards people.
//!
//! ```
//! use common::conventions::{degrees, frequency_from_omega};
//! use common::{median, wrap};
//!
//! // A shaft that turns counter-clockwise by 10° a millisecond, read modulo a turn.
//! let read: Vec<f64> = (0..100).map(|ms| wrap(f64::from(10 * ms).to_radians())).collect();
//! let mut steps: Vec<f64> = read.windows(2).map(|pair| wrap(pair[1] - pair[0])).collect();
//! let step = median(&mut steps).expect("99 steps");
//! assert!((degrees(step) - 10.0).abs() < 1e-9);
//! // For people the frequency is positive clockwise.
//! assert!((frequency_from_omega(step / 1e-3) + 27.78).abs() < 0.01);
//! ```
//!
//! What it does not do:
//!
//! * It knows nothing of the robot and depends on no other crate of the project.
//! * It has no numerics beyond order statistics: fits and filters are where they are used.
//! * It prints nothing and reads no file.

pub mod angle;
pub mod atomic;
pub mod conventions;
pub mod statistics;

pub use angle::wrap;
pub use statistics::{median, quantile};

/// Is told what is being done (a word or two) and the share done, 0 … 1.
pub type Progress = std::sync::Arc<dyn Fn(&str, f64) + Send + Sync>;
