//! `ground_slope`: the ground is an inclined plane.
//!
//! The world's z stays the ground's normal, and gravity leans: `g (−sin a cos d, −sin a sin d, −cos a)`.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// An inclined plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundSlope {
    /// Inclination, rad.
    pub angle_rad: f64,
    /// Where it rises to, rad: 0 ahead of the robot, π/2 to its left.
    pub direction_rad: f64,
}

impl Effect for GroundSlope {
    type State = ();

    const SPEC: Spec = Spec {
        name: "ground_slope",
        summary: "The ground is a slope.",
        title: "a sloping ground",
        clause: "ground that rises in one direction",
        law: "g (−sin a cos d, −sin a sin d, −cos a) in the ground's frame",
        source: "an inclined plane",
        parameters: &[
            Parameter::new("angle_deg", "Inclination of the ground.", 0.0, 60.0),
            Parameter::new(
                "direction_deg",
                "Where it rises to: 0 ahead of the robot, 90 to its left.",
                -360.0,
                360.0,
            ),
        ],
        acts: Acts::Ground,
        shows_in: Coordinate::Ground,
        candidate: false,
        contains: &[],
        mistaken_for: &[],
        resembles: &[],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { angle_rad: values[0], direction_rad: values[1] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        vec![
            FitNumber::linear("slope_cos", "the slope", 0.01, 0.0, [-1.0, 1.0]),
            FitNumber::linear("slope_sin", "the slope", 0.01, 0.0, [-1.0, 1.0]),
        ]
    }

    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        values[0] = numbers[0].hypot(numbers[1]);
        values[1] = numbers[1].atan2(numbers[0]);
    }

    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        let (sin, cos) = values[1].sin_cos();
        numbers.copy_from_slice(&[values[0] * cos, values[0] * sin]);
    }

    fn fit_ranges(values: &[f64], half_ranges: &[f64], numbers: &mut [f64]) {
        numbers.fill(half_ranges[0].max(values[0] * half_ranges[1]));
    }

    fn down(&self, _level: [f64; 3]) -> [f64; 3] {
        let lean = -self.angle_rad.sin();
        [lean * self.direction_rad.cos(), lean * self.direction_rad.sin(), -self.angle_rad.cos()]
    }
}
