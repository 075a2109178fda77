//! Policy and value function, and their gradients.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// A layer `W·x + b`.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// W, a row for each output.
    pub weights: DMatrix<f64>,
    /// b.
    pub bias: DVector<f64>,
}

/// Layers, of which all but the last pass through a hyperbolic tangent.
#[derive(Clone, Debug, PartialEq)]
pub struct Perceptron {
    /// The first one sees the input.
    pub layers: Vec<Layer>,
}

/// Two networks that share nothing, as Stable-Baselines3's `MlpPolicy` has them.
#[derive(Clone, Debug, PartialEq)]
pub struct ActorCritic {
    /// Gives every action a logit.
    pub policy: Perceptron,
    /// Says what an observation is worth.
    pub value: Perceptron,
}

/// What every layer was given in a pass, and what came out, a column for each input.
pub struct Pass {
    given: Vec<DMatrix<f64>>,
    /// Of the last layer.
    pub output: DMatrix<f64>,
}

/// Gain of hidden layers behind a hyperbolic tangent.
const HIDDEN_GAIN: f64 = std::f64::consts::SQRT_2;
/// Small logits: at first every action is about as likely.
const POLICY_GAIN: f64 = 0.01;

impl ActorCritic {
    /// Two hidden layers each; orthogonal weights (A. M. Saxe and others, ICLR 2014), no bias.
    #[must_use]
    pub fn new(observed: usize, hidden: usize, actions: usize, random: &mut Pcg64) -> Self {
        let mut perceptron = |outputs: usize, gain: f64| {
            let shapes = [(hidden, observed, HIDDEN_GAIN), (hidden, hidden, HIDDEN_GAIN), (outputs, hidden, gain)];
            Perceptron {
                layers: shapes.map(|(rows, columns, gain)| Layer::orthogonal(rows, columns, gain, random)).into(),
            }
        };
        Self { policy: perceptron(actions, POLICY_GAIN), value: perceptron(1, 1.0) }
    }

    /// All weights and biases, the policy's first.
    #[must_use]
    pub fn parameters(&self) -> Vec<f64> {
        self.layers().flat_map(|layer| layer.weights.iter().chain(layer.bias.iter())).copied().collect()
    }

    /// How many numbers [`Self::parameters`] has.
    #[must_use]
    pub fn size(&self) -> usize {
        self.layers().map(|layer| layer.weights.len() + layer.bias.len()).sum()
    }

    /// Sets all weights and biases, in the order of [`Self::parameters`].
    ///
    /// # Panics
    /// If there are not as many.
    pub fn set_parameters(&mut self, parameters: &[f64]) {
        assert_eq!(parameters.len(), self.size(), "a number for every weight and bias");
        let mut left = parameters.iter();
        for layer in self.policy.layers.iter_mut().chain(&mut self.value.layers) {
            for (parameter, value) in layer.weights.iter_mut().chain(layer.bias.iter_mut()).zip(left.by_ref()) {
                *parameter = *value;
            }
        }
    }

    fn layers(&self) -> impl Iterator<Item = &Layer> {
        self.policy.layers.iter().chain(&self.value.layers)
    }
}

impl Perceptron {
    /// What comes out for inputs, a column each.
    #[must_use]
    pub fn forward(&self, inputs: &DMatrix<f64>) -> Pass {
        let mut given = vec![inputs.clone()];
        for (place, layer) in self.layers.iter().enumerate() {
            let mut output = &layer.weights * &given[place];
            output.column_iter_mut().for_each(|mut column| column += &layer.bias);
            if place + 1 == self.layers.len() {
                return Pass { given, output };
            }
            output.apply(|x| *x = x.tanh());
            given.push(output);
        }
        Pass { output: inputs.clone(), given }
    }

    /// Gradient of a sum over the pass's inputs, in the order of the parameters, from its gradient by the outputs.
    #[must_use]
    pub fn backward(&self, pass: &Pass, by_output: DMatrix<f64>) -> Vec<f64> {
        let mut by_layer = Vec::with_capacity(self.layers.len());
        let mut by_output = by_output;
        for (place, layer) in self.layers.iter().enumerate().rev() {
            let given = &pass.given[place];
            by_layer.push((&by_output * given.transpose(), by_output.column_sum()));
            if place > 0 {
                // What it was given is a hyperbolic tangent, whose slope is 1 less its square.
                by_output =
                    (layer.weights.transpose() * &by_output).zip_map(given, |by, tanh| by * (1.0 - tanh * tanh));
            }
        }
        by_layer.iter().rev().flat_map(|(weights, bias)| weights.iter().chain(bias.iter())).copied().collect()
    }
}

impl Layer {
    fn orthogonal(rows: usize, columns: usize, gain: f64, random: &mut Pcg64) -> Self {
        Self { weights: gain * orthogonal(rows, columns, random), bias: DVector::zeros(rows) }
    }
}

/// A matrix whose shorter side's vectors are orthonormal, drawn evenly: the Q of normal numbers, with R's diagonal positive.
fn orthogonal(rows: usize, columns: usize, random: &mut Pcg64) -> DMatrix<f64> {
    let (long, short) = (rows.max(columns), rows.min(columns));
    let normal: DMatrix<f64> = DMatrix::from_fn(long, short, |_, _| StandardNormal.sample(random));
    let (mut q, r) = normal.qr().unpack();
    for (mut column, on_diagonal) in q.column_iter_mut().zip(r.diagonal().iter()) {
        column *= on_diagonal.signum();
    }
    if rows >= columns { q } else { q.transpose() }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn weights_are_orthogonal_and_parameters_are_set_as_they_are_read() {
        let mut random = Pcg64::seed_from_u64(1);
        for (rows, columns) in [(8, 3), (3, 8), (5, 5)] {
            let matrix = orthogonal(rows, columns, &mut random);
            let product = if rows >= columns { matrix.tr_mul(&matrix) } else { &matrix * matrix.transpose() };
            assert!((product - DMatrix::identity(rows.min(columns), rows.min(columns))).amax() < 1e-12);
        }
        let network = ActorCritic::new(3, 16, 10, &mut random);
        let mut other = ActorCritic::new(3, 16, 10, &mut random);
        assert_ne!(network, other);
        other.set_parameters(&network.parameters());
        assert_eq!(network, other);
        assert_eq!(network.size(), network.parameters().len());
    }

    #[test]
    fn inputs_side_by_side_do_not_see_each_other() {
        let network = ActorCritic::new(3, 16, 10, &mut Pcg64::seed_from_u64(2)).policy;
        let inputs = DMatrix::from_fn(3, 5, |row, column| (row as f64 - column as f64).sin());
        let both = network.forward(&inputs).output;
        for (place, column) in inputs.column_iter().enumerate() {
            let alone = network.forward(&DMatrix::from_columns(&[column])).output;
            assert!((alone.column(0) - both.column(place)).amax() < 1e-14);
        }
    }
}
