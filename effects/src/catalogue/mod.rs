//! The catalogue: one line an effect, `file::Type`. The order is that in which reports and documents list them, and in
//! which laws that follow one another act.

mod id;
mod list;

use crate::effect::{BridgeDrop, Coupling, Drag, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Spec};
use list::{Entry, acts};

pub use id::Id;

list::catalogue! {
    coulomb_friction::CoulombFriction,
    stribeck_friction::StribeckFriction,
    directional_friction::DirectionalFriction,
    load_friction::LoadFriction,
    friction_patch::FrictionPatch,
    quadratic_drag::QuadraticDrag,
    cubic_drag::CubicDrag,
    bias_torque::BiasTorque,
    gravity_tilt::GravityTilt,
    torque_ripple::TorqueRipple,
    shaft_compliance::ShaftCompliance,
    backlash::Backlash,
    winding_heating::WindingHeating,
    grease_warming::GreaseWarming,
    driver_drop::DriverDrop,
    driver_drop_by_command::DriverDropByCommand,
    driver_dead_time::DriverDeadTime,
    driver_deadband::DriverDeadband,
    command_latency::CommandLatency,
    battery_sag::BatterySag,
    battery_discharge::BatteryDischarge,
    sensor_nonlinearity::SensorNonlinearity,
    sensor_delay::SensorDelay,
    sensor_hysteresis::SensorHysteresis,
    sensor_lag::SensorLag,
    held_samples::HeldSamples,
    clock_drift::ClockDrift,
    foot_stribeck::FootStribeck,
    foot_anisotropy::FootAnisotropy,
    foot_load_friction::FootLoadFriction,
    foot_friction::FootFriction,
    foot_hertz_contact::FootHertzContact,
    ground_slope::GroundSlope,
    payload_offset::PayloadOffset,
    backbone_mismatch::BackboneMismatch,
    backbone_hardening::BackboneHardening,
}

/// Effects that have a name but no file yet: planned, and named so everywhere.
///
/// A blind arc that is wider than the file's (`blind_arc`) is no law of a rollout: it changes which readings count and not what is
/// predicted, so that models with and without it would be judged on different data. What finds it is an identification of the
/// potentiometer.
pub const PLANNED: &[&str] = &["blind_arc"];
