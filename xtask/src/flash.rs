//! `cargo flash-robot` and `cargo flash-dongle`: build, write to the board, show what it prints.

use std::path::PathBuf;

use miette::{IntoDiagnostic, Result, WrapErr, miette};

use crate::cargo;
use crate::chip::Chip;
use crate::project::Project;
use crate::toolchain::{find_program, search_path};

/// The program that writes to the board.
pub fn espflash() -> Result<PathBuf> {
    find_program("espflash", &search_path()).ok_or_else(|| {
        miette!(
            help = "cargo install espflash --version ^4 --locked",
            "espflash, which makes images and writes them to the board, is not installed"
        )
    })
}

/// Hands over to the firmware's own `cargo run`, whose runner is espflash.
pub fn run(project: &Project, chip: Chip, binary: &str, port: Option<&str>, inject: bool) -> Result<()> {
    let espflash = espflash()?;
    let toolchain = cargo::linking_toolchain(chip)?;
    let mut command = cargo::command(project, &toolchain, "run", chip);
    if let Some(folder) = espflash.parent() {
        command.env("PATH", crate::toolchain::path_with(folder));
    }
    if let Some(port) = port {
        command.env("ESPFLASH_PORT", port);
    }
    if inject {
        command.args(["--features", "inject"]);
    }
    let status = command.args(["--bin", binary]).status().into_diagnostic().wrap_err("cannot run cargo")?;
    if status.success() {
        return Ok(());
    }
    Err(miette!(
        help = "is the board at a USB port?  espflash list-ports  shows those it knows; --port PORT chooses one",
        "{binary} was not built or not flashed; the messages are above"
    ))
}
