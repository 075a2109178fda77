//! `scram identify robot` on runs that were filmed, with the command as a person uses it. Whether it finds a robot's numbers is shown
//! by its own tests and by `cargo body-figures --only twelve-robots`.

use std::fmt::Write as _;
use std::path::Path;

use crate::common::assert_nothing_kept;
use crate::common::command::{fails, json, succeeds, temporary};

/// (f, α), and how the robot goes: mm/s ahead, mm/s to the left, °/s counter-clockwise.
const WALKS: [([f64; 2], [f64; 3]); 5] = [
    ([7.0, 60.0], [20.0, 3.0, 2.0]),
    ([8.0, 60.0], [31.0, -2.0, 1.0]),
    ([-7.0, 60.0], [18.0, -3.0, -2.0]),
    ([7.0, 90.0], [14.0, 6.0, 4.0]),
    ([-7.0, 90.0], [15.0, -6.0, -4.0]),
];

/// A table of files, and the files: a body that stands 30° off the room's axis, filmed at 100 Hz.
fn filmed(at: &Path) {
    let mut table = "f_hz,alpha_deg,file\n".to_owned();
    for (number, ([f, alpha], [ahead, left, yaw])) in WALKS.iter().enumerate() {
        let mut text = "t_s,x_mm,y_mm,z_mm,yaw_deg\n".to_owned();
        let (sin, cos) = 30f64.to_radians().sin_cos();
        for k in 0..=60 {
            let t = f64::from(k) * 0.01;
            let (x, y) = (cos * ahead * t - sin * left * t, sin * ahead * t + cos * left * t);
            writeln!(text, "{t:.2},{x:.5},{y:.5},20,{:.5}", 30.0 + yaw * t).unwrap();
        }
        std::fs::write(at.join(format!("walk-{number}.csv")), text).unwrap();
        writeln!(table, "{f},{alpha},walk-{number}.csv").unwrap();
    }
    std::fs::write(at.join("filmed.csv"), table).unwrap();
}

const FAST: &str = "--window 0.3,0.5 --draws 2 --robot @/robot.toml";

#[test]
fn filmed_walks_become_speeds_and_a_robot_file_with_intervals() {
    let directory = temporary();
    let at = directory.path();
    filmed(at);
    let words = format!("identify robot --measured filmed.csv {FAST} --holdout 8,60 --out found --json");
    let said = json(&succeeds(at, &words));
    for condition in said["conditions"].as_array().unwrap() {
        let key = [condition["f_hz"].as_f64().unwrap(), condition["alpha_deg"].as_f64().unwrap()];
        let (_, truth) = WALKS.iter().find(|(at, _)| *at == key).unwrap();
        for (part, truth) in truth.iter().enumerate() {
            let measured = condition["measured"][part].as_f64().unwrap();
            assert!((measured - truth).abs() < 0.03, "{condition}");
        }
        assert_eq!(condition["held_out"], key == [8.0, 60.0]);
    }
    let [before, after] = [0, 1].map(|k| said["thesis_loss"][k].as_f64().unwrap());
    assert!(after < before, "{before} {after}");
    let file = at.join("found/robot.toml");
    let robot = robot_file::Robot::load(&file).unwrap();
    assert!(robot.backbone.unwrap().soft_nm_per_rad.source.contains("identify robot"));
    assert!(std::fs::read_to_string(at.join("found/robot.svg")).unwrap().contains("measured vx, mm/s"));
    assert_nothing_kept(at);
}

#[test]
fn what_cannot_be_used_is_said() {
    let directory = temporary();
    let at = directory.path();
    filmed(at);
    let refused = |words: &str, code, says: &[&str]| fails(at, &format!("identify robot {words}"), code, says);
    refused(&format!("--measured filmed.csv {FAST} --holdout 9,60"), 1, &["no run of 9 Hz and 60°"]);
    refused(
        "--measured filmed.csv --robot @/robot.toml --window 1,2",
        1,
        &["walk-0.csv", "from 1 s to 2 s", "--window"],
    );
    refused("--measured filmed.csv --robot @/robot.toml --window 2,1", 2, &["the second one later"]);
    refused(&format!("--measured none.csv {FAST}"), 1, &["none.csv", "cannot be read"]);
    std::fs::write(at.join("few.csv"), "f_hz,alpha_deg,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s\n7,60,1,2,3\n").unwrap();
    refused(&format!("--measured few.csv {FAST}"), 1, &["1 conditions with a speed, of 4 at least"]);
    std::fs::write(at.join("odd.csv"), "f_hz,alpha_deg,vx_mm_per_s\n7,60,1\n").unwrap();
    refused(&format!("--measured odd.csv {FAST}"), 1, &["odd.csv:1", "no column vy_mm_per_s"]);
}
