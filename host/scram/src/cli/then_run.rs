//! The experiment that a diagnosis proposes, run on a robot through the console.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use miette::{IntoDiagnostic, Report, WrapErr, miette};

use super::say;

/// Where an experiment runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// On a robot behind the dongle at this serial port.
    Port(String),
    /// On a simulated robot with this robot file.
    Simulated(PathBuf),
}

impl Place {
    /// `sim:FILE`, or else a port.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.strip_prefix("sim:") {
            Some("") => Err("sim: needs the robot file that is simulated, sim:FILE".to_owned()),
            Some(file) => Ok(Self::Simulated(file.into())),
            None if text == "sim" => Err("sim needs the robot file that is simulated, sim:FILE".to_owned()),
            None => Ok(Self::Port(text.to_owned())),
        }
    }

    /// Runs a script with `scram console`, in a process of its own, so that what watches over a person's driving watches over
    /// this; returns the recording, in a directory of its own. What the console says goes to stderr.
    pub fn record(&self, script: &Path, keys: Option<&Path>, seed: u64, out: &Path) -> Result<PathBuf, Report> {
        let own = std::env::current_exe().into_diagnostic().wrap_err("this program is not found")?;
        let mut console = Command::new(own);
        console.arg("console").arg("--script").arg(script).arg("--out").arg(out).args(["--seed", &seed.to_string()]);
        match self {
            Self::Port(port) => console.args(["--port", port]),
            Self::Simulated(file) => console.args(["--sim", "--robot"]).arg(file),
        };
        if let Some(keys) = keys {
            console.arg("--keys").arg(keys);
        }
        say(&format!("running {} in {}", script.display(), out.display()));
        let ended =
            console.stdout(Stdio::from(std::io::stderr())).status().into_diagnostic().wrap_err("scram console")?;
        if !ended.success() {
            return Err(miette!(
                help = "the first diagnosis stands as it is written; run the script again with scram console --script",
                "the console did not run {} to its end: {ended}",
                script.display()
            ));
        }
        recording_in(out)
    }
}

/// The last recording of a console in a directory.
fn recording_in(out: &Path) -> Result<PathBuf, Report> {
    let entries = std::fs::read_dir(out).into_diagnostic().wrap_err_with(|| out.display().to_string())?;
    let recordings = entries.flatten().map(|entry| entry.path());
    recordings
        .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .max()
        .ok_or_else(|| miette!("{}: the console left no recording", out.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_port_or_a_robot_file() {
        assert_eq!(Place::parse("/dev/ttyACM0"), Ok(Place::Port("/dev/ttyACM0".to_owned())));
        assert_eq!(Place::parse("sim:a/robot.toml"), Ok(Place::Simulated("a/robot.toml".into())));
        assert!(Place::parse("sim").is_err() && Place::parse("sim:").is_err());
    }
}
