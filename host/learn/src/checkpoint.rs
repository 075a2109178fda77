//! A training that was stopped, to go on as if it had not been.

use serde::{Deserialize, Serialize};

use super::adam::Adam;
use super::environment::Environments;
use super::episodes::Episodes;
use super::learner::Learner;
use super::{Hyperparameters, LearnError};

/// Everything that a [`Learner`] is between two updates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// The hyperparameters.
    pub hyperparameters: Hyperparameters,
    /// The seed.
    pub seed: u64,
    /// Updates so far.
    pub updates: usize,
    episodes: Episodes,
    adam: Adam,
    parameters: Vec<f64>,
}

impl<E: Environments> Learner<E> {
    /// What it takes to go on from here.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            hyperparameters: self.hyperparameters.clone(),
            seed: self.seed,
            updates: self.updates,
            episodes: self.episodes.clone(),
            adam: self.adam.clone(),
            parameters: self.network.parameters(),
        }
    }

    /// Goes on from a checkpoint, with environments that are as those were.
    ///
    /// # Errors
    /// The checkpoint is of other environments, or the environments' errors.
    pub fn resume(environments: E, checkpoint: &Checkpoint) -> Result<Self, LearnError> {
        if checkpoint.episodes.environments() != environments.count() {
            let (was, is) = (checkpoint.episodes.environments(), environments.count());
            return Err(LearnError::OtherTraining(format!("it had {was} environments, and these are {is}")));
        }
        let mut learner = Self::new(environments, checkpoint.hyperparameters.clone(), checkpoint.seed)?;
        let size = learner.network.size();
        if checkpoint.parameters.len() != size || checkpoint.adam.parameters() != size {
            let was = checkpoint.parameters.len();
            return Err(LearnError::OtherTraining(format!(
                "it had {was} weights and biases, and these networks have {size}"
            )));
        }
        learner.network.set_parameters(&checkpoint.parameters);
        learner.adam = checkpoint.adam.clone();
        learner.updates = checkpoint.updates;
        learner.episodes = checkpoint.episodes.clone();
        learner.seen = learner.episodes.relive(&mut learner.environments)?;
        Ok(learner)
    }
}
