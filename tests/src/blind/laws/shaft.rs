//! What else turns the truth's shaft.

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
    /// A soft mass swings out: by this share more at 100 rad/s.
    pub swings_out: f64,
}

impl Gravity {
    /// Torque on the shaft, N·m.
    #[must_use]
    pub fn torque(&self, angle: f64, speed: f64) -> f64 {
        -self.torque_nm
            * (1.0 + self.swings_out * (1e-2 * speed).powi(2))
            * ((angle - self.direction).sin() + self.second_share * (2.0 * (angle - self.second_direction)).sin())
    }
}

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
    /// Of a shaft without play: the twist at which its stiffness has doubled, rad; infinite for a linear one.
    pub doubles_at: f64,
    /// Of play: the length over which the teeth come to bear once they touch, rad; 0 for hard ones.
    pub soft_contact: f64,
}

impl TwoInertias {
    /// Torque from the rotor to the load, N·m, for a twist (rotor − load, rad) and its rate.
    #[must_use]
    pub fn torque(&self, twist: f64, rate: f64) -> f64 {
        if self.half_gap == 0.0 {
            let stiffer = 1.0 + (twist / self.doubles_at).powi(2) / 3.0;
            return self.stiffness * stiffer * twist + self.damping * rate;
        }
        let touched = twist.abs() - self.half_gap;
        if touched <= 0.0 {
            return 0.0;
        }
        let soft = self.soft_contact;
        let into = if touched < soft { 0.5 * touched * touched / soft } else { touched - 0.5 * soft };
        let spring = self.stiffness * into.copysign(twist);
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
    /// Share of twice as many a turn.
    pub second_share: f64,
}

impl Ripple {
    /// Torque on the shaft, N·m.
    #[must_use]
    pub fn torque(&self, angle: f64) -> f64 {
        let phase = self.per_turn * angle + self.phase;
        self.torque_nm * (phase.sin() + self.second_share * (2.0 * phase).cos())
    }
}

/// A torque that is always there, nearly the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bias {
    /// N·m.
    pub torque_nm: f64,
    /// Share that comes and goes once a turn.
    pub once_share: f64,
    /// Share that it loses a second.
    pub fades_per_s: f64,
}

/// A drag by a power of the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// At the reference speed, N·m.
    pub torque_nm: f64,
    /// rad/s.
    pub reference: f64,
    /// Power.
    pub power: f64,
}

impl Bias {
    /// Torque on the shaft, N·m.
    #[must_use]
    pub fn torque(&self, angle: f64, time: f64) -> f64 {
        self.torque_nm * (1.0 + self.once_share * angle.cos() - self.fades_per_s * time)
    }
}

impl Drag {
    /// Torque against the motion, N·m.
    #[must_use]
    pub fn torque(&self, speed: f64) -> f64 {
        self.torque_nm * (speed.abs() / self.reference).powf(self.power).copysign(speed)
    }
}

/// Grease that thins as it works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grease {
    /// Logarithm of the fall per watt in the end, 1/W.
    pub thinning_per_w: f64,
    /// Thermal time constant, s.
    pub time_s: f64,
    /// Share of the damping that is not the grease's.
    pub stays: f64,
}

impl Grease {
    /// What is left of the damping.
    #[must_use]
    pub fn left(&self, warmth: f64) -> f64 {
        self.stays + (1.0 - self.stays) * (-warmth).exp()
    }
}
