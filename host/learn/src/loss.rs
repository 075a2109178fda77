//! The loss of proximal policy optimisation, and its gradient.

use nalgebra::{DMatrix, DVector};

use super::Hyperparameters;
use super::network::{ActorCritic, Perceptron};

/// Steps by which the networks are improved.
pub struct Batch {
    /// What was seen, a column each.
    pub observations: DMatrix<f64>,
    /// What was done.
    pub actions: Vec<usize>,
    /// Logarithm of the probability that the policy gave it then.
    pub log_probabilities: Vec<f64>,
    /// How much better it was than expected.
    pub advantages: Vec<f64>,
    /// What the value function should have expected.
    pub returns: Vec<f64>,
}

/// What a batch showed, in the mean over its steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// The loss.
    pub loss: f64,
    /// Entropy of the policy, nat.
    pub entropy: f64,
    /// Divergence of the new policy from the old one, nat (J. Schulman's estimate `r − 1 − ln r`).
    pub divergence: f64,
    /// Share of the ratios that were clipped.
    pub clipped: f64,
    /// Square of what the value function missed by.
    pub value_error: f64,
}

impl Shown {
    /// With so many times another one added.
    #[must_use]
    pub fn plus(&self, other: &Self, times: f64) -> Self {
        Self {
            loss: self.loss + times * other.loss,
            entropy: self.entropy + times * other.entropy,
            divergence: self.divergence + times * other.divergence,
            clipped: self.clipped + times * other.clipped,
            value_error: self.value_error + times * other.value_error,
        }
    }
}

/// `−mean(min(r·A, clip(r)·A)) − c_e·entropy + c_v·mean((V − R)²)` with the ratio r of the new probability of an action to its old one (J. Schulman and
/// others, 2017), and its gradient in the order of the networks' parameters.
#[must_use]
pub fn loss(network: &ActorCritic, batch: &Batch, hyperparameters: &Hyperparameters) -> (Shown, Vec<f64>) {
    // The two networks share nothing.
    let (policy, value) = rayon::join(
        || policy_loss(&network.policy, batch, hyperparameters),
        || value_loss(&network.value, batch, hyperparameters.value_coefficient),
    );
    (policy.0.plus(&value.0, 1.0), [policy.1, value.1].concat())
}

fn policy_loss(policy: &Perceptron, batch: &Batch, hyperparameters: &Hyperparameters) -> (Shown, Vec<f64>) {
    let (share, clip) = (1.0 / batch.actions.len() as f64, hyperparameters.clip_range);
    let pass = policy.forward(&batch.observations);
    let mut shown = Shown::default();
    let mut by_logits = DMatrix::zeros(pass.output.nrows(), pass.output.ncols());
    for (place, &action) in batch.actions.iter().enumerate() {
        let logs = log_softmax(&pass.output.column(place).into_owned());
        let probabilities = logs.map(f64::exp);
        let entropy = -probabilities.dot(&logs);
        let by_entropy = probabilities.zip_map(&logs, |p, log| -p * (log + entropy));
        let change = logs[action] - batch.log_probabilities[place];
        let (ratio, advantage) = (change.exp(), batch.advantages[place]);
        let clipped = ratio.clamp(1.0 - clip, 1.0 + clip);
        let gain = (ratio * advantage).min(clipped * advantage);
        // Where the clipped one is the smaller one, it does not move with the ratio.
        let by_log = if ratio * advantage <= clipped * advantage { ratio * advantage } else { 0.0 };
        let mut by_logit = by_log * &probabilities - hyperparameters.entropy_coefficient * by_entropy;
        by_logit[action] -= by_log;
        by_logits.set_column(place, &(share * by_logit));
        let step = Shown {
            loss: -gain - hyperparameters.entropy_coefficient * entropy,
            entropy,
            divergence: ratio - 1.0 - change,
            clipped: f64::from(u8::from((ratio - 1.0).abs() > clip)),
            value_error: 0.0,
        };
        shown = shown.plus(&step, share);
    }
    let gradient = policy.backward(&pass, by_logits);
    (shown, gradient)
}

fn value_loss(value: &Perceptron, batch: &Batch, coefficient: f64) -> (Shown, Vec<f64>) {
    let pass = value.forward(&batch.observations);
    let missed = &pass.output - DMatrix::from_row_slice(1, batch.returns.len(), &batch.returns);
    let value_error = missed.norm_squared() / batch.returns.len() as f64;
    let by_values = (2.0 * coefficient / batch.returns.len() as f64) * missed;
    (Shown { loss: coefficient * value_error, value_error, ..Shown::default() }, value.backward(&pass, by_values))
}

/// Logarithms of the probabilities that logits stand for.
#[must_use]
pub fn log_softmax(logits: &DVector<f64>) -> DVector<f64> {
    let most = logits.max();
    let sum = logits.iter().map(|logit| (logit - most).exp()).sum::<f64>();
    logits.add_scalar(-most - sum.ln())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    use super::*;

    /// Steps of which some ratios lie inside of the clip range, some outside on either side.
    fn batch() -> Batch {
        let wave = |place: usize, pace: f64| (pace * place as f64 + 0.3).sin();
        Batch {
            observations: DMatrix::from_fn(3, 12, |row, column| wave(3 * column + row, 1.7)),
            actions: (0..12).map(|place| place % 4).collect(),
            log_probabilities: (0..12).map(|place| 0.25f64.ln() + 0.5 * wave(place, 2.3)).collect(),
            advantages: (0..12).map(|place| wave(place, 0.9)).collect(),
            returns: (0..12).map(|place| 2.0 * wave(place, 0.4)).collect(),
        }
    }

    #[test]
    fn the_gradient_is_the_slope_of_the_loss() {
        let hyperparameters = Hyperparameters { entropy_coefficient: 0.2, ..Hyperparameters::default() };
        let mut network = ActorCritic::new(3, 6, 4, &mut Pcg64::seed_from_u64(4));
        // Away from the start, where all logits are about 0.
        let moved: Vec<f64> =
            network.parameters().iter().enumerate().map(|(i, p)| p + 0.3 * (i as f64).cos()).collect();
        network.set_parameters(&moved);
        let (shown, gradient) = loss(&network, &batch(), &hyperparameters);
        assert!(shown.clipped > 0.2 && shown.clipped < 0.9, "{shown:?}");
        let step = 1e-6;
        for place in 0..network.size() {
            let at = |change: f64| {
                let mut network = network.clone();
                let mut parameters = moved.clone();
                parameters[place] += change;
                network.set_parameters(&parameters);
                loss(&network, &batch(), &hyperparameters).0.loss
            };
            let slope = (at(step) - at(-step)) / (2.0 * step);
            assert!((slope - gradient[place]).abs() < 1e-7, "parameter {place}: {slope} and {}", gradient[place]);
        }
    }

    #[test]
    fn a_softmax_sums_to_one_also_of_large_logits() {
        let logs = log_softmax(&DVector::from_vec(vec![1000.0, 1001.0, -1000.0]));
        assert!((logs.iter().map(|log| log.exp()).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((logs[1] - logs[0] - 1.0).abs() < 1e-9);
    }
}
