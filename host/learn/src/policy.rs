//! A policy that was learned, without what it took to learn it.

use serde::{Deserialize, Serialize};

use super::network::{self, Perceptron};

/// A perceptron that gives every action a logit: hidden layers pass through a hyperbolic tangent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Policy {
    layers: Vec<Layer>,
}

/// A layer: a row of weights for each of its units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Layer {
    weights: Vec<Vec<f32>>,
    bias: Vec<f32>,
}

impl Policy {
    pub(crate) fn of(network: &Perceptron) -> Self {
        let layer = |layer: &network::Layer| Layer {
            weights: layer.weights.row_iter().map(|row| row.iter().map(|w| *w as f32).collect()).collect(),
            bias: layer.bias.iter().map(|b| *b as f32).collect(),
        };
        Self { layers: network.layers.iter().map(layer).collect() }
    }

    /// How many numbers an observation has.
    #[must_use]
    pub fn observation_size(&self) -> usize {
        self.layers.first().and_then(|layer| layer.weights.first()).map_or(0, Vec::len)
    }

    /// How many numbers an observation has and how many actions there are; none where the layers do not fit each other.
    pub(crate) fn sizes(&self) -> Option<(usize, usize)> {
        let mut size = self.observation_size();
        for layer in &self.layers {
            let fits = layer.weights.len() == layer.bias.len() && layer.weights.iter().all(|row| row.len() == size);
            if !fits || size == 0 {
                return None;
            }
            size = layer.bias.len();
        }
        (size > 0).then(|| (self.observation_size(), size))
    }

    /// Probabilities of the actions.
    ///
    /// # Panics
    /// If the observation is not as long as [`Self::observation_size`] says.
    #[must_use]
    pub fn probabilities(&self, observation: &[f32]) -> Vec<f32> {
        let logits = self.logits(observation);
        let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let weights: Vec<f32> = logits.iter().map(|logit| (logit - most).exp()).collect();
        let sum: f32 = weights.iter().sum();
        weights.iter().map(|weight| weight / sum).collect()
    }

    /// The likeliest action, the first of equals.
    ///
    /// # Panics
    /// If the observation is not as long as [`Self::observation_size`] says.
    #[must_use]
    pub fn best(&self, observation: &[f32]) -> usize {
        let logits = self.logits(observation);
        (0..logits.len()).rev().max_by(|&a, &b| logits[a].total_cmp(&logits[b])).unwrap_or(0)
    }

    fn logits(&self, observation: &[f32]) -> Vec<f32> {
        assert_eq!(observation.len(), self.observation_size(), "an observation of the policy's size");
        let mut x = observation.to_vec();
        for (place, layer) in self.layers.iter().enumerate() {
            let out = layer.weights.iter().zip(&layer.bias);
            x = out.map(|(row, bias)| row.iter().zip(&x).map(|(w, x)| w * x).sum::<f32>() + bias).collect();
            if place + 1 < self.layers.len() {
                x.iter_mut().for_each(|x| *x = x.tanh());
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    use super::super::network::ActorCritic;
    use super::*;

    #[test]
    fn a_policy_says_what_its_network_says() {
        let mut network = ActorCritic::new(3, 16, 10, &mut Pcg64::seed_from_u64(3));
        let moved: Vec<f64> =
            network.parameters().iter().enumerate().map(|(i, p)| p + 0.3 * (i as f64).sin()).collect();
        network.set_parameters(&moved);
        let policy = Policy::of(&network.policy);
        let text = serde_json::to_string(&policy).unwrap();
        let policy_read: Policy = serde_json::from_str(&text).unwrap();
        assert_eq!(policy_read, policy, "written and read again it is the same in every bit");
        let seen = [0.3f32, -1.2, 2.0];
        let logits = network.policy.forward(&DMatrix::from_column_slice(3, 1, &seen.map(f64::from))).output;
        let expected = super::super::loss::log_softmax(&logits.column(0).into_owned());
        for (found, log) in policy.probabilities(&seen).iter().zip(expected.iter()) {
            assert!((f64::from(*found) - log.exp()).abs() < 1e-6, "{found} {}", log.exp());
        }
        assert_eq!(policy.best(&seen), expected.imax());
    }
}
