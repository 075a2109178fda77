//! The controller of a chip in the loop with the simulated plant: a board on a serial port (hardware in the loop), or
//! RISC-V machine code in QEMU (processor in the loop). Both speak [`control::protocol::lockstep`].
//!
//! [`Remote`] decides wherever [`simulation`] takes a decider; [`Client`] asks; a [`Transport`] carries bytes.

mod client;
mod error;
mod port;
mod program;
mod qemu;
mod remote;

use std::time::Duration;

pub use client::{Client, Counts};
pub use error::HilError;
pub use port::Port;
pub use program::build_program;
pub use qemu::{PROGRAM, Qemu};
pub use remote::{Remote, Ticks};

/// A line of bytes to a chip.
pub trait Transport {
    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// The line is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), HilError>;

    /// Some bytes that came; 0 where none came within `timeout`.
    ///
    /// # Errors
    /// The line is gone.
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, HilError>;
}
