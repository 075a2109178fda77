//! The steps between two updates, and what they were worth.

/// Steps of several environments, step by step, each step of all environments in a row.
#[derive(Clone, Debug, Default)]
pub struct Rollout {
    /// How many environments.
    pub environments: usize,
    /// What was seen before each action, as many numbers a row as an observation has.
    pub observations: Vec<f64>,
    /// The actions, as indices.
    pub actions: Vec<usize>,
    /// Logarithm of the probability that the policy gave each action.
    pub log_probabilities: Vec<f64>,
    /// What the value function expected before each action.
    pub values: Vec<f64>,
    /// Rewards. One of an episode that was cut off has γ times the value of its last observation in it, one of an episode
    /// that ended too early what it left out.
    pub rewards: Vec<f64>,
    /// Whether the episode ended with the step.
    pub ended: Vec<bool>,
}

/// What the steps of a [`Rollout`] were worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Worth {
    /// How much better each action was than the value function expected.
    pub advantages: Vec<f64>,
    /// What the value function should have expected.
    pub returns: Vec<f64>,
}

impl Rollout {
    /// How many steps of all environments together.
    #[must_use]
    pub fn len(&self) -> usize {
        self.actions.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.actions.is_empty()
    }

    /// Generalised advantage estimation (J. Schulman and others, ICLR 2016): `A_t = δ_t + γλ·A_{t+1}` with
    /// `δ_t = r_t + γ·V_{t+1} − V_t` up to an episode's end; `last` are the values of what is seen after the last step, one an environment.
    #[must_use]
    pub fn worth(&self, last: &[f64], discount: f64, lambda: f64) -> Worth {
        let mut advantages = vec![0.0; self.len()];
        for (environment, beyond) in last.iter().enumerate() {
            let (mut next_value, mut next_advantage) = (*beyond, 0.0);
            for place in (environment..self.len()).step_by(self.environments).rev() {
                let goes_on = if self.ended[place] { 0.0 } else { 1.0 };
                let value = self.values[place];
                let surprise = self.rewards[place] + discount * goes_on * next_value - value;
                next_advantage = surprise + discount * lambda * goes_on * next_advantage;
                advantages[place] = next_advantage;
                next_value = value;
            }
        }
        let returns = advantages.iter().zip(&self.values).map(|(advantage, value)| advantage + value).collect();
        Worth { advantages, returns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of one environment.
    fn rollout(values: &[f64], rewards: &[f64], ended: &[bool]) -> Rollout {
        Rollout {
            environments: 1,
            observations: vec![0.0; values.len()],
            actions: vec![0; values.len()],
            log_probabilities: vec![0.0; values.len()],
            values: values.to_vec(),
            rewards: rewards.to_vec(),
            ended: ended.to_vec(),
        }
    }

    #[test]
    fn with_lambda_1_an_advantage_is_the_discounted_rewards_less_the_value() {
        let worth = rollout(&[0.5, 1.0, 2.0], &[1.0, 2.0, 3.0], &[false; 3]).worth(&[4.0], 0.5, 1.0);
        // 1 + 0.5·2 + 0.25·3 + 0.125·4 = 3.25.
        assert_eq!(worth.returns, [3.25, 4.5, 5.0]);
        assert_eq!(worth.advantages, [2.75, 3.5, 3.0]);
    }

    #[test]
    fn with_lambda_0_an_advantage_is_one_steps_surprise() {
        let worth = rollout(&[0.5, 1.0, 2.0], &[1.0, 2.0, 3.0], &[false; 3]).worth(&[4.0], 0.5, 0.0);
        assert_eq!(worth.advantages, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn nothing_is_expected_beyond_an_episodes_end() {
        let worth = rollout(&[0.0; 3], &[1.0, 2.0, 4.0], &[false, true, false]).worth(&[8.0], 1.0, 1.0);
        assert_eq!(worth.advantages, [3.0, 2.0, 12.0]);
    }

    #[test]
    fn environments_do_not_see_each_other() {
        let alone = [rollout(&[0.5, 1.0], &[1.0, 2.0], &[false; 2]), rollout(&[3.0, 4.0], &[5.0, 6.0], &[true, false])];
        let both = Rollout {
            environments: 2,
            values: vec![0.5, 3.0, 1.0, 4.0],
            rewards: vec![1.0, 5.0, 2.0, 6.0],
            ended: vec![false, true, false, false],
            ..rollout(&[0.0; 4], &[0.0; 4], &[false; 4])
        };
        let worth = both.worth(&[7.0, 8.0], 0.9, 0.8).advantages;
        let of = |which: usize, last: f64| alone[which].worth(&[last], 0.9, 0.8).advantages;
        let (first, second) = (of(0, 7.0), of(1, 8.0));
        assert_eq!(worth, [first[0], second[0], first[1], second[1]]);
    }
}
