//! `shaft_compliance`: the load turns on a spring behind the motor.
//!
//! `J_M dω_M/dt = τ_M − T`, `J_L dω_L/dt = τ_L − b_L·ω_L + T`, `T = k·φ·(1 + β·φ²) + 2ζ√(k J_r)·dφ/dt` for the twist `φ = θ_M − θ_L`
//! between two inertias, `J_r = J_M J_L/(J_M + J_L)`; `θ_L` is what the sensor sees. It rings with `√(k/J_r)` where it is twisted little
//! (two-mass system: R. Isermann, "Mechatronic Systems", 2005, section 6.2; W. Leonhard, "Control of Electrical Drives", 2001). A coupling
//! of rubber and a shaft whose parts come to bear grow stiffer the more they are twisted: β, the first term beyond a linear spring (G.
//! Duffing, "Erzwungene Schwingungen", 1918). How the two advance: `hal_sim::shaft`.

use crate::effect::{Coupling, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A spring between motor and load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftCompliance {
    /// Of the spring, N·m/rad; positive.
    pub stiffness_nm_per_rad: f64,
    /// Of the critical damping, 1.
    pub damping_ratio: f64,
    /// Share of the whole inertia behind the spring, within 0 … 1.
    pub load_share: f64,
    /// Share of the viscous damping on the load, in its bearing and in the air, within 0 … 1.
    pub load_drag_share: f64,
    /// How much more the spring bears at a twist φ, as a share of a linear one's torque over φ², 1/rad².
    pub hardening_per_rad2: f64,
}

/// The share of the inertia that is behind a spring or a play, as a fit moves it.
pub(super) fn load_share() -> FitNumber {
    FitNumber { prior: 2.0, ..FitNumber::linear("load_share", "the share of the inertia behind it", 0.1, 0.4, [0.02, 0.98]) }
}

/// The share of the viscous damping that is on the load, as a fit moves it. Not down to zero, which would make it one of the numbers that
/// say how large an effect is.
pub(super) fn load_drag_share() -> FitNumber {
    let share = FitNumber::linear("load_drag_share", "the share of the damping behind it", 0.2, 0.4, [0.01, 1.0]);
    FitNumber { prior: 2.0, ..share }
}

/// A spring's stiffness at a natural frequency (rad/s) of a rig with two fifths of its inertia behind it.
pub(super) fn stiffness(sizes: &Sizes, natural: f64) -> f64 {
    0.4 * 0.6 * sizes.inertia_kg_m2 * natural * natural
}

/// β/k², 1/(N·m)². Of a spring that is not there both are none.
fn over_square(hardening: f64, stiffness: f64) -> f64 {
    if stiffness == 0.0 { 0.0 } else { hardening / (stiffness * stiffness) }
}

impl Effect for ShaftCompliance {
    type State = ();

    const SPEC: Spec = Spec {
        name: "shaft_compliance",
        summary: "The load turns on a spring behind the motor.",
        title: "a flexible shaft",
        clause: "a load that turns on a spring behind the motor",
        law: "T = k·φ·(1 + β·φ²) + 2ζ√(k·J_r)·dφ/dt between motor and load, φ = θ_motor − θ, J_r = J·share·(1 − share)",
        source: "R. Isermann, \"Mechatronic Systems\", 2005, 6.2 (two-mass system); G. Duffing, \"Erzwungene Schwingungen\", 1918 (β)",
        parameters: &[
            Parameter::new("stiffness_nm_per_rad", "Stiffness k, at the output shaft.", 1e-6, 1e6),
            Parameter::new("damping_ratio", "Damping ζ of the two against each other; 1 is critical.", 0.0, 10.0),
            Parameter::new("load_share", "Share of the whole inertia that lies behind the spring.", 0.01, 0.99),
            Parameter::new("load_drag_share", "Share of the viscous damping that acts on the load.", 0.0, 1.0),
            Parameter::new("hardening_per_rad2", "How much stiffer it grows: β, over the square of the twist; 0: not.", 0.0, 1e6),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "backlash",
                when: "the torque changes its sign all the time",
                experiment: "hold the motor on one side with a constant torque and shake it a little: a spring rings there as \
                             well, teeth that touch do not",
            },
            Confusion {
                with: "sensor_delay",
                when: "the drive changes slowly",
                experiment: "reverse the drive abruptly: a spring rings, a late reading is late by the same time everywhere",
            },
        ],
        experiment: Some("reverse the drive abruptly, and sweep it through the frequencies at a small amplitude"),
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self {
            stiffness_nm_per_rad: values[0],
            damping_ratio: values[1],
            load_share: values[2],
            load_drag_share: values[3],
            hardening_per_rad2: values[4],
        }
    }

    /// From springs at 12, 30, 75 and 5 Hz. How much stiffer they grow is moved as `β/k²`, over the square of a linear one's torque: how far a
    /// spring twists its stiffness decides, how much it bears the drive.
    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let start = |natural_hz: f64| stiffness(sizes, std::f64::consts::TAU * natural_hz);
        let spring = FitNumber::log("stiffness", "the spring", [start(12.0); 2], [start(1.0), start(400.0)], f64::INFINITY);
        // From nothing, and not down to it, which would make it one of the numbers that say how large an effect is.
        let unit = sizes.torque_nm.powi(-2);
        let (least, harder) = (1e-4 * unit, "how much stiffer the spring grows");
        let hardening = FitNumber::linear("hardening", harder, unit, least, [least, 30.0 * unit]);
        let damping = FitNumber::linear("spring_damping", "the spring's damping", 0.1, 0.1, [1e-3, 2.0]);
        vec![
            FitNumber { starts: [12.0, 30.0, 75.0, 5.0].map(start).to_vec(), ..spring },
            FitNumber { prior: 3.0, ..damping },
            load_share(),
            load_drag_share(),
            FitNumber { prior: 3.0, ..hardening },
        ]
    }

    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        values.copy_from_slice(numbers);
        values[4] *= numbers[0] * numbers[0];
    }

    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        numbers.copy_from_slice(values);
        numbers[4] = over_square(numbers[4], values[0]);
    }

    fn fit_ranges(values: &[f64], half_ranges: &[f64], numbers: &mut [f64]) {
        numbers.copy_from_slice(half_ranges);
        numbers[4] = over_square(numbers[4], values[0]);
    }

    fn coupling(&self) -> Option<Coupling> {
        Some(Coupling {
            half_gap: 0.0,
            stiffness: self.stiffness_nm_per_rad,
            hardening: self.hardening_per_rad2,
            damping_ratio: self.damping_ratio,
            load_share: self.load_share,
            load_drag_share: self.load_drag_share,
        })
    }
}
