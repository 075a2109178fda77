//! `scram sim` for a robot with a body: what it writes and says of the walk, and what it refuses.

use std::path::Path;

use crate::common::command::{fails, json, succeeds, succeeds_saying, temporary};
use crate::common::csv::Csv;
use crate::common::root;
use serde_json::Value;

/// A file in a directory whose text changes the default robot.
fn robot(directory: &Path, name: &str, text: &str) {
    let base = root().join("robot.toml").canonicalize().unwrap();
    std::fs::write(directory.join(name), format!("base = {:?}\n{text}", base.display().to_string())).unwrap();
}

#[track_caller]
fn close(found: &Value, expected: f64, tolerance: f64) {
    let found = found.as_f64().unwrap_or_else(|| panic!("{found}"));
    assert!((found - expected).abs() <= tolerance, "{found} against {expected}");
}

#[test]
fn a_walk_is_told_as_its_track_has_it() {
    let directory = temporary();
    let said = json(&succeeds(directory.path(), "sim --robot @/robot.toml --drive freq:8 --alpha 90 --json"));
    let walk = &said["walk"];
    let out = directory.path().join("out/latest");
    for name in ["track.csv", "path.svg", "feet.svg", "gait.svg"] {
        assert!(said["files"].to_string().contains(name), "{name}");
    }
    let track = Csv::read(&out.join("track.csv"));
    let (time, x, y, yaw) = (track.column("t_s"), track.column("x_m"), track.column("y_m"), track.column("yaw_rad"));
    assert_eq!((time.len(), time[0], time[1000], time[2000]), (2001, 0.0, 1.0, 2.0));
    // The thesis's speeds: over the second half, in the frame of the start. It ends at t = 2 s.
    close(&walk["speeds_from_s"], 1.0, 1e-9);
    close(&walk["longitudinal_mm_per_s"], 1e3 * (x[2000] - x[1000]), 1e-3);
    close(&walk["lateral_mm_per_s"], 1e3 * (y[2000] - y[1000]), 1e-3);
    close(&walk["yaw_deg_per_s"], (yaw[2000] - yaw[1000]).to_degrees(), 1e-3);
    close(&walk["turned_deg"], (yaw[2000] - yaw[0]).to_degrees(), 1e-3);
    let path: f64 = (0..2000).map(|i| (x[i + 1] - x[i]).hypot(y[i + 1] - y[i])).sum();
    close(&walk["path_mm"], 1e3 * path, 0.3);
    let energy = track.column("energy_j");
    let gone = (x[2000] - x[1000]).hypot(y[2000] - y[1000]);
    let per_distance = (energy[2000] - energy[1000]) / gone;
    close(&walk["energy_per_distance_j_per_m"], per_distance, 1e-3 * per_distance);
    close(&said["energy_j"], energy[2000], 0.02 * energy[2000]);
    let shares = walk["contact_share"].as_array().unwrap();
    assert_eq!(shares.len(), 8);
    for (foot, share) in shares.iter().enumerate() {
        let name = format!("foot{}_{}_fz_n", foot / 2 + 1, ["left", "right"][foot % 2]);
        let touching = track.column(&name)[1000..].iter().filter(|force| **force > 0.0).count();
        close(share, touching as f64 / 1001.0, 0.01);
    }
    assert!(shares.iter().any(|share| share.as_f64().unwrap() < 0.95), "a gait lifts a foot at 8 Hz: {shares:?}");
    // A positive frequency is clockwise, and the rotor's angle counter-clockwise.
    let rotor = track.column("rotor_angle_rad");
    assert!(rotor[2000] - rotor[1000] < -45.0, "{}", rotor[2000] - rotor[1000]);
    // The feet carry the robot's weight.
    let feet = (1..=4).flat_map(|m| ["left", "right"].map(|side| track.column(&format!("foot{m}_{side}_fz_n"))));
    let weight = feet.map(|force| force[1000..].iter().sum::<f64>()).sum::<f64>() / 1001.0;
    assert!((weight / (0.04396 * 9.81) - 1.0).abs() < 0.03, "{weight} N");
}

#[test]
fn the_recording_has_the_pose_and_replays_to_the_bit() {
    let directory = temporary();
    succeeds(directory.path(), "sim --robot @/robot.toml --seconds 1");
    let out = directory.path().join("out/latest");
    let (run, track) = (Csv::read(&out.join("run.csv")), Csv::read(&out.join("track.csv")));
    assert_eq!(run.rows.len(), 1000);
    for name in ["x_m", "y_m", "yaw_rad"] {
        let (ours, theirs) = (run.column(name), track.column(name));
        assert!(ours.iter().zip(&theirs).all(|(a, b)| (a - b).abs() < 1e-6), "{name}");
    }
    for file in ["run.mcap", "run.csv"] {
        let said = json(&succeeds(
            directory.path(),
            &format!("replay out/latest/{file} --robot @/robot.toml --json --out again-{file}"),
        ));
        assert_eq!(said["same"], Value::Bool(true), "{said}");
        let compared = said["compared"].as_array().unwrap();
        assert!(compared.len() > 4 && compared.iter().all(|q| q["different"] == 0), "{said}");
    }
}

#[test]
fn on_the_bench_there_is_no_body() {
    let directory = temporary();
    robot(directory.path(), "bare.toml", "remove = [\"body\", \"backbone\", \"eccentric\", \"feet\", \"ground\"]\n");
    succeeds(directory.path(), "sim --robot @/robot.toml --seconds 1 --out walked");
    let words = "sim --robot @/robot.toml --seconds 1 --bench --out walked --overwrite";
    let (table, message) = succeeds_saying(directory.path(), words);
    assert!(table.contains("seed 1, the motor alone") && !table.contains("ground") && !table.contains("α"), "{table}");
    // The walk's files stay, and the table does not claim them.
    assert!(message.contains("not of this run, but in walked: path.svg, feet.svg, gait.svg, track.csv"), "{message}");
    assert!(!table.contains("path.svg") && directory.path().join("walked/path.svg").exists(), "{table}");
    succeeds(directory.path(), "sim --robot bare.toml --seconds 1 --out bare");
    let bytes = |out: &str, name: &str| std::fs::read(directory.path().join(out).join(name)).unwrap();
    assert_eq!(bytes("walked", "run.csv"), bytes("bare", "run.csv"));
    assert!(!Csv::read(&directory.path().join("bare/run.csv")).names.contains(&"x_m".to_owned()));
}

#[test]
fn a_clamped_robot_has_foot_paths_and_no_speeds() {
    let directory = temporary();
    let words = "sim --robot @/robots/bench-two-modules.toml --view walk.html";
    let table = succeeds(directory.path(), words);
    assert!(table.contains("seed 1, module 2 clamped, α 60°"), "{table}");
    for walks in ["on the ground, α", "speed ahead", "turning", "per distance"] {
        assert!(!table.contains(walks), "{walks}: {table}");
    }
    assert!(table.contains("module 1: ") && !table.contains("module 2: "), "{table}");
    let said = json(&succeeds(directory.path(), &format!("{words} --json")));
    assert!(said.get("walk").is_none(), "{said}");
    let clamped = &said["clamped"];
    assert_eq!((clamped["clamped_module"].as_u64(), clamped["feet_from_s"].as_f64()), (Some(2), Some(1.0)));
    let track = Csv::read(&directory.path().join("out/latest/track.csv"));
    let paths = clamped["foot_path_mm"].as_array().unwrap();
    assert_eq!(paths.len(), 4);
    for (foot, path) in paths.iter().enumerate() {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let column = track.column(&format!("foot{}_{}_{name}_m", foot / 2 + 1, ["left", "right"][foot % 2]));
            let late = &column[1000..];
            let size = late.iter().fold(f64::MIN, |a, b| a.max(*b)) - late.iter().fold(f64::MAX, |a, b| a.min(*b));
            close(&path[axis], 1e3 * size, 2e-3);
            assert_eq!(size > 1e-4, foot < 2, "the module that is clamped does not move: {clamped}");
        }
    }
    assert_eq!(clamped["contact_share"].to_string(), "[0.0,0.0,0.0,0.0]", "nothing is under the feet");
    let page = std::fs::read_to_string(directory.path().join("walk.html")).unwrap();
    assert!(page.contains("module 2 clamped") && page.contains("\"speeds\":null"), "no speeds in 3D either");
}

#[test]
fn alpha_is_the_robot_files_for_a_run() {
    let directory = temporary();
    robot(
        directory.path(),
        "ninety.toml",
        "[backbone]\nalpha_deg = { value = 90.0, low = 0.0, high = 120.0, source = \"test\" }\n",
    );
    let bytes = |out: &str| std::fs::read(directory.path().join(out).join("track.csv")).unwrap();
    let table = succeeds(directory.path(), "sim --robot @/robot.toml --seconds 0.5 --alpha 90 --out flag");
    assert!(table.contains("on the ground, α 90°"), "{table}");
    succeeds(directory.path(), "sim --robot ninety.toml --seconds 0.5 --out file");
    succeeds(directory.path(), "sim --robot @/robot.toml --seconds 0.5 --out default");
    assert_eq!(bytes("flag"), bytes("file"), "and the same seed gives the same bytes");
    assert_ne!(bytes("flag"), bytes("default"));
}

#[test]
fn the_pictures_are_drawings_of_every_foot() {
    let directory = temporary();
    succeeds(directory.path(), "sim --robot @/robot.toml --seconds 0.8 --view walk.html");
    let texts = |name: &str| {
        let svg = std::fs::read_to_string(directory.path().join("out/latest").join(name)).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let texts = document.descendants().filter(|node| node.has_tag_name("text"));
        texts.filter_map(|node| node.text().map(|text| text.trim().to_owned())).collect::<Vec<_>>()
    };
    let (gait, feet, path) = (texts("gait.svg"), texts("feet.svg"), texts("path.svg"));
    for foot in ["1 left", "1 right", "4 left", "4 right"] {
        assert!(gait.iter().any(|text| text == foot), "{foot}: {gait:?}");
        assert!(feet.iter().any(|text| text.starts_with(foot) && text.ends_with("from above")), "{foot}: {feet:?}");
    }
    assert!(gait.iter().any(|text| text.ends_with(" %")), "{gait:?}");
    assert!(["start", "end"].iter().all(|mark| path.iter().any(|text| text == mark)), "{path:?}");
    let page = std::fs::read_to_string(directory.path().join("walk.html")).unwrap();
    assert!(page.to_lowercase().starts_with("<!doctype html>"), "{}", &page[..200]);
    assert!(page.contains("freq:7 for 0.8 s"), "its title says what runs");
}

#[test]
fn what_cannot_walk_is_said_before_anything_runs() {
    let directory = temporary();
    let bad = |words: &str, code: i32, says: &[&str]| fails(directory.path(), words, code, says);
    let bench = "sim --robot @/robots/bench-linear.toml";
    bad(&format!("{bench} --view w.html"), 1, &["bench-linear", "no body", "--view"]);
    bad(&format!("{bench} --alpha 60"), 1, &["no body", "--alpha"]);
    bad("sim --robot @/robot.toml --view none/w.html", 1, &["--view none/w.html", "no directory none"]);
    std::fs::create_dir(directory.path().join("pages")).unwrap();
    bad("sim --robot @/robot.toml --view pages", 1, &["pages", "a directory"]);
    bad("sim --robot @/robot.toml --bench --view w.html", 2, &["--bench", "--view"]);
    bad("sim --robot @/robot.toml --alpha sixty", 2, &["--alpha", "360"]);
    bad("sim --robot @/robot.toml --alpha 400", 2, &["--alpha", "360"]);
    robot(directory.path(), "rolled.toml", "[backbone]\nroll_deg = [0.0, 30.0, 90.0]\n");
    for words in ["sim --robot rolled.toml", "export mjcf --robot rolled.toml"] {
        bad(&format!("{words} --alpha 60"), 1, &["backbone.roll_deg", "--alpha"]);
    }
    robot(directory.path(), "short.toml", "[backbone]\nroll_deg = [0.0, 30.0]\n");
    bad("sim --robot short.toml", 1, &["backbone.roll_deg", "3 backbones", "2 angles"]);
}

#[test]
fn a_run_that_blows_up_is_an_error_and_leaves_nothing() {
    let directory = temporary();
    // Backbones that carry nothing.
    let quantity = |axis: &str, unit: &str, value: f64| {
        format!("{axis}_{unit} = {{ value = {value}, low = {value}, high = 1.0, source = \"test\" }}\n")
    };
    let limp = |axis| quantity(axis, "nm_per_rad", 0.00001) + &quantity(axis, "nm_s_per_rad", 0.000001);
    let text = ["soft", "stiff", "torsion"].map(limp).concat();
    robot(directory.path(), "limp.toml", &format!("[backbone]\n{text}"));
    let says = ["the run blew up: at 0.", "has a joint at", "too soft to carry the robot"];
    fails(directory.path(), "sim --robot limp.toml --seconds 0.3", 1, &says);
}

#[test]
fn recorded_walks_are_as_their_own_file_says() {
    let directory = temporary();
    let at = directory.path();
    for drive in ["freq:6.3", "freq:-6.6", "duty:1", "freq:6.8"] {
        succeeds(at, &format!("sim --robot @/robot.toml --drive {drive} --seconds 2 --seed 5"));
    }
    let runs: Vec<String> = (1..5).map(|run| format!("out/run-000{run}/run.mcap")).collect();
    let diagnose = format!("diagnose --robot @/robot.toml {} --holdout {}", runs[..3].join(" "), runs[3]);
    let told = succeeds(at, &diagnose);
    assert!(told.contains("nothing to explain"), "{told}");
    // At full drive the gait never repeats, and soon no reading says where the feet are.
    let words: Vec<&str> = told.split_whitespace().collect();
    let left_out = words.windows(3).find(|words| words[..2] == ["left", "out"]).map(|words| words[2].parse::<f64>());
    assert!(left_out.is_some_and(|percent| percent.is_ok_and(|percent| (10.0..80.0).contains(&percent))), "{told}");
}
