//! Which Rust toolchain can build for a chip, found by looking at what is installed.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use miette::{IntoDiagnostic, Result, WrapErr, miette};

/// The target of the ESP32-C3 and of the emulated processor.
pub const RISCV: &str = "riscv32imc-unknown-none-elf";

/// A toolchain, and whether it brings the chip's standard library compiled or as source.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Toolchain {
    /// The one that runs this program; it has the target's libraries.
    Active,
    /// One with the standard library's source, which cargo compiles for the target.
    Source {
        /// The folder that holds `bin/cargo` and `lib/rustlib`
        sysroot: PathBuf,
    },
    /// Espressif's compiler, installed by `espup`.
    Espressif,
}

/// What is installed, as far as the choice depends on it.
pub struct Installed {
    /// Sysroot of the active toolchain
    pub active: PathBuf,
    /// Sysroot of the system's packages
    pub system: PathBuf,
    /// Folders that programs are looked for in
    pub path: Vec<PathBuf>,
}

impl Installed {
    /// Looks at this machine.
    pub fn here() -> Result<Self> {
        let sysroot = output_of(Command::new("rustc").args(["--print", "sysroot"]))?;
        Ok(Self { active: sysroot.trim().into(), system: "/usr".into(), path: search_path() })
    }

    /// The toolchain that links for RISC-V: a compiled standard library if there is one, else its source.
    pub fn riscv(&self) -> Result<Toolchain> {
        if rustlib(&self.active).join(RISCV).join("lib").is_dir() {
            return Ok(Toolchain::Active);
        }
        let toolchain = self.with_source().ok_or_else(|| {
            miette!(
                help = format!(
                    "either  rustup target add {RISCV}\n\
                     or, on Debian without rustup's downloads,  apt-get install {DEBIAN}"
                ),
                "no Rust toolchain here has {RISCV}: neither {} nor {} has its libraries or their source",
                self.active.display(),
                self.system.display()
            )
        })?;
        if !self.has_linker(&toolchain) {
            return Err(miette!(
                help = "apt-get install lld-22  (the number as in  ls -l /usr/bin/rust-lld)",
                "rust-lld, the linker for {RISCV}, is not installed"
            ));
        }
        Ok(toolchain)
    }

    /// A toolchain with the standard library's source: the system's before the active one.
    pub fn with_source(&self) -> Option<Toolchain> {
        let has_source =
            |sysroot: &&PathBuf| source(sysroot).join("core/src/lib.rs").is_file() && sysroot.join("bin").is_dir();
        let sysroot = [&self.system, &self.active].into_iter().find(has_source)?.clone();
        Some(Toolchain::Source { sysroot })
    }

    fn has_linker(&self, toolchain: &Toolchain) -> bool {
        let Toolchain::Source { sysroot } = toolchain else { return true };
        let name = format!("rust-lld{}", std::env::consts::EXE_SUFFIX);
        // The compiler looks beside its own libraries for the host, then on the search path. A link of Debian's package
        // may lead nowhere, so the file itself has to be there.
        let beside = std::fs::read_dir(rustlib(sysroot)).into_iter().flatten().flatten();
        let mut folders = beside.map(|entry| entry.path().join("bin")).chain(self.path.iter().cloned());
        folders.any(|folder| folder.join(&name).is_file())
    }
}

/// What Debian calls a toolchain with the standard library's source and a linker.
const DEBIAN: &str = "rustc-web cargo-web rust-web-src rust-web-llvm lld-22";

impl Toolchain {
    /// A cargo command, with what this toolchain needs before and after the subcommand.
    pub fn cargo(&self, subcommand: &str) -> Command {
        let mut command = match self {
            Self::Active => Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())),
            Self::Source { sysroot } => Command::new(sysroot.join("bin/cargo")),
            Self::Espressif => Command::new("cargo"),
        };
        if let Self::Source { sysroot } = self {
            // Called by its path the system's cargo would still take whatever `rustc` comes first on the search path.
            command.env("RUSTC", sysroot.join("bin/rustc")).env("RUSTDOC", sysroot.join("bin/rustdoc"));
            command.env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
            command.env("PATH", path_with(&sysroot.join("bin")));
        }
        if *self == Self::Espressif {
            command.arg("+esp").env_remove("RUSTC").env_remove("RUSTUP_TOOLCHAIN");
        }
        // The variables that cargo gives to this program must not reach the one that it starts.
        for (name, _) in std::env::vars_os() {
            let name = name.to_string_lossy();
            if name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_") || name == "RUSTFLAGS" {
                command.env_remove(name.as_ref());
            }
        }
        command.arg(subcommand);
        if *self != Self::Active {
            command.arg("-Zbuild-std=core,alloc");
        }
        command
    }

    /// What to call it in a message.
    pub fn describe(&self) -> String {
        match self {
            Self::Active => "the active toolchain".to_owned(),
            Self::Source { sysroot } => {
                format!("{}, standard library from source", sysroot.join("bin/rustc").display())
            }
            Self::Espressif => "Espressif's toolchain, `cargo +esp`".to_owned(),
        }
    }
}

/// Espressif's toolchain if rustup knows it; an error if it is there without its linker.
pub fn espressif() -> Result<Option<Toolchain>> {
    let known = Command::new("rustup").args(["run", "esp", "rustc", "--version"]).output();
    if !known.is_ok_and(|output| output.status.success()) {
        return Ok(None);
    }
    if find_program("xtensa-esp32-elf-gcc", &search_path()).is_none() {
        return Err(miette!(
            help = "in this shell type:  . ~/export-esp.sh",
            "Espressif's toolchain is installed, but its linker xtensa-esp32-elf-gcc is not on the search path"
        ));
    }
    Ok(Some(Toolchain::Espressif))
}

/// The standard library's source in a sysroot.
pub fn source(sysroot: &Path) -> PathBuf {
    rustlib(sysroot).join("src/rust/library")
}

fn rustlib(sysroot: &Path) -> PathBuf {
    sysroot.join("lib/rustlib")
}

/// Folders on the search path, cargo's own among them.
pub fn search_path() -> Vec<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| std::env::home_dir().map(|home| home.join(".cargo")));
    std::env::split_paths(&path).chain(home.map(|home| home.join("bin"))).collect()
}

/// A program's file.
pub fn find_program(name: &str, path: &[PathBuf]) -> Option<PathBuf> {
    let name = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    path.iter().map(|folder| folder.join(&name)).find(|file| file.is_file())
}

/// The search path with one folder in front.
pub fn path_with(first: &Path) -> OsString {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::iter::once(first.to_owned()).chain(std::env::split_paths(&path))).unwrap_or(path)
}

/// What a program prints, or why it failed.
pub fn output_of(command: &mut Command) -> Result<String> {
    let output = command.output().into_diagnostic().wrap_err_with(|| format!("cannot run {command:?}"))?;
    if !output.status.success() {
        return Err(miette!("{command:?} failed:\n{}", String::from_utf8_lossy(&output.stderr).trim_end()));
    }
    String::from_utf8(output.stdout).into_diagnostic().wrap_err_with(|| format!("{command:?} printed no text"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine whose two sysroots hold these files.
    fn machine(active: &[&str], system: &[&str]) -> (tempfile::TempDir, Installed) {
        let dir = tempfile::tempdir().expect("a folder");
        for (root, files) in [("active", active), ("system", system)] {
            for file in files {
                let path = dir.path().join(root).join(file);
                std::fs::create_dir_all(path.parent().expect("a parent")).expect("folders");
                std::fs::write(path, "").expect("a file");
            }
        }
        let installed = Installed {
            active: dir.path().join("active"),
            system: dir.path().join("system"),
            path: vec![dir.path().join("system/bin")],
        };
        (dir, installed)
    }

    const COMPILED: &str = "lib/rustlib/riscv32imc-unknown-none-elf/lib/libcore.rlib";
    const SOURCE: &str = "lib/rustlib/src/rust/library/core/src/lib.rs";
    const LINKER: &str = if cfg!(windows) { "bin/rust-lld.exe" } else { "bin/rust-lld" };

    #[test]
    fn a_compiled_library_is_preferred_to_source() {
        let (_dir, installed) = machine(&[COMPILED], &[SOURCE, LINKER]);
        assert_eq!(installed.riscv().expect("a toolchain"), Toolchain::Active);
    }

    #[test]
    fn without_it_the_system_builds_from_source() {
        let (_dir, installed) = machine(&["lib/rustlib/x86_64-unknown-linux-gnu/lib/libcore.rlib"], &[SOURCE, LINKER]);
        let expected = Toolchain::Source { sysroot: installed.system.clone() };
        assert_eq!(installed.riscv().expect("a toolchain"), expected);
    }

    #[test]
    fn the_active_toolchain_with_source_is_enough() {
        let linker = format!("lib/rustlib/x86_64-unknown-linux-gnu/{LINKER}");
        let (_dir, installed) = machine(&[SOURCE, &linker, "bin/cargo"], &[]);
        let expected = Toolchain::Source { sysroot: installed.active.clone() };
        assert_eq!(installed.riscv().expect("a toolchain"), expected);
    }

    #[test]
    fn nothing_names_both_ways_to_install() {
        let (_dir, installed) = machine(&[], &[]);
        let error = installed.riscv().expect_err("nothing is installed");
        let help = error.help().expect("help").to_string();
        assert!(help.contains("rustup target add riscv32imc-unknown-none-elf"), "{help}");
        assert!(help.contains("apt-get install rustc-web cargo-web rust-web-src"), "{help}");
    }

    #[cfg(unix)]
    #[test]
    fn a_linker_that_leads_nowhere_is_named() {
        let (_dir, installed) = machine(&[], &[SOURCE, "bin/cargo"]);
        std::os::unix::fs::symlink("lld-22", installed.system.join(LINKER)).expect("a link");
        let error = installed.riscv().expect_err("no linker");
        assert!(error.help().expect("help").to_string().contains("apt-get install lld-22"), "{error:?}");
    }

    #[test]
    fn source_is_compiled_by_its_own_compiler() {
        let command = Toolchain::Source { sysroot: "/usr".into() }.cargo("build");
        assert_eq!(command.get_program(), "/usr/bin/cargo");
        let rustc = command.get_envs().find(|(name, _)| *name == "RUSTC").and_then(|(_, value)| value);
        assert_eq!(rustc, Some("/usr/bin/rustc".as_ref()));
        assert!(command.get_args().any(|argument| argument == "-Zbuild-std=core,alloc"));
    }
}
