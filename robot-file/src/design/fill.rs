//! Everything that the controller runs on, from the file and the gains.

use std::f64::consts::TAU;

use control::Parameters;
use control::parameters::{
    Acquisition, AngleSource, Battery, BlindArcHandling, Bridge, Estimator, Limits, Motor, Oscillator, Position, Speed,
    SpeedLaw, Supervisor, Transition, Tuning,
};

use effects::BatterySag;

use super::model::{Discrete, MotorValues};
use super::numbers::Numbers;
use super::{DesignError, deadband, drop, reading_age, sensor};
use crate::angle_code::battery_curve;
use crate::robot::{Robot, Sensor};

/// Share of the tolerated phase error that is kept through a momentary saturation.
const SATURATION_HOLD_SHARE: f64 = 0.4;

pub(super) fn parameters(
    robot: &Robot,
    numbers: &Numbers<'_>,
    values: &MotorValues,
    discrete: &Discrete,
    gain: [f64; 3],
) -> Result<Parameters, DesignError> {
    let motor = motor(robot, numbers, values)?;
    let edge_margin = numbers.angle("estimator.edge_margin_deg")?;
    Ok(Parameters {
        tick: discrete.period as f32,
        motor,
        transition: transition(discrete),
        bridge: bridge(robot, numbers)?,
        battery: battery(robot),
        sensor: sensor::map(&robot.sensor, edge_margin)?,
        second: sensor::second(
            &robot.sensor,
            edge_margin,
            [numbers.positive("estimator.reading_deg")?, numbers.positive("estimator.reading_calibrated_deg")?],
        )?,
        estimator: estimator(robot, numbers, values)?,
        acquisition: Acquisition {
            samples: numbers.count("estimator.acquire_samples", 6, 16)?,
            residual: numbers.positive_angle("estimator.acquire_residual_deg")? as f32,
            least_speed: numbers.positive("estimator.acquire_least_rad_per_s")? as f32,
            speed: numbers.positive("estimator.acquire_rad_per_s")? as f32,
            patience: numbers.positive("estimator.acquire_patience_s")? as f32,
        },
        speed: Speed {
            angle_gain: gain[0] as f32,
            speed_gain: gain[1] as f32,
            current_gain: gain[2] as f32,
            law: SpeedLaw::Refined,
            phase_reset_error: numbers.positive_angle("lqg.anchor_deg")? as f32,
            // Part of what Bryson's rule tolerates anyway.
            saturation_hold: (SATURATION_HOLD_SHARE * numbers.positive_angle("lqg.phase_deg")?)
                .min(numbers.angle("lqg.anchor_deg")?) as f32,
        },
        position: position(numbers)?,
        oscillator: Oscillator {
            brake_share: numbers.within("oscillator.brake_share", 0.05, 1.0)? as f32,
            proportional: numbers.positive("oscillator.proportional_v_per_rad")? as f32,
            switch_margin: numbers.angle("oscillator.switch_margin_deg")? as f32,
        },
        supervisor: supervisor(numbers)?,
        limits: Limits {
            speed: (TAU * numbers.positive("limits.frequency_hz")?) as f32,
            least_speed: (TAU * numbers.within("limits.least_frequency_hz", 0.0, 100.0)?) as f32,
            least_stroke: numbers.positive_angle("limits.least_stroke_deg")? as f32,
        },
    })
}

/// Torque at standstill with the whole rail, N·m: the scale of drags where the file expects none.
fn stall_torque(robot: &Robot, values: &MotorValues) -> f64 {
    robot.supply.rail_v.value * values.torque_per_volt()
}

fn motor(robot: &Robot, numbers: &Numbers<'_>, values: &MotorValues) -> Result<Motor, DesignError> {
    let share = numbers.within("estimator.drag_limit_share", 1.0, 100.0)?;
    Ok(Motor {
        resistance: values.resistance as f32,
        torque_constant: values.torque_constant as f32,
        inertia: values.inertia as f32,
        viscous: values.viscous as f32,
        drag: values.drag as f32,
        drag_limit: (share * values.drag).max(0.25 * stall_torque(robot, values)) as f32,
        continuous_current: robot.motor.continuous_current_a.value as f32,
        thermal_time_constant: robot.motor.thermal_time_constant_s.value as f32,
    })
}

fn transition(discrete: &Discrete) -> Transition {
    let phi = |row: usize, column: usize| discrete.phi[(row, column)] as f32;
    Transition {
        angle_speed: phi(0, 1),
        angle_current: phi(0, 2),
        speed_speed: phi(1, 1),
        speed_current: phi(1, 2),
        current_speed: phi(2, 1),
        current_current: phi(2, 2),
        angle_voltage: discrete.gamma[0] as f32,
        speed_voltage: discrete.gamma[1] as f32,
        current_voltage: discrete.gamma[2] as f32,
        angle_torque: discrete.eta[0] as f32,
        speed_torque: discrete.eta[1] as f32,
        current_torque: discrete.eta[2] as f32,
    }
}

fn bridge(robot: &Robot, numbers: &Numbers<'_>) -> Result<Bridge, DesignError> {
    let effects = &robot.effects;
    let driver = &robot.driver;
    Ok(Bridge {
        rail: robot.supply.rail_v.value as f32,
        rail_resistance: effects.get::<BatterySag>().map_or(0.0, |sag| sag.resistance_ohm + sag.relaxation_ohm) as f32,
        drop: drop(robot) as f32,
        dead_duty: (driver.dead_time_s.value * driver.pwm_frequency_hz.value) as f32,
        deadband: deadband(robot) as f32,
        fade_current: numbers.positive("lqg.fade_a")? as f32,
    })
}

fn battery(robot: &Robot) -> Battery {
    let Some(cell) = &robot.supply.battery else {
        return Battery { volt_per_code: 0.0, volt_at_zero: 0.0 };
    };
    let curve = battery_curve(&robot.sensor);
    let divider = cell.divider.value;
    // The divider keeps the cell in the converter's straight part.
    Battery {
        volt_per_code: (1.0 / (curve.codes_per_v * divider)) as f32,
        volt_at_zero: (curve.low_v / divider) as f32,
    }
}

fn estimator(robot: &Robot, numbers: &Numbers<'_>, values: &MotorValues) -> Result<Estimator, DesignError> {
    let calibrated = match &robot.sensor {
        Sensor::Potentiometer(potentiometer) => potentiometer.correction.is_some(),
        Sensor::Ideal | Sensor::Encoder(_) => true,
    };
    let tuning = |group: &str| -> Result<Tuning, DesignError> {
        let reading = if calibrated { "reading_calibrated_deg" } else { "reading_deg" };
        Ok(Tuning {
            reading: numbers.positive_angle(&format!("estimator.{group}{reading}"))? as f32,
            speed: numbers.positive(&format!("estimator.{group}speed_rad_per_s"))? as f32,
            drag: (numbers.positive(&format!("estimator.{group}drag_share"))? * stall_torque(robot, values)) as f32,
        })
    };
    let drag_scale = values.drag.max(0.1 * stall_torque(robot, values));
    Ok(Estimator {
        speed: tuning("")?,
        stroke: tuning("stroke_")?,
        blind_reading: numbers.positive_angle("estimator.blind_reading_deg")? as f32,
        gate: numbers.positive("estimator.gate_sigma")? as f32,
        rejected_limit: numbers.count("estimator.rejected_limit", 2, 10_000)?,
        handling: BlindArcHandling::Full,
        initial_angle: numbers.positive_angle("estimator.initial_angle_deg")? as f32,
        initial_speed: numbers.positive("estimator.initial_rad_per_s")? as f32,
        initial_drag: (numbers.positive("estimator.initial_drag_share")? * drag_scale) as f32,
        sensor_persistence: numbers.positive("estimator.sensor_persistence_s")? as f32,
        reading_age: reading_age(robot) as f32,
    })
}

fn position(numbers: &Numbers<'_>) -> Result<Position, DesignError> {
    Ok(Position {
        proportional: numbers.positive("position.proportional_v_per_rad")? as f32,
        integral: numbers.within("position.integral_v_per_rad_s", 0.0, 1e6)? as f32,
        derivative: numbers.within("position.derivative_v_s_per_rad", 0.0, 1e4)? as f32,
        average: numbers.count("position.average_samples", 1, 16)?,
        tolerance: numbers.angle("position.tolerance_deg")? as f32,
        drag_share: numbers.within("position.drag_share", 0.0, 2.0)? as f32,
        source: AngleSource::Estimate,
    })
}

fn supervisor(numbers: &Numbers<'_>) -> Result<Supervisor, DesignError> {
    Ok(Supervisor {
        stall: numbers.fault_limit("stall_rad_per_s", "stall")?,
        stall_window: numbers.positive_angle("supervisor.stall_window_deg")? as f32,
        runaway: numbers.fault_limit("runaway_rad_per_s", "runaway")?,
        sensor_open: numbers.fault_limit("open_rad_per_s", "open")?,
        sensor_shorted: numbers.fault_limit("shorted_rad_per_s", "shorted")?,
        sensor_frozen: numbers.fault_limit("frozen_lsb", "frozen")?,
        supply_low: numbers.fault_limit("supply_v", "supply")?,
        supply_high: numbers.within("supervisor.supply_high_v", 0.0, 60.0)? as f32,
        slow_after: numbers.within("supervisor.link_slow_s", 0.0, 10.0)? as f32,
        command_old: numbers.fault_limit("command_age_s", "command")?,
        clock: numbers.fault_limit("clock_gap_s", "clock")?,
        loop_starved: numbers.fault_limit("starved_s", "starved")?,
        starved_share: numbers.within("supervisor.starved_share", 0.0, 1.0)? as f32,
        overheated: numbers.fault_limit("heat_share", "heat")?,
        driven_duty: numbers.within("supervisor.driven_duty", 0.0, 1.0)? as f32,
        driven_current: numbers.positive("supervisor.driven_a")? as f32,
        rest_least: numbers.within("supervisor.rest_least_lsb", 0.0, 100.0)? as f32,
        rest_most: numbers.within("supervisor.rest_most_lsb", 0.0, 120.0)? as f32,
    })
}
