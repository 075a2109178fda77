//! `payload_offset`: what the courier carries is not in its middle.
//!
//! Its mass keeps the inertia of the homogeneous box about its own centre, and that centre lies aside. The thesis (chapter 5)
//! blames the uneven weight of its electronics for a difference between 60° and 120°.

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Where the courier's mass is centred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PayloadOffset {
    /// From the middle of the courier's box in its own frame: x ahead, y to the left, z up, m.
    pub from_middle_m: [f64; 3],
}

impl Effect for PayloadOffset {
    type State = ();

    const SPEC: Spec = Spec {
        name: "payload_offset",
        summary: "The courier's mass is not centred in its box.",
        title: "an off-centre payload",
        clause: "a courier whose weight lies beside its middle",
        law: "r_mass = r_box + R·(x, y, z); about r_mass the inertia is the box's",
        source: "Newton and Euler; the thesis's chapter 5 names it",
        parameters: &[
            Parameter::new("x_m", "Ahead of the box's middle.", -0.05, 0.05).believed(0.0, -0.003, 0.003),
            Parameter::new("y_m", "To the left of the box's middle.", -0.05, 0.05).believed(0.0, -0.003, 0.003),
            // How high it lies cannot be told from its tilting modules' stiffness.
            Parameter::new("z_m", "Above the box's middle.", -0.05, 0.05).believed(0.0, 0.0, 0.0),
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
        Self { from_middle_m: [values[0], values[1], values[2]] }
    }

    fn payload(&self) -> [f64; 3] {
        self.from_middle_m
    }
}
