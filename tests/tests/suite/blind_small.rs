//! A small blind campaign in the ordinary tests: an effect of the shaft, of the drive and of the sensor, nothing, one from
//! outside. The seeds are fixed; `.ci/run` has more of them, and the whole campaign is `cargo blind`.

use std::path::Path;

use system_tests::blind::case::{self, Category};
use system_tests::blind::hidden::Effect;
use system_tests::blind::rig;
use system_tests::blind::score::{self, Outcome};
use system_tests::blind::setting::Setting;

fn outcome(seed: u64, category: Category, only: Option<Effect>) -> Outcome {
    outcome_with(seed, category, only, &Setting::default())
}

fn outcome_with(seed: u64, category: Category, only: Option<Effect>, setting: &Setting) -> Outcome {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/bench-linear.toml");
    let robot_file = rig::flatten(Path::new(path)).expect("the bench's robot file");
    let case = case::draw_with(seed, category, only, &robot_file, setting);
    let case = case.expect("the bench's robot file has every number");
    let directory = tempfile::tempdir().expect("a temporary directory");
    let outcome = score::run(&case, directory.path()).expect("files in a temporary directory");
    println!("{}", outcome.line());
    outcome
}

fn finds(effect: Effect) {
    let outcome = outcome(501, Category::Hidden, Some(effect));
    assert!(outcome.passed(), "{}", outcome.line());
    let (estimated, truth) = outcome.after().expect("a cause was named");
    assert!(estimated <= 1.25 && truth <= 1.25, "what is left: {}", outcome.line());
}

#[test]
fn stribeck_friction_is_found() {
    finds(Effect::StribeckFriction);
}

#[test]
fn driver_drop_is_found() {
    finds(Effect::DriverDrop);
}

#[test]
fn sensor_delay_is_found() {
    finds(Effect::SensorDelay);
}

#[test]
fn where_nothing_is_hidden_nothing_is_found() {
    let outcome = outcome(511, Category::Nothing, None);
    assert!(outcome.passed(), "{}", outcome.line());
}

#[test]
fn what_the_library_lacks_gets_no_false_name() {
    let outcome = outcome(521, Category::Outside, Some(Effect::SupplyClip));
    assert!(outcome.passed(), "{}", outcome.line());
}

/// The two effects of a seed of the campaign are both found.
fn both_are_found(seed: u64) {
    let outcome = outcome_with(seed, Category::Two, None, &Category::Two.setting(seed));
    assert!(outcome.passed(), "{}", outcome.line());
}

#[test]
fn a_second_effect_of_which_no_screen_is_sure_is_found() {
    // The first one alone reaches the floor and leaves a tenth above it (mean square).
    both_are_found(165_761_552);
}

#[test]
fn a_second_effect_that_the_first_takes_for_noise_is_found() {
    // The floor lies where the first one alone leaves it: a play of the teeth is a scatter about it.
    both_are_found(569_512_429);
}

#[test]
fn two_laws_that_are_nearly_right_leave_a_trace_in_noise_that_remembers() {
    both_are_found(569_512_415);
}
