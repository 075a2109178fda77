//! `load_friction`: friction that grows with the torque through the gears.
//!
//! `g = coefficient·|τ_motor − τ_external|`, on the bristle that carries all friction (M. Duclusaud et al., "Extended friction
//! models for the physics simulation of servo actuators", 2024).

use super::coulomb_friction::presliding_length;
use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Friction in proportion to the torque that the teeth transmit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadFriction {
    /// Level per N·m transmitted, 1.
    pub coefficient: f64,
    /// Presliding length δ, rad; positive. Counts where no other friction has one.
    pub presliding_rad: f64,
}

impl Effect for LoadFriction {
    type State = ();

    const SPEC: Spec = Spec {
        name: "load_friction",
        summary: "Friction that grows with the torque through the gears.",
        title: "load friction",
        clause: "friction that grows with the torque through the gears",
        law: "g = coefficient·|τ_motor − τ_external|, on the bristle of the other friction",
        source: "M. Duclusaud et al., \"Extended friction models for the physics simulation of servo actuators\", 2024",
        parameters: &[
            Parameter::drag("coefficient", "Friction per transmitted torque |τ_motor − τ_external|.", 0.0, 1.0),
            Parameter::new("presliding_deg", "Presliding length (Dahl).", 0.001, 30.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Voltage,
        candidate: true,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "driver_drop",
            when: "the bridge always drives",
            experiment: "turn the shaft up to speed and let it coast with the bridge open (enable = 0), from several speeds: \
                         friction brakes on, the driver's drop does not",
        }],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { coefficient: values[0], presliding_rad: values[1] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        vec![
            FitNumber::linear("load_coefficient", "the load coefficient", 0.05, 0.1, [0.0, 0.95]),
            presliding_length([4e-3, 2e-2]),
        ]
    }

    #[inline]
    fn friction_level(&self, _angle: f64, _speed: f64, transmitted_nm: f64) -> f64 {
        self.coefficient * transmitted_nm.abs()
    }

    #[inline]
    fn presliding(&self) -> Option<f64> {
        Some(self.presliding_rad)
    }
}
