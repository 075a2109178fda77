//! Where the project's folders are.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr};

/// The work tree and the folders that builds go to.
pub struct Project {
    /// The work tree
    pub root: PathBuf,
    /// `CARGO_TARGET_DIR`, absolute, where it is set
    shared_target: Option<PathBuf>,
    /// Whether cargo may change the firmware's lock file
    pub locked: bool,
}

impl Project {
    /// The work tree that this program was built in.
    pub fn find(locked: bool) -> Result<Self> {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = manifest.parent().unwrap_or(manifest).to_owned();
        let shared_target = std::env::var_os("CARGO_TARGET_DIR").filter(|dir| !dir.is_empty()).map(PathBuf::from);
        let shared_target = shared_target
            .map(|dir| std::path::absolute(&dir).into_diagnostic().wrap_err("CARGO_TARGET_DIR"))
            .transpose()?;
        Ok(Self { root, shared_target, locked })
    }

    /// The firmware's workspace.
    pub fn firmware(&self) -> PathBuf {
        self.root.join("firmware")
    }

    /// Where firmware is built.
    pub fn firmware_target(&self) -> PathBuf {
        self.shared_target.clone().unwrap_or_else(|| self.firmware().join("target"))
    }

    /// A folder for what is generated for people.
    pub fn output(&self, name: &str) -> PathBuf {
        self.shared_target.clone().unwrap_or_else(|| self.root.join("target")).join(name)
    }

    /// A path as short as a person would write it.
    pub fn short<'a>(&self, path: &'a Path) -> &'a Path {
        path.strip_prefix(&self.root).unwrap_or(path)
    }

    /// Whether a manifest is one of the project's own, not a copy or a dependency.
    pub fn owns(&self, manifest: &Path) -> bool {
        let generated = [self.firmware_target(), self.output("")];
        manifest.starts_with(&self.root) && !generated.iter().any(|dir| manifest.starts_with(dir))
    }
}
