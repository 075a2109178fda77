//! What a learner acts on.

use super::LearnError;

/// Environments that are stepped side by side. What one does follows from the seed of its episode and the actions in it alone.
pub trait Environments {
    /// How many.
    fn count(&self) -> usize;

    /// How many numbers an observation has.
    fn observation_size(&self) -> usize;

    /// How many actions there are.
    fn actions(&self) -> usize;

    /// Begins an episode of one of them; what is seen.
    ///
    /// # Errors
    /// The environment's.
    fn reset(&mut self, which: usize, seed: u64) -> Result<Vec<f32>, LearnError>;

    /// An action of each.
    ///
    /// # Errors
    /// The environment's.
    fn step(&mut self, actions: &[usize]) -> Result<Stepped, LearnError>;
}

/// What a step of all environments gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stepped {
    /// What is seen, a row an environment: of an episode that ended, its last observation.
    pub observations: Vec<f32>,
    /// Rewards.
    pub rewards: Vec<f64>,
    /// The episode came to its end.
    pub terminated: Vec<bool>,
    /// The episode was cut off for its length.
    pub truncated: Vec<bool>,
}

impl Environments for tasks::Environments {
    fn count(&self) -> usize {
        self.len()
    }

    fn observation_size(&self) -> usize {
        self.definition().observation_size()
    }

    fn actions(&self) -> usize {
        self.definition().frequencies_hz.len()
    }

    fn reset(&mut self, which: usize, seed: u64) -> Result<Vec<f32>, LearnError> {
        self.reset(which, Some(seed))?;
        let mut seen = vec![0.0; self.definition().observation_size()];
        self.observe(which, &mut seen);
        Ok(seen)
    }

    fn step(&mut self, actions: &[usize]) -> Result<Stepped, LearnError> {
        let tasks::Steps { observations, rewards, terminated, truncated } = self.step(actions)?;
        Ok(Stepped { observations, rewards, terminated, truncated })
    }
}
