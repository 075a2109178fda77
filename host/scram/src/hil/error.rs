//! Why there is no chip in the loop.

use std::io;
use std::path::PathBuf;
use std::time::Duration;

use control::protocol::VERSION;

use super::{Counts, PROGRAM};
use link::serial::SerialError;

/// Why there is no chip in the loop.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum HilError {
    /// The port does not open.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Serial(#[from] SerialError),
    /// The port is open and fails.
    #[error("the line broke: {0}")]
    #[diagnostic(help("check the cable and that the board has power, then start again"))]
    Line(io::Error),
    /// QEMU is not installed.
    #[error("there is no {PROGRAM} on the PATH")]
    #[diagnostic(help(
        "install QEMU's RISC-V machines: `apt install qemu-system-misc` on Debian and Ubuntu, `brew install qemu` on \
         macOS, `dnf install qemu-system-riscv` on Fedora"
    ))]
    NoQemu,
    /// QEMU does not start.
    #[error("{PROGRAM} does not start: {0}")]
    #[diagnostic(help("`{PROGRAM} --version` should work in this shell"))]
    Spawn(io::Error),
    /// The program for QEMU is not there.
    #[error("there is no program {}", .0.display())]
    #[diagnostic(help("`cargo run -p xtask -- build-pil` builds it and prints where it is"))]
    NoElf(PathBuf),
    /// The program for QEMU does not build.
    #[error("the program for QEMU was not built: {0}")]
    #[diagnostic(help(
        "run this in the project's folder, where `cargo run -p xtask -- build-pil` works and says what it needs, or name \
         a program that is built with --elf FILE"
    ))]
    Build(String),
    /// QEMU is gone.
    #[error("{PROGRAM} ended: {why}{}", said(.output))]
    #[diagnostic(help(
        "is the file RISC-V machine code built by `cargo run -p xtask -- build-pil`? A panic or trap in it is a fault of \
         `control` or of the program around it: please report it with the command that led to it"
    ))]
    QemuEnded {
        /// What its exit code means.
        why: String,
        /// What it wrote to its standard error.
        output: String,
    },
    /// Nobody answers, or no longer.
    #[error("nobody answers: {tries} requests in {:.1} s, {}", waited.as_secs_f64(), heard(.counts))]
    #[diagnostic(help(
        "is `hil` on the board (`cargo flash-hil esp32c3`), the right port named, and no monitor open on it? Press the \
         board's reset button and start again. In QEMU: is the file the program that `cargo run -p xtask -- build-pil` builds?"
    ))]
    NoAnswer {
        /// Number of requests sent.
        tries: u32,
        /// Time waited in all.
        waited: Duration,
        /// Frames and bytes received while waiting.
        counts: Counts,
    },
    /// The chip's messages are not ours.
    #[error("the chip speaks version {theirs:08x} of the protocol, this program {VERSION:08x}")]
    #[diagnostic(help(
        "build both from the same sources: flash `hil` again (`cargo flash-hil`), or `cargo run -p xtask -- build-pil`"
    ))]
    Version {
        /// Protocol version of the chip.
        theirs: u32,
    },
    /// The chip has forgotten the run.
    #[error("the chip lost its controller in the middle of the run")]
    #[diagnostic(help("it was reset: by hand, its watchdog or its supply? Start again"))]
    Forgot,
    /// The controller of the chip does not run on these parameters.
    #[error("the chip's controller refuses the parameters")]
    #[diagnostic(help("a number in [controller] is out of its range: `scram sim` on the same robot file says which"))]
    Parameters,
    /// An answer to another question.
    #[error("the chip's answers mean nothing to this program: it was built from other sources")]
    #[diagnostic(help(
        "build both from the same sources: flash `hil` again (`cargo flash-hil`), or `cargo run -p xtask -- build-pil`"
    ))]
    Confused,
}

fn heard(counts: &Counts) -> String {
    match (counts.bytes, counts.bad_here) {
        (0, _) => "and not a byte came".to_owned(),
        (bytes, bad) => format!("and {bytes} bytes came with {bad} bad frames among them"),
    }
}

fn said(output: &str) -> String {
    if output.is_empty() { String::new() } else { format!("\n{output}") }
}
