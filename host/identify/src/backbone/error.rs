//! Why oscillations give no parameters.

use miette::Diagnostic;
use thiserror::Error;

/// Why there is no fit.
#[derive(Clone, Debug, PartialEq, Eq, Error, Diagnostic)]
pub enum BackboneError {
    /// No run.
    #[error("no recording of an oscillation")]
    #[diagnostic(help("give one run or more: angles of the backbone's end after it is let go"))]
    Nothing,
    /// The robot file has no such backbone.
    #[error("{0}")]
    #[diagnostic(help("name the right file with --robot, and the module at the backbone's end with --module"))]
    Robot(String),
    /// A recording that cannot be used.
    #[error("{run}: {problem}")]
    #[diagnostic(help("{help}"))]
    Run {
        /// The run.
        run: String,
        /// What is wrong with it.
        problem: String,
        /// What to do.
        help: String,
    },
    /// No parameters near the file's carry these runs.
    #[error("no stiffness between a quarter and four times the file's gives oscillations like these")]
    #[diagnostic(help("are the angles in radians, and the mass and size of the module at the end in the robot file?"))]
    Hopeless,
}
