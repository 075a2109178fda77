//! Runs of a few robots side by side, and what is measured of them.

mod group;
mod phase;

use control::{Controller, Parameters, Stroke};
use group::Group;
use hal_sim::body::{Plan, Precision, Track};
use hal_sim::random::Seeds;

use super::measure::{Measures, measure};
use super::variant::Variant;
use common::conventions::frequency_from_omega;
use simulation::{DriveCommand, blow_up};

/// Time between two snapshots, s: some fourteen a turn.
pub const INTERVAL_S: f64 = 0.01;
/// Robots that are advanced side by side: as many as single-precision lanes.
pub const SIDE_BY_SIDE: usize = 8;
/// Points of a path that are kept.
pub const PATH_POINTS: usize = 201;

/// What turns the eccentric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveKind {
    /// The firmware's controller with the simulated motor, sensor and battery; the run's seed draws start angle, charge and noise,
    /// the robot's its sensor's error.
    Motor,
    /// A shaft that turns at exactly the frequency, whatever torque that takes. The run's seed draws the start angle, the
    /// robot's the phases of a phase error of one and of two periods a turn.
    Ideal {
        /// Root mean square of the phase error, rad.
        phase_noise: f64,
    },
    /// The same from angle 0 and with no phase error: no seed in it.
    Exact,
}

/// How runs are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunSettings {
    /// What turns the eccentric.
    pub drive: DriveKind,
    /// Length of a run, s; speeds are those of its second half.
    pub seconds: f64,
    /// Integration step, s.
    pub step_s: f64,
    /// With how many digits the bodies are advanced.
    pub precision: Precision,
}

/// The step does not go into what is made of whole steps.
#[derive(Debug, Clone, PartialEq, thiserror::Error, miette::Diagnostic)]
#[error("{step_s} does not go into {periods}")]
#[diagnostic(help("e.g. 1e-4, 2e-4, 5e-5"))]
pub struct StepError {
    step_s: f64,
    periods: String,
}

impl RunSettings {
    /// The step goes into the time between two pictures and, where a motor drives, into the control period.
    ///
    /// # Errors
    /// It does not.
    pub fn check_step(&self, robot: &robot_file::Robot) -> Result<(), StepError> {
        let tick_s = robot.controller.as_ref().map_or(INTERVAL_S, |controller| controller.tick_s.value);
        let goes = |time: f64| {
            let count = time / self.step_s;
            count >= 0.999 && (count - count.round()).abs() < 1e-6 * count
        };
        let motor = self.drive == DriveKind::Motor;
        if self.step_s > 0.0 && goes(INTERVAL_S) && (!motor || goes(tick_s)) {
            return Ok(());
        }
        let periods = if motor { format!("10 ms and the control period of {tick_s} s") } else { "10 ms".into() };
        Err(StepError { step_s: self.step_s, periods })
    }
}

/// Run of a sweep: variant, frequency, seed.
#[derive(Clone, Copy, Debug)]
pub struct Trial<'a> {
    /// Robot that runs.
    pub variant: &'a Variant,
    /// What the robot's controller knows, where a motor drives.
    pub parameters: Option<&'a Parameters>,
    /// Actuation frequency, Hz, positive clockwise; with an ideal shaft that of a swing, too.
    pub f_hz: f64,
    /// The shaft swings between 0 and this angle, degrees counter-clockwise, instead of turning; 0 where it turns.
    pub swing_deg: f64,
    /// Of what is random in it.
    pub seeds: Seeds,
}

/// What came out of a run.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Outcome {
    /// What was measured.
    pub measures: Measures,
    /// What a person should know; empty for an ordinary run.
    pub note: String,
    /// The centroid from the start on at [`PATH_POINTS`] even times, mm; empty where the run blew up.
    pub path: Vec<[f64; 2]>,
}

/// Why there is no run.
#[derive(Debug, Clone, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum TrialError {
    /// No body.
    #[error("{0}")]
    #[diagnostic(help("choose other values, or a shorter --step"))]
    Body(String),
    /// The robot's controller refuses.
    #[error("{axis}: {why}")]
    #[diagnostic(help("the limits are in [controller.limits] of the robot file; --drive ideal has none"))]
    Refused {
        /// The axis and its value.
        axis: String,
        /// The controller's words.
        why: String,
    },
}

/// What must be equal for robots to be advanced side by side: segments of every backbone, and which module is clamped.
#[must_use]
pub fn shape(plan: &Plan) -> (Vec<usize>, Option<usize>, bool) {
    let segments = plan.backbones.iter().map(|backbone| backbone.segments).collect();
    (segments, plan.clamped, plan.eccentric.is_some())
}

/// Whether the robot's controller takes the frequency of a run.
///
/// # Errors
/// It does not.
pub fn check(trial: &Trial<'_>) -> Result<(), TrialError> {
    let Some(parameters) = trial.parameters else { return Ok(()) };
    let mut controller = Controller::new(parameters).map_err(|error| TrialError::Body(error.to_string()))?;
    trial.start(&mut controller, 0)
}

impl Trial<'_> {
    /// What a motor's controller is told.
    fn command(&self) -> DriveCommand {
        if self.swing_deg == 0.0 {
            return DriveCommand::Freq { hz: self.f_hz };
        }
        let (from_deg, to_deg) = (self.swing_deg.min(0.0), self.swing_deg.max(0.0));
        DriveCommand::Oscillate { from_deg, to_deg, style: Stroke::default() }
    }

    fn start(&self, controller: &mut Controller, time_us: u64) -> Result<(), TrialError> {
        let command = self.command();
        let limits = controller.parameters().limits;
        let axis = if self.swing_deg == 0.0 {
            format!("axis `f`: {} Hz", self.f_hz)
        } else {
            format!("axis `swing`: {}°", self.swing_deg)
        };
        let refused = |refusal| TrialError::Refused { axis, why: simulation::said(command, refusal, &limits) };
        controller.command(command.to_control(), time_us).map_err(refused)
    }
}

/// Runs robots of one shape.
///
/// # Errors
/// The step cannot carry a body, or a controller refuses.
pub fn simulate(trials: &[Trial<'_>], settings: &RunSettings) -> Result<Vec<Outcome>, TrialError> {
    let mut group = Group::new(trials, settings)?;
    let count = (settings.seconds / INTERVAL_S).round() as usize;
    let mut tracks: Vec<Track> = trials
        .iter()
        .map(|trial| Track {
            plan: trial.variant.plan.clone(),
            snapshots: Vec::with_capacity(count + 1),
            energy_j: vec![],
        })
        .collect();
    let mut angles = vec![Vec::with_capacity(count + 1); trials.len()];
    for index in 0..=count {
        if index > 0 {
            group.advance();
        }
        for (i, (track, angles)) in tracks.iter_mut().zip(&mut angles).enumerate() {
            track.snapshots.push(group.snapshot(i));
            track.energy_j.extend(group.energy_j(i));
            angles.push(group.angle(i));
        }
    }
    let ends = tracks.iter().zip(&angles).enumerate();
    Ok(ends
        .map(|(i, (track, angles))| {
            let held = Some(trials[i].f_hz).filter(|_| trials[i].swing_deg == 0.0);
            outcome(track, angles, settings.seconds, group.fault(i), held)
        })
        .collect())
}

/// Of a run that holds a frequency, where it should.
fn outcome(track: &Track, angles: &[f64], seconds: f64, fault: Option<String>, f_hz: Option<f64>) -> Outcome {
    if let Some(why) = blow_up(track) {
        return Outcome { note: why.to_string(), ..Outcome::default() };
    }
    let mut measures = measure(track, 0.5 * seconds, seconds);
    let middle = angles.len() / 2;
    let turned = angles[angles.len() - 1] - angles[middle];
    // A group's interval is whole ticks or steps: near INTERVAL_S, not always equal.
    let time = track.snapshots[angles.len() - 1].time_s - track.snapshots[middle].time_s;
    measures.mean_f_hz = Some(frequency_from_omega(turned / time)).filter(|f| f.is_finite());
    let near = |f_hz: f64| measures.mean_f_hz.is_some_and(|f| (f - f_hz).abs() <= 0.02 * f_hz.abs());
    let held = f_hz.is_none_or(near);
    let note = match fault {
        Some(fault) => fault,
        None if !held => "the shaft does not hold the frequency".into(),
        None => String::new(),
    };
    let last = track.snapshots.len() - 1;
    let at = |k: usize| track.snapshots[(k * last) / (PATH_POINTS - 1)].centroid();
    let start = at(0);
    let path = (0..PATH_POINTS).map(|k| [at(k)[0] - start[0], at(k)[1] - start[1]].map(|m| 1e3 * m)).collect();
    Outcome { measures: measures.rounded(), note, path }
}

#[cfg(test)]
mod tests {
    use hal_sim::body::{Ensemble, Snapshot, ensemble};

    use super::*;
    use common::conventions::omega_from_frequency;

    #[test]
    fn the_frequency_is_over_the_time_that_passed() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let plan = Plan::new(&robot_file::Robot::load(&file).unwrap()).unwrap();
        let still = Ensemble::new(std::slice::from_ref(&plan), ensemble::Settings::default()).unwrap().snapshot(0);
        // Seven ticks of 1.5 ms instead of 10 ms.
        let times = (0..100).map(|k| 0.0105 * f64::from(k));
        let angles: Vec<f64> = times.clone().map(|time_s| omega_from_frequency(7.0) * time_s).collect();
        let snapshots = times.map(|time_s| Snapshot { time_s, ..still.clone() }).collect();
        let outcome = outcome(&Track { plan, snapshots, energy_j: vec![] }, &angles, 1.0, None, Some(7.0));
        assert!((outcome.measures.mean_f_hz.unwrap() - 7.0).abs() < 1e-6, "{outcome:?}");
        assert_eq!(outcome.note, "");
    }
}
