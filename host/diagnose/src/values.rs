//! Fitted numbers in the robot file's own keys and units.

use std::collections::BTreeMap;

use common::wrap;
use effects::{Id, Scale};
use robot_file::robot::{Quantity, Robot};

use super::fit::{Fit, WIDE};
use super::nominal::FileModel;
use super::numbers::Number;
use super::screen::{Direction, Screen, Screened};
use super::verdict::{FittedParameter, Limit};

/// Value and 95 % interval of a number of a fit in SI and radians, inside the bounds; `shapes` are the places of the others of its
/// effect that say how it looks.
fn range(fit: &Fit, i: usize, shapes: &[usize]) -> [f64; 3] {
    let (free, at) = (&fit.free[i], fit.coordinates[i]);
    let slopes: Vec<(usize, f64)> = vec![(i, 1.0)];
    let [low, high] = match free.scale {
        Scale::Linear(_) if free.follows_scale != 0.0 => in_ratio(fit, at, &slopes),
        _ => None,
    }
    .or_else(|| in_ratio_with_its_shape(fit, i, shapes))
    .unwrap_or_else(|| [-1.0, 1.0].map(|side| at + side * WIDE * fit.deviation(i).min(1e3)));
    let inside = |coordinate: f64| free.number(coordinate).clamp(free.low, free.high);
    [free.number(at), inside(low), inside(high)]
}

/// The interval of a size that is there beyond doubt in the fitted shape, and uncertain only because another shape of another size
/// does as well: in ratio, for zero is none of them.
fn in_ratio_with_its_shape(fit: &Fit, i: usize, shapes: &[usize]) -> Option<[f64; 2]> {
    let (value, deviation) = (fit.coordinates[i], fit.deviation(i));
    let doubtful = fit.free[i].is_size() && value.abs() <= WIDE * deviation;
    (doubtful && fit.is_apart_from_zero(i, shapes)).then(|| {
        let factor = (WIDE * deviation / value.abs()).min(20.0).exp();
        let ends = [value / factor, value * factor];
        if value > 0.0 { ends } else { [ends[1], ends[0]] }
    })
}

/// The 95 % interval of a value that changes so with coordinates of a fit, where it is known but for the scale of torques: in ratio,
/// as the resistance is whose range that scale hangs on.
fn in_ratio(fit: &Fit, value: f64, slopes: &[(usize, f64)]) -> Option<[f64; 2]> {
    let resistance = fit.free.iter().position(|one| one.number == Number::Resistance)?;
    let with_resistance: f64 = slopes.iter().map(|(i, slope)| slope * fit.covariance[(*i, resistance)]).sum();
    let shared = with_resistance.powi(2) / fit.covariance[(resistance, resistance)];
    let variance = variance(fit, slopes);
    let at_scale = (variance - shared).max(0.0);
    if !(shared > at_scale && value.powi(2) > WIDE.powi(2) * at_scale) {
        return None;
    }
    let factor = (WIDE * variance.sqrt() / value.abs()).exp();
    Some(if value > 0.0 { [value / factor, value * factor] } else { [value * factor, value / factor] })
}

/// Of a value that changes so with coordinates of a fit.
fn variance(fit: &Fit, slopes: &[(usize, f64)]) -> f64 {
    let with = |&(i, at_i): &(usize, f64)| -> f64 {
        slopes.iter().map(|&(j, at_j)| at_i * fit.covariance[(i, j)] * at_j).sum()
    };
    slopes.iter().map(with).sum::<f64>().max(0.0)
}

/// Every fitted number of a model, in the file's keys and units.
#[must_use]
pub fn fitted(robot: &Robot, model: &FileModel, fit: &Fit) -> Vec<FittedParameter> {
    let mut out = Vec::new();
    for (i, free) in fit.free.iter().enumerate() {
        out.extend(motor(robot, free.number, range(fit, i, &[])));
    }
    for (id, values) in model.values(&fit.effects, |number| fit.value(number)) {
        out.extend(of_table(robot, model, fit, id, &values));
    }
    out
}

/// The parameters of one effect's table.
fn of_table(robot: &Robot, model: &FileModel, fit: &Fit, id: Id, values: &[f64]) -> Vec<FittedParameter> {
    let added = fit.effects.contains(&id);
    id.spec()
        .parameters
        .iter()
        .enumerate()
        .filter_map(|(place, key)| {
            let path = format!("effects.{}.{}", id.name(), key.key);
            let interval = interval(model, fit, id, place, values[place]);
            // What neither the fit moves nor an added effect brings stays the file's.
            let [value, low, high] = if added { interval.unwrap_or([values[place]; 3]) } else { interval? };
            Some(parameter(robot, path, [value, low, high].map(|value| key.from_si(value))))
        })
        .collect()
}

/// Value and 95 % interval of a parameter, SI units and radians; `None` where no number of the fit moves it. A parameter that
/// is a number of the fit keeps the number's own scale and bounds; one that several make (a torque and its direction) has
/// their covariance carried over in first order.
fn interval(model: &FileModel, fit: &Fit, id: Id, place: usize, value: f64) -> Option<[f64; 3]> {
    let own: Vec<usize> = model.numbers_of(id, fit);
    let slopes: Vec<f64> = own.iter().map(|&i| slope(model, fit, id, place, i)).collect();
    let shapes: Vec<usize> = own.iter().copied().filter(|&i| !fit.free[i].is_size()).collect();
    let moving: Vec<(usize, f64)> = own.into_iter().zip(slopes).filter(|(_, slope)| *slope != 0.0).collect();
    match moving.as_slice() {
        [] => None,
        &[(i, _)] if fit.value(fit.free[i].number) == Some(value) => Some(range(fit, i, &shapes)),
        several => {
            let key = &id.spec().parameters[place];
            let follows = several.iter().any(|(i, _)| fit.free[*i].follows_scale != 0.0);
            if follows
                && !key.in_degrees()
                && let Some([low, high]) = in_ratio(fit, value, several)
            {
                return Some([value, low, high]);
            }
            // Beyond half a turn either way an angle is unknown.
            let most = if key.in_degrees() { 1.6 } else { f64::INFINITY };
            let half = WIDE * variance(fit, several).sqrt().min(most);
            let least = if key.in_degrees() { f64::NEG_INFINITY } else { key.to_si(key.low) };
            Some([value, (value - half).max(least), value + half])
        }
    }
}

/// How a parameter changes with a coordinate of the fit.
fn slope(model: &FileModel, fit: &Fit, id: Id, place: usize, i: usize) -> f64 {
    const STEP: f64 = 1e-4;
    let at = |offset: f64| {
        let value = |number| {
            let j = fit.free.iter().position(|one| one.number == number)?;
            Some(fit.free[j].number(fit.coordinates[j] + if i == j { offset } else { 0.0 }))
        };
        model.values(&fit.effects, value).get(&id).map_or(0.0, |values| values[place])
    };
    let change = at(STEP) - at(-STEP);
    // An angle may pass ±π in between.
    let change = if id.spec().parameters[place].in_degrees() { wrap(change) } else { change };
    change / (2.0 * STEP)
}

/// How large each effect may be that a screen of a model has not found.
#[must_use]
pub fn limits(model: &FileModel, screen: &Screen, named: &[Id]) -> Vec<Limit> {
    let mut limits: Vec<Limit> = Vec::new();
    for one in &screen.directions {
        let Direction::Effect(id, _) = one.direction else { continue };
        let limit = limit(model, id, one);
        match limits.iter_mut().find(|known| known.effect == limit.effect) {
            _ if named.iter().any(|named| *named == id || named.contains(id)) => {}
            // Of two shapes, what the less visible one allows.
            Some(known) => {
                for (key, other) in limit.at_most {
                    let larger = |at_most: &mut Option<f64>| *at_most = at_most.zip(other).map(|(a, b)| a.max(b));
                    known.at_most.entry(key).and_modify(larger).or_insert(other);
                }
                known.chance = known.chance.min(limit.chance);
                known.would_show &= limit.would_show;
            }
            None => limits.push(limit),
        }
    }
    limits
}

fn limit(model: &FileModel, id: Id, screened: &Screened) -> Limit {
    let free = model.with(&[id], 0);
    let of = |number: Number| free.iter().find(|one| one.number == number);
    // `negative` of those that may be.
    let at = |share: f64, negative: f64| {
        let value = |number| {
            let (_, limit) = screened.limits.iter().find(|(one, _)| *one == number)?;
            let one = of(number)?;
            let sign = if one.low < 0.0 { negative } else { 1.0 };
            Some(one.number(sign * share * limit.min(1e9)))
        };
        model.values(&[id], value).remove(&id).unwrap_or_default()
    };
    let absent = at(0.0, 1.0);
    let ends = id.spec().parameters.iter().zip(at(1.0, 1.0).into_iter().zip(at(1.0, -1.0)));
    // An angle is another one there, not a larger one.
    let largest: Vec<f64> = ends
        .map(|(key, (plus, minus))| if key.in_degrees() || plus.abs() >= minus.abs() { plus } else { minus })
        .collect();
    let unknown = screened.limits.iter().any(|(_, limit)| !limit.is_finite());
    let keys = id.spec().parameters.iter().zip(absent.iter().zip(&largest));
    let at_most = keys
        .filter(|(key, (absent, largest))| absent != largest && !(key.in_degrees() && key.key.contains("direction")))
        .map(|(key, (_, largest))| (key.key.to_owned(), (!unknown).then(|| key.from_si(largest.abs()))))
        .collect();
    let usual = |number: Number| of(number).map_or(0.0, |one| one.coordinate(one.start.abs().max(one.number(1.0))));
    Limit {
        effect: id.name().to_owned(),
        at_most,
        chance: screened.family_chance,
        would_show: screened.dose.is_none_or(|dose| dose <= 1.0)
            && screened.limits.iter().all(|(number, limit)| *limit <= usual(*number)),
    }
}

fn motor(robot: &Robot, number: Number, value: [f64; 3]) -> Vec<FittedParameter> {
    let one = |path: &str, factor: f64| parameter(robot, path.to_owned(), value.map(|value| value * factor));
    match number {
        Number::Resistance => vec![one("motor.resistance_ohm", 1.0)],
        Number::TorqueConstant => vec![one("motor.torque_constant_nm_per_a", 1.0)],
        Number::Viscous => vec![one("motor.viscous_nm_s_per_rad", 1.0)],
        Number::Inertia => {
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
        Number::WindingTime | Number::OfEffect(_) | Number::OfConverter(_) | Number::OfCurve(_) => Vec::new(),
    }
}

/// A number by its path in the robot file, with what the file says: value and interval in the unit of its key.
pub fn parameter(robot: &Robot, path: String, [value, low, high]: [f64; 3]) -> FittedParameter {
    let file_value = quantity(robot, &path).map(|quantity| quantity.value);
    FittedParameter { path, value, low, high, file_value }
}

/// The file's quantity at a dotted path.
fn quantity<'a>(robot: &'a Robot, path: &str) -> Option<&'a Quantity> {
    let motor = &robot.motor;
    match path {
        "motor.resistance_ohm" => Some(&motor.resistance_ohm),
        "motor.torque_constant_nm_per_a" => Some(&motor.torque_constant_nm_per_a),
        "motor.viscous_nm_s_per_rad" => Some(&motor.viscous_nm_s_per_rad),
        "motor.rotor_inertia_kg_m2" => Some(&motor.rotor_inertia_kg_m2),
        "load.inertia_kg_m2" => Some(&robot.load.inertia_kg_m2),
        _ => {
            let (table, key) = path.strip_prefix("effects.")?.split_once('.')?;
            robot.effects.quantity(table, key)
        }
    }
}

/// The parameters of one effect for the JSON: key without its table, `[value, low, high]`.
#[must_use]
pub fn of_effect(parameters: &[FittedParameter], effect: Id) -> BTreeMap<String, [f64; 3]> {
    let prefix = format!("effects.{}.", effect.name());
    parameters
        .iter()
        .filter_map(|one| one.path.strip_prefix(&prefix).map(|key| (key.to_owned(), [one.value, one.low, one.high])))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::super::session::Session;
    use super::super::tests::{Rig, bench};
    use super::*;

    #[test]
    fn what_may_lean_either_way_is_limited_both_ways() {
        let runs = Rig::off().runs(3);
        let (session, _) = Session::open(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
        let id = Id::of("directional_friction").unwrap();
        let limits = [("sliding_torque", 1.0), ("friction_lean", 2.0)];
        let screened = Screened {
            direction: Direction::Effect(id, 0),
            promised: 0.0,
            by_accident: 0.0,
            chance: 1.0,
            family_chance: 1.0,
            limits: limits.map(|(name, limit)| (Number::OfEffect(name), limit)).to_vec(),
            dose: None,
        };
        let at_most = limit(&session.model, id, &screened).at_most;
        assert!(at_most["forward_nm"].is_some_and(|torque| torque > 0.0), "{at_most:?}");
        assert_eq!(at_most["forward_nm"], at_most["backward_nm"]);
    }
}
