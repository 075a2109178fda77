//! Proximal policy optimisation.

use nalgebra::DMatrix;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use tasks::Steps;

use super::adam::Adam;
use super::environment::Environments;
use super::episodes::Episodes;
use super::loss::{Batch, Shown, log_softmax, loss};
use super::network::ActorCritic;
use super::policy::Policy;
use super::rollout::{Rollout, Worth};
use super::{Hyperparameters, LearnError};

/// Learns by J. Schulman and others, *Proximal policy optimization algorithms*, 2017, in the form of Stable-Baselines3: advantages are
/// normalised in each minibatch, the value's loss is not clipped. Beyond it, environments are kept out of step with each other.
pub struct Learner<E> {
    pub(crate) environments: E,
    pub(crate) hyperparameters: Hyperparameters,
    pub(crate) network: ActorCritic,
    pub(crate) adam: Adam,
    pub(crate) episodes: Episodes,
    pub(crate) seed: u64,
    pub(crate) updates: usize,
    /// What is seen before the next action, a row an environment.
    pub(crate) seen: Vec<f32>,
}

/// What an update did.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Progress {
    /// Updates so far.
    pub updates: usize,
    /// Steps of all environments so far.
    pub steps: usize,
    /// Mean sum of the rewards of the episodes that ended since the last update; `None` if none did.
    pub mean_return: Option<f64>,
    /// How many that were.
    pub episodes: usize,
    /// Mean entropy of the policy, nat.
    pub entropy: f64,
    /// Mean divergence of the new policy from the old one, nat (J. Schulman's estimate `r − 1 − ln r`).
    pub divergence: f64,
    /// Share of the ratios that were clipped.
    pub clipped: f64,
    /// Mean square of what the value function missed by.
    pub value_error: f64,
}

/// Keeps advantages that are all alike from being blown up.
const LEAST_SPREAD: f64 = 1e-8;

/// What the streams of random numbers are for.
const FOR_WEIGHTS: u64 = 0;
const FOR_ACTIONS: u64 = 1;
const FOR_SHUFFLES: u64 = 2;

impl<E: Environments> Learner<E> {
    /// A learner that knows nothing; its environments begin their first episodes.
    ///
    /// # Errors
    /// A hyperparameter is out of its range, or the environments' errors.
    pub fn new(mut environments: E, hyperparameters: Hyperparameters, seed: u64) -> Result<Self, LearnError> {
        hyperparameters.check(environments.count())?;
        let (observed, hidden) = (environments.observation_size(), hyperparameters.hidden_units);
        let mut random = Pcg64::new(u128::from(seed), u128::from(FOR_WEIGHTS));
        let network = ActorCritic::new(observed, hidden, environments.actions(), &mut random);
        let adam = Adam::new(network.size());
        let mut episodes = Episodes::new(environments.count(), seed);
        let mut seen = Vec::new();
        for which in 0..environments.count() {
            seen.extend(environments.reset(which, episodes.begin(which))?);
        }
        Ok(Self { environments, hyperparameters, network, adam, episodes, seed, updates: 0, seen })
    }

    /// The policy as it is now.
    #[must_use]
    pub fn policy(&self) -> Policy {
        Policy::of(&self.network.policy)
    }

    /// Seed of all that is drawn.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Updates so far.
    #[must_use]
    pub fn updates(&self) -> usize {
        self.updates
    }

    /// The environments.
    #[must_use]
    pub fn environments(&self) -> &E {
        &self.environments
    }

    /// Acts for [`Hyperparameters::steps`] steps and improves the policy by them.
    ///
    /// # Errors
    /// The environments', or there is no policy left.
    pub fn update(&mut self) -> Result<Progress, LearnError> {
        let (rollout, ended) = self.act()?;
        let last = self.network.value.forward(&self.columns(&self.seen)).output;
        let worth = rollout.worth(last.as_slice(), self.hyperparameters.discount, self.hyperparameters.gae_lambda);
        let shown = self.improve(&rollout, &worth);
        self.updates += 1;
        let mean_return = (!ended.is_empty()).then(|| ended.iter().sum::<f64>() / ended.len() as f64);
        Ok(Progress {
            updates: self.updates,
            steps: self.updates * self.hyperparameters.steps,
            mean_return,
            episodes: ended.len(),
            entropy: shown.entropy,
            divergence: shown.divergence,
            clipped: shown.clipped,
            value_error: shown.value_error,
        })
    }

    /// A stream of random numbers of this update: none is carried over from one update to the next.
    fn random(&self, purpose: u64) -> Pcg64 {
        let seed = [self.seed.to_le_bytes(), (self.updates as u64).to_le_bytes(), purpose.to_le_bytes(), [0; 8]];
        Pcg64::from_seed(seed.concat().try_into().unwrap_or([0; 32]))
    }

    /// Observations that stand one after the other, as columns.
    fn columns(&self, observations: &[f32]) -> DMatrix<f64> {
        let size = self.environments.observation_size();
        DMatrix::from_iterator(size, observations.len() / size, observations.iter().copied().map(f64::from))
    }

    /// Acts by the policy; what happened, and the sums of the rewards of the episodes that ended.
    fn act(&mut self) -> Result<(Rollout, Vec<f64>), LearnError> {
        let mut random = self.random(FOR_ACTIONS);
        let mut rollout = Rollout { environments: self.environments.count(), ..Rollout::default() };
        let mut returns = Vec::new();
        while rollout.len() < self.hyperparameters.steps {
            let seen = self.columns(&self.seen);
            let logits = self.network.policy.forward(&seen).output;
            rollout.values.extend(self.network.value.forward(&seen).output.iter());
            let mut actions = Vec::with_capacity(logits.ncols());
            for logits in logits.column_iter() {
                let logs = log_softmax(&logits.into_owned());
                let action = draw(logs.as_slice(), &mut random).ok_or(LearnError::Diverged { update: self.updates })?;
                rollout.log_probabilities.push(logs[action]);
                actions.push(action);
            }
            rollout.observations.extend(seen.iter());
            rollout.actions.extend(&actions);
            let mut stepped = self.environments.step(&actions)?;
            self.episodes.take(&actions, &stepped.rewards);
            let shares = self.end_shares(&mut stepped);
            let beyond = self.beyond(&stepped);
            let rewards = stepped.rewards.iter().zip(beyond);
            rollout.rewards.extend(rewards.map(|(reward, beyond)| reward + beyond));
            rollout.ended.extend(stepped.terminated.iter().zip(&stepped.truncated).map(|(a, b)| *a || *b));
            returns.extend(self.begin_anew(&stepped, &shares)?);
        }
        Ok((rollout, returns))
    }

    /// Cuts the first episode of every environment off after its share of an episode, so that from then on they are in different parts of
    /// their episodes: a policy that sees the same part of all of them in an update forgets the others. Says which.
    fn end_shares(&self, stepped: &mut Steps) -> Vec<bool> {
        let most = self.environments.episode_steps();
        let is_over = |which: usize| self.episodes.is_first_share_over(which, most) && !stepped.terminated[which];
        let over: Vec<bool> = (0..stepped.truncated.len()).map(is_over).collect();
        stepped.truncated.iter_mut().zip(&over).for_each(|(truncated, over)| *truncated |= over);
        over
    }

    /// What lies beyond the end of each episode: one that was cut off would have gone on, one that ended too early leaves steps out.
    fn beyond(&self, stepped: &Steps) -> Vec<f64> {
        let discount = self.hyperparameters.discount;
        let cut = |which: usize| stepped.truncated[which] && !stepped.terminated[which];
        let left_out = |which: usize| self.environments.left_out(which, discount);
        let environments = 0..stepped.truncated.len();
        if !environments.clone().any(cut) {
            return environments.map(left_out).collect();
        }
        let values = self.network.value.forward(&self.columns(&stepped.observations)).output;
        environments.map(|which| if cut(which) { discount * values[which] } else { left_out(which) }).collect()
    }

    /// Begins new episodes where one ended; the sums of the rewards of those that were whole.
    fn begin_anew(&mut self, stepped: &Steps, shares: &[bool]) -> Result<Vec<f64>, LearnError> {
        self.seen.clone_from(&stepped.observations);
        let size = self.environments.observation_size();
        let mut returns = Vec::new();
        for (which, is_share) in shares.iter().enumerate() {
            if stepped.terminated[which] || stepped.truncated[which] {
                if !is_share {
                    returns.push(self.episodes.sum(which) + self.environments.left_out(which, 1.0));
                }
                let seen = self.environments.reset(which, self.episodes.begin(which))?;
                self.seen[which * size..(which + 1) * size].copy_from_slice(&seen);
            }
        }
        Ok(returns)
    }

    /// Passes over a rollout in shuffled minibatches; the means of what they showed.
    fn improve(&mut self, rollout: &Rollout, worth: &Worth) -> Shown {
        let mut random = self.random(FOR_SHUFFLES);
        let size = self.environments.observation_size();
        let mut order: Vec<usize> = (0..rollout.len()).collect();
        let mut parameters = self.network.parameters();
        let (mut sum, mut count) = (Shown::default(), 0.0);
        for _ in 0..self.hyperparameters.epochs {
            order.shuffle(&mut random);
            for chosen in order.chunks(self.hyperparameters.batch_size) {
                let of = |values: &[f64]| chosen.iter().map(|&step| values[step]).collect::<Vec<f64>>();
                let seen = |row: usize, column: usize| rollout.observations[chosen[column] * size + row];
                let batch = Batch {
                    observations: DMatrix::from_fn(size, chosen.len(), seen),
                    actions: chosen.iter().map(|&step| rollout.actions[step]).collect(),
                    log_probabilities: of(&rollout.log_probabilities),
                    advantages: normalised(of(&worth.advantages)),
                    returns: of(&worth.returns),
                };
                let (shown, gradient) = loss(&self.network, &batch, &self.hyperparameters);
                let (rate, longest) = (self.hyperparameters.learning_rate, self.hyperparameters.max_gradient_norm);
                self.adam.step(&mut parameters, &gradient, rate, longest);
                self.network.set_parameters(&parameters);
                sum = sum.plus(&shown, 1.0);
                count += 1.0;
            }
        }
        Shown::default().plus(&sum, 1.0 / count)
    }
}

/// Draws one of several by the logarithms of their probabilities; `None` where these are none.
fn draw(logs: &[f64], random: &mut Pcg64) -> Option<usize> {
    let mut left = random.random::<f64>() * logs.iter().map(|log| log.exp()).sum::<f64>();
    if !left.is_finite() {
        return None;
    }
    for (place, log) in logs.iter().enumerate() {
        left -= log.exp();
        if left < 0.0 {
            return Some(place);
        }
    }
    Some(logs.len() - 1)
}

/// To mean 0 and standard deviation 1.
fn normalised(mut advantages: Vec<f64>) -> Vec<f64> {
    let count = advantages.len() as f64;
    let mean = advantages.iter().sum::<f64>() / count;
    let square = advantages.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    advantages.iter_mut().for_each(|a| *a = (*a - mean) / (square.sqrt() + LEAST_SPREAD));
    advantages
}
