//! What can be hidden, and how a size turns it up.
//!
//! Everything about an effect but its size is drawn from the seed ([`Shape`]); the size is one number that
//! [`super::case`] scales until the effect is as visible as the seed wants it.

use super::laws::{Battery, Bridge, Bristle, Gravity, Heating, Patch, Ripple, TwoInertias};
use super::sensing::Sensor;
use super::world::World;
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::{PI, TAU};

/// An effect that a data set can hide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Effect {
    /// Constant friction with an elasto-plastic bristle.
    CoulombFriction,
    /// The same with a higher level near rest.
    StribeckFriction,
    /// Gears that lose a share of the torque, more when driven back.
    LoadFriction,
    /// Gravity on a mass that is a little soft.
    GravityTilt,
    /// Transistors and diodes by PWM phase.
    DriverDrop,
    /// Series resistance and two RC pairs.
    BatterySag,
    /// Error over the turn with a tail of harmonics.
    SensorNonlinearity,
    /// An old reading with a little jitter.
    SensorDelay,
    /// Outside: ripple of the teeth.
    TorqueRipple,
    /// Outside: two inertias with a gap.
    Backlash,
    /// Outside: a soft shaft.
    ShaftCompliance,
    /// Outside: friction at some angles.
    FrictionPatch,
    /// Outside: the winding's resistance rises.
    WindingHeating,
    /// Outside: first-order lag above 5 ms.
    SensorLag,
    /// Outside: drag with the square of the speed.
    QuadraticDrag,
    /// Outside: play between shaft and sensor.
    SensorHysteresis,
}

impl Effect {
    /// The eight that the diagnosis should name.
    pub const LIBRARY: [Self; 8] = [
        Self::CoulombFriction,
        Self::StribeckFriction,
        Self::LoadFriction,
        Self::GravityTilt,
        Self::DriverDrop,
        Self::BatterySag,
        Self::SensorNonlinearity,
        Self::SensorDelay,
    ];

    /// What it should call "unexplained".
    pub const OUTSIDE: [Self; 8] = [
        Self::TorqueRipple,
        Self::Backlash,
        Self::ShaftCompliance,
        Self::FrictionPatch,
        Self::WindingHeating,
        Self::SensorLag,
        Self::QuadraticDrag,
        Self::SensorHysteresis,
    ];

    /// The name, as robot files and verdicts spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::CoulombFriction => "coulomb_friction",
            Self::StribeckFriction => "stribeck_friction",
            Self::LoadFriction => "load_friction",
            Self::GravityTilt => "gravity_tilt",
            Self::DriverDrop => "driver_drop",
            Self::BatterySag => "battery_sag",
            Self::SensorNonlinearity => "sensor_nonlinearity",
            Self::SensorDelay => "sensor_delay",
            Self::TorqueRipple => "torque_ripple",
            Self::Backlash => "backlash",
            Self::ShaftCompliance => "shaft_compliance",
            Self::FrictionPatch => "friction_patch",
            Self::WindingHeating => "winding_heating",
            Self::SensorLag => "sensor_lag",
            Self::QuadraticDrag => "quadratic_drag",
            Self::SensorHysteresis => "sensor_hysteresis",
        }
    }

    /// The effect of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::LIBRARY.into_iter().chain(Self::OUTSIDE).find(|effect| effect.name() == name)
    }

    /// Whether it is one of the eight.
    #[must_use]
    pub fn in_library(self) -> bool {
        Self::LIBRARY.contains(&self)
    }

    /// Sizes within which the effect stays physical: the search for the wanted visibility ends there.
    #[must_use]
    pub fn bounds(self) -> (f64, f64) {
        match self {
            // Half of the transmitted torque: a worm gear.
            Self::LoadFriction => (1e-3, 5.0),
            // Up to 5 ms: beyond, nobody would look for a delay in a wired sensor.
            Self::SensorDelay => (1e-3, 5.0),
            // 5.5 ms, where lag and delay part, to 25 ms.
            Self::SensorLag => (5.5 / 8.0, 3.1),
            // 180 K/W: a 6 mm motor in still air, wrapped in tape.
            Self::WindingHeating => (1e-2, 3.0),
            // 150 Hz down to 6 Hz.
            Self::ShaftCompliance => (1e-2, 6.0),
            // A total of 3 V at the knee.
            Self::DriverDrop => (1e-3, 3.0),
            // 12 Ω in all: four nearly empty button cells.
            Self::BatterySag => (1e-3, 12.0),
            _ => (1e-3, 30.0),
        }
    }
}

/// Everything about an effect but its size: shares in 0 … 1 drawn once, read by whichever effect it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape([f64; 8]);

impl Shape {
    /// Draws a shape.
    #[must_use]
    pub fn draw(rng: &mut Pcg64) -> Self {
        Self(std::array::from_fn(|_| rng.random_range(0.0..1.0)))
    }

    /// The n-th number, between two ends.
    fn between(&self, n: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0[n]
    }

    /// A bristle that is not there yet.
    #[must_use]
    pub fn bristle(&self) -> Bristle {
        Bristle {
            coulomb_nm: 0.0,
            static_ratio: 1.0,
            stribeck_speed: 1.0,
            stribeck_exponent: 2.0,
            loss_driving: 0.0,
            loss_driven: 0.0,
            presliding: self.between(0, 4e-3, 8e-3),
            elastic_share: self.between(1, 0.05, 0.6),
            micro_damping: self.between(2, 0.02, 0.3),
            patch: None,
        }
    }

    /// Puts an effect of a size into a world and its sensor. Size 1 is a few per cent of the stall torque, a volt, an
    /// ohm, 10 mrad, a millisecond: something that one would notice.
    pub fn apply(&self, effect: Effect, size: f64, world: &mut World, sensor: &mut Sensor) {
        let stall = world.rig.stall_torque();
        let mut add_bristle = |bristle: Bristle| {
            if world.bristle.is_none() { world.bristle = Some(bristle) } else { world.second_bristle = Some(bristle) }
        };
        match effect {
            Effect::CoulombFriction => add_bristle(Bristle { coulomb_nm: 0.02 * size * stall, ..self.bristle() }),
            Effect::StribeckFriction => add_bristle(Bristle {
                coulomb_nm: 0.02 * size * stall,
                static_ratio: self.between(3, 1.6, 2.5),
                stribeck_speed: self.between(4, 6.0, 25.0),
                stribeck_exponent: self.between(5, 1.4, 2.0),
                ..self.bristle()
            }),
            Effect::LoadFriction => {
                let loss_driving = 0.1 * size;
                add_bristle(Bristle {
                    loss_driving,
                    loss_driven: loss_driving * self.between(3, 1.08, 1.2),
                    ..self.bristle()
                });
            }
            Effect::GravityTilt => {
                world.gravity = Some(Gravity {
                    torque_nm: 0.03 * size * stall,
                    direction: self.between(3, -PI, PI),
                    second_share: self.between(4, 0.02, 0.05),
                    second_direction: self.between(5, -PI, PI),
                });
            }
            Effect::DriverDrop => {
                world.bridge = Some(Bridge {
                    transistors_v: size,
                    // The curve scales as a whole: a small drop that is as soft as a large one would be no drop.
                    knee_a: size * self.between(3, 2e-3, 5e-3),
                    transistor_ohm: size * self.between(4, 0.3, 0.9),
                    diode_v: size * self.between(5, 0.85, 1.1),
                    diode_log_v: size * self.between(6, 0.01, 0.03),
                    diode_ohm: size * self.between(4, 0.25, 0.8),
                });
            }
            Effect::BatterySag => {
                world.battery = Some(Battery {
                    series_ohm: size * self.between(3, 0.45, 0.6),
                    pair_ohm: [size * self.between(4, 0.10, 0.2), size * self.between(5, 0.3, 0.5)],
                    pair_s: [self.between(6, 0.03, 0.12), self.between(7, 0.8, 3.0)],
                });
            }
            Effect::SensorNonlinearity => {
                // Most in the first two harmonics, a tail that falls off as a bent element's does.
                let first = self.between(3, 0.5, 1.0);
                let amplitudes = [first, 1.3 - first, self.between(4, 0.03, 0.06), self.between(5, 0.015, 0.03), 0.01];
                let phase = |n: usize| TAU * (self.0[6] * (3 * n + 1) as f64 + self.0[7] * (n * n) as f64);
                sensor.harmonics =
                    amplitudes.iter().enumerate().map(|(n, a)| (0.010 * size * a, phase(n).rem_euclid(TAU))).collect();
            }
            Effect::SensorDelay => {
                sensor.delay = 1e-3 * size;
                sensor.delay_jitter = self.between(3, 1e-6, 4e-6);
            }
            Effect::TorqueRipple => {
                world.ripple = Some(Ripple {
                    torque_nm: 0.05 * size * stall,
                    per_turn: self.between(3, 5.0, 15.0).round(),
                    phase: self.between(4, -PI, PI),
                });
            }
            Effect::Backlash => world.two = Some(self.two(0.03 * size, 3000.0)),
            Effect::ShaftCompliance => world.two = Some(self.two(0.0, TAU * 15.0 / size.sqrt())),
            Effect::FrictionPatch => {
                let half_width = self.between(4, 0.3, 0.8);
                add_bristle(Bristle {
                    coulomb_nm: 0.05 * size * stall,
                    patch: Some(Patch { middle: self.between(3, -PI, PI), half_width, edge: 0.05 }),
                    ..self.bristle()
                });
            }
            Effect::WindingHeating => {
                world.heating = Some(Heating { kelvin_per_watt: 60.0 * size, time_s: self.between(3, 1.5, 5.0) });
            }
            Effect::SensorLag => world.sensor_lag_s = 8e-3 * size,
            Effect::QuadraticDrag => world.quadratic_drag = 0.05 * size * stall / world.rig.free_speed().powi(2),
            Effect::SensorHysteresis => sensor.hysteresis = 0.01 * size,
        }
        if matches!(effect, Effect::Backlash | Effect::ShaftCompliance)
            && let Some(two) = &mut world.two
        {
            // The natural frequency was given for a unit of inertia.
            let (load, rotor) = (two.load_share, 1.0 - two.load_share);
            let reduced = world.rig.inertia_kg_m2 * load * rotor;
            let natural = two.stiffness;
            two.stiffness = reduced * natural * natural;
            two.damping = 2.0 * self.between(4, 0.05, 0.2) * reduced * natural;
        }
    }

    /// Two inertias; `natural` (rad/s) stands in for the stiffness until the rig's inertia is known.
    fn two(&self, half_gap: f64, natural: f64) -> TwoInertias {
        TwoInertias {
            load_share: self.between(3, 0.25, 0.5),
            stiffness: natural,
            damping: 0.0,
            half_gap,
            load_drag_share: self.between(5, 0.2, 0.6),
        }
    }
}
