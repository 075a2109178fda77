//! What is hidden in which robot.

use effects::Id;
use identify::robot::Numbers;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use robot_file::edit::Document;
use robot_file::robot::Quantity;

use crate::body::peer::root;

/// Robots below this number were looked at while the diagnosis was made; those from it on were not.
pub const FIRST_JUDGED: u64 = 1000;

/// A robot.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Its number, from which all else follows.
    pub number: u64,
    /// What its walk has beyond its file.
    pub hidden: Hidden,
}

/// What a walk has beyond its file.
#[derive(Clone, Debug, PartialEq)]
pub enum Hidden {
    /// Nothing.
    Nothing,
    /// An effect of the catalogue.
    Effect(&'static str),
    /// Something that the catalogue has not.
    Outside(&'static str),
}

/// The effects, one after the other.
const EFFECTS: [&str; 10] = [
    "foot_stribeck",
    "payload_offset",
    "foot_anisotropy",
    "ground_slope",
    "foot_hertz_contact",
    "backbone_mismatch",
    "foot_load_friction",
    "foot_friction",
    "backbone_hardening",
    "foot_stribeck",
];
/// What the catalogue has not.
const OUTSIDE: [&str; 4] = ["bristles", "adhesion", "ripple", "stripes"];

/// So many robots with an effect, with nothing, and with something else, from a number on.
#[must_use]
pub fn truths(first: u64, effects: u64, nothing: u64, outside: u64) -> Vec<Truth> {
    let one = |number: u64, hidden: Hidden| Truth { number, hidden };
    let of = |list: &'static [&'static str], k: u64| list[k as usize % list.len()];
    (0..effects)
        .map(|k| one(first + k, Hidden::Effect(of(&EFFECTS, k))))
        .chain((0..nothing).map(|k| one(first + 100 + k, Hidden::Nothing)))
        .chain((0..outside).map(|k| one(first + 200 + k, Hidden::Outside(of(&OUTSIDE, k)))))
        .collect()
}

/// The robot file that the diagnosis is given: that of a robot whose parts were measured by themselves.
///
/// # Panics
/// When it is not there or is no robot.
#[must_use]
pub fn robot_file() -> Document {
    Document::load(&root().join("tests/walks/robot.toml")).unwrap_or_else(|error| panic!("{error}"))
}

impl Truth {
    /// The stream that its draws come from.
    #[must_use]
    pub fn random(&self) -> Pcg64 {
        Pcg64::seed_from_u64(0x77a1_0000 + self.number)
    }

    /// The robot as it is, and what `feet.c` is told of its feet.
    ///
    /// # Panics
    /// When a robot file takes no such effect.
    #[must_use]
    pub fn robot(&self, random: &mut Pcg64) -> (Document, Vec<(&'static str, f64)>) {
        let numbers = numbers();
        let mut robot = numbers.document(&drawn(&numbers, random)).unwrap_or_else(|error| panic!("{error}"));
        let second = (self.number / 10) % 2 == 1;
        let law = match &self.hidden {
            Hidden::Nothing => Vec::new(),
            Hidden::Effect(name) => effect(name, second, &mut robot, random),
            Hidden::Outside(name) => outside(name, random),
        };
        (robot, law)
    }

    /// Coordinates of the file's numbers as they were drawn.
    #[must_use]
    pub fn coordinates(&self, numbers: &Numbers) -> Vec<f64> {
        drawn(numbers, &mut self.random())
    }

    /// The robot as a file has it, its effect by the catalogue's law; none with one that the catalogue has not.
    ///
    /// # Panics
    /// When a robot file takes no such effect.
    #[must_use]
    pub fn file(&self) -> Option<Document> {
        let (mut robot, law) = self.robot(&mut self.random());
        let Hidden::Effect(name) = self.hidden else { return (self.hidden == Hidden::Nothing).then_some(robot) };
        let of = |key: &str| law.iter().find(|(name, _)| *name == key).map(|(_, value)| *value);
        let values = match name {
            "foot_stribeck" => {
                vec![("excess_share", of("excess").or(of("tanh_excess"))?), ("speed_m_per_s", of("speed")?)]
            }
            "foot_anisotropy" => vec![("lateral_share", of("lateral")?)],
            "foot_load_friction" => vec![("exponent", of("load_exponent")?)],
            // Of a spring with a share s of a sphere's, the power with which the load grows is 1 + s/2 where it is as deep as the linear one.
            "foot_hertz_contact" => vec![("share", 2.0 * (of("exponent")? - 1.0))],
            // The robot file has it already.
            _ => return Some(robot),
        };
        put(&mut robot, name, &values);
        Some(robot)
    }

    /// The file's numbers as they were drawn, by their paths.
    #[must_use]
    pub fn numbers(&self) -> Vec<(String, f64)> {
        let numbers = numbers();
        let at = self.coordinates(&numbers);
        let of_the_robot = numbers.all.iter().zip(at).filter(|(one, _)| !is_given(&one.path));
        of_the_robot.map(|(one, at)| (one.path.clone(), one.at(at))).collect()
    }
}

/// The numbers of the robot file.
///
/// # Panics
/// When they cannot be varied.
#[must_use]
pub fn numbers() -> Numbers {
    Numbers::with_effects(&robot_file(), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Coordinates of a robot's own numbers, drawn from what is believed of them.
fn drawn(numbers: &Numbers, random: &mut Pcg64) -> Vec<f64> {
    let mut one = |path: &str| if is_given(path) { 0.0 } else { coordinate(random) };
    numbers.all.iter().map(|number| one(&number.path)).collect()
}

/// A coordinate that is drawn from what is believed of a number, between the ends of its 90 % interval.
#[must_use]
pub fn coordinate(random: &mut Pcg64) -> f64 {
    let normal: f64 = StandardNormal.sample(random);
    normal.clamp(-1.645, 1.645)
}

/// Whether a number is no robot's own: MuJoCo's servo is the file's.
fn is_given(path: &str) -> bool {
    path.starts_with("eccentric.servo")
}

/// Gives a robot an effect: in its file, from which MuJoCo's model is made, or in what is told of its feet. `second`: another law of it.
fn effect(name: &str, second: bool, robot: &mut Document, random: &mut Pcg64) -> Vec<(&'static str, f64)> {
    let mut between = |low: f64, high: f64| low * (high / low).powf(random.random::<f64>());
    match name {
        "foot_stribeck" => {
            let (excess, speed) = (between(0.15, 0.5), between(0.01, 0.06));
            vec![(if second { "tanh_excess" } else { "excess" }, excess), ("speed", speed)]
        }
        "foot_anisotropy" => {
            let share = between(1.18, 1.5);
            vec![("lateral", if second { 1.0 / share } else { share })]
        }
        "foot_load_friction" => vec![("load_exponent", between(0.1, 0.35))],
        "foot_hertz_contact" => vec![("exponent", if second { 1.35 } else { 1.5 })],
        "ground_slope" => {
            put(robot, name, &signed(random, &["ahead_deg", "left_deg"], [0.4, 2.5]));
            Vec::new()
        }
        "payload_offset" => {
            put(robot, name, &signed(random, &["x_m", "y_m"], [0.6e-3, 3e-3]));
            Vec::new()
        }
        "backbone_hardening" => {
            let keys = ["torsion_share", "stiff_share", "soft_share"];
            let values: Vec<_> = keys.iter().map(|key| (*key, between(0.4, 2.5))).collect();
            put(robot, name, &values);
            Vec::new()
        }
        "backbone_mismatch" | "foot_friction" => {
            let id = Id::of(name).unwrap_or_else(|| panic!("no effect {name}"));
            let width = if name == "foot_friction" { 1.2 } else { 1.15 };
            let keys = id.spec().parameters.iter();
            let drawn = |random: &mut Pcg64| {
                let normal: f64 = StandardNormal.sample(random);
                f64::powf(width, normal.clamp(-1.6, 1.6))
            };
            let values: Vec<_> = keys.map(|key| (key.key, drawn(random))).collect();
            put(robot, name, &values);
            Vec::new()
        }
        _ => panic!("no such effect: {name}"),
    }
}

/// Sizes of either sign.
fn signed(random: &mut Pcg64, keys: &[&'static str], [low, high]: [f64; 2]) -> Vec<(&'static str, f64)> {
    let one = |random: &mut Pcg64| {
        let size = low * (high / low).powf(random.random::<f64>());
        if random.random::<bool>() { size } else { -size }
    };
    keys.iter().map(|key| (*key, one(random))).collect()
}

/// Writes an effect into a robot file; keys that are not given stay where the effect is absent.
fn put(robot: &mut Document, name: &str, values: &[(&'static str, f64)]) {
    let id = Id::of(name).unwrap_or_else(|| panic!("no effect {name}"));
    let given = |key: &effects::Parameter| {
        let without = key.belief.map_or(0.0, |belief| belief[0]);
        let value = values.iter().find(|(given, _)| *given == key.key).map_or(without, |(_, value)| *value);
        (key.key, Quantity { value, low: value, high: value, source: "hidden".into() })
    };
    let quantities: Vec<_> = id.spec().parameters.iter().map(given).collect();
    robot.set_effect(name, &quantities).unwrap_or_else(|error| panic!("{error}"));
}

/// What the catalogue has not.
fn outside(name: &'static str, random: &mut Pcg64) -> Vec<(&'static str, f64)> {
    let mut between = |low: f64, high: f64| low * (high / low).powf(random.random::<f64>());
    match name {
        "bristles" => vec![("bristles", between(0.15, 0.35))],
        "adhesion" => vec![("adhesion", between(0.01, 0.03))],
        "ripple" => vec![("ripple", between(1e-4, 3e-4)), ("ripple_length", between(6e-3, 15e-3))],
        _ => vec![("stripes", between(0.2, 0.4))],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hidden_effect_can_be_in_a_file() {
        // Each of both laws.
        for truth in truths(1, 2 * EFFECTS.len() as u64, 0, 0) {
            let Hidden::Effect(name) = truth.hidden else { unreachable!() };
            let robot = truth.file().and_then(|file| file.robot().ok()).unwrap_or_else(|| panic!("{truth:?}"));
            assert!(robot.effects.listed().any(|id| id.name() == name), "{truth:?}");
        }
    }
}
