//! The program for QEMU.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use scram::hil::{HilError, PROGRAM, Qemu};
use testbed::peers::skip;

use super::root;

/// Builds it, once for all tests of a program; `None` where this machine cannot build or run it.
pub fn program() -> Option<PathBuf> {
    static BUILT: OnceLock<Option<PathBuf>> = OnceLock::new();
    BUILT.get_or_init(build).clone()
}

fn build() -> Option<PathBuf> {
    if let Err(HilError::NoQemu) = Qemu::is_installed() {
        skip(&format!("there is no {PROGRAM}"));
        return None;
    }
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(root()).args(["run", "--quiet", "--package", "xtask", "--", "build-pil"]);
    let output = cargo.output().expect("cargo starts");
    let said = String::from_utf8_lossy(&output.stderr);
    if said.contains("no Rust toolchain here has") || said.contains("the linker for riscv32imc") {
        skip(&said);
        return None;
    }
    assert!(output.status.success(), "firmware/pil does not build:\n{said}");
    let path = String::from_utf8_lossy(&output.stdout).lines().last().map(PathBuf::from);
    Some(path.expect("build-pil prints a path"))
}
