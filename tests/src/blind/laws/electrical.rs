//! Bridge, supply and winding of the truth.

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

/// What else a bridge, a supply or a winding's leads lose, V against the current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// A drop with a soft beginning and a slope, the same in every phase of the period.
    Saturating {
        /// V.
        volts: f64,
        /// Current of the knee, A.
        knee_a: f64,
        /// Ω.
        ohm: f64,
    },
    /// The diodes' way for a share of every period that switches at all: of the supply.
    DeadTime {
        /// Volts of a whole period.
        rail_v: f64,
        /// Share of the period.
        lost: f64,
        /// Current at which the winding's ripple no longer passes zero, A.
        knee_a: f64,
        /// Of the dead time that lies within pulses nothing is left beyond this duty.
        until_duty: f64,
    },
    /// An electrode that polarises (J. Tafel, Z. physikalische Chemie 50, 1905).
    Polarisation {
        /// V.
        volts: f64,
        /// A.
        ampere: f64,
    },
    /// A supply that gives no more than so much current.
    Clip {
        /// A.
        ampere: f64,
        /// How steeply it falls beyond, Ω.
        ohm: f64,
    },
}

impl Loss {
    /// Voltage lost at a current at a duty, V; falls with the current nowhere.
    #[must_use]
    pub fn drop(&self, current: f64, duty: f64) -> f64 {
        match *self {
            Self::Saturating { volts, knee_a, ohm } => volts * (current / knee_a).tanh() + ohm * current,
            Self::DeadTime { rail_v, lost, knee_a, until_duty } => {
                let switches = duty != 0.0 && duty.abs() < until_duty;
                if switches { rail_v * lost * (current / knee_a).tanh() } else { 0.0 }
            }
            Self::Polarisation { volts, ampere } => duty * volts * (duty * current / ampere).asinh(),
            Self::Clip { ampere, ohm } => {
                let drawn = duty * current;
                duty * ohm * (drawn.abs() - ampere).max(0.0).copysign(drawn)
            }
        }
    }
}

/// What a bridge takes of the commanded voltage whichever way the current flows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandDrop {
    /// At a small duty, V.
    pub volts: f64,
    /// By how much of it the loss has grown at the whole duty.
    pub growth: f64,
}

impl CommandDrop {
    /// What is left of a commanded voltage (V) at a duty.
    #[must_use]
    pub fn through(&self, voltage: f64, duty: f64) -> f64 {
        (voltage.abs() - self.volts * (1.0 + self.growth * duty.abs())).max(0.0).copysign(voltage)
    }
}

/// Duties that do nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deadband {
    /// Up to this duty.
    pub width: f64,
    /// Length of the rounded corner, duty.
    pub corner: f64,
    /// Whether the whole duty still gives all of the supply.
    pub stretched: bool,
}

impl Deadband {
    /// What comes out.
    #[must_use]
    pub fn through(&self, duty: f64) -> f64 {
        let beyond = duty.abs() - self.width;
        let rounded = if self.corner > 0.0 {
            0.5 * (beyond + beyond.hypot(self.corner)) - 0.5 * ((-self.width) + self.width.hypot(self.corner))
        } else {
            beyond
        };
        let out = rounded.max(0.0).copysign(duty);
        if self.stretched { out / (1.0 - self.width) } else { out }
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

/// A supply that falls with the charge drawn from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discharge {
    /// At first, V/(A·s).
    pub fall_v_per_as: f64,
    /// The fall levels off with this charge, A·s; infinite: it does not.
    pub levels_off_as: f64,
}

impl Discharge {
    /// V.
    #[must_use]
    pub fn fallen(&self, drawn_as: f64) -> f64 {
        if self.levels_off_as.is_finite() {
            -self.fall_v_per_as * self.levels_off_as * (-drawn_as / self.levels_off_as).exp_m1()
        } else {
            self.fall_v_per_as * drawn_as
        }
    }
}

/// The winding warms up and its resistance with it; the housing does, more slowly, where it is not large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heating {
    /// Temperature rise per watt in the end, K/W.
    pub kelvin_per_watt: f64,
    /// Thermal time constant, s.
    pub time_s: f64,
    /// The housing's rise per watt, K/W.
    pub housing_kelvin_per_watt: f64,
    /// Its time constant, s.
    pub housing_s: f64,
}

/// Temperature coefficient of copper's resistance, 1/K.
pub const COPPER_PER_KELVIN: f64 = 0.0039;
