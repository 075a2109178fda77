//! The robot's and the dongle's tasks: a thin async shell around [`control`].
//!
//! Generic over the [`board`], so that the same tasks run on an ESP32 and, under virtual time, on the host. It may
//! decide nothing about the motor: that is `control`'s. No `std`, no heap, no chip.

#![no_std]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

pub mod adc;
pub mod board;
pub mod bounded;
pub mod dongle;
pub mod image;
pub mod inbox;
pub mod inject;
pub mod pwm;
pub mod robot;
pub mod store;
