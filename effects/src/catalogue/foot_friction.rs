//! `foot_friction`: every foot has a friction of its own.
//!
//! `µ_foot = share·µ`: feet are cast, worn and dirtied one by one.

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// Modules whose feet have a number of their own: the thesis's robot has four.
const MODULES: usize = 4;

/// Friction foot by foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootFriction {
    /// Of each module from the front, left and right: friction as a share of the ground's, 1.
    pub shares: [[f64; 2]; MODULES],
}

/// A key of the table.
const fn foot(key: &'static str, meaning: &'static str) -> Parameter {
    Parameter::new(key, meaning, 0.0, 10.0).believed(1.0, 0.8, 1.25)
}

impl Effect for FootFriction {
    type State = ();

    const SPEC: Spec = Spec {
        name: "foot_friction",
        summary: "Every foot has a friction of its own; feet behind module 4 have `ground.friction`.",
        title: "unequal friction of the feet",
        clause: "feet that do not all grip alike",
        law: "µ_foot = share·µ, µ being `ground.friction`",
        source: "S. Goyal, A. Ruina, J. Papadopoulos, Wear 143, 1991: a slider on several points of contact",
        parameters: &[
            foot("left_1_share", "Of module 1's left foot, share of the ground's friction."),
            foot("right_1_share", "Of module 1's right foot."),
            foot("left_2_share", "Of module 2's left foot."),
            foot("right_2_share", "Of module 2's right foot."),
            foot("left_3_share", "Of module 3's left foot; 1 where there is no such foot."),
            foot("right_3_share", "Of module 3's right foot; 1 where there is no such foot."),
            foot("left_4_share", "Of module 4's left foot; 1 where there is no such foot."),
            foot("right_4_share", "Of module 4's right foot; 1 where there is no such foot."),
        ],
        acts: Acts::Foot,
        shows_in: Coordinate::Ground,
        candidate: true,
        contains: &[],
        mistaken_for: &[],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        let mut shares = [[1.0; 2]; MODULES];
        shares.iter_mut().flatten().zip(values).for_each(|(share, value)| *share = *value);
        Self { shares }
    }

    fn foot_share(&self, module: usize, side: usize) -> f64 {
        self.shares.get(module).map_or(1.0, |module| module[side])
    }
}
