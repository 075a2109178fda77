//! `scram diagnose --measured`, with the command as a person uses it. Whether it finds what is missing is shown by its own tests and by
//! `cargo blind-walks`.

use std::fmt::Write as _;
use std::path::Path;

use crate::common::command::{fails, json, succeeds, temporary};
use crate::common::{assert_nothing_kept, root};

const FAST: &str = "--window 0.2,0.4 --robot @/robot.toml";

/// Speeds of the file's own robot under eight conditions, steps half as long.
fn walked(at: &Path) {
    let robot = robot_file::Robot::load(&root().join("robot.toml")).unwrap();
    let plan = hal_sim::body::Plan::new(&robot).unwrap();
    let conditions: Vec<(f64, f64)> =
        [30.0, 90.0].iter().flat_map(|alpha| [-8.0, -6.0, 6.0, 8.0].map(|f| (f, *alpha))).collect();
    let run = identify::robot::Run { from_s: 0.2, to_s: 0.4, step_s: 1e-4 };
    let speeds = identify::robot::simulate(&[Some(plan)], &conditions, run).remove(0).unwrap();
    let mut table = "f_hz,alpha_deg,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s\n".to_owned();
    for ((f, alpha), [vx, vy, yaw]) in conditions.iter().zip(speeds) {
        writeln!(table, "{f},{alpha},{vx},{vy},{yaw}").unwrap();
    }
    std::fs::write(at.join("speeds.csv"), table).unwrap();
}

#[test]
fn a_robot_that_is_its_file_lacks_nothing() {
    let directory = temporary();
    let at = directory.path();
    walked(at);
    let said =
        json(&succeeds(at, &format!("diagnose --measured speeds.csv {FAST} --holdout=-6,90 --out found --json")));
    assert_eq!((said["verdict"].as_str(), said["causes"].as_array().unwrap().len()), (Some("nothing"), 0), "{said}");
    let held_out = said["conditions"].as_array().unwrap().iter().filter(|one| one["held_out"] == true).count();
    assert_eq!(held_out, 1);
    assert!(said["models"].as_array().unwrap().len() > 5, "{}", said["models"]);
    assert!(said["limits"].as_array().unwrap().iter().any(|one| one["effect"] == "ground_slope"), "{}", said["limits"]);
    let page = std::fs::read_to_string(at.join("found/report.html")).unwrap();
    for words in ["Diagnosis of the walk", "measured vx, mm/s", "Anisotropic friction of the feet", "scram sweep"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(robot_file::Robot::load(&at.join("found/robot.toml")).is_ok());
    assert_nothing_kept(at);
}

#[test]
fn what_cannot_be_used_is_said() {
    let directory = temporary();
    let at = directory.path();
    std::fs::write(at.join("few.csv"), "f_hz,alpha_deg,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s\n7,60,1,2,3\n").unwrap();
    let refused = |words: &str, code, says: &[&str]| fails(at, &format!("diagnose {words}"), code, says);
    refused(&format!("--measured few.csv {FAST}"), 1, &["1 conditions with a speed, of 4 at least"]);
    refused(&format!("--measured few.csv {FAST} --holdout 7,90"), 1, &["no run of 7 Hz and 90°"]);
    refused(&format!("--measured few.csv {FAST} --holdout run.csv"), 2, &["frequency in Hz and α in degrees"]);
    refused(&format!("run.csv --measured few.csv {FAST}"), 2, &["recordings of a shaft cannot stand beside it"]);
    refused(&format!("--measured few.csv {FAST} --try gravity_tilt"), 2, &["--try cannot stand beside it"]);
    refused("--measured none.csv --robot @/robot.toml", 1, &["none.csv", "cannot be read"]);
    refused("--robot @/robot.toml", 2, &["RUNS"]);
}
