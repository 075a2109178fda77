//! Mechanics, on speeds that the simulation itself made. Whether it holds against other simulators is the campaigns' business.

use std::path::Path;

use effects::Id;
use hal_sim::random::{Source, Stream};
use identify::robot::{Numbers, Run, simulate};
use robot_file::robot::Quantity;

use super::*;
use crate::Verdict;

/// Few, since a diagnosis walks under each of them a thousand times.
fn conditions() -> Vec<(f64, f64)> {
    [60.0, 90.0].iter().flat_map(|alpha| [-8.0, -6.0, 6.0, 8.0].map(|f| (f, *alpha))).collect()
}

/// The project's robot file, its numbers believed to a tenth.
fn document() -> Document {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
    let mut document = Document::load(&file).unwrap();
    let numbers = Numbers::new(&document, false).unwrap();
    let quantity = |value: f64| Quantity { value, low: value / 1.1, high: value * 1.1, source: "test".into() };
    let all: Vec<_> = numbers.all.iter().map(|number| (number.path.as_str(), quantity(number.file))).collect();
    document.set_all(&all).unwrap();
    document
}

/// Speeds as early as they can be told: what takes minutes otherwise takes less than one.
fn early() -> WalkOptions {
    WalkOptions { window_s: (0.3, 0.6), draws: 6, ..WalkOptions::default() }
}

/// Three repeats of a robot whose numbers are drawn from what the file believes, with an effect or without.
fn measured(document: &Document, seed: u64, hidden: Option<(&str, &[f64])>) -> Measured {
    let mut draws = Stream::new(seed, Source::Variation);
    let numbers = Numbers::with_effects(document, &[]).unwrap();
    let at: Vec<f64> = numbers.all.iter().map(|_| draws.normal().clamp(-1.5, 1.5)).collect();
    let mut truth = numbers.document(&at).unwrap();
    if let Some((name, values)) = hidden {
        let keys = Id::of(name).unwrap().spec().parameters;
        let quantity = |value: f64| Quantity { value, low: value, high: value, source: "test".into() };
        let quantities: Vec<_> = keys.iter().zip(values).map(|(key, value)| (key.key, quantity(*value))).collect();
        truth.set_effect(name, &quantities).unwrap();
    }
    let plan = hal_sim::body::Plan::new(&truth.robot().unwrap()).unwrap();
    let run = Run { step_s: 1e-4, ..early().run().unwrap() };
    let conditions = conditions();
    let speeds = simulate(&[Some(plan)], &conditions, run).remove(0).unwrap();
    let largest = [0, 1, 2].map(|part| speeds.iter().map(|one| one[part].abs()).fold(0.0, f64::max));
    let mut seen = |one: &[f64; 3]| [0, 1, 2].map(|part| Some(one[part] + 0.03 * largest[part] * draws.normal()));
    let runs: Vec<_> =
        (0..3).flat_map(|_| conditions.clone()).zip(speeds.iter().cycle()).map(|(at, one)| (at, seen(one))).collect();
    Measured::of_runs(runs)
}

#[test]
fn speeds_of_no_time_are_refused() {
    let options = WalkOptions { window_s: (2.0, 1.0), ..early() };
    let error = diagnose_walk(&document(), &Measured::of_runs([]), &options).unwrap_err();
    assert!(matches!(error, RobotError::Window { .. }), "{error}");
}

#[test]
fn feet_that_grip_less_across_are_named_with_how_much() {
    let document = document();
    let share = 0.75;
    let measured = measured(&document, 1, Some(("foot_anisotropy", &[share])));
    let found = diagnose_walk(&document, &measured, &early()).unwrap();
    assert_eq!((found.verdict, found.causes.len()), (Verdict::Explained, 1), "{:?} {:?}", found.causes, found.models);
    let [value, low, high] = found.causes[0].parameters["lateral_share"];
    assert!(low < share && share < high && (value - share).abs() < 0.1, "{value} {low} {high}");
    assert!(found.log10_evidence_against_nothing > 6.0, "{}", found.log10_evidence_against_nothing);
    let sum = |errors: [Option<f64>; 3]| errors.into_iter().flatten().sum::<f64>();
    assert!(sum(found.after) < 0.7 * sum(found.before), "{:?} {:?}", found.before, found.after);
    assert!(found.document.robot().unwrap().effects.listed().any(|id| id.name() == "foot_anisotropy"));
    assert!(found.summary[0].contains("anisotropic friction of the feet"), "{:?}", found.summary);
}

#[test]
fn a_robot_whose_numbers_alone_differ_lacks_nothing() {
    let document = document();
    let measured = measured(&document, 2, None);
    let directory = tempfile::tempdir().unwrap();
    let options = WalkOptions { keep_in: Some(directory.path().into()), ..early() };
    let found = diagnose_walk(&document, &measured, &options).unwrap();
    assert_eq!((found.verdict, found.causes.len()), (Verdict::Nothing, 0), "{:?}", found.models);
    assert_eq!((found.before, found.place), (found.after, None));
    let slope = found.limits.iter().find(|limit| limit.effect == "ground_slope").unwrap();
    assert!(slope.largest.iter().all(|(_, degrees)| (0.01..3.0).contains(degrees)), "{slope:?}");
    // Once more: everything is known already, and the same comes out.
    assert!(!found.kept.is_empty());
    let again = diagnose_walk(&document, &measured, &options).unwrap();
    assert_eq!((again.verdict, again.models, again.parameters), (found.verdict, found.models, found.parameters));
}

#[test]
fn a_foot_that_grips_less_is_pointed_to() {
    let document = document();
    let mut shares = [1.0; 8];
    shares[4] = 0.6;
    let measured = measured(&document, 3, Some(("foot_friction", &shares)));
    let table = identify::robot::Table::new(&measured, &identify::robot::Held::None).unwrap();
    let bench = models::Bench::new((&document, &table), early().run().unwrap(), None, &|_| {});
    let base = bench.baseline(6, &mut Stream::new(1, Source::Variation)).unwrap();
    let screen = bench.screen(&base, Id::of("foot_friction").unwrap()).unwrap().unwrap();
    let feet = feet::feet(&[screen], 1.0);
    assert_eq!(feet.len(), 8);
    let first = feet::pointed(&feet).expect("a foot stands out");
    assert_eq!(first.foot, "left_3", "{feet:#?}");
    assert!(first.share < 0.9 && first.deviations < -4.0, "{first:?}");
    assert!(feet::feet(&[], 1.0).is_empty() && feet::pointed(&[]).is_none());
}
