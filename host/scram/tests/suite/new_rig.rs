//! `scram new-rig`, as a person runs it: options, answers through a pipe, the check of recordings.

use std::io::Write as _;
use std::path::Path;
use std::process::{Output, Stdio};

use crate::common::command::{command, fails, json, refuses, scram, succeeds, succeeds_saying, temporary};
use control::Actuation;
use hal_sim::SimulatedRobot;
use recording::{AngleReading, Drive, Recording, write_csv};
use robot_file::Robot;
use robot_file::robot::Sensor;

const LABEL: &str = "new-rig --supply-v 12 --no-load-rpm 300 --stall-a 2.5 --load disc:0.2:0.04 --sensor encoder:1024";

/// Runs it with answers through a pipe.
fn answered(directory: &Path, words: &str, answers: &str) -> Output {
    let mut child =
        command(directory, words).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(answers.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

/// Runs without anybody who answers.
fn alone(directory: &Path, words: &str) -> Output {
    command(directory, words).stdin(Stdio::null()).output().unwrap()
}

#[track_caller]
fn loads(directory: &Path, name: &str) -> Robot {
    Robot::load(&directory.join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// A run of a rig with another torque constant and inertia than its file has, at a factor on the angle.
fn record(file: &Robot, path: &Path, angle_factor: f64) {
    let mut rig = file.clone();
    rig.motor.torque_constant_nm_per_a.value *= 0.8;
    rig.motor.rotor_inertia_kg_m2.value *= 1.4;
    let mut world = SimulatedRobot::new(&rig, 1);
    let (mut duties, mut angles) = (Vec::new(), Vec::new());
    let mut run = Recording::default();
    for row in 0_u32..6000 {
        let duty = f64::from((row / 250 * 7) % 11) / 5.0 - 1.0;
        run.t_s.push(f64::from(row) * world.tick_s());
        angles.push(Some(angle_factor * world.truth().angle));
        duties.push(duty);
        let _ = world.sample();
        world.advance(Actuation { duty: duty as f32, enable: true });
    }
    run.enable = vec![true; duties.len()];
    run.drive = Drive::Duty(duties);
    run.angle = AngleReading::Angle(angles);
    write_csv(path, &run).unwrap();
}

#[test]
fn options_write_a_file_whose_numbers_follow_from_the_label() {
    let directory = temporary();
    let at = directory.path();
    let said = succeeds(at, LABEL);
    assert_eq!(said, "written: rig.toml\n");
    let robot = loads(at, "rig.toml");
    let motor = &robot.motor;
    assert_eq!((robot.name.as_str(), robot.supply.rail_v.value), ("rig", 12.0));
    assert_eq!(motor.resistance_ohm.value, 4.8, "12 V over 2.5 A");
    // 300 rpm are 31.42 rad/s; a tenth of the voltage is taken for the current without load.
    assert!(
        (motor.torque_constant_nm_per_a.value - 0.9 * 12.0 / 31.4159).abs() < 1e-3,
        "{:?}",
        motor.torque_constant_nm_per_a
    );
    assert_eq!(robot.load.inertia_kg_m2.value, 1.6e-4, "half of m r²");
    let Sensor::Encoder(encoder) = &robot.sensor else { panic!("{:?}", robot.sensor) };
    assert_eq!(encoder.counts_per_turn.value, 1024.0);
    let text = std::fs::read_to_string(at.join("rig.toml")).unwrap();
    for quantity in text.lines().filter(|line| line.contains("value =")) {
        let sourced = ["label", "estimated", "unknown", "no gears"].iter().any(|word| quantity.contains(word));
        assert!(sourced, "no source: {quantity}");
    }
    // It simulates: full duty without a load's friction reaches the speed of the label.
    let mut world = SimulatedRobot::new(&robot, 1);
    for _ in 0..1000 {
        let _ = world.sample();
        world.advance(Actuation { duty: 1.0, enable: true });
    }
    let speed = world.truth().speed;
    assert!((0.9..1.1).contains(&(speed / 31.4159)), "{speed} rad/s");
}

#[test]
fn answers_come_through_a_pipe() {
    let directory = temporary();
    let at = directory.path();
    // Supply, label's voltage, speed, stall current, current without load, gears, where, load, sensor, driver, PWM, sampling.
    let answers = "12 V\n\n10200\n2,5\n0.1\n34\nmotor\nunknown\npotentiometer 10 270\nbipolar\n490\n\n";
    let output = answered(at, "new-rig --out pot.toml", answers);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let robot = loads(at, "pot.toml");
    assert_eq!((robot.name.as_str(), robot.motor.gear_ratio.value), ("pot", 34.0));
    assert!((robot.motor.torque_constant_nm_per_a.value - 12.0 * 0.96 / 31.4159).abs() < 1e-3);
    assert_eq!(robot.driver.pwm_frequency_hz.value, 490.0);
    let Sensor::Potentiometer(sensor) = &robot.sensor else { panic!("{:?}", robot.sensor) };
    assert_eq!((sensor.adc.bits.value, sensor.electrical_angle_deg.value), (10.0, 270.0));
    assert_eq!(robot.effects.listed().map(|id| id.name()).collect::<Vec<_>>(), ["driver_drop"]);
}

#[test]
fn torque_and_current_make_a_motor_without_a_speed() {
    let directory = temporary();
    let words =
        "new-rig --supply-v 6 --no-load-rpm unknown --stall-a 1.5 --stall-torque-nm 0.3 --sensor ideal --load none";
    succeeds(directory.path(), words);
    let motor = loads(directory.path(), "rig.toml").motor;
    assert_eq!((motor.torque_constant_nm_per_a.value, motor.resistance_ohm.value), (0.2, 4.0));
}

#[test]
fn what_is_missing_is_named_with_its_option() {
    let directory = temporary();
    let at = directory.path();
    for (words, option) in [
        ("new-rig", "--supply-v 12"),
        ("new-rig --supply-v 12", "--no-load-rpm 300"),
        ("new-rig --supply-v 12 --no-load-rpm 300 --stall-a 2", "--sensor encoder:1024"),
        ("new-rig --supply-v 12 --no-load-rpm unknown --stall-a 2", "--stall-torque-nm 0.5"),
    ] {
        let output = alone(at, words);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{words}: {message}");
        assert!(message.contains(option), "{words}: {message}");
    }
    fails(at, "new-rig --supply-v twelve", 2, &["--supply-v", "`twelve` is no number in V"]);
    fails(at, "new-rig --supply-v unknown", 2, &["measure it"]);
    fails(at, "new-rig --supply-v 1,200", 2, &["--supply-v", "`1,200` may mean two numbers"]);
    fails(at, &format!("{LABEL} --no-load-a 3"), 2, &["--no-load-a", "2.5"]);
    fails(at, &LABEL.replace("encoder:1024", "resolver"), 2, &["encoder:COUNTS, potentiometer:BITS:DEG"]);
    fails(at, &LABEL.replace("encoder:1024", "encoder:2"), 1, &["sensor.counts_per_turn.value", "4 … 65536"]);
    let nothing =
        "new-rig --supply-v 6 --no-load-rpm unknown --stall-a 1 --stall-torque-nm unknown --sensor ideal --load none";
    fails(at, nothing, 2, &["too little to know the motor by"]);
    assert!(!at.join("rig.toml").exists(), "nothing is written");
}

#[test]
fn a_file_is_written_over_with_force_only() {
    let directory = temporary();
    let at = directory.path();
    std::fs::write(at.join("rig.toml"), "mine").unwrap();
    refuses(at, LABEL, 1, &["rig.toml is there already", "--force"]);
    assert_eq!(std::fs::read_to_string(at.join("rig.toml")).unwrap(), "mine");
    succeeds(at, &format!("{LABEL} --force"));
    loads(at, "rig.toml");
}

#[test]
fn a_check_passes_the_rig_and_says_what_is_wrong_with_another_unit() {
    let directory = temporary();
    let at = directory.path();
    succeeds(at, LABEL);
    let robot = loads(at, "rig.toml");
    record(&robot, &at.join("right.csv"), 1.0);
    record(&robot, &at.join("reversed.csv"), -1.0);
    record(&robot, &at.join("turns.csv"), 1.0 / std::f64::consts::TAU);
    assert_eq!(succeeds(at, "new-rig --check rig.toml right.csv"), "rig.toml: nothing is wrong in 1 recording\n");
    let says = |words: &str, parts: &[&str]| {
        let output = scram(at, words);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(3), "{words}: {said}{}", String::from_utf8_lossy(&output.stderr));
        parts.iter().for_each(|part| assert!(said.contains(part), "{words}: `{said}` does not say `{part}`"));
    };
    says("new-rig --check rig.toml reversed.csv", &["turns against its drive", "--map angle=-COLUMN:UNIT"]);
    says("new-rig --check rig.toml turns.csv", &["--map angle=COLUMN:turns", "rig.toml:10: ", "to know which:"]);
    let report = json(&String::from_utf8(scram(at, "new-rig --check rig.toml turns.csv --json").stdout).unwrap());
    assert_eq!(report["findings"][0]["mends"][0]["causes"][0]["angle_unit"], "turns");
    // With the mapping that it asks for the same file passes.
    let mapped = "--map time=t_s:s --map angle=angle_rad:turns --map duty=duty:1";
    let (said, _) = succeeds_saying(at, &format!("new-rig --check rig.toml turns.csv {mapped}"));
    assert!(said.contains("nothing is wrong"), "{said}");
    // And in one go with the writing.
    let said = succeeds(at, &format!("{LABEL} --out again.toml --check right.csv"));
    assert!(said.contains("written: again.toml\nagain.toml: nothing is wrong"), "{said}");
}

#[test]
fn a_duty_that_is_none_is_a_finding_even_where_nothing_turns_and_a_missing_file_is_none() {
    let directory = temporary();
    let at = directory.path();
    succeeds(at, LABEL);
    std::fs::write(at.join("percent.csv"), "t_s,duty,angle_rad\n0,50,0\n0.001,60,0.1\n").unwrap();
    let output = scram(at, "new-rig --check rig.toml percent.csv");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("if the duty is in percent: ") && said.contains("divide duty by 100"), "{said}");
    refuses(at, "new-rig --check rig.toml nothing.csv", 1, &["nothing.csv"]);
    std::fs::write(at.join("row.csv"), "t_s,duty,angle_rad\n0,0.5,0\n").unwrap();
    refuses(at, "new-rig --check rig.toml row.csv", 1, &["nothing was checked", "row.csv"]);
    refuses(at, "new-rig --check rig.toml", 2, &["no recording is named"]);
}
