//! `ground_slope`: the ground is an inclined plane.
//!
//! The world's z stays the ground's normal, and gravity leans: `g (−sin a cos d, −sin a sin d, −cos a)`.

use crate::effect::Effect;
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
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { angle_rad: values[0], direction_rad: values[1] }
    }

    fn down(&self, _level: [f64; 3]) -> [f64; 3] {
        let lean = -self.angle_rad.sin();
        [lean * self.direction_rad.cos(), lean * self.direction_rad.sin(), -self.angle_rad.cos()]
    }
}
