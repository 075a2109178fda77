//! Edits keep what the person wrote, and never make a file that is no robot.

use std::path::{Path, PathBuf};

use robot_file::Robot;
use robot_file::edit::Document;
use robot_file::robot::{Correction, Quantity, Sensor};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

fn quantity(value: f64, low: f64, high: f64) -> Quantity {
    Quantity { value, low, high, source: "fitted".into() }
}

fn default_robot() -> Document {
    Document::load(&root().join("robot.toml")).unwrap()
}

fn stribeck() -> Vec<(&'static str, Quantity)> {
    vec![
        ("torque_nm", quantity(2.1e-3, 2.0e-3, 2.2e-3)),
        ("breakaway_excess_nm", quantity(4e-4, 3e-4, 5e-4)),
        ("speed_rad_per_s", quantity(3.0, 2.0, 4.0)),
        ("presliding_deg", quantity(0.3, 0.1, 0.5)),
    ]
}

fn correction() -> Correction {
    Correction {
        zero_deg: 24.123_456_7,
        deg_per_code: 0.088_654_321,
        cos_deg: vec![1.25, -0.5],
        sin_deg: vec![0.0, 0.75],
        blind_from_deg: -38.5,
        blind_to_deg: 27.0,
        residual_deg: 0.04,
        source: "test run".into(),
    }
}

#[test]
fn one_line_changes_when_one_number_does() {
    let mut document = default_robot();
    let before = document.to_string();
    let new = quantity(14.123_456_7, 13.9, 14.4);
    document.set("motor.resistance_ohm", &new).unwrap();
    let after = document.to_string();
    let changed: Vec<_> = before.lines().zip(after.lines()).filter(|(old, new)| old != new).collect();
    assert_eq!(changed.len(), 1);
    assert_eq!(before.lines().count(), after.lines().count());
    assert_eq!(changed[0].1, "resistance_ohm = { value = 14.1234567, low = 13.9, high = 14.4, source = \"fitted\" }");
    assert_eq!(document.robot().unwrap().motor.resistance_ohm, new);
}

#[test]
fn small_numbers_survive() {
    let mut document = default_robot();
    let new = quantity(1.234_567_89e-6, 1e-6, 2e-6);
    document.set("motor.rotor_inertia_kg_m2", &new).unwrap();
    assert_eq!(document.robot().unwrap().motor.rotor_inertia_kg_m2, new);
    assert!(document.to_string().contains("value = 1.23456789e-6"));
}

#[test]
fn stribeck_takes_the_place_of_coulomb() {
    let mut document = default_robot();
    let both = document.set_effect("stribeck_friction", &stribeck()).unwrap_err().to_string();
    assert!(both.contains("stands beside stribeck_friction"), "{both}");
    document.remove("effects.coulomb_friction").unwrap();
    document.set_effect("stribeck_friction", &stribeck()).unwrap();
    let effects = document.robot().unwrap().effects;
    assert_eq!(effects.quantity("coulomb_friction", "torque_nm"), None);
    assert_eq!(effects.quantity("stribeck_friction", "breakaway_excess_nm"), Some(&stribeck()[1].1));
    // Once more: replaced, not doubled.
    document.set_effect("stribeck_friction", &stribeck()).unwrap();
    assert_eq!(document.to_string().matches("[effects.stribeck_friction]").count(), 1);
}

#[test]
fn every_comment_stays() {
    let comments = |text: &str| text.lines().filter(|line| line.contains('#')).map(str::to_owned).collect::<Vec<_>>();
    let mut document = default_robot();
    let before = comments(&document.to_string());
    document.set_correction(&correction()).unwrap();
    document.set("supply.rail_v", &quantity(5.1, 5.0, 5.2)).unwrap();
    document.set_effect("sensor_delay", &[("delay_s", quantity(1e-3, 0.0, 2e-3))]).unwrap();
    assert_eq!(comments(&document.to_string()), before);
}

#[test]
fn a_new_name_keeps_the_comment_beside_the_old() {
    let path = root().join("robots/variant.toml");
    let text = "base = \"../robot.toml\" # below\nname = \"a\" # why\n";
    let mut document = Document::parse(text, &path.display().to_string()).unwrap();
    document.set_name("b", "another").unwrap();
    let expected = "base = \"../robot.toml\" # below\nname = \"b\" # why\nsummary = \"another\"\n";
    assert_eq!(document.to_string(), expected);
}

#[test]
fn a_correction_is_written_and_read() {
    let mut document = default_robot();
    document.set_correction(&correction()).unwrap();
    let Sensor::Potentiometer(sensor) = document.robot().unwrap().sensor else { panic!("potentiometer expected") };
    assert_eq!(sensor.correction, Some(correction()));
    let refused = Document::load(&root().join("robots/bench-linear.toml")).unwrap().set_correction(&correction());
    assert!(refused.unwrap_err().to_string().contains("sensor.correction: unknown field"));
}

#[test]
fn a_refused_edit_leaves_the_document_as_it_was() {
    let mut document = default_robot();
    let before = document.to_string();
    assert!(document.set("motor.resistance_ohm", &quantity(-1.0, -2.0, 0.0)).is_err());
    assert!(document.set("motor.resistance_ohm", &quantity(f64::NAN, 1.0, 2.0)).is_err());
    assert!(document.set("motor.colour", &quantity(1.0, 1.0, 1.0)).is_err());
    assert!(document.set("name.of", &quantity(1.0, 1.0, 1.0)).is_err());
    assert!(document.set_effect("magic", &stribeck()).is_err());
    assert!(document.set_effect("sensor_delay", &stribeck()).is_err());
    assert!(document.remove("effects.gravity_tilt").is_err());
    assert!(document.remove("motor").is_err());
    assert_eq!(document.to_string(), before);
}

#[test]
fn a_variant_is_edited_without_touching_its_base() {
    let path = root().join("robots/motor-136.toml");
    let mut document = Document::load(&path).unwrap();
    document.set("motor.resistance_ohm", &quantity(16.0, 15.0, 17.0)).unwrap();
    document.remove("effects.battery_sag").unwrap();
    document.remove("effects.coulomb_friction").unwrap();
    document.set_effect("stribeck_friction", &stribeck()).unwrap();
    let robot = document.robot().unwrap();
    assert_eq!(robot.motor.resistance_ohm.value, 16.0);
    let listed: Vec<_> = robot.effects.listed().map(effects::Id::name).collect();
    assert_eq!(listed, ["stribeck_friction", "driver_drop", "sensor_nonlinearity"]);
    // Elsewhere it still finds its base.
    let directory = tempfile::tempdir().unwrap();
    let elsewhere = directory.path().join("extended.toml");
    document.save(&elsewhere).unwrap();
    assert_eq!(Robot::load(&elsewhere).unwrap(), robot);
}

#[test]
fn what_was_removed_can_come_back() {
    let mut document = Document::load(&root().join("robots/motor-136.toml")).unwrap();
    document.remove("effects.battery_sag").unwrap();
    let sag = [
        ("resistance_ohm", quantity(0.5, 0.4, 0.6)),
        ("relaxation_ohm", quantity(0.1, 0.0, 0.2)),
        ("relaxation_s", quantity(0.1, 0.05, 0.2)),
    ];
    document.set_effect("battery_sag", &sag).unwrap();
    let effects = document.robot().unwrap().effects;
    assert_eq!(effects.quantity("battery_sag", "resistance_ohm"), Some(&sag[0].1));
    document.remove("effects.battery_sag").unwrap();
    assert_eq!(document.robot().unwrap().effects.quantity("battery_sag", "resistance_ohm"), None);
}

#[test]
fn saving_replaces_the_file_or_leaves_it() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("robot.toml");
    let document = default_robot();
    document.save(&path).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), document.to_string());
    assert_eq!(std::fs::read_dir(&directory).unwrap().count(), 1, "no temporary file is left");

    // A file where a directory is needed.
    let below_a_file = path.join("robot.toml");
    let error = document.save(&below_a_file).unwrap_err().to_string();
    assert!(error.starts_with(&format!("{}: cannot be written: ", below_a_file.display())), "{error}");
    // A directory in the file's place: the rename fails and nothing stays behind.
    let occupied = directory.path().join("occupied.toml");
    std::fs::create_dir_all(occupied.join("x")).unwrap();
    assert!(document.save(&occupied).is_err());
    assert_eq!(std::fs::read_dir(&directory).unwrap().count(), 2, "no temporary file is left");
}

#[test]
fn what_must_fit_together_is_changed_together() {
    let mut document = default_robot();
    let eccentric = document.robot().unwrap().eccentric.unwrap();
    let longer = Quantity { value: 0.012, ..eccentric.radius_m.clone() };
    let alone = document.set("eccentric.radius_m", &longer).unwrap_err().to_string();
    assert!(alone.contains("load.inertia_kg_m2"), "{alone}");
    let load = document.robot().unwrap().load.inertia_kg_m2;
    let changed = robot_file::robot::Eccentric { radius_m: longer.clone(), ..eccentric };
    let load = Quantity { value: changed.inertia_kg_m2(), high: 1e-6, ..load };
    document.set_all(&[("eccentric.radius_m", longer), ("load.inertia_kg_m2", load)]).unwrap();
    assert_eq!(document.robot().unwrap().eccentric.unwrap(), changed);
}
