//! `ground_slope`: the ground is an inclined plane.
//!
//! The world's z stays the ground's normal, and gravity leans: along `(−tan a, −tan l, −1)` for a ground that rises by a ahead of the robot
//! and by l to its left.

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// An inclined plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundSlope {
    /// By how much it rises ahead of the robot where the robot starts, rad.
    pub ahead_rad: f64,
    /// By how much it rises to the robot's left where the robot starts, rad.
    pub left_rad: f64,
}

impl Effect for GroundSlope {
    type State = ();

    const SPEC: Spec = Spec {
        name: "ground_slope",
        summary: "The ground is a slope.",
        title: "a sloping ground",
        clause: "ground that rises in one direction",
        law: "gravity along (−tan ahead, −tan left, −1) in the ground's frame",
        source: "an inclined plane",
        parameters: &[
            Parameter::new("ahead_deg", "How steeply it rises ahead of the robot.", -60.0, 60.0)
                .believed(0.0, -3.0, 3.0),
            Parameter::new("left_deg", "How steeply it rises to the robot's left.", -60.0, 60.0)
                .believed(0.0, -3.0, 3.0),
        ],
        acts: Acts::Ground,
        shows_in: Coordinate::Ground,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { ahead_rad: values[0], left_rad: values[1] }
    }

    fn down(&self, _level: [f64; 3]) -> [f64; 3] {
        let along = [-self.ahead_rad.tan(), -self.left_rad.tan(), -1.0];
        let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
        along.map(|x| x / length)
    }
}
