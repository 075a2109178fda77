//! Friction of the truth: elasto-plastic bristles.

use std::f64::consts::{PI, TAU};

/// Friction with an elasto-plastic bristle (Dupont et al., "Single state elastoplastic friction models", 2002):
/// purely elastic below the breakaway deflection, LuGre above, with micro-damping in presliding. Several of them beside each
/// other are Iwan's and Maxwell's slip ("On a class of models for the yielding behavior of continuous and composite systems", J.
/// Applied Mechanics 34, 1967).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristle {
    /// Sliding level at speed, N·m.
    pub coulomb_nm: f64,
    /// Level at rest over the level at speed, 1 = plain Coulomb.
    pub static_ratio: f64,
    /// Stribeck speed, rad/s.
    pub stribeck_speed: f64,
    /// How it falls from the one to the other.
    pub weakening: Weakening,
    /// Loss per torque through the teeth while the motor drives the load.
    pub loss_driving: f64,
    /// The same while the load drives the motor; gears are worse backwards.
    pub loss_driven: f64,
    /// The loss grows with this power of the torque, and is as stated at [`Self::loss_reference_nm`].
    pub loss_power: f64,
    /// N·m.
    pub loss_reference_nm: f64,
    /// Deflection at which the sliding level is reached, rad.
    pub presliding: f64,
    /// Share of that deflection which is purely elastic, 0 … 1; 0 is the LuGre bristle, which yields from the start.
    pub elastic_share: f64,
    /// Micro-damping of the bristle relative to critical for the shaft's inertia.
    pub micro_damping: f64,
    /// The loss is that of the torque some time ago, as long as [`super::super::world::World::load_memory_s`] says.
    pub remembers_load: bool,
    /// By how much of the level it is higher counter-clockwise, and lower clockwise.
    pub lean: f64,
    /// Only within this window of angles; `None` everywhere.
    pub patch: Option<Patch>,
}

/// How friction falls with the speed from its level at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weakening {
    /// `exp(−|ω/ω_s|^n)`; the textbook has 2, measurements 0.5 … 2 (Armstrong-Hélouvry 1994).
    Exponential(f64),
    /// `1/(1 + (ω/ω_s)²)`, of lubricated contacts (D. P. Hess, A. Soom, J. Tribology 112, 1990).
    Hyperbolic,
}

impl Weakening {
    fn at(self, relative_speed: f64) -> f64 {
        match self {
            Self::Exponential(power) => (-relative_speed.abs().powf(power)).exp(),
            Self::Hyperbolic => 1.0 / (1.0 + relative_speed * relative_speed),
        }
    }
}

/// Shaft angles at which there is more of something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Patch {
    /// A window with smooth edges.
    Window {
        /// Middle, rad.
        middle: f64,
        /// Half width, rad.
        half_width: f64,
        /// Length of an edge, rad.
        edge: f64,
    },
    /// A bell.
    Bell {
        /// Middle, rad.
        middle: f64,
        /// Standard deviation, rad.
        width: f64,
    },
    /// Everywhere, more and less, by several orders of the turn: order, share, phase.
    Mesh([(f64, f64, f64); 3]),
}

impl Patch {
    /// 1 inside, 0 outside, smooth between; of a mesh about 1.
    #[must_use]
    pub fn weight(&self, angle: f64) -> f64 {
        let away = |middle: f64| (angle - middle + PI).rem_euclid(TAU) - PI;
        match *self {
            Self::Window { middle, half_width, edge } => 1.0 / (1.0 + ((away(middle).abs() - half_width) / edge).exp()),
            Self::Bell { middle, width } => (-0.5 * (away(middle) / width).powi(2)).exp(),
            Self::Mesh(orders) => {
                let sum: f64 = orders.iter().map(|(order, share, phase)| share * (order * angle + phase).sin()).sum();
                (1.0 + sum).max(0.02)
            }
        }
    }
}

impl Bristle {
    /// Sliding level, N·m, at a speed, the motor's torque and an angle.
    #[must_use]
    pub fn level(&self, speed: f64, motor_nm: f64, angle: f64) -> f64 {
        let mut level = self.coulomb_nm;
        if self.static_ratio > 1.0 {
            let excess = self.coulomb_nm * (self.static_ratio - 1.0);
            level += excess * self.weakening.at(speed / self.stribeck_speed);
        }
        if self.loss_driving > 0.0 {
            // Over a couple of rad/s the teeth change flanks; the loss changes with them, not at a point.
            let forward = 0.5 * (1.0 + (motor_nm * speed / (1e-5 + 2.0 * motor_nm.abs())).tanh());
            let torque = if self.loss_power == 1.0 {
                motor_nm.abs()
            } else {
                self.loss_reference_nm * (motor_nm.abs() / self.loss_reference_nm).powf(self.loss_power)
            };
            level += torque * (self.loss_driven + (self.loss_driving - self.loss_driven) * forward);
        }
        match self.patch {
            Some(patch) => level * patch.weight(angle),
            None => level,
        }
    }

    /// Friction torque against the motion (N·m) and the rate of the relative deflection (1/s).
    /// `deflection` is relative to [`Bristle::presliding`].
    #[must_use]
    pub fn torque(&self, deflection: f64, speed: f64, motor_nm: f64, angle: f64, inertia: f64) -> (f64, f64) {
        let level = self.level(speed, motor_nm, angle) * (1.0 + self.lean * deflection.clamp(-1.0, 1.0));
        // The bristle's stiffness belongs to the surfaces where friction is a constant, and to the load where it is not.
        let own = self.coulomb_nm * self.static_ratio;
        let moves = self.loss_driving > 0.0 || self.patch.is_some() || self.lean != 0.0;
        let stiff_level = if moves { level } else { own };
        let full = if stiff_level > 0.0 { level / stiff_level } else { 1.0 };
        let relative = deflection / full;
        let yielding = if self.elastic_share <= 0.0 {
            1.0
        } else if deflection * speed <= 0.0 {
            0.0
        } else {
            let x = (relative.abs() - self.elastic_share) / (1.0 - self.elastic_share);
            if x <= 0.0 {
                0.0
            } else if x >= 1.0 {
                1.0
            } else {
                0.5 - 0.5 * (PI * x).cos()
            }
        };
        let rate = speed / self.presliding * (1.0 - yielding * relative * speed.signum());
        let stiffness = stiff_level / self.presliding;
        let damping = self.micro_damping * 2.0 * (stiffness * inertia).sqrt();
        (stiff_level * deflection + damping * rate * self.presliding, rate)
    }
}
