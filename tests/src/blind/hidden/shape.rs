//! Everything about a hidden effect but its size.

use rand::RngExt;
use rand_pcg::Pcg64;

use super::{Effect, electrical, friction, sensor, shaft};
use crate::blind::laws::{Bristle, Weakening};
use crate::blind::sensing::Sensor;
use crate::blind::world::World;

/// Which of an effect's two laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// The one.
    First,
    /// The other.
    Second,
}

/// Shares in 0 … 1 drawn once, read by whichever effect it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// The shares.
    pub shares: [f64; 8],
    /// Which law the effect has.
    pub law: Law,
}

impl Shape {
    /// Draws a shape, of the first law.
    #[must_use]
    pub fn draw(rng: &mut Pcg64) -> Self {
        Self { shares: std::array::from_fn(|_| rng.random_range(0.0..1.0)), law: Law::First }
    }

    /// The n-th number, between two ends.
    pub(super) fn between(&self, n: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.shares[n]
    }

    /// One of two by the law.
    pub(super) fn either<T>(&self, first: T, second: T) -> T {
        match self.law {
            Law::First => first,
            Law::Second => second,
        }
    }

    /// A bristle that is not there yet.
    #[must_use]
    pub fn bristle(&self) -> Bristle {
        Bristle {
            coulomb_nm: 0.0,
            static_ratio: 1.0,
            stribeck_speed: 1.0,
            weakening: Weakening::Exponential(2.0),
            loss_driving: 0.0,
            loss_driven: 0.0,
            loss_power: 1.0,
            loss_reference_nm: 1.0,
            presliding: self.between(0, 4e-3, 8e-3),
            elastic_share: self.between(1, 0.05, 0.6),
            micro_damping: self.between(2, 0.02, 0.3),
            remembers_load: false,
            lean: 0.0,
            patch: None,
        }
    }

    /// Puts an effect of a size into a world and its sensor. Size 1 is a few per cent of the stall torque, a volt, an
    /// ohm, 10 mrad, a millisecond: something that one would notice.
    pub fn apply(&self, effect: Effect, size: f64, world: &mut World, sensor: &mut Sensor) {
        match effect {
            Effect::CoulombFriction
            | Effect::StribeckFriction
            | Effect::LoadFriction
            | Effect::DirectionalFriction
            | Effect::FrictionPatch
            | Effect::GearMesh
            | Effect::StickingTooth
            | Effect::RememberedLoad => friction::apply(self, effect, size, world),
            Effect::GravityTilt
            | Effect::BiasTorque
            | Effect::TorqueRipple
            | Effect::Backlash
            | Effect::ShaftCompliance
            | Effect::QuadraticDrag
            | Effect::CubicDrag
            | Effect::GreaseWarming => shaft::apply(self, effect, size, world),
            Effect::DriverDrop
            | Effect::DriverDropByCommand
            | Effect::DriverDeadband
            | Effect::DriverDeadTime
            | Effect::BatterySag
            | Effect::BatteryDischarge
            | Effect::WindingHeating
            | Effect::CommandLatency
            | Effect::SupplyClip => electrical::apply(self, effect, size, world),
            Effect::SensorNonlinearity
            | Effect::SensorDelay
            | Effect::SensorLag
            | Effect::SensorHysteresis
            | Effect::HeldSamples
            | Effect::ClockDrift
            | Effect::EncoderSkip
            | Effect::BeltCreep => sensor::apply(self, effect, size, world, sensor),
        }
    }
}
