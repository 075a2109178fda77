//! Numbers that do not hang on the scale of torques. Angle and drive alone show the motor's equation in volts only,
//! `V = (K + b·R/K)·ω + (J·R/K)·dω/dt + τ·R/K`: how large the torques and inertias behind it are follows from what the file says of
//! R, K and J, unless a current is measured. What is in volts is known as well as the data are good.

use std::collections::BTreeMap;

use effects::Id;

use super::fit::{Fit, WIDE};
use super::nominal::FileModel;
use super::numbers::Number;

/// Value and 95 % interval of every such number by its key, which ends with its unit: of the motor, and of each effect that the
/// fit has added whatever is a torque, as `EFFECT.KEY` with volts for newton metres.
#[must_use]
pub fn of(model: &FileModel, fit: &Fit) -> BTreeMap<String, [f64; 3]> {
    let at = |moved: Option<(usize, f64)>| volts(model, fit, moved).unwrap_or_default();
    let values = at(None);
    let slopes: Vec<BTreeMap<String, f64>> = (0..fit.free.len()).map(|i| slopes(&at, i)).collect();
    let interval = |(key, value): (&String, &f64)| {
        let mut variance = 0.0;
        for (i, at_i) in slopes.iter().enumerate() {
            for (j, at_j) in slopes.iter().enumerate() {
                variance += at_i[key] * fit.covariance[(i, j)] * at_j[key];
            }
        }
        let half = WIDE * variance.max(0.0).sqrt();
        (key.clone(), [*value, value - half, value + half])
    };
    values.iter().map(interval).collect()
}

/// How every number changes with a coordinate of the fit.
fn slopes(at: &dyn Fn(Option<(usize, f64)>) -> BTreeMap<String, f64>, i: usize) -> BTreeMap<String, f64> {
    const STEP: f64 = 1e-4;
    let (up, down) = (at(Some((i, STEP))), at(Some((i, -STEP))));
    up.into_iter().map(|(key, up)| (key.clone(), (up - down[&key]) / (2.0 * STEP))).collect()
}

/// The numbers with one coordinate of the fit moved; `None` where R, K, J or b is not among the fit's.
fn volts(model: &FileModel, fit: &Fit, moved: Option<(usize, f64)>) -> Option<BTreeMap<String, f64>> {
    let value = |number: Number| {
        let i = fit.free.iter().position(|one| one.number == number)?;
        let by = moved.filter(|(place, _)| *place == i).map_or(0.0, |(_, by)| by);
        Some(fit.free[i].number(fit.coordinates[i] + by))
    };
    let (resistance, constant) = (value(Number::Resistance)?, value(Number::TorqueConstant)?);
    let (inertia, viscous) = (value(Number::Inertia)?, value(Number::Viscous)?);
    let per_torque = resistance / constant;
    let (back_emf, inertia) = (constant + viscous * per_torque, inertia * per_torque);
    let mut out = BTreeMap::from([
        ("motor.back_emf_v_s_per_rad".to_owned(), back_emf),
        ("motor.inertia_v_s2_per_rad".to_owned(), inertia),
        ("motor.time_constant_s".to_owned(), inertia / back_emf),
    ]);
    let effects = model.values(&fit.effects, value);
    for &id in &fit.effects {
        out.extend(torques(id, &effects[&id]).map(|(key, torque)| (key, torque * per_torque)));
    }
    Some(out)
}

/// An effect's parameters that are in newton metres, keys in volts.
fn torques(id: Id, values: &[f64]) -> impl Iterator<Item = (String, f64)> {
    let keys = id.spec().parameters.iter().zip(values);
    keys.filter(|(parameter, _)| parameter.key.split('_').any(|word| word == "nm"))
        .map(move |(parameter, value)| (format!("{}.{}", id.name(), parameter.key.replace("nm", "v")), *value))
}
