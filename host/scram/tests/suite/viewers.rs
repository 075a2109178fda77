//! Recordings of `scram sim` as viewers see them: read by the official packages of MCAP and Foxglove, and by Rerun's own
//! loader, against the tables that the same run writes. Skipped, and said so, where `target/viewers-venv` has not been made
//! (docs/viewers.md); with SCRAM_ALL_PEERS=1 that is a failure.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::command::{succeeds, temporary};
use crate::common::csv::Csv;
use crate::common::root;
use serde_json::Value;
use testbed::peers::skip;

/// Names a Python that has the packages, instead of the environment's.
const PYTHON: &str = "SCRAM_VIEWERS_PYTHON";
/// States a second of a scene, and ticks a second of the robot.
const RATE: usize = 100;
const TICKS: usize = 1000;

/// The Python with a package; skips where there is none.
fn python(package: &str) -> Option<PathBuf> {
    let usual = || root().join("target/viewers-venv/bin/python");
    let python = std::env::var_os(PYTHON).map_or_else(usual, PathBuf::from);
    let asked = Command::new(&python).args(["-c", &format!("import {package}")]).output();
    if asked.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    let how =
        "python3 -m venv target/viewers-venv && target/viewers-venv/bin/pip install -r tests/viewers/requirements.txt";
    skip(&format!("no {package} at {}: {how}, or name a Python that has it in {PYTHON}", python.display()));
    None
}

/// What a script prints.
fn found(python: &Path, script: &str, words: &[&str]) -> String {
    let output = Command::new(python).arg("-B").arg(root().join("tests/viewers").join(script)).args(words).output();
    let output = output.expect("Python starts");
    assert!(output.status.success(), "{script}:\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn read(python: &Path, recording: &Path, words: &[&str]) -> Value {
    let path = recording.display().to_string();
    serde_json::from_str(&found(python, "read.py", &[&[path.as_str()], words].concat())).unwrap()
}

/// A run of 0.5 s; its directory.
fn run(directory: &Path, words: &str) -> PathBuf {
    succeeds(directory, &format!("sim --robot @/robot.toml --seconds 0.5 --alpha 90 {words}"));
    directory.join("out/latest")
}

#[track_caller]
fn close(found: &Value, expected: &[f64], tolerance: f64) {
    let found: Vec<f64> = found.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    assert_eq!(found.len(), expected.len());
    let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off <= tolerance, "{found:?} against {expected:?}");
}

/// A frame's position and quaternion, or a foot's position and force, in a row of the track.
fn cells(track: &Csv, names: &[String], row: usize) -> Vec<f64> {
    names.iter().map(|name| track.column(name)[row]).collect()
}

#[test]
fn foxglove_reads_poses_transforms_feet_and_forces() {
    let Some(python) = python("mcap_protobuf, foxglove") else { return };
    let directory = temporary();
    let out = run(directory.path(), "");
    let track = Csv::read(&out.join("track.csv"));
    let seen = read(&python, &out.join("run.mcap"), &[]);
    assert_eq!(seen["is_sorted"], true);
    for (topic, schema) in [
        ("/tf", "foxglove.FrameTransforms"),
        ("/pose", "foxglove.PoseInFrame"),
        ("/feet", "foxglove.PointCloud"),
        ("/forces", "foxglove.SceneUpdate"),
        ("/scene", "foxglove.SceneUpdate"),
    ] {
        assert_eq!(seen["schemas"][topic], schema);
    }
    let states = RATE / 2;
    for topic in ["tf", "pose", "feet", "forces"] {
        assert_eq!(seen[topic].as_array().unwrap().len(), states, "{topic}");
    }
    let (mut touching, mut turned) = (0, 0.0_f64);
    for state in (0..states).step_by(7) {
        let row = state * TICKS / RATE;
        let frames = &seen["tf"][state]["frames"];
        for module in 1..=4 {
            let name = |part: &str| format!("module{module}_{part}");
            let frame = &frames[format!("module{module}")];
            assert_eq!(frame["parent"], "world");
            close(&frame["at"], &cells(&track, &["x_m", "y_m", "z_m"].map(name), row), 1e-7);
            close(&frame["turn"], &cells(&track, &["qw", "qx", "qy", "qz"].map(name), row), 1e-7);
        }
        let rotor = &frames["rotor"];
        assert_eq!(rotor["parent"], "module1");
        let half = 0.5 * track.column("rotor_angle_rad")[row];
        close(&rotor["turn"], &[half.cos(), 0.0, 0.0, half.sin()], 1e-6);
        turned = turned.max(half.abs());
        close(&seen["pose"][state]["at"], &cells(&track, &["x_m", "y_m", "z_m"].map(String::from), row), 1e-7);
        let yaw = 0.5 * track.column("yaw_rad")[row];
        close(&seen["pose"][state]["turn"], &[yaw.cos(), 0.0, 0.0, yaw.sin()], 1e-7);
        touching += check_feet(&track, row, &seen["feet"][state], &seen["forces"][state]);
    }
    assert!(touching > 10 && turned > 1.0, "it walks: {touching} feet touch, the rotor turns {turned} rad");
    check_shapes(&seen);
}

/// Points and arrows of a state; how many feet touch.
fn check_feet(track: &Csv, row: usize, points: &Value, arrows: &Value) -> usize {
    let mut forces = Vec::new();
    for (foot, point) in points.as_array().unwrap().iter().enumerate() {
        let side = ["left", "right"][foot % 2];
        let name = |part: &str| format!("foot{}_{side}_{part}", foot / 2 + 1);
        let at = cells(track, &["x_m", "y_m", "z_m"].map(name), row);
        let force = cells(track, &["fx_n", "fy_n", "fz_n"].map(name), row);
        let told = |names: [&str; 3]| Value::from(names.map(|name| point[name].as_f64().unwrap()).to_vec());
        close(&told(["x", "y", "z"]), &at, 1e-6);
        close(&told(["fx_n", "fy_n", "fz_n"]), &force, 1e-5);
        let touches = force.iter().any(|part| *part != 0.0);
        assert_eq!(point["red"] == 179, touches, "coloured by whether it touches");
        if touches {
            forces.push((at, force));
        }
    }
    let arrows = arrows.as_array().unwrap();
    assert_eq!(arrows.len(), forces.len(), "an arrow a foot that touches");
    let norm = |vector: &[f64]| vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    let mut scales = Vec::new();
    for (arrow, (at, force)) in arrows.iter().zip(&forces) {
        close(&arrow["at"], at, 1e-6);
        let along: Vec<f64> = arrow["along"].as_array().unwrap().iter().map(|part| part.as_f64().unwrap()).collect();
        // Forces below some mN are rounded away in the table.
        if norm(force) > 0.01 {
            scales.push(norm(&along) / norm(force));
            let unit: Vec<f64> = along.iter().map(|part| part / norm(&along)).collect();
            close(&unit.into(), &force.iter().map(|part| part / norm(force)).collect::<Vec<_>>(), 2e-3);
        }
    }
    assert!(scales.windows(2).all(|pair| (pair[0] / pair[1] - 1.0).abs() < 2e-3), "one scale: {scales:?}");
    forces.len()
}

/// The scene's entities and the links of the URDF are the frames of the transforms.
fn check_shapes(seen: &Value) {
    let entities = seen["entities"].as_object().unwrap();
    let frames = seen["tf"][0]["frames"].as_object().unwrap();
    assert_eq!(frames.len(), 4 + 3 * 10 + 1);
    for name in frames.keys().map(String::as_str).chain(["world"]) {
        let entity = &entities[name];
        assert_eq!((entity["frame"].as_str(), &entity["locked"]), (Some(name), &Value::Bool(true)));
    }
    // A box, and a leg and a foot on either side.
    assert_eq!(entities["module2"]["shapes"], serde_json::json!([1, 2, 2]));
    let text = seen["urdf"].as_str().unwrap();
    let urdf = roxmltree::Document::parse(text).unwrap();
    let links: Vec<_> = urdf.descendants().filter(|node| node.has_tag_name("link")).collect();
    assert_eq!(links.len(), frames.len() + 1);
    let module = links.iter().find(|link| link.attribute("name") == Some("module2")).unwrap();
    assert_eq!(module.children().filter(|node| node.has_tag_name("visual")).count(), 5);
    let joints = urdf.descendants().filter(|node| node.has_tag_name("joint")).count();
    assert_eq!(joints, frames.len());
}

#[test]
fn foxglove_reads_the_shaft_of_a_bench() {
    let Some(python) = python("mcap_protobuf, foxglove") else { return };
    let directory = temporary();
    succeeds(directory.path(), "sim --robot @/robots/motor-136.toml --seconds 0.2 --bench --drive duty:1");
    let seen = read(&python, &directory.path().join("out/latest/run.mcap"), &[]);
    let csv = Csv::read(&directory.path().join("out/latest/run.csv"));
    let angles = csv.column("truth_angle_rad");
    let states = seen["tf"].as_array().unwrap();
    assert_eq!(states.len(), RATE / 5);
    for (state, found) in states.iter().enumerate() {
        let half = 0.5 * angles[state * TICKS / RATE];
        close(&found["frames"]["shaft"]["turn"], &[half.cos(), 0.0, 0.0, half.sin()], 1e-9);
    }
    assert!(angles.last().unwrap().abs() > 0.5, "it turns");
    assert_eq!(seen["pose"].as_array().unwrap().len() + seen["entities"].as_object().unwrap().len(), 0);
}

#[test]
fn rerun_decodes_poses_and_the_robot_without_set_up() {
    let Some(python) = python("rerun") else { return };
    let directory = temporary();
    let out = run(directory.path(), "");
    let track = Csv::read(&out.join("track.csv"));
    let seen = read(&python, &out.join("run.mcap"), &["--rerun"]);
    let states = (RATE / 2) as u64;
    let frames = 4 + 3 * 10 + 1;
    let rows = |entity: &str, component: &str| seen[entity]["rows"][component].as_u64().unwrap_or(0);
    // A row a transform, or a row a message: all of them come.
    assert_eq!(rows("/tf", "Transform3D:translation"), states * frames);
    assert_eq!(rows("/tf", "Transform3D:quaternion"), states * frames);
    assert_eq!(rows("/pose", "InstancePoses3D:translations"), states);
    assert_eq!(rows("/feet", "Points3D:positions"), states);
    let first = &seen["/pose"]["first"]["InstancePoses3D:translations"][0];
    close(first, &cells(&track, &["x_m", "y_m", "z_m"].map(String::from), 0), 1e-6);
    // The URDF's boxes, whichever entities Rerun gives them.
    let shapes = seen.as_object().unwrap().iter().filter(|(_, entity)| {
        entity["rows"]
            .as_object()
            .unwrap()
            .keys()
            .any(|name| name.starts_with("Boxes3D") || name.starts_with("Mesh3D") || name.starts_with("Asset3D"))
    });
    assert!(shapes.count() >= 4 + 30, "boxes of modules and segments: {:?}", seen.as_object().unwrap().keys());
}

#[test]
fn the_layout_in_the_documents_is_the_one_that_is_made() {
    let Some(python) = python("foxglove.layouts") else { return };
    let kept = std::fs::read_to_string(root().join("docs/viewers/foxglove.json")).unwrap();
    assert_eq!(found(&python, "layout.py", &[]), kept, "tests/viewers/layout.py > docs/viewers/foxglove.json");
}

#[test]
fn the_script_for_rerun_makes_a_recording() {
    let Some(python) = python("rerun, mcap_protobuf") else { return };
    let directory = temporary();
    let out = run(directory.path(), "");
    let saved = directory.path().join("run.rrd");
    let script = Command::new(&python)
        .arg("-B")
        .arg(root().join("docs/viewers/open_in_rerun.py"))
        .arg(out.join("run.mcap"))
        .arg("--save")
        .arg(&saved)
        .output()
        .unwrap();
    assert!(script.status.success(), "{}", String::from_utf8_lossy(&script.stderr));
    let text = found(&python, "stored.py", &[&saved.display().to_string()]);
    for entity in ["/forces/arrows Arrows3D:vectors", "/plots/duty Scalars:scalars", "/tf Transform3D:translation"] {
        assert!(text.lines().any(|line| line == entity), "no {entity} in\n{text}");
    }
}
