//! What no controller can run on, refused by name.
//!
//! A number that stands in [`TABLE`] has its range there and nowhere else, and is named and reported as robot.toml has it.
//! Here are the ranges of what comes out of a design, and what must hold between numbers.

use core::f32::consts::TAU;

use super::table::{TABLE, find};
use super::{Bridge, Estimator, Motor, Parameters, Transition};
use crate::error::ParameterError;

/// Relative error that a number may have picked up between robot.toml's unit and the controller's, in f32 or in f64.
pub(super) const ROUNDING: f32 = 4.0 * f32::EPSILON;

pub(super) fn within(name: &'static str, value: f32, low: f32, high: f32) -> Result<(), ParameterError> {
    if !value.is_finite() {
        Err(ParameterError::NonFinite { name })
    } else if value < low || value > high {
        Err(ParameterError::OutOfRange { name, value, low, high })
    } else {
        Ok(())
    }
}

fn positive(name: &'static str, value: f32, high: f32) -> Result<(), ParameterError> {
    if !value.is_finite() {
        Err(ParameterError::NonFinite { name })
    } else if value <= 0.0 {
        Err(ParameterError::NonPositive { name, value })
    } else if value > high {
        Err(ParameterError::OutOfRange { name, value, low: 0.0, high })
    } else {
        Ok(())
    }
}

/// Between two numbers of the table, in the unit of the named one.
fn at_least(name: &'static str, value: f32, least: f32) -> Result<(), ParameterError> {
    if value < least - ROUNDING * least.abs() { Err(too_low(name, value, least)) } else { Ok(()) }
}

fn too_low(name: &'static str, value: f32, low: f32) -> ParameterError {
    let high = find(name).and_then(|index| TABLE.get(usize::from(index))).map_or(f32::MAX, |entry| entry.high);
    ParameterError::OutOfRange { name, value, low, high }
}

impl Parameters {
    /// Refuses what no controller can run on.
    ///
    /// # Errors
    /// The first parameter that is not finite, not positive, out of its range or contradicts another, by name.
    pub fn check(&self) -> Result<(), ParameterError> {
        within("tick", self.tick, 1e-4, 1e-2)?;
        self.motor.check()?;
        self.transition.check()?;
        self.bridge.check()?;
        within("battery.volt_per_code", self.battery.volt_per_code, 0.0, 1.0)?;
        within("battery.volt_at_zero", self.battery.volt_at_zero, -10.0, 10.0)?;
        self.sensor.check()?;
        if let Some(second) = &self.second {
            second.check()?;
        }
        self.estimator.check()?;
        within("speed.angle_gain", self.speed.angle_gain, 0.0, 1e4)?;
        within("speed.speed_gain", self.speed.speed_gain, 0.0, 1e4)?;
        within("speed.current_gain", self.speed.current_gain, -1e4, 1e4)?;
        positive("speed.phase_reset_error", self.speed.phase_reset_error, 3.0)?;
        within("speed.saturation_hold", self.speed.saturation_hold, 0.0, self.speed.phase_reset_error)?;
        for entry in TABLE {
            entry.check(self)?;
        }
        self.check_together()
    }

    /// Every number is in its own range.
    fn check_together(&self) -> Result<(), ParameterError> {
        let (supervisor, limits) = (&self.supervisor, &self.limits);
        // A fault that persists must be able to end within its bound.
        at_least("controller.supervisor.stall_bound_s", supervisor.stall.bound, supervisor.stall.persistence)?;
        at_least("controller.supervisor.runaway_bound_s", supervisor.runaway.bound, supervisor.runaway.persistence)?;
        let (open, shorted, frozen) = (&supervisor.sensor_open, &supervisor.sensor_shorted, &supervisor.sensor_frozen);
        at_least("controller.supervisor.open_bound_s", open.bound, open.persistence)?;
        at_least("controller.supervisor.shorted_bound_s", shorted.bound, shorted.persistence)?;
        at_least("controller.supervisor.frozen_bound_s", frozen.bound, frozen.persistence)?;
        let (supply, command) = (&supervisor.supply_low, &supervisor.command_old);
        at_least("controller.supervisor.supply_bound_s", supply.bound, supply.persistence)?;
        at_least("controller.supervisor.command_age_s", command.limit, supervisor.slow_after)?;
        at_least("controller.supervisor.command_bound_s", command.bound, command.limit + command.persistence)?;
        at_least("controller.supervisor.clock_bound_s", supervisor.clock.bound, supervisor.clock.persistence)?;
        let (starved, overheated) = (&supervisor.loop_starved, &supervisor.overheated);
        at_least("controller.supervisor.starved_bound_s", starved.bound, starved.limit + starved.persistence)?;
        at_least("controller.supervisor.heat_bound_s", overheated.bound, overheated.persistence)?;
        at_least("controller.supervisor.supply_high_v", supervisor.supply_high, supply.limit)?;
        at_least("controller.supervisor.rest_most_lsb", supervisor.rest_most, supervisor.rest_least)?;
        at_least("controller.limits.frequency_hz", limits.speed / TAU, limits.least_speed / TAU)?;
        within("effects.driver_drop.drop_v", self.bridge.drop, 0.0, self.bridge.rail)?;
        // What may be commanded must not count as running away.
        if supervisor.runaway.limit <= limits.speed {
            return Err(too_low("controller.supervisor.runaway_rad_per_s", supervisor.runaway.limit, limits.speed));
        }
        Ok(())
    }
}

impl Motor {
    fn check(&self) -> Result<(), ParameterError> {
        positive("motor.resistance", self.resistance, 1e4)?;
        positive("motor.torque_constant", self.torque_constant, 1e3)?;
        positive("motor.inertia", self.inertia, 1e3)?;
        within("motor.viscous", self.viscous, 0.0, 1e3)?;
        within("motor.drag", self.drag, 0.0, 1e3)?;
        within("motor.drag_limit", self.drag_limit, self.drag, 1e4)?;
        positive("motor.continuous_current", self.continuous_current, 1e3)?;
        positive("motor.thermal_time_constant", self.thermal_time_constant, 1e4)
    }
}

impl Transition {
    fn check(&self) -> Result<(), ParameterError> {
        positive("transition.angle_speed", self.angle_speed, 1.0)?;
        within("transition.angle_current", self.angle_current, -1e6, 1e6)?;
        within("transition.speed_speed", self.speed_speed, 0.0, 1.0)?;
        within("transition.speed_current", self.speed_current, -1e6, 1e6)?;
        within("transition.current_speed", self.current_speed, -1e6, 1e6)?;
        within("transition.current_current", self.current_current, -1.0, 1.0)?;
        within("transition.angle_voltage", self.angle_voltage, 0.0, 1e6)?;
        positive("transition.speed_voltage", self.speed_voltage, 1e6)?;
        within("transition.current_voltage", self.current_voltage, 0.0, 1e6)?;
        within("transition.angle_torque", self.angle_torque, 0.0, 1e9)?;
        positive("transition.speed_torque", self.speed_torque, 1e9)?;
        within("transition.current_torque", self.current_torque, -1e9, 1e9)
    }
}

impl Bridge {
    fn check(&self) -> Result<(), ParameterError> {
        positive("bridge.rail", self.rail, 100.0)?;
        within("bridge.rail_resistance", self.rail_resistance, 0.0, 100.0)?;
        within("bridge.dead_duty", self.dead_duty, 0.0, 0.5)?;
        positive("bridge.fade_current", self.fade_current, 100.0)
    }
}

impl Estimator {
    fn check(&self) -> Result<(), ParameterError> {
        positive("estimator.speed.reading", self.speed.reading, 3.2)?;
        positive("estimator.speed.drag", self.speed.drag, 1e3)?;
        positive("estimator.stroke.reading", self.stroke.reading, 3.2)?;
        positive("estimator.stroke.drag", self.stroke.drag, 1e3)?;
        positive("estimator.initial_drag", self.initial_drag, 1e3)
    }
}
