//! Files that stand on a base file.

use std::path::{Path, PathBuf};

use robot_file::Robot;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A directory with a copy of robot.toml, and a variant in it.
fn variant(text: &str) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    std::fs::copy(root().join("robot.toml"), directory.path().join("robot.toml")).unwrap();
    let path = directory.path().join("variant.toml");
    std::fs::write(&path, text).unwrap();
    (directory, path)
}

/// What is wrong, with the directory left out of the file names.
fn message(text: &str) -> String {
    let (directory, path) = variant(text);
    let prefix = format!("{}/", directory.path().display());
    Robot::load(&path).unwrap_err().to_string().replace(&prefix, "")
}

#[test]
fn what_is_not_overridden_is_the_bases() {
    let (_directory, path) = variant(
        "base = \"robot.toml\"\nname = \"other\"\n[motor]\nresistance_ohm = { value = 20, low = 19, high = 21, source = \"test\" }\n",
    );
    let (other, base) = (Robot::load(&path).unwrap(), Robot::load(&root().join("robot.toml")).unwrap());
    let mut expected = base;
    expected.name = "other".into();
    expected.motor.resistance_ohm = other.motor.resistance_ohm.clone();
    assert_eq!(other.motor.resistance_ohm.value, 20.0);
    assert_eq!(other, expected);
}

#[test]
fn a_removed_table_is_gone() {
    let (_directory, path) = variant("base = \"robot.toml\"\nremove = [\"effects.battery_sag\"]\n");
    let robot = Robot::load(&path).unwrap();
    assert_eq!(robot.effects.get::<effects::BatterySag>(), None);
    assert!(robot.effects.get::<effects::DriverDrop>().is_some());
}

#[test]
fn a_quantity_is_replaced_whole() {
    assert_eq!(
        message("base = \"robot.toml\"\n[motor]\nresistance_ohm = { value = 20 }\n"),
        "variant.toml:3: motor.resistance_ohm.low: field is missing in table [motor.resistance_ohm]; add `low = …` (value and \
         the ends of its plausible range)\n\
         variant.toml:3: motor.resistance_ohm.high: field is missing in table [motor.resistance_ohm]; add `high = …` (value \
         and the ends of its plausible range)\n\
         variant.toml:3: motor.resistance_ohm.source: field is missing in table [motor.resistance_ohm]; add `source = \"…\"` \
         (data sheet, paper, measurement or estimate)"
    );
}

#[test]
fn an_error_names_the_file_that_has_it() {
    let (directory, path) = variant("base = \"robot.toml\"\n");
    let base = directory.path().join("robot.toml");
    let text = std::fs::read_to_string(&base).unwrap();
    let line = 1 + text.lines().position(|line| line.starts_with("resistance_ohm")).unwrap();
    std::fs::write(&base, text.replacen("value = 15.0", "value = -1.0", 1)).unwrap();
    let error = Robot::load(&path).unwrap_err().to_string();
    let expected =
        format!("{}:{line}: motor.resistance_ohm.value: -1 is outside the allowed 0.01 … 1000 Ω", base.display());
    assert_eq!(error, expected);
}

#[test]
fn wrong_bases() {
    assert_eq!(
        message("base = \"none.toml\"\n"),
        "variant.toml:1: base: cannot read none.toml (No such file or directory (os error 2)); the path starts at this \
         file's directory"
    );
    assert_eq!(message("base = 3\n"), "variant.toml:1: base: expected the base file's path as a text, found a number");
    assert!(
        message("base = \"variant.toml\"\n").contains("variant.toml:1: base: more than 8 files stand on each other")
    );
    assert_eq!(
        message("base = \"robot.toml\"\nremove = [\"effects.none\"]\n"),
        "variant.toml:2: remove: the base has no `effects.none`"
    );
    assert_eq!(
        message("remove = [\"effects\"]\n"),
        "variant.toml:1: remove: there is no `base` to remove anything from"
    );
    assert_eq!(
        message("base = \"robot.toml\"\nremove = \"effects\"\n"),
        "variant.toml:2: remove: expected paths like [\"supply.battery\"], found a text"
    );
}
