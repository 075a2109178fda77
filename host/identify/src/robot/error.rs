//! Why speeds give no parameters.

use std::path::PathBuf;

use miette::Diagnostic;
use sweep::AxisError;
use thiserror::Error;

/// Why there is no fit.
#[derive(Debug, Error, Diagnostic)]
pub enum RobotError {
    /// The robot file cannot be varied.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Robot(#[from] AxisError),
    /// The table has too few conditions.
    #[error("{conditions} conditions with a speed, of {least} at least")]
    #[diagnostic(help("measure at other frequencies and α: f_hz and alpha_deg are a condition"))]
    TooFew {
        /// How many there are.
        conditions: usize,
        /// How many there must be.
        least: usize,
    },
    /// A condition that is to be held out was not measured.
    #[error("{f_hz},{alpha_deg}: there is no run of {f_hz} Hz and {alpha_deg}° in what was measured")]
    NotMeasured {
        /// Hz, positive clockwise.
        f_hz: f64,
        /// Degrees.
        alpha_deg: f64,
    },
    /// Speeds cannot be told between these times.
    #[error("speeds are not told from {from_s} s to {to_s} s")]
    #[diagnostic(help("give two times from 0 s on, the second one later, by {least_s} s at least"))]
    Window {
        /// s.
        from_s: f64,
        /// s.
        to_s: f64,
        /// s.
        least_s: f64,
    },
    /// Too much is held out.
    #[error("leaves too few conditions to fit")]
    TooFewLeft,
    /// Nothing can be simulated.
    #[error("the robot file's own numbers cannot be simulated: {0}")]
    #[diagnostic(help("scram sweep --drive ideal says what is wrong with which condition"))]
    CannotRun(String),
    /// What was evaluated cannot be kept.
    #[error("{}: {problem}", path.display())]
    #[diagnostic(help("remove the file to begin anew"))]
    Cache {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}
