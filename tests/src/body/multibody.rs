//! MuJoCo's multibody without its contacts, by the small program `tests/mujoco/feet.c` on MuJoCo's library.

use std::path::{Path, PathBuf};
use std::process::Command;

use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::{Plan, Pose, Snapshot, Speeds, Track};
use serde::Deserialize;

use super::peer::{Peer, PeerError, root};

/// The program.
const SOURCE: &str = "feet.c";
/// Time between two samples of a run on the ground, s: the heading is unwrapped without doubt.
const SAMPLE_S: f64 = 0.025;

/// Centres of all modules, m, at even times from the start on.
pub type Path3 = Vec<Vec<[f64; 3]>>;

/// The program, built.
#[derive(Debug)]
pub struct Multibody {
    program: PathBuf,
}

/// What is run.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// A model that `scram export mjcf` wrote.
    pub model: &'a Path,
    /// Counter-clockwise positive, Hz.
    pub frequency_hz: f64,
    /// Length, s.
    pub length_s: f64,
    /// Time between two samples, s.
    pub sample_s: f64,
    /// The feet's law; none for a robot that touches nothing.
    pub law: Option<Law<'a>>,
}

/// The feet's four numbers, as the robot file has them.
#[derive(Clone, Copy, Debug)]
pub struct Law<'a> {
    /// k, N/m.
    pub normal_n_per_m: f64,
    /// χ, s/m.
    pub normal_s_per_m: f64,
    /// N/m.
    pub shear_n_per_m: f64,
    /// N·s/m.
    pub shear_n_s_per_m: f64,
    /// What makes it another law than the simulator's.
    pub other: OtherLaw<'a>,
}

/// What makes a law of the feet another one than the simulator's: keys of the program with values; `feet.c` says what they do.
pub type OtherLaw<'a> = &'a [(&'static str, f64)];

/// What the program prints.
#[derive(Deserialize)]
struct Printed {
    modules: Path3,
}

impl Multibody {
    /// Builds the program with this machine's C compiler against the library that Python's MuJoCo brings.
    ///
    /// # Errors
    /// There is no compiler, or it refuses.
    pub fn build(peer: &Peer) -> Result<Self, PeerError> {
        let fail = |message: String| PeerError::Script { script: SOURCE, message };
        let package = peer.package()?;
        let library = std::fs::read_dir(&package)
            .map_err(|error| fail(error.to_string()))?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .find(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("libmujoco.")))
            .ok_or_else(|| fail(format!("no libmujoco in {}", package.display())))?;
        let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
        let program = peer.directory().join("feet");
        let output = Command::new(&compiler)
            .args(["-O2", "-std=c11", "-o"])
            .arg(&program)
            .arg("-I")
            .arg(package.join("include"))
            .arg(root().join("tests/mujoco").join(SOURCE))
            .arg(library)
            .arg(format!("-Wl,-rpath,{}", package.display()))
            .arg("-lm")
            .output()
            .map_err(|_| PeerError::NoCompiler(compiler.into()))?;
        if output.status.success() {
            Ok(Self { program })
        } else {
            Err(fail(String::from_utf8_lossy(&output.stderr).lines().next().unwrap_or("it does not build").to_owned()))
        }
    }

    /// A run at a step, s.
    ///
    /// # Errors
    /// The program fails.
    pub fn run(&self, run: Run<'_>, step_s: f64) -> Result<Path3, PeerError> {
        let fail = |message: String| PeerError::Script { script: SOURCE, message };
        let mut words: Vec<String> =
            [run.frequency_hz, step_s, run.length_s, run.sample_s].iter().map(ToString::to_string).collect();
        if let Some(law) = run.law {
            let own = [
                ("normal_k", law.normal_n_per_m),
                ("normal_chi", law.normal_s_per_m),
                ("shear_k", law.shear_n_per_m),
                ("shear_d", law.shear_n_s_per_m),
            ];
            words.extend(own.iter().chain(law.other).map(|(key, value)| format!("{key}={value}")));
        }
        // MuJoCo leaves a log of its warnings where it runs.
        let at = self.program.parent().unwrap_or(Path::new("."));
        let output = Command::new(&self.program)
            .current_dir(at)
            .arg(run.model)
            .args(words)
            .output()
            .map_err(|error| fail(error.to_string()))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            return Err(fail(said.lines().last().unwrap_or("it failed silently").to_owned()));
        }
        let printed: Printed = serde_json::from_slice(&output.stdout).map_err(|error| fail(error.to_string()))?;
        Ok(printed.modules)
    }

    /// The limit of small steps of a run that converges with the first order, from a step (s) and half of it.
    ///
    /// # Errors
    /// The program fails.
    pub fn limit(&self, run: Run<'_>, step_s: f64) -> Result<Path3, PeerError> {
        let (coarse, mut fine) = (self.run(run, step_s)?, self.run(run, 0.5 * step_s)?);
        for (fine, coarse) in fine.iter_mut().flatten().flatten().zip(coarse.iter().flatten().flatten()) {
            *fine = 2.0 * *fine - coarse;
        }
        Ok(fine)
    }

    /// Mean speeds over t = 1 … 2 s in the limit of small steps, as the simulator defines them: m/s, m/s, rad/s.
    ///
    /// # Errors
    /// The program fails.
    pub fn speeds(&self, robot: (&Plan, &Path), frequency_hz: f64, step_s: f64) -> Result<[f64; 3], PeerError> {
        self.speeds_under(&[], robot, frequency_hz, step_s)
    }

    /// The same under another law of the feet.
    ///
    /// # Errors
    /// The program fails.
    pub fn speeds_under(
        &self,
        other: OtherLaw<'_>,
        (plan, model): (&Plan, &Path),
        frequency_hz: f64,
        step_s: f64,
    ) -> Result<[f64; 3], PeerError> {
        let law = plan.contact.as_ref().map(|contact| Law {
            normal_n_per_m: contact.normal_stiffness,
            normal_s_per_m: contact.normal_damping,
            shear_n_per_m: contact.shear_stiffness,
            shear_n_s_per_m: contact.shear_damping,
            other,
        });
        let run = Run { model, frequency_hz, length_s: 2.0, sample_s: SAMPLE_S, law };
        let path = self.limit(run, step_s)?;
        Ok(speeds(plan, &path))
    }
}

/// Mean speeds over t = 1 … 2 s of a path, NaN where it is too short.
fn speeds(plan: &Plan, path: &[Vec<[f64; 3]>]) -> [f64; 3] {
    let [w, x, y, z] = Coordinates::nominal(plan).orientation;
    let pose = |position: &[f64; 3]| Pose { position: *position, orientation: [w, x, y, z] };
    let snapshot = |(index, modules): (usize, &Vec<[f64; 3]>)| Snapshot {
        time_s: index as f64 * SAMPLE_S,
        modules: modules.iter().map(pose).collect(),
        segments: Vec::new(),
        feet: Vec::new(),
        rotor: None,
    };
    let snapshots = path.iter().enumerate().map(snapshot).collect();
    let track = Track { plan: plan.clone(), snapshots, energy_j: Vec::new() };
    let none = Speeds { longitudinal: f64::NAN, lateral: f64::NAN, yaw: f64::NAN };
    let Speeds { longitudinal, lateral, yaw } = track.speeds(1.0, 2.0).unwrap_or(none);
    [longitudinal, lateral, yaw]
}
