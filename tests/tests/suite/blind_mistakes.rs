//! Data sets with a mistake in their files: what is in them, and that it is said with its mend. The seeds are below 1000;
//! `cargo blind --mistaken 40` takes fresh ones.

use std::f64::consts::TAU;
use std::path::Path;

use system_tests::blind::case::{self, Case, Category};
use system_tests::blind::files::{Decimals, Units};
use system_tests::blind::heard::listen;
use system_tests::blind::mistake::{KINDS, Mistake};
use system_tests::blind::rig::{self, Rig};
use system_tests::blind::setting::Setting;

fn robot_file() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/bench-linear.toml");
    rig::flatten(Path::new(path)).expect("the bench's robot file")
}

fn drawn(seed: u64) -> Case {
    let short = Setting { share: 0.4, ..Setting::default() };
    case::draw_with(seed, Category::Mistaken, None, &robot_file(), &short).expect("the bench's file has every number")
}

fn of_kind(wanted: fn(&Mistake) -> bool) -> Case {
    let cases = (600..600 + KINDS).map(drawn);
    cases.into_iter().find(|case| case.mistake.as_ref().is_some_and(wanted)).expect("every kind is among them")
}

/// A column of the first run's file.
fn column(text: &str, name: &str) -> Vec<f64> {
    let place = text.lines().next().and_then(|line| line.split(',').position(|cell| cell == name)).expect("a column");
    text.lines().skip(1).map(|line| line.split(',').nth(place).expect("a cell").parse().expect("a number")).collect()
}

#[test]
fn a_column_is_the_right_one_times_its_units() {
    for seed in 600..600 + KINDS {
        let case = drawn(seed);
        let mistake = case.mistake.expect("one is made");
        let (units, run) = (mistake.units(), &case.runs[0]);
        let texts = [Units::default(), units].map(|units| run.csv_in(&units, false, Decimals::FULL));
        let ratio = |name: &str, factor: f64, least: f64| {
            for (right, made) in column(&texts[0], name).into_iter().zip(column(&texts[1], name)) {
                assert!((made - factor * right).abs() < least, "{}, {name}: {made} of {right}", mistake.name());
            }
        };
        ratio("t_s", units.time, 1e-3);
        ratio("duty", units.duty, if units.whole_duty { 0.51 } else { 1e-3 });
        ratio("angle_rad", units.gear * units.turn / TAU, if units.counts { 0.51 } else { 1e-3 });
    }
}

#[test]
fn a_wrapped_column_stays_within_its_turn() {
    for (units, low, high) in [
        (Units { turn: 360.0, ..Units::default() }, -180.0, 180.0),
        (Units { turn: 4096.0, counts: true, ..Units::default() }, 0.0, 4096.0),
        (Units { gear: 26.4, ..Units::default() }, -0.5 * TAU, 0.5 * TAU),
    ] {
        let angles = column(&drawn(600).runs[0].csv_in(&units, true, Decimals::FULL), "angle_rad");
        let ends = angles.iter().fold((f64::MAX, f64::MIN), |(low, high), angle| (low.min(*angle), high.max(*angle)));
        assert!(ends.0 >= low - 1e-6 && ends.1 <= high + 1e-6, "{units:?}: {ends:?}");
        assert!(ends.1 - ends.0 > 0.9 * (high - low), "the shaft turns round: {units:?}: {ends:?}");
    }
}

#[test]
fn gears_and_supply_are_in_the_rig_and_another_rig_in_the_file() {
    let nominal = Rig::nominal(&robot_file()).expect("every number");
    let supply = of_kind(|one| matches!(one, Mistake::Supply(_)));
    assert!(supply.world.rig.rail_v >= 3.5 * nominal.rail_v);
    // K is 10–30 % off the file's by itself.
    let geared = of_kind(|one| matches!(one, Mistake::OtherGears(_))).world.rig;
    assert!((3.5..7.0).contains(&(geared.torque_constant / nominal.torque_constant)));
    // With K² grows J of the rotor, so that the time constant is nearly as before.
    let pace = |rig: &Rig| rig.torque_constant.powi(2) / rig.resistance_ohm / rig.inertia_kg_m2;
    assert!((0.3..4.0).contains(&(pace(&geared) / pace(&nominal))));
    let other = of_kind(|one| matches!(one, Mistake::OtherRig(_)));
    let file = Rig::nominal(&other.robot_file).expect("another rig's numbers");
    assert!(file.torque_constant > 3.0 * other.world.rig.torque_constant);
}

#[test]
fn every_mistake_is_said_by_the_check_of_the_rig_and_nothing_else_is() {
    for seed in 600..600 + KINDS {
        let case = drawn(seed);
        let mistake = case.mistake.expect("one is made");
        let directory = tempfile::tempdir().expect("a temporary directory");
        let paths = case.write(directory.path()).expect("files in a temporary directory");
        let nothing_said = Err(String::new());
        let heard = listen(mistake, &case, &paths, &nothing_said);
        assert!(heard.by_check, "{}: {}", mistake.name(), heard.check);
        assert!(!heard.by_diagnosis, "silence says nothing");
        // The same files beside the truth of another mistake are not the mend of that.
        let other = if mistake == Mistake::Turns { Mistake::Milliseconds } else { Mistake::Turns };
        let heard = listen(other, &case, &paths, &nothing_said);
        assert!(!heard.by_check || heard.check.contains("turns"), "{}: {}", mistake.name(), heard.check);
    }
}

#[test]
fn the_same_seed_gives_the_same_files() {
    let [a, b] = [drawn(605), drawn(605)];
    let text = |case: &Case| case.runs[0].csv(case.sensor.wrapped, Decimals::FULL);
    assert_eq!((a.mistake, text(&a)), (b.mistake, text(&b)));
}
