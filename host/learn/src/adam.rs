//! Adam.

use serde::{Deserialize, Serialize};

/// How fast the mean of the gradient forgets.
const FIRST_DECAY: f64 = 0.9;
/// How fast the mean of its square forgets.
const SECOND_DECAY: f64 = 0.999;
/// Keeps the step finite where there is no gradient. Stable-Baselines3's for this method.
const EPSILON: f64 = 1e-5;

/// D. P. Kingma and J. Ba, *Adam*, ICLR 2015: gradient descent by means of the gradient and of its square.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adam {
    first: Vec<f64>,
    second: Vec<f64>,
    steps: i32,
}

impl Adam {
    /// For so many parameters; no step was taken.
    #[must_use]
    pub fn new(parameters: usize) -> Self {
        Self { first: vec![0.0; parameters], second: vec![0.0; parameters], steps: 0 }
    }

    /// How many parameters it is for.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.first.len()
    }

    /// A step against the gradient, which is shortened where it is longer than `longest`.
    ///
    /// # Panics
    /// If there are not as many parameters and gradients as it is for.
    pub fn step(&mut self, parameters: &mut [f64], gradient: &[f64], rate: f64, longest: f64) {
        assert!(
            parameters.len() == self.first.len() && gradient.len() == self.first.len(),
            "a gradient of each parameter"
        );
        self.steps += 1;
        let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        let shorten = (longest / (length + 1e-6)).min(1.0);
        let unbiased = |decay: f64| 1.0 / (1.0 - decay.powi(self.steps));
        let (rate, square) = (rate * unbiased(FIRST_DECAY), unbiased(SECOND_DECAY));
        for (place, parameter) in parameters.iter_mut().enumerate() {
            let g = shorten * gradient[place];
            let (first, second) = (&mut self.first[place], &mut self.second[place]);
            *first += (1.0 - FIRST_DECAY) * (g - *first);
            *second += (1.0 - SECOND_DECAY) * (g * g - *second);
            *parameter -= rate * *first / ((square * *second).sqrt() + EPSILON);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_is_as_long_as_the_rate_against_each_gradient() {
        let mut x = [1.0, -2.0];
        Adam::new(2).step(&mut x, &[3.0, -0.5], 0.1, f64::INFINITY);
        assert!((x[0] - 0.9).abs() < 1e-5 && (x[1] + 1.9).abs() < 1e-5, "{x:?}");
    }

    #[test]
    fn a_long_gradient_is_shortened_as_a_whole() {
        let (mut long, mut short) = ([0.0; 2], [0.0; 2]);
        Adam::new(2).step(&mut long, &[30.0, 40.0], 0.1, 5e-5);
        Adam::new(2).step(&mut short, &[3e-5, 4e-5], 0.1, f64::INFINITY);
        assert!((long[0] - short[0]).abs() < 1e-5 && (long[1] - short[1]).abs() < 1e-5, "{long:?} {short:?}");
    }

    #[test]
    fn a_parabola_is_descended() {
        let (mut x, mut adam) = ([3.0, -4.0], Adam::new(2));
        for _ in 0..400 {
            let gradient = x.map(|x| 2.0 * x);
            adam.step(&mut x, &gradient, 0.05, 0.5);
        }
        assert!(x.iter().all(|x| x.abs() < 0.02), "{x:?}");
    }
}
