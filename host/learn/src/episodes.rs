//! The episodes that are under way: what it takes to be in the middle of them again.

use serde::{Deserialize, Serialize};

use super::LearnError;
use super::environment::Environments;
use super::seeds;

/// Of every environment the episode that it is in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Episodes {
    seed: u64,
    underway: Vec<Episode>,
}

/// An episode so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Episode {
    /// Episodes that this environment began before.
    number: u64,
    actions: Vec<usize>,
    sum: f64,
}

impl Episodes {
    /// No environment has begun one.
    #[must_use]
    pub fn new(environments: usize, seed: u64) -> Self {
        Self { seed, underway: vec![Episode::default(); environments] }
    }

    /// Seed of the next episode of an environment, which begins.
    pub fn begin(&mut self, which: usize) -> u64 {
        let number = self.underway[which].number + 1;
        self.underway[which] = Episode { number, ..Episode::default() };
        self.seed_of(which)
    }

    /// Notes a step of all environments.
    pub fn take(&mut self, actions: &[usize], rewards: &[f64]) {
        for ((episode, action), reward) in self.underway.iter_mut().zip(actions).zip(rewards) {
            episode.actions.push(*action);
            episode.sum += reward;
        }
    }

    /// Sum of the rewards of an environment's episode.
    #[must_use]
    pub fn sum(&self, which: usize) -> f64 {
        self.underway[which].sum
    }

    /// Whether the first episode of an environment has come to its share of an episode's steps: half for the first of two environments, all for
    /// the second.
    pub fn is_first_share_over(&self, which: usize, episode_steps: usize) -> bool {
        let Episode { number, actions, .. } = &self.underway[which];
        *number == 1 && actions.len() * self.underway.len() >= (which + 1) * episode_steps
    }

    /// How many environments there are.
    #[must_use]
    pub fn environments(&self) -> usize {
        self.underway.len()
    }

    fn seed_of(&self, which: usize) -> u64 {
        let number = self.underway[which].number * self.underway.len() as u64 + which as u64;
        seeds::of_training(self.seed, number)
    }

    /// Brings environments to where these episodes are, by what was done in them; what is seen there.
    ///
    /// # Errors
    /// The environments'.
    pub fn relive(&self, environments: &mut impl Environments) -> Result<Vec<f32>, LearnError> {
        let longest = self.underway.iter().map(|episode| episode.actions.len()).max().unwrap_or(0);
        let size = environments.observation_size();
        let mut seen = vec![0.0; size * self.underway.len()];
        for step in 0..=longest {
            for (which, episode) in self.underway.iter().enumerate() {
                // All end at the same step. What is stepped before its episode begins only waits.
                if step + episode.actions.len() == longest || step == 0 {
                    let first = environments.reset(which, self.seed_of(which))?;
                    seen[which * size..(which + 1) * size].copy_from_slice(&first);
                }
            }
            if step < longest {
                let action = |episode: &Episode| {
                    (step + episode.actions.len()).checked_sub(longest).map_or(0, |place| episode.actions[place])
                };
                let actions: Vec<usize> = self.underway.iter().map(action).collect();
                seen = environments.step(&actions)?.observations;
            }
        }
        Ok(seen)
    }
}
