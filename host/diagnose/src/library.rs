//! The library of effects: their numbers, how the fit moves them, and what the robot file calls them.

use description::robot::Robot;

/// Every number of the forward model, SI units and radians, by [`Slot`].
pub type Numbers = [f64; SLOTS];

/// Names the entries of [`Numbers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Slot {
    /// R, Ω.
    Resistance,
    /// K, N·m/A.
    TorqueConstant,
    /// J of rotor and load, kg·m².
    Inertia,
    /// b, N·m·s/rad.
    Viscous,
    /// Sliding friction, N·m.
    Coulomb,
    /// Stribeck excess at rest, N·m.
    BreakawayExcess,
    /// Stribeck speed, rad/s.
    StribeckSpeed,
    /// Friction per transmitted torque.
    LoadCoefficient,
    /// Presliding length, rad.
    Presliding,
    /// Gravity torque times cos of its direction, N·m.
    GravityCos,
    /// Gravity torque times sin of its direction, N·m.
    GravitySin,
    /// Bridge drop at zero current, V.
    DropVolts,
    /// Bridge drop's rise, Ω.
    DropSlope,
    /// Duty deadband.
    Deadband,
    /// Supply's resistance, Ω.
    SagOhm,
    /// Supply's slow resistance, Ω.
    RelaxationOhm,
    /// Its time constant, s.
    RelaxationTime,
    /// Age of the reading, s.
    Delay,
    /// Sensor error, first harmonic, rad.
    Cos1,
    /// First harmonic, rad.
    Sin1,
    /// Second harmonic, rad.
    Cos2,
    /// Second harmonic, rad.
    Sin2,
}

/// How many slots there are.
pub const SLOTS: usize = Slot::Sin2 as usize + 1;

/// How the fit moves a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Positive: by ratios.
    Log,
    /// In units of this much.
    Linear(f64),
}

/// A number that the fit moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Free {
    /// Which.
    pub slot: Slot,
    /// How.
    pub scale: Scale,
    /// Where the fit begins (SI, rad).
    pub start: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Standard deviation of the weak prior about `start`, in the fit's own coordinate; infinite for none.
    pub prior: f64,
}

impl Free {
    /// The fit's coordinate of a number.
    #[must_use]
    pub fn coordinate(&self, number: f64) -> f64 {
        match self.scale {
            Scale::Log => number.ln(),
            Scale::Linear(unit) => number / unit,
        }
    }

    /// The number at a coordinate.
    #[must_use]
    pub fn number(&self, coordinate: f64) -> f64 {
        match self.scale {
            Scale::Log => coordinate.exp(),
            Scale::Linear(unit) => coordinate * unit,
        }
    }
}

/// The effects that a diagnosis can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// `coulomb_friction`
    Coulomb,
    /// `stribeck_friction`
    Stribeck,
    /// `load_friction`
    Load,
    /// `gravity_tilt`
    Gravity,
    /// `driver_drop`
    Drop,
    /// `battery_sag`
    Sag,
    /// `sensor_nonlinearity`
    Nonlinearity,
    /// `sensor_delay`
    Delay,
}

impl Effect {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Coulomb,
        Self::Stribeck,
        Self::Load,
        Self::Gravity,
        Self::Drop,
        Self::Sag,
        Self::Nonlinearity,
        Self::Delay,
    ];

    /// The table's name in robot.toml.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Coulomb => "coulomb_friction",
            Self::Stribeck => "stribeck_friction",
            Self::Load => "load_friction",
            Self::Gravity => "gravity_tilt",
            Self::Drop => "driver_drop",
            Self::Sag => "battery_sag",
            Self::Nonlinearity => "sensor_nonlinearity",
            Self::Delay => "sensor_delay",
        }
    }

    /// Whether the file's model has it already (or has what contains it).
    #[must_use]
    pub fn in_file(self, robot: &Robot) -> bool {
        let effects = &robot.effects;
        match self {
            Self::Coulomb => effects.coulomb_friction.is_some() || effects.stribeck_friction.is_some(),
            Self::Stribeck => effects.stribeck_friction.is_some(),
            Self::Load => effects.load_friction.is_some(),
            Self::Gravity => effects.gravity_tilt.is_some(),
            Self::Drop => effects.driver_drop.is_some(),
            Self::Sag => effects.battery_sag.is_some(),
            Self::Nonlinearity => effects.sensor_nonlinearity.is_some(),
            Self::Delay => effects.sensor_delay.is_some(),
        }
    }

    /// Whether two effects are forms of the same thing, so that a pair of them is never asked for.
    #[must_use]
    pub fn overlaps(self, other: Self) -> bool {
        let both = (self.min(other), self.max(other));
        self == other || both == (Self::Coulomb, Self::Stribeck)
    }
}

/// The typical sizes that candidates start from.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Stall torque, N·m.
    pub stall_nm: f64,
    /// Bridge supply, V.
    pub rail_v: f64,
    /// Winding resistance, Ω.
    pub resistance_ohm: f64,
}

/// The numbers of an effect, as the fit begins with them when the file does not have it.
/// `start` chooses among several starting points.
#[must_use]
pub fn candidate(effect: Effect, sizes: &Sizes, start: usize) -> Vec<Free> {
    let torque = sizes.stall_nm;
    let linear = |slot, unit: f64, start, low, high| Free {
        slot,
        scale: Scale::Linear(unit),
        start,
        low,
        high,
        prior: f64::INFINITY,
    };
    let log = |slot, start: f64, low, high, prior| Free { slot, scale: Scale::Log, start, low, high, prior };
    let presliding = log(Slot::Presliding, [4e-3, 2e-2][start % 2], 3e-4, 0.15, 2.0);
    let level = linear(Slot::Coulomb, 0.01 * torque, 0.02 * torque, 0.0, torque);
    match effect {
        Effect::Coulomb => vec![level, presliding],
        Effect::Stribeck => vec![
            level,
            linear(Slot::BreakawayExcess, 0.01 * torque, 0.02 * torque, 0.0, torque),
            log(Slot::StribeckSpeed, [4.0, 1.0][start % 2], 0.1, 40.0, 2.0),
            log(Slot::Presliding, 4e-3, 3e-4, 0.15, 2.0),
        ],
        Effect::Load => vec![linear(Slot::LoadCoefficient, 0.05, 0.1, 0.0, 0.95), presliding],
        Effect::Gravity => vec![
            linear(Slot::GravityCos, 0.01 * torque, 0.0, -2.0 * torque, 2.0 * torque),
            linear(Slot::GravitySin, 0.01 * torque, 0.0, -2.0 * torque, 2.0 * torque),
        ],
        Effect::Drop => vec![linear(Slot::DropVolts, 0.1, 0.1, 0.0, 0.8 * sizes.rail_v)],
        Effect::Sag => vec![
            linear(
                Slot::SagOhm,
                0.05 * sizes.resistance_ohm,
                0.05 * sizes.resistance_ohm,
                0.0,
                2.0 * sizes.resistance_ohm,
            ),
            linear(
                Slot::RelaxationOhm,
                0.05 * sizes.resistance_ohm,
                0.05 * sizes.resistance_ohm,
                0.0,
                2.0 * sizes.resistance_ohm,
            ),
            log(Slot::RelaxationTime, [0.8, 0.1][start % 2], 0.02, 20.0, 1.5),
        ],
        Effect::Nonlinearity => [Slot::Cos1, Slot::Sin1, Slot::Cos2, Slot::Sin2]
            .into_iter()
            .map(|slot| linear(slot, 0.01, 0.0, -0.15, 0.15))
            .collect(),
        Effect::Delay => vec![linear(Slot::Delay, 1e-3, [2e-3, 10e-3][start % 2], 0.0, 60e-3)],
    }
}

/// How many starting points an effect is worth.
#[must_use]
pub fn starts(effect: Effect) -> usize {
    match effect {
        Effect::Coulomb | Effect::Stribeck | Effect::Load | Effect::Sag | Effect::Delay => 2,
        Effect::Gravity | Effect::Drop | Effect::Nonlinearity => 1,
    }
}
