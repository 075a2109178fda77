//! What a learner acts on.

use tasks::Steps;

use super::LearnError;

/// Environments that are stepped side by side. What one does follows from the seed of its episode and the actions in it alone.
pub trait Environments {
    /// How many.
    fn count(&self) -> usize;

    /// How many numbers an observation has.
    fn observation_size(&self) -> usize;

    /// How many actions there are.
    fn actions(&self) -> usize;

    /// Steps after which an episode is over at the latest.
    fn episode_steps(&self) -> usize;

    /// Begins an episode of one of them; what is seen.
    ///
    /// # Errors
    /// The environment's.
    fn reset(&mut self, which: usize, seed: u64) -> Result<Vec<f32>, LearnError>;

    /// An action of each: of an episode that ended, what is seen is its last observation.
    ///
    /// # Errors
    /// The environment's.
    fn step(&mut self, actions: &[usize]) -> Result<Steps, LearnError>;

    /// What an episode that was ended before its time left out, each step worth `discount` times the one before; 0 where it goes on or its
    /// end is no loss.
    fn left_out(&self, _which: usize, _discount: f64) -> f64 {
        0.0
    }
}

impl Environments for tasks::Environments {
    fn count(&self) -> usize {
        self.len()
    }

    fn observation_size(&self) -> usize {
        self.definition().observation_size()
    }

    fn actions(&self) -> usize {
        self.definition().actions().len()
    }

    fn episode_steps(&self) -> usize {
        self.definition().episode_steps()
    }

    fn reset(&mut self, which: usize, seed: u64) -> Result<Vec<f32>, LearnError> {
        self.reset(which, Some(seed))?;
        let mut seen = vec![0.0; self.definition().observation_size()];
        self.observe(which, &mut seen);
        Ok(seen)
    }

    fn step(&mut self, actions: &[usize]) -> Result<Steps, LearnError> {
        Ok(self.step(actions)?)
    }

    fn left_out(&self, which: usize, discount: f64) -> f64 {
        self.left_out(which, discount)
    }
}
