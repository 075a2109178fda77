//! A policy that needs no training.

use std::path::{Path, PathBuf};

use learn::{Direction, PolicyFile, Settings};

/// Writes a policy of one layer that chooses one of two frequencies: the first where the robot looks to the left of where it began to, the
/// second where it looks to the right.
pub fn steering_policy(directory: &Path, interval_s: f64, left_right_hz: [f64; 2]) -> PathBuf {
    let settings = format!(
        "[turn]\ndrive = \"motor\"\nfrequencies_hz = {left_right_hz:?}\ninterval_s = {interval_s}\nepisode_s = 100"
    );
    let settings: Settings = toml::from_str(&settings).expect("a learning file");
    let network = serde_json::json!({ "layers": [{ "weights": [[0, 0, 1], [0, 0, -1]], "bias": [0, 0] }] });
    let policy = serde_json::from_value(network).expect("a network");
    let file =
        PolicyFile { robot: "robot-0".into(), direction: Direction::Left, seed: 1, updates: 0, settings, policy };
    let path = directory.join("policy.json");
    std::fs::write(&path, serde_json::to_string(&file).expect("text")).expect("written");
    path
}
