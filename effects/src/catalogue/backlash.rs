//! `backlash`: play between the motor's teeth and the load's.
//!
//! `T = k·d(φ) + c(d)·dφ/dt` where `d` is how deep the twist `φ = θ_M − θ_L` between motor and load is in the teeth, zero over
//! the play: a dead zone before a stiff spring (M. Nordin, P.-O. Gutman, "Controlling mechanical systems with backlash: a
//! survey", Automatica 38, 2002; damping that begins at nothing where the teeth first touch: K. H. Hunt, F. R. E. Crossley, J.
//! Applied Mechanics 42, 1975). Teeth push and do not pull. The two inertias are those of `shaft_compliance`: with both in a
//! file, one spring and one play.

use super::shaft_compliance::{load_drag_share, load_share, stiffness};
use crate::effect::{Coupling, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// Play between motor and load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backlash {
    /// All of the play, rad.
    pub gap_rad: f64,
    /// Of the teeth, N·m/rad; positive.
    pub stiffness_nm_per_rad: f64,
    /// Of the teeth's critical damping, 1.
    pub damping_ratio: f64,
    /// Share of the whole inertia behind the play, within 0 … 1.
    pub load_share: f64,
    /// Share of the viscous damping on the load, which alone acts on it while no teeth touch, within 0 … 1.
    pub load_drag_share: f64,
}

impl Effect for Backlash {
    type State = ();

    const SPEC: Spec = Spec {
        name: "backlash",
        summary: "Play between the motor's gears and the load.",
        title: "backlash",
        clause: "play between the gears and the load",
        law: "T = k·d + 2ζ√(k·J_r)·min(|d|/δ, 1)·dφ/dt, d = φ beyond ±gap/2, φ = θ_motor − θ, δ = 0.5 mrad or gap/20 if less; teeth only push",
        source: "M. Nordin, P.-O. Gutman, Automatica 38, 2002; K. H. Hunt, F. R. E. Crossley, J. Applied Mechanics 42, 1975",
        parameters: &[
            Parameter::new("gap_deg", "All of the play, at the output shaft.", 0.0, 45.0),
            Parameter::new("stiffness_nm_per_rad", "Stiffness k of the teeth that touch.", 1e-6, 1e6),
            Parameter::new("damping_ratio", "Damping ζ of the teeth that touch; 1 is critical.", 0.0, 10.0),
            Parameter::new("load_share", "Share of the whole inertia that lies behind the play.", 0.01, 0.99),
            Parameter::new("load_drag_share", "Share of the viscous damping that acts on the load.", 0.0, 1.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "sensor_hysteresis",
                when: "the shaft reverses slowly",
                experiment: "reverse the drive abruptly at several speeds: behind play in the gears the load goes on by its own \
                             inertia, and how long it takes to be caught depends on the speed; a sensor's play is crossed by \
                             the shaft's own motion, over the same angle at any speed",
            },
            Confusion {
                with: "stribeck_friction",
                when: "the shaft reverses seldom",
                experiment: "reverse at the same duty from rest and from full speed: friction holds a shaft that rests, play \
                             does not",
            },
        ],
        experiment: Some("reverse the drive abruptly at several speeds, and let the shaft coast (enable = 0) in between"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self {
            gap_rad: values[0],
            stiffness_nm_per_rad: values[1],
            damping_ratio: values[2],
            load_share: values[3],
            load_drag_share: values[4],
        }
    }

    /// How hard the teeth are hardly shows: it is held near what lets them touch for some milliseconds.
    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let start = |natural: f64| stiffness(sizes, natural);
        let gap = FitNumber::linear("backlash", "the play", 0.01, 0.02, [0.0, 0.6]);
        let damping = FitNumber::linear("tooth_damping", "the teeth's damping", 0.1, 0.2, [1e-3, 1.5]);
        vec![
            FitNumber { starts: [0.02, 0.05, 0.1].repeat(2), ..gap },
            FitNumber::log("tooth_stiffness", "the teeth's stiffness", [start(1500.0); 2], [start(200.0), start(1e4)], 1.0),
            FitNumber { prior: 1.0, ..damping },
            FitNumber { starts: vec![0.3, 0.3, 0.3, 0.6, 0.6, 0.6], ..load_share() },
            load_drag_share(),
        ]
    }

    fn coupling(&self) -> Option<Coupling> {
        Some(Coupling {
            half_gap: 0.5 * self.gap_rad,
            stiffness: self.stiffness_nm_per_rad,
            hardening: 0.0,
            damping_ratio: self.damping_ratio,
            load_share: self.load_share,
            load_drag_share: self.load_drag_share,
        })
    }
}
