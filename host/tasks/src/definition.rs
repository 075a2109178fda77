//! Everything that defines an environment.

use hal_sim::body::Precision;
use robot_file::gait::GaitStep;

use super::error::TaskError;
use super::observation::Part;
use super::specimen::Randomization;
use super::task::Task;

/// What turns the eccentric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum DriveKind {
    /// A shaft that follows its frequency exactly, [`crate::RampedShaft`]. The seed draws its angle at the start.
    #[default]
    Exact,
    /// The firmware's controller with the simulated motor, sensor and battery. The seed draws angle, charge and noise.
    Motor,
}

/// How far from its place an episode's robot starts, each uniformly to either side.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Start {
    /// Of x and of y, m.
    pub position_m: f64,
    /// Of the heading, rad.
    pub heading_rad: f64,
}

/// Everything that defines an environment.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// What is to be learned.
    pub task: Task,
    /// What an action chooses among, Hz, clockwise positive.
    pub frequencies_hz: Vec<f64>,
    /// What it chooses among beyond them: the controller's swings between two angles, degrees, with [`DriveKind::Motor`].
    pub oscillations_deg: Vec<[f64; 2]>,
    /// Δt: from an action to the next, s.
    pub interval_s: f64,
    /// Length of an episode, s; what does not end before is truncated.
    pub episode_s: f64,
    /// What turns the eccentric.
    pub drive: DriveKind,
    /// Integration step, s.
    pub step_s: f64,
    /// With how many digits bodies are advanced.
    pub precision: Precision,
    /// What is observed, part after part.
    pub parts: Vec<Part>,
    /// Observed lengths are in this unit, m.
    pub length_unit_m: f64,
    /// How an episode starts.
    pub start: Start,
    /// α, degrees; none for the robot file's own.
    pub alpha_deg: Option<f64>,
    /// What differs from one episode's robot to the next.
    pub randomization: Randomization,
}

/// Ten frequencies of 6 to 8 Hz of both signs, Hz: thesis 5.3.2, which does not say which; these are evenly spaced.
#[must_use]
pub fn thesis_frequencies_hz() -> Vec<f64> {
    vec![-8.0, -7.5, -7.0, -6.5, -6.0, 6.0, 6.5, 7.0, 7.5, 8.0]
}

impl Definition {
    /// A task with the thesis's observation and actions, and what it leaves open as chosen: docs/gymnasium.md has the reasons.
    #[must_use]
    pub fn new(task: Task) -> Self {
        let (maze, turn) = (matches!(task, Task::Maze(_)), matches!(task, Task::Turn(_)));
        Self {
            task,
            frequencies_hz: thesis_frequencies_hz(),
            oscillations_deg: vec![],
            interval_s: if turn { 0.02 } else { 0.04 },
            episode_s: if maze { 240.0 } else { 10.0 },
            drive: DriveKind::Exact,
            step_s: 1e-4,
            precision: Precision::Single,
            parts: if maze { vec![Part::Pose, Part::Walls] } else { vec![Part::Pose] },
            length_unit_m: 0.01,
            start: Start::default(),
            alpha_deg: Some(90.0),
            randomization: Randomization::default(),
        }
    }

    /// What an action chooses among: the frequencies, then the oscillations.
    #[must_use]
    pub fn actions(&self) -> Vec<GaitStep> {
        let frequencies = self.frequencies_hz.iter().copied().map(GaitStep::Frequency);
        frequencies.chain(self.oscillations_deg.iter().copied().map(GaitStep::Oscillation)).collect()
    }

    /// Numbers of an observation.
    #[must_use]
    pub fn observation_size(&self) -> usize {
        self.parts.iter().map(|part| part.size()).sum()
    }

    /// The least and the greatest value of every number of an observation.
    #[must_use]
    pub fn observation_bounds(&self) -> Vec<[f64; 2]> {
        self.parts.iter().flat_map(|part| part.bounds(self.length_unit_m)).collect()
    }

    /// Actions of an episode.
    #[must_use]
    pub fn episode_steps(&self) -> usize {
        (self.episode_s / self.interval_s).round().max(1.0) as usize
    }

    /// Integration steps from an action to the next.
    #[must_use]
    pub fn steps_per_interval(&self) -> usize {
        (self.interval_s / self.step_s).round().max(1.0) as usize
    }

    /// Whether every number is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), TaskError> {
        let positive = |field, value: f64, unit: &str| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(TaskError::definition(field, format!("{value} is not positive"), format!("give a number of {unit}")))
        };
        positive("step_s", self.step_s, "seconds, at most 1e-4 or so")?;
        positive("interval_s", self.interval_s, "seconds")?;
        positive("episode_s", self.episode_s, "seconds")?;
        positive("length_unit_m", self.length_unit_m, "metres")?;
        let whole = self.interval_s / self.step_s;
        if (whole - whole.round()).abs() > 1e-6 * whole {
            let problem = format!("{} s are no whole number of steps of {} s", self.interval_s, self.step_s);
            return Err(TaskError::definition("interval_s", problem, "give a multiple of step_s"));
        }
        if self.actions().is_empty() || !self.frequencies_hz.iter().all(|hz| hz.is_finite()) {
            let problem = format!("{:?} are no actions", self.frequencies_hz);
            return Err(TaskError::definition("frequencies_hz", problem, "give one finite frequency or more, Hz"));
        }
        if self.drive == DriveKind::Exact && !self.oscillations_deg.is_empty() {
            let problem = "an exact drive has no controller that would swing the shaft";
            return Err(TaskError::definition("oscillations_deg", problem, "choose the motor as drive, or give none"));
        }
        if self.parts.is_empty() {
            return Err(TaskError::definition("observe", "nothing is observed", "name one part or more, e.g. pose"));
        }
        if self.parts.contains(&Part::Walls) && self.task.maze().is_none() {
            return Err(TaskError::definition("observe", "there are no walls to be seen", "only a maze has walls"));
        }
        for (field, value) in
            [("start_position_m", self.start.position_m), ("start_heading_rad", self.start.heading_rad)]
        {
            if !value.is_finite() || value < 0.0 {
                return Err(TaskError::definition(field, format!("{value} is no width"), "give 0 or more"));
            }
        }
        if let Some((field, value)) = self.task.weights().into_iter().find(|(_, value)| !value.is_finite()) {
            return Err(TaskError::definition(field, format!("{value} is no number"), "give a finite number"));
        }
        if let Some(maze) = self.task.maze() {
            positive("cell_m", maze.cell_m(), "metres")?;
        }
        self.randomization.check()
    }
}
