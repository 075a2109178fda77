//! What the firmware's programs share: a chip's peripherals behind the traits of [`shell::board`].
//!
//! The decisions are `control`'s and the tasks `shell`'s; here are pins, registers and start-up. What differs between the
//! chips is in [`board`] and nowhere else.

#![no_std]

pub mod adc;
#[cfg(feature = "esp32c3")]
mod analog_bus;
#[cfg(feature = "esp32")]
mod analog_power;
pub mod board;
pub mod bridge;
pub mod flash;
#[cfg(feature = "inject")]
pub mod inject;
pub mod led;
pub mod memory;
pub mod panic;
pub mod radio;
pub mod random;
pub mod reset;
pub mod tick;
pub mod watchdog;
