//! `cargo check-esp32`: what can be said about the ESP32's firmware on this machine.
//!
//! Only Espressif's compiler links for Xtensa. Where it is installed, the firmware is built. Elsewhere the ordinary
//! compiler knows the target well enough to check types and borrows of everything, once four obstacles are out of the
//! way: a data layout of Espressif's own, a floating-point unit that its code generator stumbles over, inline assembly
//! that it does not have for Xtensa, and naked functions made of that.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde_json::Value;

use crate::cargo;
use crate::chip::{BINARIES, Chip};
use crate::project::Project;
use crate::toolchain::{self, Installed, Toolchain};

/// The layout of data in memory: Xtensa LX6 aligns 64-bit integers to 8 bytes and has no vectors.
const DATA_LAYOUT: &str = "e-m:e-p:32:32-i8:8:32-i16:16:32-i64:64-n32";

/// The libraries with naked functions for Xtensa.
const PATCHED: [&str; 2] = ["esp-hal", "esp-rtos"];

/// Checks all three binaries, by building them if that is possible.
pub fn run(project: &Project) -> Result<()> {
    if let Some(toolchain) = toolchain::espressif()? {
        let mut command = cargo::command(project, &toolchain, "build", Chip::Esp32);
        cargo::build(project, command.args(BINARIES.iter().flat_map(|name| ["--bin", name])))?;
        println!("esp32: {} built and linked by {}", BINARIES.join(", "), toolchain.describe());
        return Ok(());
    }
    let toolchain = Installed::here()?.with_source().ok_or_else(|| {
        miette!(
            help = "rustup component add rust-src  (or, on Debian,  apt-get install rustc-web cargo-web rust-web-src)",
            "checking for the ESP32 needs the standard library's source, which is not installed"
        )
    })?;
    let Toolchain::Source { sysroot } = &toolchain else { return Err(miette!("{toolchain:?} has no sysroot")) };
    let workshop = Workshop::prepare(project, sysroot)?;
    eprintln!("(cargo will say that two patches are not used: they are, but not by the standard library's own tree)");
    cargo::build(project, &mut workshop.command(project, &toolchain))?;
    println!(
        "esp32: {} type- and borrow-checked by {}; not linked: that takes Espressif's toolchain",
        BINARIES.join(", "),
        toolchain.describe()
    );
    Ok(())
}

/// The generated folder with everything that stands in for Espressif's compiler.
struct Workshop {
    folder: PathBuf,
    patched: Vec<(String, PathBuf)>,
}

impl Workshop {
    fn prepare(project: &Project, sysroot: &Path) -> Result<Self> {
        let folder = project.output("esp32-check");
        let compiler = toolchain::output_of(std::process::Command::new(sysroot.join("bin/rustc")).arg("-vV"))?;
        let library = folder.join("library");
        // Files that are written anew would be compiled anew.
        if std::fs::read_to_string(folder.join("made-for")).ok().as_deref() != Some(&compiler) {
            remove(&library)?;
            copy(&toolchain::source(sysroot), &library)?;
            edit(&library.join("core/src/arch.rs"), without_assembly)?;
            write(&folder.join(target_file()), &target_specification(sysroot)?)?;
            write(&folder.join("made-for"), &compiler)?;
        }
        let mut patched = Vec::new();
        for (name, source) in locked_sources(project)? {
            let versioned = source.file_name().ok_or_else(|| miette!("{} has no name", source.display()))?;
            let copied = folder.join(versioned);
            if !copied.join("patched").is_file() {
                remove(&copied)?;
                copy(&source, &copied)?;
                edit_all(&copied.join("src"), |text| Ok(text.replace("#[unsafe(naked)]", "")))?;
                write(&copied.join("patched"), "")?;
            }
            patched.push((name, copied));
        }
        // Cargo notes the patched copies in the lock file: in a copy of it, not in the firmware's.
        let lock = project.firmware().join("Cargo.lock");
        std::fs::copy(&lock, folder.join("Cargo.lock"))
            .into_diagnostic()
            .wrap_err_with(|| lock.display().to_string())?;
        Ok(Self { folder, patched })
    }

    fn command(&self, project: &Project, toolchain: &Toolchain) -> std::process::Command {
        let mut command = toolchain.cargo("check");
        command.current_dir(project.firmware()).env("CARGO_TARGET_DIR", project.firmware_target());
        command.env("__CARGO_TESTS_ONLY_SRC_ROOT", self.folder.join("library"));
        command.args(["-Zjson-target-spec", "-Zlockfile-path", "--config"]);
        command.arg(format!("resolver.lockfile-path={:?}", self.folder.join("Cargo.lock")));
        for (name, folder) in &self.patched {
            command.arg("--config").arg(format!("patch.crates-io.{name}.path={folder:?}"));
        }
        command.args(["--release", "--package", "firmware", "--no-default-features", "--features", "esp32"]);
        command.arg("--target").arg(self.folder.join(target_file()));
        command.args(BINARIES.iter().flat_map(|name| ["--bin", name]));
        command
    }
}

fn target_file() -> String {
    format!("{}.json", Chip::Esp32.target())
}

/// The built-in target with Espressif's data layout and without the floating-point unit.
fn target_specification(sysroot: &Path) -> Result<String> {
    let mut command = std::process::Command::new(sysroot.join("bin/rustc"));
    command.args(["-Zunstable-options", "--print", "target-spec-json", "--target", Chip::Esp32.target()]);
    let printed = toolchain::output_of(command.env("RUSTC_BOOTSTRAP", "1"))?;
    let mut specification: Value = serde_json::from_str(&printed).into_diagnostic()?;
    let fields = specification.as_object_mut().ok_or_else(|| miette!("the target's specification is not an object"))?;
    fields.insert("data-layout".to_owned(), DATA_LAYOUT.into());
    fields.insert("features".to_owned(), "-fp".into());
    serde_json::to_string_pretty(&specification).into_diagnostic()
}

/// The inline assembly macros of `core`, replaced by ordinary ones that type-check on any target.
fn without_assembly(text: &str) -> Result<String> {
    let mut text = text.to_owned();
    for (name, body) in [("asm", "loop {}"), ("naked_asm", "loop {}"), ("global_asm", "const _: () = ();")] {
        let start = text.find(&format!("#[rustc_builtin_macro]\npub macro {name}("));
        let range = start.and_then(|start| Some(start..start + text[start..].find("\n}")? + 2));
        let range =
            range.ok_or_else(|| miette!("no macro `{name}`: this compiler's library differs from the known"))?;
        text.replace_range(range, &format!("pub macro {name}($($assembly:tt)*) {{\n    {body}\n}}"));
    }
    Ok(text)
}

/// Where cargo keeps the libraries to patch, in the versions of the firmware's lock file.
fn locked_sources(project: &Project) -> Result<Vec<(String, PathBuf)>> {
    let mut command = Toolchain::Active.cargo("metadata");
    command.current_dir(project.firmware()).args(["--format-version", "1", "--locked"]);
    command.args(["--no-default-features", "--features", Chip::Esp32.name()]);
    let metadata: Value = serde_json::from_str(&toolchain::output_of(&mut command)?).into_diagnostic()?;
    let packages = metadata["packages"].as_array().ok_or_else(|| miette!("cargo metadata lists no packages"))?;
    PATCHED
        .into_iter()
        .map(|name| {
            let package = packages.iter().find(|package| package["name"] == name);
            let manifest = package.and_then(|package| package["manifest_path"].as_str()).map(Path::new);
            let folder = manifest.and_then(Path::parent);
            let folder = folder.ok_or_else(|| miette!("firmware/Cargo.lock has no {name}"))?;
            Ok((name.to_owned(), folder.to_owned()))
        })
        .collect()
}

fn edit(file: &Path, change: impl Fn(&str) -> Result<String>) -> Result<()> {
    let text = std::fs::read_to_string(file).into_diagnostic().wrap_err_with(|| file.display().to_string())?;
    let changed = change(&text).wrap_err_with(|| file.display().to_string())?;
    if changed == text { Ok(()) } else { write(file, &changed) }
}

fn edit_all(folder: &Path, change: impl Fn(&str) -> Result<String> + Copy) -> Result<()> {
    for entry in folder.read_dir().into_diagnostic().wrap_err_with(|| folder.display().to_string())? {
        let path = entry.into_diagnostic()?.path();
        if path.is_dir() {
            edit_all(&path, change)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            edit(&path, change)?;
        }
    }
    Ok(())
}

fn write(file: &Path, text: &str) -> Result<()> {
    std::fs::write(file, text).into_diagnostic().wrap_err_with(|| file.display().to_string())
}

fn remove(folder: &Path) -> Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).into_diagnostic().wrap_err_with(|| folder.display().to_string())
        }
        _ => Ok(()),
    }
}

/// Copies a folder with everything in it, links followed.
fn copy(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to).into_diagnostic().wrap_err_with(|| to.display().to_string())?;
    for entry in from.read_dir().into_diagnostic().wrap_err_with(|| from.display().to_string())? {
        let entry = entry.into_diagnostic()?;
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if source.is_dir() {
            copy(&source, &target)?;
        } else {
            std::fs::copy(&source, &target).into_diagnostic().wrap_err_with(|| source.display().to_string())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARCH: &str = "/// Assembly.\n#[stable]\n#[rustc_builtin_macro]\npub macro asm(\"assembly template\", $(operands,)*) {\n    \
        /* compiler built-in */\n}\n\n#[rustc_builtin_macro]\npub macro naked_asm(\"assembly template\") {\n    /* */\n}\n\n\
        #[rustc_builtin_macro]\npub macro global_asm(\"assembly template\") {\n    /* */\n}\n\npub fn breakpoint() {}\n";

    #[test]
    fn assembly_becomes_ordinary_macros_and_the_rest_stays() {
        let text = without_assembly(ARCH).expect("all three are there");
        assert!(!text.contains("rustc_builtin_macro"), "{text}");
        assert!(text.contains("#[stable]\npub macro asm($($assembly:tt)*) {\n    loop {}\n}\n"), "{text}");
        assert!(text.contains("pub macro global_asm($($assembly:tt)*) {\n    const _: () = ();\n}\n"), "{text}");
        assert!(text.ends_with("pub fn breakpoint() {}\n"), "{text}");
    }

    #[test]
    fn a_library_that_differs_is_told() {
        let error = without_assembly(&ARCH.replace("naked_asm", "other")).expect_err("one is missing");
        assert!(error.to_string().contains("naked_asm"), "{error}");
    }
}
