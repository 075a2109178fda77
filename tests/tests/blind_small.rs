//! A small blind campaign in the ordinary tests: each of the eight effects once, nothing three times, two from outside.
//! The seeds are fixed; the whole campaign is `cargo run -p system-tests --bin blind`.

use std::path::Path;

use system_tests::blind::case::{self, Category};
use system_tests::blind::hidden::Effect;
use system_tests::blind::rig;
use system_tests::blind::score::{self, Mark, Outcome};

fn outcome(seed: u64, category: Category, only: Option<Effect>) -> Outcome {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/bench-linear.toml");
    let robot_file = rig::flatten(Path::new(path)).expect("the bench's robot file");
    let case = case::draw(seed, category, only, &robot_file).expect("the bench's robot file has every number");
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
fn coulomb_friction_is_found() {
    finds(Effect::CoulombFriction);
}

#[test]
fn stribeck_friction_is_found() {
    finds(Effect::StribeckFriction);
}

#[test]
fn load_friction_is_found() {
    finds(Effect::LoadFriction);
}

#[test]
fn gravity_tilt_is_found() {
    finds(Effect::GravityTilt);
}

#[test]
fn driver_drop_is_found() {
    finds(Effect::DriverDrop);
}

#[test]
fn battery_sag_is_found() {
    finds(Effect::BatterySag);
}

#[test]
fn sensor_nonlinearity_is_found() {
    finds(Effect::SensorNonlinearity);
}

#[test]
fn sensor_delay_is_found() {
    finds(Effect::SensorDelay);
}

#[test]
fn where_nothing_is_hidden_nothing_is_found() {
    for seed in [511, 512, 513] {
        let outcome = outcome(seed, Category::Nothing, None);
        assert!(outcome.passed(), "{}", outcome.line());
    }
}

#[test]
fn what_the_library_lacks_gets_no_false_name() {
    // Teeth that rub and one that sticks are frictions: a friction of the library may be named for a part of them, which the
    // campaign counts as false.
    for (seed, effect) in [(521, Effect::SupplyClip), (522, Effect::RememberedLoad)] {
        let outcome = outcome(seed, Category::Outside, Some(effect));
        assert_ne!(outcome.mark, Mark::FalseName, "{}", outcome.line());
        assert!(outcome.passed(), "{}", outcome.line());
    }
}
