//! The motor's numbers from bench runs, with what these runs can tell of them.

use std::collections::BTreeMap;

use effects::{Acts, Id};
use recording::Recording;
use robot_file::robot::Robot;
use serde::Serialize;

use super::bootstrap::Bootstrap;
use super::fit::Fit;
use super::nominal::FileModel;
use super::numbers::Number;
use super::search::{Candidate, ROUNDS, TOLERANCE, Wanted, best, try_all};
use super::selection::{REACHES, Selection};
use super::session::Session;
use super::verdict::FittedParameter;
use super::{
    DiagnoseError, Options, in_pool, is_implausible, judged, open, scale_free, values, with_reason, wrong_rig,
};

/// What bench runs tell of a motor and its friction.
#[derive(Clone, Debug, Serialize)]
pub struct MotorFit {
    /// Of the motor, then of its friction: value and 95 % interval in the file's keys and units.
    pub numbers: Vec<MotorNumber>,
    /// What holds whatever the scale of torques is, by key with its unit: value and 95 % interval.
    pub volts: BTreeMap<String, [f64; 3]>,
    /// Effects of friction in the model: the file's, or those that these runs show; empty where they show none.
    pub friction: Vec<String>,
    /// Whether a current was measured that sets the scale of torques.
    pub current: bool,
    /// Noise of the angle reading, rad.
    pub noise_rad: f64,
    /// Error of free rollouts on the held-out runs with the file's numbers, rad.
    pub before_rad: f64,
    /// The same with those found.
    pub after_rad: f64,
    /// For the robot file: [`super::extend`] puts them there.
    #[serde(skip)]
    pub fitted: Vec<FittedParameter>,
}

/// A number of the motor or of its friction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotorNumber {
    /// Dotted path in the robot file.
    pub path: String,
    /// In the file's unit.
    pub value: f64,
    /// Of the 95 % interval.
    pub low: f64,
    /// Of the 95 % interval.
    pub high: f64,
    /// What the file says, if it does.
    pub file: Option<f64>,
    /// Whether these runs tell it, or it hangs on what the file says of others.
    pub told: bool,
}

/// What is known of a motor beside its runs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Known {
    /// R, Ω, as an ohmmeter shows it at several places of the rotor.
    pub resistance_ohm: Option<f64>,
    /// J of rotor and load, kg·m², from a data sheet or a weight and a shape.
    pub inertia_kg_m2: Option<f64>,
}

/// Kinds of friction, the simplest first.
const FRICTION: [&str; 3] = ["coulomb_friction", "load_friction", "stribeck_friction"];
/// Another friction takes away at least this share of what the model without one misses by: less than that is in the integration of a
/// shaft that sticks, where readings are precise.
const RICHER_PAYS: f64 = 0.02;
/// What is known beside the runs is known to this share (standard deviation).
const KNOWN_TO: f64 = 0.02;
/// A number whose interval is wider, as a ratio of its ends, is not told: the file's own beliefs are about so wide.
const TOLD: f64 = 1.3;

impl MotorFit {
    /// Whether the model misses the held-out runs by more than a motor with friction explains: a diagnosis finds what it is.
    #[must_use]
    pub fn lacks_more(&self) -> bool {
        self.after_rad > REACHES * self.noise_rad
    }
}

/// Fits R, K, J, b and friction to bench runs.
///
/// Angle and drive alone show the motor's equation in volts, `V = (K + b·R/K)·ω + (J·R/K)·dω/dt + τ·R/K`: of R, J, b and torques they
/// tell products, unless a current is measured or one of R and J is known. A file without friction gets
/// Coulomb, load or Stribeck friction where the held-out runs are better for it beyond doubt.
///
/// # Errors
/// As [`super::diagnose`].
pub fn identify_motor(
    robot: &Robot,
    fit: &[Recording],
    held_out: &[Recording],
    known: Known,
    options: &Options,
) -> Result<MotorFit, DiagnoseError> {
    in_pool(options, || {
        options.tell("refitting the motor's numbers", 0.0);
        let (mut session, mut baseline) = open(robot, fit, held_out, options)?;
        if session.model.hold(known_numbers(known)) {
            let fit = session.settle(&baseline.fit);
            baseline = judged(&mut session, fit);
        }
        options.tell("friction", 0.5);
        let mut model = with_friction(robot, &session, &baseline, options).unwrap_or_else(|| baseline.clone());
        if is_implausible(&session, &model) {
            return Err(wrong_rig(robot, &session, &model));
        }
        model.fit = session.in_small_steps(&model.fit);
        options.tell("done", 1.0);
        Ok(written(robot, &session, &model))
    })
    .map_err(|error| with_reason(error, robot, fit, held_out))
}

fn known_numbers(known: Known) -> Vec<(Number, f64, f64)> {
    let all = [(Number::Resistance, known.resistance_ohm), (Number::Inertia, known.inertia_kg_m2)];
    all.into_iter().filter_map(|(number, value)| Some((number, value?, KNOWN_TO))).collect()
}

/// The model with the friction that these runs show; `None` where the file has one or they show none. A richer one is taken where it
/// is better beyond doubt.
fn with_friction(robot: &Robot, session: &Session, baseline: &Candidate, options: &Options) -> Option<Candidate> {
    let kinds: Vec<Id> = FRICTION.into_iter().filter_map(Id::of).collect();
    if robot.effects.listed().any(|id| kinds.contains(&id)) {
        return None;
    }
    let wanted: Vec<Wanted> =
        kinds.iter().map(|&id| Wanted::new(vec![id], baseline.fit.clone(), session.all_starts(&[id]))).collect();
    let mut candidates = try_all(session, &wanted, (kinds.len(), f64::INFINITY), &|| ());
    refit_the_simplest(session, &mut candidates);
    let bootstrap = Bootstrap::new(baseline.evaluation.errors.len(), options.seed);
    let selection = Selection { noise: session.noise, baseline, candidates: &candidates, bootstrap: &bootstrap };
    let excess = baseline.mean_square() - session.noise;
    let mut taken: Option<&Candidate> = None;
    for one in candidates.iter().filter(|one| one.sized) {
        let before = taken.unwrap_or(baseline);
        let pays = before.mean_square() - one.mean_square() > RICHER_PAYS * excess;
        if pays && selection.beats(one, before) {
            taken = Some(one);
        }
    }
    taken.cloned()
}

/// Fits the simplest friction once more from where the best ended, so that it does not lose for want of a good start.
fn refit_the_simplest(session: &Session, candidates: &mut [Candidate]) {
    let Some(best) = best(candidates).map(|best| best.fit.clone()) else { return };
    if let Some(simplest) = candidates.first_mut().filter(|one| one.fit.effects != best.effects) {
        let fit = session.again(&simplest.effects, &best, ROUNDS, TOLERANCE, f64::INFINITY);
        simplest.improve(Candidate::of(session, fit, true));
    }
}

fn written(robot: &Robot, session: &Session, model: &Candidate) -> MotorFit {
    let fitted = values::fitted(robot, &session.model, &model.fit);
    let of_shaft = |path: &str| {
        let effect = path.strip_prefix("effects.").and_then(|rest| rest.split('.').next()).and_then(Id::of);
        effect.is_none_or(|id| id.spec().acts == Acts::Shaft)
    };
    let number = |one: &FittedParameter| MotorNumber {
        path: one.path.clone(),
        value: one.value,
        low: one.low,
        high: one.high,
        file: one.file_value,
        told: is_told(one),
    };
    let friction = friction_of(robot, &session.model, &model.fit);
    MotorFit {
        numbers: fitted.iter().filter(|one| of_shaft(&one.path)).map(number).collect(),
        volts: scale_free::of(&session.model, &model.fit),
        friction,
        current: session.has_current(),
        noise_rad: session.noise.sqrt(),
        before_rad: session.evaluate(&session.unfitted).mean_square().sqrt(),
        after_rad: model.mean_square().sqrt(),
        fitted,
    }
}

/// Told is what lies within a narrow ratio.
fn is_told(one: &FittedParameter) -> bool {
    one.low > 0.0 && one.high / one.low <= TOLD
}

fn friction_of(robot: &Robot, model: &FileModel, fit: &Fit) -> Vec<String> {
    let is_friction = |id: &Id| FRICTION.contains(&id.name());
    let kept = model.values(&fit.effects, |number| fit.value(number));
    robot
        .effects
        .listed()
        .filter(|id| kept.contains_key(id))
        .chain(fit.effects.iter().copied())
        .filter(is_friction)
        .map(|id| id.name().to_owned())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Rig, bench, coulomb};
    use super::*;

    /// With 0.2 mN·m of Coulomb friction.
    fn rubbing() -> Rig {
        let mut rig = Rig::off();
        rig.shaft.laws = coulomb(2e-4);
        rig
    }

    fn identified(rig: &Rig, known: Known) -> MotorFit {
        let runs = rig.runs(8);
        identify_motor(&bench(), &runs[..4], &runs[4..], known, &Options::default()).unwrap()
    }

    fn number<'a>(fit: &'a MotorFit, path: &str) -> &'a MotorNumber {
        fit.numbers.iter().find(|one| one.path == path).unwrap_or_else(|| panic!("no {path}: {:?}", fit.numbers))
    }

    #[test]
    fn angle_and_drive_tell_volts_and_no_resistance() {
        let rig = rubbing();
        let fit = identified(&rig, Known::default());
        let shaft = &rig.shaft;
        let per_torque = shaft.resistance_ohm / shaft.torque_constant;
        for (key, truth) in [
            ("motor.back_emf_v_s_per_rad", shaft.torque_constant + shaft.viscous * per_torque),
            ("motor.inertia_v_s2_per_rad", shaft.inertia_kg_m2 * per_torque),
            ("coulomb_friction.torque_v", 2e-4 * per_torque),
        ] {
            let [value, low, high] = fit.volts[key];
            assert!((value / truth - 1.0).abs() < 0.03 && high / low < 1.1, "{key}: {:?}, {truth}", fit.volts[key]);
        }
        assert_eq!((fit.friction.as_slice(), fit.current), (&["coulomb_friction".to_owned()][..], false));
        assert!(number(&fit, "motor.torque_constant_nm_per_a").told);
        let resistance = number(&fit, "motor.resistance_ohm");
        assert!(!resistance.told && resistance.low < 17.25 && 17.25 < resistance.high, "{resistance:?}");
        assert!(!fit.lacks_more() && fit.before_rad > 2.0 * fit.after_rad);
    }

    #[test]
    fn no_readings_seem_to_know_the_scale_of_torques() {
        let resistance = |seed| {
            let runs = rubbing().runs(seed);
            let fit = identify_motor(&bench(), &runs[..4], &runs[4..], Known::default(), &Options::default()).unwrap();
            number(&fit, "motor.resistance_ohm").clone()
        };
        let [one, other] = [9, 11].map(resistance);
        // What the file says of R, J and b decides, whatever the readings' noise is.
        assert!((one.value / other.value - 1.0).abs() < 0.05, "{one:?} {other:?}");
        assert!(one.high / one.low > 2.0 && other.high / other.low > 2.0, "{one:?} {other:?}");
    }

    #[test]
    fn a_known_resistance_or_inertia_tells_the_rest() {
        let rig = rubbing();
        let shaft = &rig.shaft;
        let by_resistance = Known { resistance_ohm: Some(shaft.resistance_ohm), ..Known::default() };
        let by_inertia = Known { inertia_kg_m2: Some(shaft.inertia_kg_m2), ..Known::default() };
        for known in [by_resistance, by_inertia] {
            let fit = identified(&rig, known);
            let inertia: f64 =
                ["motor.rotor_inertia_kg_m2", "load.inertia_kg_m2"].iter().map(|path| number(&fit, path).value).sum();
            assert!((inertia / shaft.inertia_kg_m2 - 1.0).abs() < 0.04, "{known:?}: {inertia:e}");
            for (path, truth) in [
                ("motor.resistance_ohm", shaft.resistance_ohm),
                ("motor.viscous_nm_s_per_rad", shaft.viscous),
                ("effects.coulomb_friction.torque_nm", 2e-4),
            ] {
                let one = number(&fit, path);
                assert!(one.low < truth && truth < one.high, "{known:?}: {one:?}, truth {truth:e}");
                assert!(one.told, "{known:?}: {one:?}");
            }
        }
    }

    #[test]
    fn no_friction_is_found_where_there_is_none() {
        let fit = identified(&Rig::off(), Known::default());
        assert_eq!(fit.friction, Vec::<String>::new());
        assert!(!fit.numbers.iter().any(|one| one.path.starts_with("effects")), "{:?}", fit.numbers);
    }
}
