//! The decisions as RISC-V machine code in QEMU, beside the same decisions on the host: bit for bit, instruction by
//! instruction. The binary `pil` prints it all.

pub mod bits;
pub mod cost;
pub mod course;
pub mod equal;
pub mod search;

use std::path::Path;

use control::Parameters;
use scram::hil::{Client, HilError, Qemu, Remote};

/// Starts the program in QEMU.
///
/// # Errors
/// It does not answer.
pub fn chip(elf: &Path, parameters: &Parameters) -> Result<Remote<Qemu>, HilError> {
    Remote::start(Client::connect(Qemu::start(elf)?)?, parameters)
}
