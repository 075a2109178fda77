//! Why there is no training.

use std::path::PathBuf;

/// What can go wrong.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum LearnError {
    /// A hyperparameter is out of its range.
    #[error("{name}: expected {expected}")]
    #[diagnostic(help("it is in the table [ppo] of the learning file"))]
    Hyperparameter {
        /// The field.
        name: &'static str,
        /// What is expected.
        expected: String,
    },
    /// Another key of the learning file is out of its range.
    #[error("{name}: expected {expected}")]
    #[diagnostic(help("it is in the learning file; docs/learning.md lists every key"))]
    Setting {
        /// The key with its table.
        name: &'static str,
        /// What is expected.
        expected: String,
    },
    /// The environments'.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Task(#[from] tasks::TaskError),
    /// The robot file's.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Robot(#[from] robot_file::RobotFileError),
    /// The robot file has no body, or one that cannot be built.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Axis(#[from] sweep::AxisError),
    /// The networks have no answer any more.
    #[error("after update {update} the policy gives no probabilities any more")]
    #[diagnostic(help("lower learning_rate, or the weights of the reward"))]
    Diverged {
        /// Which update.
        update: usize,
    },
    /// A file holds no policy.
    #[error("{}: {problem}", path.display())]
    #[diagnostic(help("`scram learn turn` writes policies: policy.json of its directory"))]
    Policy {
        /// The file.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// A policy that no robot can be driven by: why, and with what in its learning file it could.
    #[error("no robot can be driven by this policy: {0}")]
    #[diagnostic(help("train one with `{1}` in the table [turn] of the learning file"))]
    Unplayable(&'static str, &'static str),
    /// A checkpoint is not one of this training.
    #[error("the checkpoint is of another training: {0}")]
    #[diagnostic(help("begin anew in another directory, or with what the checkpoint was begun with"))]
    OtherTraining(String),
}

impl LearnError {
    /// What was begun with one robot goes on with that robot, each by its name.
    ///
    /// # Errors
    /// [`Self::OtherTraining`], if they are two.
    pub fn unless_same(begun_with: &str, file: &str) -> Result<(), Self> {
        if begun_with == file {
            return Ok(());
        }
        Err(Self::OtherTraining(format!("it is of `{begun_with}`, and the robot file of `{file}`")))
    }
}
