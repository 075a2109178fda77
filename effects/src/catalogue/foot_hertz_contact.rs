//! `foot_hertz_contact`: the feet grow stiffer the deeper they are pressed, as spheres do.
//!
//! H. Hertz, "Über die Berührung fester elastischer Körper", 1881: a sphere on a plane carries `F ∝ δ^(3/2)`, a flat stamp `F ∝ δ`.

use crate::effect::Effect;
use crate::spec::{Acts, Coordinate, Parameter, Spec};

/// A foot between a stamp and a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootHertzContact {
    /// Share of the load that is carried as by a sphere, 0 … 1.
    pub share: f64,
    /// The load at which the foot sinks as deep as by `feet.normal_n_per_m` alone, N; positive.
    pub load_n: f64,
}

impl Effect for FootHertzContact {
    type State = ();

    const SPEC: Spec = Spec {
        name: "foot_hertz_contact",
        summary: "The feet grow stiffer the deeper they are pressed, as spheres do.",
        title: "Hertzian contact of the feet",
        clause: "feet that grow stiffer the deeper they are pressed",
        law: "F = k δ (1 − share + share·√(δ/δ₀)), δ₀ = F₀/k, k being `feet.normal_n_per_m`",
        source: "H. Hertz, Über die Berührung fester elastischer Körper, 1881",
        parameters: &[
            Parameter::new("share", "Share of the load that is carried as by a sphere; 0 is a linear spring.", 0.0, 1.0)
                .believed(0.0, 0.0, 1.0),
            Parameter::new("load_n", "The load F₀ at which the foot sinks as deep as without the effect.", 1e-4, 100.0)
                .believed(0.06, 0.06, 0.06),
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
        Self { share: values[0], load_n: values[1] }
    }

    fn sphere(&self) -> [f64; 2] {
        [self.share, self.load_n]
    }
}
