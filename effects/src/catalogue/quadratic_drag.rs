//! `quadratic_drag`: a torque against the motion that grows with the speed's square.
//!
//! `τ = −drag·ω·|ω|`: air around a fast eccentric, a bath of oil that is churned (F. M. White, "Fluid Mechanics", 2011,
//! chapter 7: drag at high Reynolds numbers).

use crate::effect::{Drag, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Drag in proportion to the speed's square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticDrag {
    /// Of ω·|ω|, N·m·s²/rad².
    pub drag: f64,
}

impl Effect for QuadraticDrag {
    type State = ();

    const SPEC: Spec = Spec {
        name: "quadratic_drag",
        summary: "Drag that grows with the square of the speed.",
        title: "quadratic drag",
        clause: "a torque against the motion that grows with the square of the speed",
        law: "τ = −drag·ω·|ω|",
        source: "F. M. White, \"Fluid Mechanics\", 2011, chapter 7: drag at high Reynolds numbers",
        parameters: &[Parameter::drag("drag_nm_s2_per_rad2", "Torque over ω·|ω|.", 0.0, 1.0)],
        acts: Acts::Shaft,
        shows_in: Coordinate::Speed,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "stribeck_friction",
                when: "the shaft is either slow or fast",
                experiment: "let the shaft coast with the bridge open (enable = 0) from its highest speed to rest: drag is \
                             gone below a third of it, Stribeck friction rises there",
            },
            Confusion {
                with: "battery_sag",
                when: "the bridge drives at full duty only",
                experiment: "let the shaft coast with the bridge open (enable = 0) from its highest speed: drag brakes on, a \
                             supply that gives way does not",
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
        let unit = 0.01 * sizes.torque_nm / sizes.free_speed.powi(2);
        vec![FitNumber::linear("quadratic_drag", "the quadratic drag", unit, 2.0 * unit, [0.0, 200.0 * unit])]
    }

    #[inline]
    fn drag(&self) -> Drag {
        Drag { quadratic: self.drag, ..Drag::default() }
    }
}
