//! Fitted numbers in the robot file's own keys and units.

use std::collections::BTreeMap;

use description::robot::{Quantity, Robot};

use super::fit::Fit;
use super::library::{Effect, Free, Scale, Slot};
use super::verdict::FittedParameter;

/// Standard deviations to the ends of a 95 % interval.
const WIDE: f64 = 1.96;

/// What a value in SI and radians is multiplied with to get the file's unit.
fn unit(slot: Slot) -> f64 {
    match slot {
        Slot::Presliding | Slot::Cos1 | Slot::Sin1 | Slot::Cos2 | Slot::Sin2 => 1f64.to_degrees(),
        _ => 1.0,
    }
}

/// Tables and keys that a slot is written to, among the effects that a model has.
fn keys(slot: Slot) -> &'static [(Effect, &'static str)] {
    match slot {
        Slot::Coulomb => &[(Effect::Coulomb, "torque_nm"), (Effect::Stribeck, "torque_nm")],
        Slot::BreakawayExcess => &[(Effect::Stribeck, "breakaway_excess_nm")],
        Slot::StribeckSpeed => &[(Effect::Stribeck, "speed_rad_per_s")],
        Slot::LoadCoefficient => &[(Effect::Load, "coefficient")],
        Slot::Presliding => &[
            (Effect::Coulomb, "presliding_deg"),
            (Effect::Stribeck, "presliding_deg"),
            (Effect::Load, "presliding_deg"),
        ],
        Slot::DropVolts => &[(Effect::Drop, "drop_v")],
        Slot::DropSlope => &[(Effect::Drop, "slope_ohm")],
        Slot::SagOhm => &[(Effect::Sag, "resistance_ohm")],
        Slot::RelaxationOhm => &[(Effect::Sag, "relaxation_ohm")],
        Slot::RelaxationTime => &[(Effect::Sag, "relaxation_s")],
        Slot::Delay => &[(Effect::Delay, "delay_s")],
        Slot::Cos1 => &[(Effect::Nonlinearity, "cos1_deg")],
        Slot::Sin1 => &[(Effect::Nonlinearity, "sin1_deg")],
        Slot::Cos2 => &[(Effect::Nonlinearity, "cos2_deg")],
        Slot::Sin2 => &[(Effect::Nonlinearity, "sin2_deg")],
        _ => &[],
    }
}

/// Value and 95 % interval in SI and radians, inside the bounds.
fn range(free: &Free, coordinate: f64, deviation: f64) -> [f64; 3] {
    let at = |offset: f64| free.number(coordinate + offset * WIDE * deviation.min(1e3)).clamp(free.low, free.high);
    [free.number(coordinate), at(-1.0), at(1.0)]
}

/// Every fitted number of a model whose effects are the file's and `added`.
#[must_use]
pub fn fitted(robot: &Robot, fit: &Fit, added: &[Effect]) -> Vec<FittedParameter> {
    let mut out = Vec::new();
    for (i, free) in fit.free.iter().enumerate() {
        let value = range(free, fit.coordinates[i], fit.deviation(i));
        out.extend(motor(robot, free.slot, value));
        for (effect, key) in keys(free.slot) {
            if has(robot, *effect, added) {
                let path = format!("effects.{}.{key}", effect.name());
                out.push(parameter(robot, path, value.map(|value| value * unit(free.slot))));
            }
        }
        if free.slot == Slot::GravityCos {
            out.extend(gravity(robot, fit, i));
        }
        if free.slot == Slot::Deadband {
            out.push(parameter(robot, "effects.driver_deadband.width_duty".to_owned(), value));
        }
    }
    if has(robot, Effect::Drop, added) && robot.effects.driver_drop.is_none() {
        // In these data the drop's slope is a resistance like the winding's: it is in motor.resistance_ohm.
        out.push(parameter(robot, "effects.driver_drop.slope_ohm".to_owned(), [0.0; 3]));
    }
    out
}

/// Whether a model has an effect; Stribeck friction takes Coulomb friction's place.
fn has(robot: &Robot, effect: Effect, added: &[Effect]) -> bool {
    let effects = &robot.effects;
    let stribeck = effects.stribeck_friction.is_some() || added.contains(&Effect::Stribeck);
    match effect {
        Effect::Coulomb => !stribeck && (effects.coulomb_friction.is_some() || added.contains(&effect)),
        _ => added.contains(&effect) || effect.in_file(robot),
    }
}

fn motor(robot: &Robot, slot: Slot, value: [f64; 3]) -> Vec<FittedParameter> {
    let one = |path: &str, factor: f64| parameter(robot, path.to_owned(), value.map(|value| value * factor));
    match slot {
        Slot::Resistance => vec![one("motor.resistance_ohm", 1.0)],
        Slot::TorqueConstant => vec![one("motor.torque_constant_nm_per_a", 1.0)],
        Slot::Viscous => vec![one("motor.viscous_nm_s_per_rad", 1.0)],
        Slot::Inertia => {
            // Angle and drive show the sum only: rotor and load keep their proportion, but for a load that its eccentric gives.
            let (rotor, load) = (robot.motor.rotor_inertia_kg_m2.value, robot.load.inertia_kg_m2.value);
            if robot.eccentric.is_some() {
                let rotor = value.map(|value| value - load);
                return vec![parameter(robot, "motor.rotor_inertia_kg_m2".to_owned(), rotor)];
            }
            let mut both = vec![one("motor.rotor_inertia_kg_m2", rotor / (rotor + load))];
            if load > 0.0 {
                both.push(one("load.inertia_kg_m2", load / (rotor + load)));
            }
            both
        }
        _ => Vec::new(),
    }
}

/// Torque and direction of gravity from the two components that the fit moves.
fn gravity(robot: &Robot, fit: &Fit, cos: usize) -> Vec<FittedParameter> {
    let Some(sin) = fit.free.iter().position(|free| free.slot == Slot::GravitySin) else { return Vec::new() };
    let unit = |i: usize| if let Scale::Linear(unit) = fit.free[i].scale { unit } else { 1.0 };
    let (x, y) = (fit.free[cos].number(fit.coordinates[cos]), fit.free[sin].number(fit.coordinates[sin]));
    let torque = x.hypot(y).max(f64::MIN_POSITIVE);
    let covariance = |i: usize, j: usize| fit.covariance[(i, j)] * unit(i) * unit(j);
    let (xx, yy, xy) = (covariance(cos, cos), covariance(sin, sin), covariance(cos, sin));
    let along = ((x * x * xx + y * y * yy + 2.0 * x * y * xy) / (torque * torque)).max(0.0).sqrt();
    let across = ((y * y * xx + x * x * yy - 2.0 * x * y * xy) / torque.powi(4)).max(0.0).sqrt().min(1.6);
    let direction = y.atan2(x).to_degrees();
    let across = (WIDE * across).to_degrees();
    vec![
        parameter(
            robot,
            "effects.gravity_tilt.torque_nm".to_owned(),
            [torque, (torque - WIDE * along).max(0.0), torque + WIDE * along],
        ),
        parameter(
            robot,
            "effects.gravity_tilt.direction_deg".to_owned(),
            [direction, direction - across, direction + across],
        ),
    ]
}

fn parameter(robot: &Robot, path: String, [value, low, high]: [f64; 3]) -> FittedParameter {
    let file_value = quantity(robot, &path).map(|quantity| quantity.value);
    FittedParameter { path, value, low, high, file_value }
}

/// The file's quantity at a dotted path.
fn quantity<'a>(robot: &'a Robot, path: &str) -> Option<&'a Quantity> {
    let (motor, effects) = (&robot.motor, &robot.effects);
    match path {
        "motor.resistance_ohm" => Some(&motor.resistance_ohm),
        "motor.torque_constant_nm_per_a" => Some(&motor.torque_constant_nm_per_a),
        "motor.viscous_nm_s_per_rad" => Some(&motor.viscous_nm_s_per_rad),
        "motor.rotor_inertia_kg_m2" => Some(&motor.rotor_inertia_kg_m2),
        "load.inertia_kg_m2" => Some(&robot.load.inertia_kg_m2),
        _ => {
            let (table, key) = path.strip_prefix("effects.")?.split_once('.')?;
            match table {
                "coulomb_friction" => effects.coulomb_friction.as_ref().and_then(|it| match key {
                    "torque_nm" => Some(&it.torque_nm),
                    "presliding_deg" => Some(&it.presliding_deg),
                    _ => None,
                }),
                "stribeck_friction" => effects.stribeck_friction.as_ref().and_then(|it| match key {
                    "torque_nm" => Some(&it.torque_nm),
                    "breakaway_excess_nm" => Some(&it.breakaway_excess_nm),
                    "speed_rad_per_s" => Some(&it.speed_rad_per_s),
                    "presliding_deg" => Some(&it.presliding_deg),
                    _ => None,
                }),
                "load_friction" => effects.load_friction.as_ref().and_then(|it| match key {
                    "coefficient" => Some(&it.coefficient),
                    "presliding_deg" => Some(&it.presliding_deg),
                    _ => None,
                }),
                "gravity_tilt" => effects.gravity_tilt.as_ref().and_then(|it| match key {
                    "torque_nm" => Some(&it.torque_nm),
                    "direction_deg" => Some(&it.direction_deg),
                    _ => None,
                }),
                "driver_drop" => effects.driver_drop.as_ref().and_then(|it| match key {
                    "drop_v" => Some(&it.drop_v),
                    "slope_ohm" => Some(&it.slope_ohm),
                    _ => None,
                }),
                "driver_deadband" => effects.driver_deadband.as_ref().map(|it| &it.width_duty),
                "battery_sag" => effects.battery_sag.as_ref().and_then(|it| match key {
                    "resistance_ohm" => Some(&it.resistance_ohm),
                    "relaxation_ohm" => Some(&it.relaxation_ohm),
                    "relaxation_s" => Some(&it.relaxation_s),
                    _ => None,
                }),
                "sensor_nonlinearity" => effects.sensor_nonlinearity.as_ref().and_then(|it| match key {
                    "cos1_deg" => Some(&it.cos1_deg),
                    "sin1_deg" => Some(&it.sin1_deg),
                    "cos2_deg" => Some(&it.cos2_deg),
                    "sin2_deg" => Some(&it.sin2_deg),
                    _ => None,
                }),
                "sensor_delay" => effects.sensor_delay.as_ref().map(|it| &it.delay_s),
                _ => None,
            }
        }
    }
}

/// The parameters of one effect for the JSON: key without its table, `[value, low, high]`.
#[must_use]
pub fn of_effect(parameters: &[FittedParameter], effect: Effect) -> BTreeMap<String, [f64; 3]> {
    let prefix = format!("effects.{}.", effect.name());
    parameters
        .iter()
        .filter_map(|one| one.path.strip_prefix(&prefix).map(|key| (key.to_owned(), [one.value, one.low, one.high])))
        .collect()
}
