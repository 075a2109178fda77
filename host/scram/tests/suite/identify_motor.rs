//! `scram identify motor` on simulated bench runs of a motor with friction that its file does not know, with the command as a person
//! uses it.

use std::path::Path;

use crate::common::command::{fails, json, succeeds, temporary};
use crate::common::root;

const FRICTION: &str = "[effects.coulomb_friction]\n\
    torque_nm = { value = 3e-4, low = 3e-4, high = 3e-4, source = \"test\" }\n\
    presliding_deg = { value = 0.2, low = 0.2, high = 0.2, source = \"test\" }\n";
/// Both ways, with steps and coasting.
const SCRIPTS: [[f64; 4]; 4] =
    [[0.6, -0.4, 0.3, -0.7], [-0.5, 0.8, -0.3, 0.5], [0.4, -0.8, 0.6, -0.3], [-0.6, 0.4, -0.5, 0.7]];

/// Four runs of the motor as it is, and the file as people believe it to be.
fn runs(at: &Path) -> String {
    let text = std::fs::read_to_string(root().join("robots/bench-linear.toml")).unwrap();
    let base = format!("base = {:?}", root().join("robot.toml"));
    let text = text.replace("base = \"../robot.toml\"", &base);
    std::fs::write(at.join("model.toml"), &text).unwrap();
    std::fs::write(at.join("truth.toml"), text + FRICTION).unwrap();
    let mut words = String::new();
    for (number, duties) in SCRIPTS.iter().enumerate() {
        let orders = duties.iter().enumerate().map(|(k, duty)| {
            let at = 0.9 * k as f64;
            format!("{at} duty {duty}\n{:.2} coast\n", at + 0.6)
        });
        std::fs::write(at.join(format!("steps-{number}.txt")), orders.collect::<String>()).unwrap();
        let set = "--set motor.resistance_ohm=18 --set motor.torque_constant_nm_per_a=0.019";
        let words_of = format!(
            "sim --bench --robot truth.toml --drive script:steps-{number}.txt --seconds 3.6 --seed {number} --out r{number} {set}"
        );
        succeeds(at, &words_of);
        words += &format!(" r{number}/run.mcap");
    }
    words
}

#[test]
fn a_known_resistance_tells_inertia_and_friction_and_the_file_has_them() {
    let directory = temporary();
    let at = directory.path();
    let runs = runs(at);
    let words = format!("identify motor{runs} --robot model.toml --resistance 18 --out found --json");
    let said = json(&succeeds(at, &words));
    assert_eq!(said["friction"][0], "coulomb_friction");
    let robot = robot_file::Robot::load(&at.join("found/robot.toml")).unwrap();
    let near = |value: f64, truth: f64| assert!((value / truth - 1.0).abs() < 0.05, "{value:e}, truth {truth:e}");
    near(robot.motor.torque_constant_nm_per_a.value, 0.019);
    near(robot.motor.rotor_inertia_kg_m2.value, 1.2e-6);
    near(robot.motor.resistance_ohm.value, 18.0);
    near(said["volts"]["coulomb_friction.torque_v"][0].as_f64().unwrap(), 3e-4 * 18.0 / 0.019);
    assert!(said["after_rad"].as_f64().unwrap() < 0.5 * said["before_rad"].as_f64().unwrap(), "{said}");
}

#[test]
fn what_angle_and_drive_leave_open_is_said() {
    let directory = temporary();
    let at = directory.path();
    let runs = runs(at);
    let said = succeeds(at, &format!("identify motor{runs} --robot model.toml --out found"));
    assert!(
        said.contains("coulomb_friction.torque_v") && said.contains("by what the file or the options say"),
        "{said}"
    );
    fails(at, &format!("identify motor{runs} --robot model.toml --resistance 0 --out other"), 2, &["positive number"]);
    fails(at, "identify motor r0/run.mcap --robot model.toml --out other", 2, &["at least two recordings"]);
}
