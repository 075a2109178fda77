//! Why there is no environment.

use hal_sim::body::plan::PlanError;
use robot_file::gait::GaitStep;
use sweep::AxisError;

/// Why environments cannot be made or advanced.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum TaskError {
    /// A number of the definition is out of its range.
    #[error("{field}: {problem}")]
    Definition {
        /// Name of the argument.
        field: &'static str,
        /// What is wrong with it.
        problem: String,
        /// What to do.
        #[help]
        help: String,
    },
    /// The robot cannot be brought to what is randomised, or has no body.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Robot(#[from] AxisError),
    /// There is no controller for the robot.
    #[error("no controller for this robot: {0}")]
    #[diagnostic(help("the exact drive turns the shaft without one"))]
    Controller(String),
    /// The robot cannot walk.
    #[error("{0}")]
    #[diagnostic(help("name the robot file of a robot with [body], [backbone], [eccentric], [feet] and [ground]"))]
    NoBody(String),
    /// The body cannot be built, or the step cannot carry it.
    #[error("no body for this robot: {0}")]
    #[diagnostic(help("choose other values, a smaller share of the spreads, or a shorter step"))]
    Body(PlanError),
    /// No robot that was drawn can be simulated.
    #[error("none of {tries} robots drawn for seed {seed} can be simulated; the last one: {last}")]
    #[diagnostic(help("randomise fewer quantities, or by a smaller share of their spreads"))]
    NoSpecimen {
        /// How many were drawn.
        tries: usize,
        /// Seed of the episode.
        seed: u64,
        /// What was wrong with the last one.
        last: String,
    },
    /// The controller refuses an action.
    #[error("the controller refuses {action}: {why}")]
    #[diagnostic(help("the limits are in [controller.limits] of the robot file; the exact drive has none"))]
    Refused {
        /// The action.
        action: GaitStep,
        /// The controller's words.
        why: String,
    },
    /// An action that does not exist, or not one for each environment.
    #[error("{0}")]
    #[diagnostic(help("give one index for each environment, from 0 to one less than the number of actions"))]
    Actions(String),
    /// The pool of threads cannot be made.
    #[error("no threads: {0}")]
    #[diagnostic(help("name fewer threads"))]
    Threads(String),
}

impl From<PlanError> for TaskError {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::NoBody(_) => Self::NoBody(error.to_string()),
            PlanError::Field { .. } => Self::Body(error),
        }
    }
}

impl TaskError {
    pub(crate) fn definition(field: &'static str, problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Definition { field, problem: problem.into(), help: help.into() }
    }
}
