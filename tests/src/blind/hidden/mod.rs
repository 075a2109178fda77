//! What can be hidden, and how a size turns it up.
//!
//! Everything about an effect but its size is drawn from the seed ([`Shape`]); the size is one number that
//! [`super::case`] scales until the effect is as visible as the seed wants it. Every effect of the library has two laws here,
//! neither of them the library's.

mod electrical;
mod friction;
mod sensor;
mod shaft;
mod shape;

pub use shape::{Law, Shape};

/// Declares the effects with their names.
macro_rules! effects {
    ($($(#[$doc:meta])* $variant:ident = $name:literal,)*) => {
        /// An effect that a data set can hide.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Effect {
            $($(#[$doc])* $variant,)*
        }

        impl Effect {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The name, as robot files and verdicts spell it.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

effects! {
    /// Constant friction.
    CoulombFriction = "coulomb_friction",
    /// The same with a higher level near rest.
    StribeckFriction = "stribeck_friction",
    /// Gears that lose a share of the torque, more when driven back; or by another power of it.
    LoadFriction = "load_friction",
    /// Gravity on a mass that is a little soft.
    GravityTilt = "gravity_tilt",
    /// Transistors and diodes by PWM phase; or one soft curve.
    DriverDrop = "driver_drop",
    /// Series resistance and two RC pairs; or an electrode that polarises.
    BatterySag = "battery_sag",
    /// Error over the turn with a tail of harmonics; or a saw.
    SensorNonlinearity = "sensor_nonlinearity",
    /// An old reading with a little jitter.
    SensorDelay = "sensor_delay",
    /// Ripple of the teeth.
    TorqueRipple = "torque_ripple",
    /// Two inertias with a gap.
    Backlash = "backlash",
    /// A soft shaft.
    ShaftCompliance = "shaft_compliance",
    /// Friction at some angles.
    FrictionPatch = "friction_patch",
    /// The winding's resistance rises.
    WindingHeating = "winding_heating",
    /// A lag of first or second order.
    SensorLag = "sensor_lag",
    /// Drag with about the square of the speed.
    QuadraticDrag = "quadratic_drag",
    /// Play between shaft and sensor.
    SensorHysteresis = "sensor_hysteresis",
    /// A constant torque, nearly.
    BiasTorque = "bias_torque",
    /// Friction of two levels.
    DirectionalFriction = "directional_friction",
    /// Drag with about the cube of the speed.
    CubicDrag = "cubic_drag",
    /// What is lost of the commanded voltage.
    DriverDropByCommand = "driver_drop_by_command",
    /// Duties that do nothing.
    DriverDeadband = "driver_deadband",
    /// Diodes in every period.
    DriverDeadTime = "driver_dead_time",
    /// A supply that empties.
    BatteryDischarge = "battery_discharge",
    /// Grease that thins.
    GreaseWarming = "grease_warming",
    /// Readings that repeat.
    HeldSamples = "held_samples",
    /// Clocks that part.
    ClockDrift = "clock_drift",
    /// A late command.
    CommandLatency = "command_latency",
    /// Outside: friction by the mesh of the teeth, several orders of the turn.
    GearMesh = "gear_mesh",
    /// Outside: the shaft sticks at one tooth.
    StickingTooth = "sticking_tooth",
    /// Outside: a supply that gives no more than so much current.
    SupplyClip = "supply_clip",
    /// Outside: an encoder that loses counts when it is fast.
    EncoderSkip = "encoder_skip",
    /// Outside: a belt between shaft and sensor that creeps under load.
    BeltCreep = "belt_creep",
    /// Outside: friction by the load of a while ago.
    RememberedLoad = "remembered_load",
}

impl Effect {
    /// How many of [`Self::ALL`] the diagnosis should name.
    const IN_LIBRARY: usize = 27;

    /// The ones that the diagnosis should name.
    #[must_use]
    pub fn library() -> &'static [Self] {
        &Self::ALL[..Self::IN_LIBRARY]
    }

    /// What it should call "unexplained".
    #[must_use]
    pub fn outside() -> &'static [Self] {
        &Self::ALL[Self::IN_LIBRARY..]
    }

    /// The effect of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|effect| effect.name() == name)
    }

    /// Whether the diagnosis should name it.
    #[must_use]
    pub fn in_library(self) -> bool {
        Self::library().contains(&self)
    }

    /// For what lies outside the library, the coordinates of the misfit that say what it is.
    #[must_use]
    pub fn lives_in(self) -> &'static [&'static str] {
        match self {
            Self::GearMesh | Self::StickingTooth => &["angle_rad"],
            Self::SupplyClip => &["voltage_v", "current_a"],
            Self::EncoderSkip => &["time_s", "speed_rad_per_s"],
            Self::BeltCreep => &["voltage_v", "current_a", "speed_rad_per_s"],
            Self::RememberedLoad => &["time_s", "voltage_v", "current_a", "time_since_reversal_s"],
            _ => &[],
        }
    }

    /// Whether two of them in one data set would be one in disguise, or need the same place in the world.
    #[must_use]
    pub fn excludes(self, other: Self) -> bool {
        const FAMILIES: [&[Effect]; 6] = [
            &[Effect::CoulombFriction, Effect::StribeckFriction, Effect::DirectionalFriction],
            &[Effect::Backlash, Effect::ShaftCompliance],
            &[Effect::QuadraticDrag, Effect::CubicDrag],
            &[Effect::SensorDelay, Effect::SensorLag, Effect::CommandLatency, Effect::HeldSamples, Effect::ClockDrift],
            &[Effect::BatterySag, Effect::BatteryDischarge, Effect::WindingHeating],
            &[Effect::DriverDrop, Effect::DriverDropByCommand, Effect::DriverDeadTime, Effect::DriverDeadband],
        ];
        self == other || FAMILIES.iter().any(|family| family.contains(&self) && family.contains(&other))
    }

    /// Sizes within which the effect stays physical: the search for the wanted visibility ends there.
    #[must_use]
    pub fn bounds(self) -> (f64, f64) {
        match self {
            // Half of the transmitted torque: a worm gear.
            Self::LoadFriction | Self::RememberedLoad => (1e-3, 5.0),
            // Up to 5 ms: beyond, nobody would look for a delay in a wired sensor.
            Self::SensorDelay => (1e-3, 5.0),
            // Up to 25 ms.
            Self::SensorLag => (1e-2, 3.1),
            // 180 K/W: a 6 mm motor in still air, wrapped in tape.
            Self::WindingHeating => (1e-2, 3.0),
            // 150 Hz down to 6 Hz.
            Self::ShaftCompliance => (1e-2, 6.0),
            // A total of 3 V at the knee.
            Self::DriverDrop | Self::DriverDropByCommand => (1e-3, 3.0),
            // 12 Ω in all: four nearly empty button cells.
            Self::BatterySag => (1e-3, 12.0),
            // A fifth of the duty.
            Self::DriverDeadband | Self::DriverDeadTime => (1e-3, 10.0),
            // Nine in ten.
            Self::HeldSamples => (1e-3, 9.0),
            // 1 %: an RC oscillator that was never trimmed.
            Self::ClockDrift => (1e-3, 10.0),
            // Up to 20 ms.
            Self::CommandLatency => (1e-3, 20.0),
            // Thinner by e³.
            Self::GreaseWarming => (1e-2, 3.0),
            // From never to always.
            Self::SupplyClip => (1e-3, 1.5),
            _ => (1e-3, 30.0),
        }
    }
}
