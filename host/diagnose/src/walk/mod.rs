//! What the simulated walk of a robot gets wrong, from its mean speeds over conditions, and the name of the cause.
//!
//! As on the shaft, numbers come first: those that decide a walk are refitted within what the robot file believes of them
//! ([`identify::robot`]), so that a wrong number is not called a wrong model. In order:
//!
//! 1. `models`: the file's model is refitted; each effect of the catalogue that acts on the ground and that the file lacks is screened by
//!    its derivatives there, and the most promising are fitted jointly with all numbers; pairs follow where one is not enough;
//! 2. `evidence`: how probable the speeds are under each model, numbers and effects' sizes averaged over what is believed of them. An
//!    alarm needs mean evidence that chance would give one table in a hundred of a robot that lacks nothing;
//! 3. `adequacy`: whether what a model leaves is what repeats scatter by, on the fitted conditions and on those held out;
//! 4. `place`, `feet`: where the file's model is wrong: by frequency, direction, α or speed, and at which foot.

mod adequacy;
mod evidence;
mod feet;
mod inquiry;
mod models;
mod outcome;
mod place;
mod secant;
mod words;

use std::path::PathBuf;

use common::Progress;
pub use identify::robot::RobotError;
use identify::robot::{Held, Run};
use robot_file::edit::Document;
use sweep::Measured;

pub use evidence::ALARM;
pub use feet::FootPlace;
pub use outcome::{WalkCause, WalkDiagnosis, WalkLimit, WalkModel};
pub use place::Place;

/// How a walk is diagnosed.
#[derive(Clone)]
pub struct WalkOptions {
    /// Which conditions are held out to judge by.
    pub held: Held,
    /// Speeds are those between these times, s: see [`Run::new`].
    pub window_s: (f64, f64),
    /// Integration step, s.
    pub step_s: f64,
    /// Seed of the draws.
    pub seed: u64,
    /// Sets that are drawn from what is believed, to find where the refit of the file's model starts.
    pub draws: usize,
    /// Threads; 0 for as many as the machine has cores.
    pub threads: usize,
    /// A directory for files of what was simulated: a diagnosis that is stopped goes on from there ([`WalkDiagnosis::kept`]).
    pub keep_in: Option<PathBuf>,
    /// Told what is being done.
    pub progress: Option<Progress>,
}

impl Default for WalkOptions {
    fn default() -> Self {
        Self {
            held: Held::OneInFour,
            window_s: (1.0, 2.0),
            step_s: 2e-4,
            seed: 1,
            draws: 24,
            threads: 0,
            keep_in: None,
            progress: None,
        }
    }
}

impl WalkOptions {
    fn run(&self) -> Result<Run, RobotError> {
        Run::new(self.window_s, self.step_s)
    }

    fn tell(&self, what: &str, share: f64) {
        if let Some(progress) = &self.progress {
            progress(what, share);
        }
    }
}

/// Compares a robot file with mean speeds and says what its walk lacks.
///
/// # Errors
/// The robot file has no body, the table too few conditions, the times are not two, nothing can be simulated, or evaluations cannot be
/// kept.
pub fn diagnose_walk(
    document: &Document,
    measured: &Measured,
    options: &WalkOptions,
) -> Result<WalkDiagnosis, RobotError> {
    identify::robot::in_pool(options.threads, || inquiry::run(document, measured, options))
}

#[cfg(test)]
mod tests;
