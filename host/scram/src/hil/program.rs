//! The program that QEMU runs.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::HilError;

/// Builds the program from `firmware/pil`, in the project's folder; where it is. What cargo has to say goes to stderr.
///
/// # Errors
/// It does not build, or this is not the project's folder.
pub fn build_program() -> Result<PathBuf, HilError> {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["run", "--quiet", "--package", "xtask", "--", "build-pil"]).stdin(Stdio::null());
    let output = cargo.stderr(Stdio::inherit()).output().map_err(|error| HilError::Build(error.to_string()))?;
    let printed = String::from_utf8_lossy(&output.stdout);
    match printed.lines().last() {
        Some(path) if output.status.success() => Ok(PathBuf::from(path)),
        _ => Err(HilError::Build(output.status.to_string())),
    }
}
