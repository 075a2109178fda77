//! Runs cargo on the firmware and reads what it reports.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, IsTerminal};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::Deserialize;

use crate::chip::Chip;
use crate::project::Project;
use crate::toolchain::{Installed, RISCV, Toolchain, espressif, find_program};

/// The toolchain that links for a chip.
pub fn linking_toolchain(chip: Chip) -> Result<Toolchain> {
    match chip {
        Chip::Esp32c3 => Installed::here()?.riscv(),
        Chip::Esp32 => espressif()?.ok_or_else(|| {
            miette!(
                help = "cargo install espup --locked && espup install && . ~/export-esp.sh\n\
                        (without it,  cargo check-esp32  still checks the types and borrows)",
                "linking for the ESP32 needs Espressif's toolchain, which is not installed"
            )
        }),
    }
}

/// A cargo command in the firmware's workspace for a chip.
pub fn command(project: &Project, toolchain: &Toolchain, subcommand: &str, chip: Chip) -> Command {
    let mut command = toolchain.cargo(subcommand);
    command.current_dir(project.firmware()).env("CARGO_TARGET_DIR", project.firmware_target());
    command.args(["--release", "--package", "firmware", "--target", chip.target()]);
    command.args(["--no-default-features", "--features", chip.name()]);
    if project.locked {
        command.arg("--locked");
    }
    command
}

/// Builds the program for the emulated processor.
pub fn pil(project: &Project) -> Result<PathBuf> {
    let toolchain = Installed::here()?.riscv()?;
    let mut command = toolchain.cargo("build");
    command.current_dir(project.firmware()).env("CARGO_TARGET_DIR", project.firmware_target());
    command.args(["--release", "--package", "pil", "--target", RISCV]);
    if project.locked {
        command.arg("--locked");
    }
    build(project, &mut command)?.remove("pil").ok_or_else(|| miette!("firmware/pil built, but it has no binary `pil`"))
}

/// Lints the firmware for RISC-V.
pub fn clippy(project: &Project) -> Result<()> {
    let toolchain = Installed::here()?.riscv()?;
    if let Toolchain::Source { sysroot } = &toolchain
        && find_program("cargo-clippy", &[sysroot.join("bin")]).is_none()
    {
        return Err(miette!(
            help = "apt-get install rust-web-clippy  (or  rustup target add riscv32imc-unknown-none-elf)",
            "{} has no clippy",
            toolchain.describe()
        ));
    }
    let mut firmware = command(project, &toolchain, "clippy", Chip::Esp32c3);
    build(project, firmware.arg("--bins"))?;
    let mut pil = toolchain.cargo("clippy");
    pil.current_dir(project.firmware()).env("CARGO_TARGET_DIR", project.firmware_target());
    build(project, pil.args(["--release", "--package", "pil", "--target", RISCV]))?;
    println!("clippy has nothing to say about the firmware");
    Ok(())
}

/// What matters of a line of cargo's JSON.
#[derive(Deserialize)]
struct Line {
    reason: String,
    manifest_path: Option<PathBuf>,
    executable: Option<PathBuf>,
    target: Option<Target>,
    message: Option<Diagnostic>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
}

#[derive(Deserialize)]
struct Diagnostic {
    message: String,
    rendered: Option<String>,
    level: String,
}

/// What a build said.
#[derive(Default)]
struct Report {
    executables: BTreeMap<String, PathBuf>,
    /// Warnings of the project's own code
    warnings: usize,
}

impl Report {
    /// Takes in one line; returns what a person should see of it.
    fn take(&mut self, line: &str, owned: impl Fn(&Path) -> bool) -> Option<String> {
        let Ok(line) = serde_json::from_str::<Line>(line) else { return Some(format!("{line}\n")) };
        if let ("compiler-artifact", Some(file), Some(target)) = (line.reason.as_str(), line.executable, line.target) {
            self.executables.insert(target.name, file);
        }
        let diagnostic = line.message.filter(|_| line.reason == "compiler-message")?;
        let own = line.manifest_path.is_some_and(|manifest| owned(&manifest));
        let warning = diagnostic.level == "warning";
        // The summary "2 warnings emitted" is a warning too.
        let summary = diagnostic.message.ends_with(" emitted");
        self.warnings += usize::from(warning && own && !summary);
        diagnostic.rendered.filter(|_| own || !warning)
    }
}

/// Runs a build, shows its messages, and returns the executables by name. A warning in the project's own code is an
/// error: cargo repeats the warnings of what it does not build again, so none is missed.
pub fn build(project: &Project, command: &mut Command) -> Result<BTreeMap<String, PathBuf>> {
    let colour = if std::io::stderr().is_terminal() { "json-diagnostic-rendered-ansi" } else { "json" };
    command.arg(format!("--message-format={colour}")).stdout(Stdio::piped());
    let program = command.get_program().to_owned();
    let mut child = command.spawn().into_diagnostic().wrap_err_with(|| format!("cannot run {}", program.display()))?;
    let stdout = child.stdout.take().ok_or_else(|| miette!("cargo has no output"))?;
    let mut report = Report::default();
    for line in BufReader::new(stdout).lines() {
        let line = line.into_diagnostic().wrap_err("reading cargo's messages")?;
        if let Some(text) = report.take(&line, |manifest| project.owns(manifest)) {
            eprint!("{text}");
        }
    }
    let status = child.wait().into_diagnostic()?;
    if !status.success() {
        return Err(miette!("the build failed; cargo's messages are above"));
    }
    match report.warnings {
        0 => Ok(report.executables),
        count => Err(miette!("warnings in the firmware: {count}; none is allowed, they are printed above")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(manifest: &Path) -> bool {
        manifest.starts_with("/project")
    }

    #[test]
    fn executables_are_found_by_name() {
        let mut report = Report::default();
        let line = r#"{"reason":"compiler-artifact","manifest_path":"/project/Cargo.toml","target":{"name":"robot"},
            "executable":"/target/robot"}"#;
        assert_eq!(report.take(line, own), None);
        assert_eq!(report.executables.get("robot"), Some(&PathBuf::from("/target/robot")));
    }

    #[test]
    fn only_own_warnings_count() {
        let mut report = Report::default();
        let warning = |manifest: &str| {
            format!(
                r#"{{"reason":"compiler-message","manifest_path":"{manifest}/Cargo.toml","target":{{"name":"x"}},
                "message":{{"message":"unused variable","level":"warning","rendered":"warning: unused variable\n"}}}}"#
            )
        };
        assert_eq!(report.take(&warning("/registry"), own), None);
        assert_eq!(report.warnings, 0);
        assert_eq!(report.take(&warning("/project"), own).as_deref(), Some("warning: unused variable\n"));
        assert_eq!(report.warnings, 1);
    }

    #[test]
    fn errors_are_shown_wherever_they_are() {
        let line = r#"{"reason":"compiler-message","manifest_path":"/registry/Cargo.toml","target":{"name":"x"},
            "message":{"message":"no","level":"error","rendered":"error: no\n"}}"#;
        assert_eq!(Report::default().take(line, own).as_deref(), Some("error: no\n"));
    }
}
