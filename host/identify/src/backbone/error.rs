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
    #[diagnostic(help("name the right robot file, and the module at the backbone's end"))]
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
    /// The program cannot do it.
    #[error("this program was built without Bayesian optimisation")]
    #[diagnostic(help(
        "from the project's folder: cargo run --release -p scram --features bayes -- identify backbone … --method bayes"
    ))]
    WithoutBayes,
    /// Bayesian optimisation with too few sets of numbers.
    #[error("{evaluations} evaluations are too few for Bayesian optimisation")]
    #[diagnostic(help("--evaluations {fewest} or more: the first are drawn, those after them are chosen"))]
    TooFew {
        /// Asked for.
        evaluations: usize,
        /// The least.
        fewest: usize,
    },
    /// No Gaussian process over what was tried.
    #[error("Bayesian optimisation came to an end: {0}")]
    #[diagnostic(help("try another --seed, or --method least-squares"))]
    Search(String),
    /// It was told to stop.
    #[error("the fit was stopped")]
    Stopped,
    /// No parameters near the file's carry these runs.
    #[error("no stiffness between a quarter and four times the file's gives oscillations like these")]
    #[diagnostic(help("are the angles in radians, and the mass and size of the module at the end in the robot file?"))]
    Hopeless,
}
