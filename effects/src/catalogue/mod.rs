//! The catalogue: one line an effect, `file::Type`. The order is that in which reports and documents list them, and in
//! which laws that follow one another act.

mod id;
mod list;

use crate::effect::{BridgeDrop, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::Spec;
use list::Entry;

pub use id::Id;

list::catalogue! {
    coulomb_friction::CoulombFriction,
    stribeck_friction::StribeckFriction,
    load_friction::LoadFriction,
    gravity_tilt::GravityTilt,
    driver_drop::DriverDrop,
    driver_deadband::DriverDeadband,
    battery_sag::BatterySag,
    sensor_nonlinearity::SensorNonlinearity,
    sensor_delay::SensorDelay,
    foot_stribeck::FootStribeck,
    foot_anisotropy::FootAnisotropy,
    foot_load_friction::FootLoadFriction,
    ground_slope::GroundSlope,
}

/// Effects that have a name but no file yet: planned, and named so everywhere.
pub const PLANNED: &[&str] = &[
    "torque_ripple",
    "backlash",
    "winding_heating",
    "grease_warming",
    "sensor_lag",
    "blind_arc",
    "shaft_compliance",
    "payload_offset",
    "backbone_hardening",
    "backbone_mismatch",
];
