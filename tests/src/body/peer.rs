//! MuJoCo: models written by `scram export mjcf`, run by the scripts of `tests/mujoco` in the environment that `.ci/tools`
//! makes.

use std::path::{Path, PathBuf};
use std::process::Command;

use hal_sim::body::Plan;
use mjcf::{Options, model};
use serde::de::DeserializeOwned;
use serde_json::json;
use tempfile::TempDir;

use testbed::peers;

use crate::row::FigureRow;

/// Names a Python that has MuJoCo, instead of the environment's.
const PYTHON: &str = "SCRAM_MUJOCO_PYTHON";

/// MuJoCo on this machine.
#[derive(Debug)]
pub struct Peer {
    python: PathBuf,
    models: TempDir,
}

/// Why MuJoCo gave nothing.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// There is none here.
    #[error("no MuJoCo at {}: run .ci/tools, or name a Python that has it in {PYTHON}", .0.display())]
    Missing(PathBuf),
    /// There is MuJoCo, but nothing that builds a program on it.
    #[error("no C compiler {}: install one, or name it in CC", .0.display())]
    NoCompiler(PathBuf),
    /// A script ended badly.
    #[error("{script}: {message}")]
    Script {
        /// Name of the script.
        script: &'static str,
        /// Message of the script.
        message: String,
    },
}

impl Peer {
    /// The Python of `SCRAM_MUJOCO_PYTHON`, or the environment's.
    ///
    /// # Errors
    /// There is none, or it has no MuJoCo.
    ///
    /// # Panics
    /// When there is no room for the models.
    pub fn find() -> Result<Self, PeerError> {
        let usual = || root().join("target/mujoco-venv/bin/python");
        let python = std::env::var_os(PYTHON).map_or_else(usual, PathBuf::from);
        let works = Command::new(&python).args(["-c", "import mujoco"]).output().is_ok_and(|o| o.status.success());
        if !works {
            return Err(PeerError::Missing(python));
        }
        let models = tempfile::tempdir().unwrap_or_else(|error| panic!("no temporary directory: {error}"));
        Ok(Self { python, models })
    }

    /// Where Python has MuJoCo: its library and headers.
    ///
    /// # Errors
    /// Python does not say.
    pub fn package(&self) -> Result<PathBuf, PeerError> {
        let asked = "import mujoco; print(mujoco.__path__[0])";
        let output = Command::new(&self.python).args(["-c", asked]).output();
        let output = output.map_err(|_| PeerError::Missing(self.python.clone()))?;
        Ok(PathBuf::from(String::from_utf8_lossy(&output.stdout).trim()))
    }

    /// Where models and programs are kept as long as this is.
    #[must_use]
    pub fn directory(&self) -> &Path {
        self.models.path()
    }

    /// Writes a model under a name of its own.
    ///
    /// # Panics
    /// When MuJoCo cannot express it, or the file cannot be written.
    #[must_use]
    pub fn export(&self, name: &str, plan: &Plan, options: &Options) -> PathBuf {
        let path = self.models.path().join(format!("{name}.xml"));
        let text = model(name, plan, options).unwrap_or_else(|error| panic!("{error}"));
        std::fs::write(&path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        path
    }

    /// Runs a script and reads what it prints.
    ///
    /// # Errors
    /// It fails, or prints something else.
    pub fn run<T: DeserializeOwned>(
        &self,
        script: &'static str,
        words: &[String],
        models: &[PathBuf],
    ) -> Result<T, PeerError> {
        let fail = |message: String| PeerError::Script { script, message };
        let path = root().join("tests/mujoco").join(script);
        let output = Command::new(&self.python)
            .arg("-B")
            .arg(path)
            // MuJoCo leaves a log of its warnings where it runs.
            .current_dir(self.models.path())
            .args(words)
            .args(models)
            .output()
            .map_err(|error| fail(error.to_string()))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            return Err(fail(said.lines().last().unwrap_or("it failed silently").to_owned()));
        }
        serde_json::from_slice(&output.stdout).map_err(|error| fail(error.to_string()))
    }

    /// Frequencies as the scripts take them.
    #[must_use]
    pub fn frequencies(hz: &[f64]) -> String {
        let words: Vec<String> = hz.iter().map(ToString::to_string).collect();
        format!("--frequencies={}", words.join(","))
    }
}

/// The row of a comparison that could not be made: visibly skipped where there is no MuJoCo, unless `SCRAM_ALL_PEERS` is 1,
/// and a failure where it fails.
#[must_use]
pub fn not_compared(what: &str, required: &str, why: &PeerError) -> FigureRow {
    let (measured, holds) = excused(why, peers::all_wanted());
    FigureRow { what: what.into(), required: required.into(), measured, holds, numbers: json!(null) }
}

/// What is said of a comparison that could not be made, and whether its row fails.
fn excused(why: &PeerError, all_peers: bool) -> (String, Option<bool>) {
    match why {
        PeerError::Missing(_) | PeerError::NoCompiler(_) if !all_peers => (format!("skipped: {why}"), None),
        _ => (why.to_string(), Some(false)),
    }
}

/// The project's root.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_mujoco_is_excused_but_not_where_all_peers_must_be_there() {
        let missing = PeerError::Missing("python".into());
        assert!(matches!(excused(&missing, false), (said, None) if said.starts_with("skipped: no MuJoCo at python")));
        assert!(matches!(excused(&missing, true), (said, Some(false)) if said.starts_with("no MuJoCo at python")));
        let no_compiler = PeerError::NoCompiler("cc".into());
        assert!(matches!(excused(&no_compiler, false), (said, None) if said.starts_with("skipped: no C compiler cc")));
        assert!(matches!(excused(&no_compiler, true), (_, Some(false))));
        let broken = PeerError::Script { script: "speeds.py", message: "no".into() };
        assert_eq!(excused(&broken, false), ("speeds.py: no".into(), Some(false)));
    }
}
