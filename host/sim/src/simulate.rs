//! A run from its robot to what is kept of it, on the ground or on a bench, with a way to stop it.

use std::sync::atomic::{AtomicBool, Ordering};

use control::{Actuation, Command, Controller, Gait, Parameters, Refusal, Sample, State, Telemetry};
use hal_sim::{Settings, SimulatedRobot};
use recording::Metadata;
use robot_file::Robot;

use super::decide::Decide;
use super::ground::{OnGround, Walk};
use super::scene::scene;
use super::{Plan, SimError, Trace, closed_loop_in, closed_loop_with, controller, export};

/// Longest run, s: everything of a run is held in memory.
pub const LONGEST_S: f64 = 600.0;
/// Length of a run when nothing is said, s: that of the thesis's experiments.
pub const USUAL_S: f64 = 2.0;

/// What ran.
#[derive(Clone, Debug)]
pub struct Ran {
    /// Everything that the run recorded.
    pub trace: Trace,
    /// How the body moved; none on the bench.
    pub walk: Option<Walk>,
}

/// Where a robot runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// With its body, on the ground.
    Ground,
    /// The shaft without a body.
    Bench,
}

/// Designs the controller from one robot file and runs it on the robot of another. Once `stop` is true the run ends at its next tick.
///
/// # Errors
/// There is no controller for `designed_from`, or no body for `robot`, the run blew up, or it was stopped.
pub fn simulate(
    designed_from: &Robot,
    robot: &Robot,
    place: Place,
    seed: u64,
    plan: &Plan,
    stop: &AtomicBool,
) -> Result<Ran, SimError> {
    let settings = Settings::default();
    let mut decider = Stoppable { controller: controller(designed_from)?, stop };
    match place {
        Place::Ground => {
            let mut ground = OnGround::new(robot, seed, &settings, plan.seconds).map_err(SimError::Body)?;
            let trace = closed_loop_in(&mut ground, &mut decider, plan)?;
            Ok(Ran { trace, walk: Some(ground.into_walk()?) })
        }
        Place::Bench => {
            let bench = SimulatedRobot::with(robot, seed, &settings);
            Ok(Ran { trace: closed_loop_with(bench, &mut decider, plan)?, walk: None })
        }
    }
}

/// A controller that decides until somebody says stop.
struct Stoppable<'a> {
    controller: Controller,
    stop: &'a AtomicBool,
}

impl Decide for Stoppable<'_> {
    type Error = SimError;

    fn parameters(&self) -> &Parameters {
        self.controller.parameters()
    }

    fn telemetry(&self) -> Telemetry {
        self.controller.telemetry()
    }

    fn command(&mut self, command: Command, time_us: u64) -> Result<Result<(), Refusal>, SimError> {
        Ok(self.controller.command(command, time_us))
    }

    fn keep_gait(&mut self, gait: &Gait) -> Result<Result<(), Refusal>, SimError> {
        Ok(self.controller.keep_gait(gait))
    }

    fn tick(&mut self, sample: &Sample) -> Result<Actuation, SimError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(SimError::Stopped);
        }
        Ok(self.controller.tick(sample))
    }
}

impl Ran {
    /// Fails where the robot refused the first command: nothing has run then.
    ///
    /// # Errors
    /// [`SimError::Refused`].
    pub fn require_accepted(&self) -> Result<(), SimError> {
        match self.trace.commands.first() {
            Some(given) if given.refusal.is_some() => Err(SimError::Refused {
                command: given.command.to_string(),
                why: given.refusal.clone().unwrap_or_default(),
            }),
            _ => Ok(()),
        }
    }

    /// The run as it is written: samples with poses, truth and belief, what it takes to decide it again, and whose it is. `drive` is what
    /// the person typed.
    #[must_use]
    pub fn recorded(&self, robot: &Robot, drive: &str, seed: u64) -> recording::Run {
        let mut recording = export::recording(&self.trace, robot);
        recording.pose = self.walk.as_ref().map_or_else(Vec::new, Walk::poses_of_rows);
        let metadata = Metadata {
            robot: Some(robot.name.clone()),
            excitation: Some(drive.to_owned()),
            seed: i64::try_from(seed).ok().map(i64::unsigned_abs),
            // Every run begins with a new controller.
            start_state: Some(State::Idle),
            ..Metadata::default()
        };
        recording::Run {
            recording,
            extra: export::extra_columns(&self.trace),
            log: export::run_log(&self.trace, robot),
            scene: Some(scene(&self.trace, self.walk.as_ref())),
            metadata,
            ..recording::Run::default()
        }
    }
}
