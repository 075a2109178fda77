//! `bias_torque`: a constant torque.
//!
//! `τ = torque`: a spring that is long against the motion, a cable that pulls, a current sensor's or an amplifier's offset
//! referred to the shaft (the offset of every friction model that robots are identified with: W. Khalil, E. Dombre,
//! "Modeling, Identification and Control of Robots", 2002, section 12.3).

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A torque that is always there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasTorque {
    /// Counter-clockwise positive, N·m.
    pub torque_nm: f64,
}

impl Effect for BiasTorque {
    type State = ();

    const SPEC: Spec = Spec {
        name: "bias_torque",
        summary: "A constant torque on the shaft.",
        title: "a constant torque",
        clause: "a torque that is always there, whichever way the shaft turns",
        law: "τ = torque",
        source: "W. Khalil, E. Dombre, \"Modeling, Identification and Control of Robots\", 2002, 12.3 (friction with an offset)",
        parameters: &[Parameter::new("torque_nm", "Counter-clockwise positive.", -10.0, 10.0)],
        acts: Acts::Shaft,
        shows_in: Coordinate::Voltage,
        candidate: true,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "gravity_tilt",
            when: "the shaft never turns once around",
            experiment: "turn the shaft slowly around: gravity's torque changes its sign within the turn, a constant one does \
                         not",
        }],
        experiment: Some("open the bridge (enable = 0) with the shaft at rest, and hold the same duties both ways"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { torque_nm: values[0] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let (unit, most) = (0.01 * sizes.torque_nm, sizes.torque_nm);
        vec![FitNumber::linear("bias_torque", "the constant torque", unit, 0.0, [-most, most])]
    }

    fn largest_torque(&self) -> f64 {
        self.torque_nm.abs()
    }

    #[inline]
    fn torque(&self, _angle: f64) -> f64 {
        self.torque_nm
    }
}
