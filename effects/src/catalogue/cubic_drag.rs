//! `cubic_drag`: a torque against the motion that grows with the speed's cube.
//!
//! `τ = −drag·ω³`: the next odd term of a drag that no square follows (H. Olsson, K. Åström, C. Canudas de Wit, M. Gäfvert,
//! P. Lischinsky, European J. Control 4, 1998: polynomials of the speed).

use crate::effect::{Drag, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Drag in proportion to the speed's cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubicDrag {
    /// Of ω³, N·m·s³/rad³.
    pub drag: f64,
}

impl Effect for CubicDrag {
    type State = ();

    const SPEC: Spec = Spec {
        name: "cubic_drag",
        summary: "Drag that grows with the cube of the speed.",
        title: "cubic drag",
        clause: "a torque against the motion that grows with the cube of the speed",
        law: "τ = −drag·ω³",
        source: "H. Olsson, K. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky, European J. Control 4, 1998 (polynomials \
                 of the speed)",
        parameters: &[Parameter::drag("drag_nm_s3_per_rad3", "Torque over ω³.", 0.0, 1.0)],
        acts: Acts::Shaft,
        shows_in: Coordinate::Speed,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "quadratic_drag",
                when: "the speed stays within a factor of two",
                experiment: "let the shaft coast with the bridge open (enable = 0) from its highest speed, again and again: at \
                             half of the speed the one has fallen to a quarter, the other to an eighth",
            },
        ],
        experiment: Some("let the shaft coast with the bridge open (enable = 0) from its highest speed to rest"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { drag: values[0] }
    }

    /// In units of a hundredth of the stall torque at the speed without load.
    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let unit = 0.01 * sizes.torque_nm / sizes.free_speed.powi(3);
        vec![FitNumber::linear("cubic_drag", "the cubic drag", unit, 2.0 * unit, [0.0, 200.0 * unit])]
    }

    #[inline]
    fn drag(&self) -> Drag {
        Drag { cubic: self.drag, ..Drag::default() }
    }
}
