//! What a training is told.

use serde::{Deserialize, Serialize};

use super::LearnError;

/// Numbers of proximal policy optimisation. The defaults are the thesis's Table 5.1 and, where it is silent, those of
/// Stable-Baselines3, which it trained with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Hyperparameters {
    /// Adam's learning rate.
    pub learning_rate: f64,
    /// Steps of all environments together between two updates; a multiple of their number.
    pub steps: usize,
    /// Steps of a minibatch.
    pub batch_size: usize,
    /// Passes over the steps of an update.
    pub epochs: usize,
    /// Discount γ of a step.
    pub discount: f64,
    /// λ of generalised advantage estimation.
    pub gae_lambda: f64,
    /// How far the ratio of new to old probability may be from 1 before it is clipped.
    pub clip_range: f64,
    /// Weight of the value's squared error in the loss.
    pub value_coefficient: f64,
    /// Weight of the policy's entropy in the loss.
    pub entropy_coefficient: f64,
    /// Largest Euclidean norm of the gradient; a longer one is shortened to it. Not in the thesis: Stable-Baselines3's.
    pub max_gradient_norm: f64,
    /// Units of the two hidden layers, of policy and of value each. Not in the thesis: Stable-Baselines3's.
    pub hidden_units: usize,
}

impl Default for Hyperparameters {
    fn default() -> Self {
        Self {
            learning_rate: 3e-4,
            steps: 2048,
            batch_size: 64,
            epochs: 10,
            discount: 0.99,
            gae_lambda: 0.95,
            clip_range: 0.2,
            value_coefficient: 0.5,
            entropy_coefficient: 0.2,
            max_gradient_norm: 0.5,
            hidden_units: 64,
        }
    }
}

impl Hyperparameters {
    /// Checks them for so many environments.
    ///
    /// # Errors
    /// The field that is out of its range, with what is expected.
    pub fn check(&self, environments: usize) -> Result<(), LearnError> {
        let field = |name: &'static str, is_right: bool, expected: String| {
            if is_right { Ok(()) } else { Err(LearnError::Hyperparameter { name, expected }) }
        };
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let counted = self.steps > 0 && environments > 0 && self.steps.is_multiple_of(environments);
        field("steps", counted, format!("a multiple of {environments}, the number of environments"))?;
        let divides = self.batch_size > 1 && self.batch_size <= self.steps;
        field("batch_size", divides, format!("a whole number from 2 to {}, the steps of an update", self.steps))?;
        field("epochs", self.epochs > 0, "a whole number above 0".to_owned())?;
        field("hidden_units", self.hidden_units > 0, "a whole number above 0".to_owned())?;
        field("learning_rate", positive(self.learning_rate), "a number above 0".to_owned())?;
        field("discount", share(self.discount), "a number from 0 to 1".to_owned())?;
        field("gae_lambda", share(self.gae_lambda), "a number from 0 to 1".to_owned())?;
        field("clip_range", positive(self.clip_range), "a number above 0".to_owned())?;
        field("value_coefficient", self.value_coefficient >= 0.0, "a number from 0 on".to_owned())?;
        field("entropy_coefficient", self.entropy_coefficient >= 0.0, "a number from 0 on".to_owned())?;
        field("max_gradient_norm", positive(self.max_gradient_norm), "a number above 0".to_owned())
    }
}
