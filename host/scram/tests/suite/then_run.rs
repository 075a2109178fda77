//! From recordings that leave several models to one that is named, in one command: the experiment is designed, run through the
//! console, and diagnosed again.

use std::path::Path;

use crate::common::command::{succeeds, temporary};
use crate::common::root;

/// The bench's motor with the robot's potentiometer, calibrated and without play.
const POTENTIOMETER: &str = "[sensor]\n\
    hysteresis_deg = { value = 0, low = 0, high = 0, source = \"test\" }\n\
    [sensor.adc]\n\
    spike_share = { value = 0, low = 0, high = 0, source = \"test\" }\n\
    inl_lsb = { value = 0, low = 0, high = 0, source = \"test\" }\n";
const DROP: &str = "[effects.driver_drop]\n\
    drop_v = { value = 0.8, low = 0.8, high = 0.8, source = \"test\" }\n\
    knee_a = { value = 0, low = 0, high = 0, source = \"test\" }\n\
    slope_ohm = { value = 0, low = 0, high = 0, source = \"test\" }\n";

/// Writes the robot file of the bench as people believe it to be, `model.toml`, and as it is, `truth.toml`.
fn write_robots(at: &Path) {
    let text = std::fs::read_to_string(root().join("robots/bench-linear.toml")).unwrap();
    let base = format!("base = {:?}", root().join("robot.toml"));
    let text = text.replace("base = \"../robot.toml\"", &base).replace("remove = [\"sensor\", ", "remove = [");
    let (text, _) = text.split_once("[sensor]").unwrap();
    std::fs::write(at.join("model.toml"), text.to_owned() + POTENTIOMETER).unwrap();
    std::fs::write(at.join("truth.toml"), text.to_owned() + POTENTIOMETER + DROP).unwrap();
}

/// The effects of every model that a diagnosis leaves.
fn models(at: &Path, directory: &str) -> Vec<String> {
    let written = std::fs::read_to_string(at.join(directory).join("diagnosis.json")).unwrap();
    let diagnosis: serde_json::Value = serde_json::from_str(&written).unwrap();
    let models = diagnosis["models"].as_array().unwrap();
    models.iter().map(|model| model[0].as_str().unwrap().to_owned()).collect()
}

#[test]
fn the_experiment_is_run_through_the_console_and_leaves_fewer_models() {
    let directory = temporary();
    let at = directory.path();
    write_robots(at);
    let duties = [0.3, 0.4, -0.35, 0.45, -0.3, 0.35];
    for (number, duty) in duties.iter().enumerate() {
        succeeds(
            at,
            &format!("sim --bench --robot truth.toml --drive duty:{duty} --seconds 6 --seed 0 --out r{number}"),
        );
    }
    let runs: Vec<String> = (0..duties.len()).map(|number| format!("r{number}/run.mcap")).collect();
    let held_out = "--holdout r4/run.mcap --holdout r5/run.mcap";
    let words = format!("diagnose {} {held_out} --robot model.toml --out first", runs.join(" "));
    succeeds(at, &(words + " --then-run sim:truth.toml"));
    let (before, after) = (models(at, "first"), models(at, "first/then"));
    assert!(before.len() > 1 && before.contains(&"driver_drop".to_owned()), "{before:?}");
    assert!(after.len() < before.len() && after.contains(&"driver_drop".to_owned()), "{before:?}, then {after:?}");
    for number in [1, 2] {
        let recorded = std::fs::read_dir(at.join(format!("first/experiment-{number}"))).unwrap();
        let is_recording = |path: &Path| path.extension().is_some_and(|extension| extension == "mcap");
        assert_eq!(recorded.flatten().filter(|entry| is_recording(&entry.path())).count(), 1);
    }
}
