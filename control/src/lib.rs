//! Every decision of the robot: estimator, speed and position control, supervisor.
//!
//! A synchronous state machine without a clock, an allocator or a chip: [`Controller::tick`] takes a [`Sample`] (its time
//! is in it) and answers with an [`Actuation`]. It may touch no `std`, no heap, no `unsafe`, no clock, no chip, and it has
//! no panic: parameters and commands are checked where they enter, and whatever a sample holds is borne.
//!
//! SI units and radians; motor values at the output shaft; angles counter-clockwise positive, 0 in the middle of the
//! potentiometer's gap.

#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::indexing_slicing,
        clippy::panic,
        clippy::float_cmp,
        clippy::cast_possible_truncation
    )
)]

#[cfg(test)]
extern crate std;

pub mod acquire;
pub mod angle;
pub mod clock;
pub mod command;
pub mod controller;
pub mod drive;
mod error;
pub mod estimator;
pub mod fault_detectors;
pub mod gait;
pub mod loop_health;
pub mod oscillator;
pub mod parameters;
pub mod position;
pub mod protocol;
pub mod sample;
pub mod scalar;
mod second_sensor;
pub mod self_check;
pub mod sensor;
pub mod sensor_pair;
pub mod speed;
pub mod supervisor;
pub mod telemetry;
pub mod winding;

pub use command::{Command, Field, Refusal, Stroke};
pub use controller::Controller;
pub use error::ParameterError;
pub use gait::{Gait, Motion};
pub use parameters::Parameters;
pub use sample::{Actuation, AdcCode, Sample};
pub use second_sensor::SecondSensor;
pub use self_check::Unready;
pub use sensor_pair::Sensor;
pub use supervisor::{Fault, State};
pub use telemetry::Telemetry;
