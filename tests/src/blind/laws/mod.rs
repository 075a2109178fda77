//! The truth's laws, each richer than what a diagnosis library would use, and two of each.
//!
//! Nothing here is an approximation of the library's law on purpose: bristles are elasto-plastic, gears lose more when
//! they are driven back, the bridge is a transistor and a diode by PWM phase, the battery has two RC pairs.

mod electrical;
mod friction;
mod shaft;

pub use electrical::{Battery, Bridge, COPPER_PER_KELVIN, CommandDrop, Deadband, Discharge, Heating, Loss};
pub use friction::{Bristle, Patch, Weakening};
pub use shaft::{Bias, Drag, Gravity, Grease, Ripple, TwoInertias};
