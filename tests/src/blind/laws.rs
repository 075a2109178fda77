//! The truth's laws, each richer than what a diagnosis library would use.
//!
//! Nothing here is an approximation of the library's law on purpose: bristles are elasto-plastic, gears lose more when
//! they are driven back, the bridge is a transistor and a diode by PWM phase, the battery has two RC pairs.

/// Friction with an elasto-plastic bristle (Dupont et al., "Single state elastoplastic friction models", 2002):
/// purely elastic below the breakaway deflection, LuGre above, with micro-damping in presliding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristle {
    /// Sliding level at speed, N·m.
    pub coulomb_nm: f64,
    /// Level at rest over the level at speed, 1 = plain Coulomb.
    pub static_ratio: f64,
    /// Stribeck speed, rad/s.
    pub stribeck_speed: f64,
    /// Exponent in `exp(−|ω/ω_s|^n)`; the textbook has 2, measurements 0.5 … 2 (Armstrong-Hélouvry 1994).
    pub stribeck_exponent: f64,
    /// Loss per torque through the teeth while the motor drives the load.
    pub loss_driving: f64,
    /// The same while the load drives the motor; gears are worse backwards.
    pub loss_driven: f64,
    /// Deflection at which the sliding level is reached, rad.
    pub presliding: f64,
    /// Share of that deflection which is purely elastic, 0 … 1; 0 is the LuGre bristle, which yields from the start.
    pub elastic_share: f64,
    /// Micro-damping of the bristle relative to critical for the shaft's inertia.
    pub micro_damping: f64,
    /// Only within this window of angles; `None` everywhere.
    pub patch: Option<Patch>,
}

/// A window of shaft angles with smooth edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Middle, rad.
    pub middle: f64,
    /// Half width, rad.
    pub half_width: f64,
    /// Length of an edge, rad.
    pub edge: f64,
}

impl Patch {
    /// 1 inside, 0 outside, smooth between.
    #[must_use]
    pub fn weight(&self, angle: f64) -> f64 {
        let away =
            (angle - self.middle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        1.0 / (1.0 + ((away.abs() - self.half_width) / self.edge).exp())
    }
}

impl Bristle {
    /// Sliding level, N·m, at a speed, the motor's torque and an angle.
    #[must_use]
    pub fn level(&self, speed: f64, motor_nm: f64, angle: f64) -> f64 {
        let mut level = self.coulomb_nm;
        if self.static_ratio > 1.0 {
            let excess = self.coulomb_nm * (self.static_ratio - 1.0);
            level += excess * (-(speed / self.stribeck_speed).abs().powf(self.stribeck_exponent)).exp();
        }
        if self.loss_driving > 0.0 {
            // Over a couple of rad/s the teeth change flanks; the loss changes with them, not at a point.
            let forward = 0.5 * (1.0 + (motor_nm * speed / (1e-5 + 2.0 * motor_nm.abs())).tanh());
            level += motor_nm.abs() * (self.loss_driven + (self.loss_driving - self.loss_driven) * forward);
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
        let level = self.level(speed, motor_nm, angle);
        // The bristle's stiffness belongs to the surfaces where friction is a constant, and to the load where it is not.
        let own = self.coulomb_nm * self.static_ratio;
        let stiff_level = if self.loss_driving > 0.0 || self.patch.is_some() { level } else { own };
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
                0.5 - 0.5 * (std::f64::consts::PI * x).cos()
            }
        };
        let rate = speed / self.presliding * (1.0 - yielding * relative * speed.signum());
        let stiffness = stiff_level / self.presliding;
        let damping = self.micro_damping * 2.0 * (stiffness * inertia).sqrt();
        (stiff_level * deflection + damping * rate * self.presliding, rate)
    }
}

/// Gravity on the eccentric of a tilted axis; a soft part of it hangs a little differently through the turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gravity {
    /// First harmonic, N·m.
    pub torque_nm: f64,
    /// Where the mass hangs, rad.
    pub direction: f64,
    /// Second harmonic relative to the first.
    pub second_share: f64,
    /// Its direction, rad.
    pub second_direction: f64,
}

impl Gravity {
    /// Torque on the shaft, N·m.
    #[must_use]
    pub fn torque(&self, angle: f64) -> f64 {
        -self.torque_nm
            * ((angle - self.direction).sin() + self.second_share * (2.0 * (angle - self.second_direction)).sin())
    }
}

/// A bipolar H-bridge by PWM phase. While the pulse is on the current passes the upper and the lower transistor; in slow
/// decay it passes a transistor and a diode. Both curves rise steeply at a few milliamperes and slowly beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// Saturation voltages of upper plus lower transistor beyond the knee, V.
    pub transistors_v: f64,
    /// Current of the knee, A.
    pub knee_a: f64,
    /// Ohmic part of a transistor path, Ω.
    pub transistor_ohm: f64,
    /// One transistor and one diode beyond the knee, V.
    pub diode_v: f64,
    /// Thermal voltage times ideality of the diode's logarithmic rise, V.
    pub diode_log_v: f64,
    /// Ohmic part of the freewheeling path, Ω.
    pub diode_ohm: f64,
}

impl Bridge {
    /// Voltage lost at a current with a share `duty` of the period in the pulse; odd in the current.
    #[must_use]
    pub fn drop(&self, current: f64, duty: f64) -> f64 {
        let on = duty.abs().min(1.0);
        let i = current.abs();
        let knee = 1.0 - (-i / self.knee_a).exp();
        let pulse = self.transistors_v * knee + self.transistor_ohm * i;
        let wheel = (self.diode_v + self.diode_log_v * (1.0 + i / self.knee_a).ln()) * knee + self.diode_ohm * i;
        (on * pulse + (1.0 - on) * wheel).copysign(current)
    }
}

/// A cell with a series resistance and two relaxations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Battery {
    /// At once, Ω.
    pub series_ohm: f64,
    /// Resistance of the two RC pairs, Ω.
    pub pair_ohm: [f64; 2],
    /// Their time constants, s.
    pub pair_s: [f64; 2],
}

/// The winding warms up and its resistance with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heating {
    /// Temperature rise per watt in the end, K/W.
    pub kelvin_per_watt: f64,
    /// Thermal time constant, s.
    pub time_s: f64,
}

/// Temperature coefficient of copper's resistance, 1/K.
pub const COPPER_PER_KELVIN: f64 = 0.0039;

/// Two inertias: rotor with gears, and the load that carries the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoInertias {
    /// Share of the inertia that belongs to the load.
    pub load_share: f64,
    /// Stiffness in contact, N·m/rad.
    pub stiffness: f64,
    /// Damping in contact, N·m·s/rad.
    pub damping: f64,
    /// Half of the free play, rad; 0 for a flexible shaft without play.
    pub half_gap: f64,
    /// Share of the viscous damping on the load's side.
    pub load_drag_share: f64,
}

impl TwoInertias {
    /// Torque from the rotor to the load, N·m, for a twist (rotor − load, rad) and its rate.
    #[must_use]
    pub fn torque(&self, twist: f64, rate: f64) -> f64 {
        let into = twist.abs() - self.half_gap;
        if into <= 0.0 && self.half_gap > 0.0 {
            return 0.0;
        }
        let spring = self.stiffness * into.copysign(twist);
        if self.half_gap == 0.0 {
            return self.stiffness * twist + self.damping * rate;
        }
        // Teeth push, they do not pull; and damping grows with the depth of contact so that the torque has no jump.
        let depth = (into / 1e-3).min(1.0);
        let torque = spring + self.damping * rate * depth;
        if torque * twist < 0.0 { 0.0 } else { torque }
    }
}

/// Torque ripple over the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    /// Amplitude, N·m.
    pub torque_nm: f64,
    /// Periods per turn.
    pub per_turn: f64,
    /// Phase, rad.
    pub phase: f64,
}
