//! From recordings that do not tell models apart to one that does, with the command as a person uses it.

use std::path::Path;

use crate::common::command::{fails, json, succeeds, temporary};
use crate::common::root;

/// A bench with an encoder.
const ENCODER: &str = "kind = \"encoder\"\n\
    counts_per_turn = { value = 4096, low = 4096, high = 4096, source = \"test\" }\n\
    noise_deg = { value = 0.2, low = 0.2, high = 0.2, source = \"test\" }\n";
const DROP: &str = "[effects.driver_drop]\n\
    drop_v = { value = 0.8, low = 0.8, high = 0.8, source = \"test\" }\n\
    knee_a = { value = 0, low = 0, high = 0, source = \"test\" }\n\
    slope_ohm = { value = 0, low = 0, high = 0, source = \"test\" }\n";

/// What takes the same of every drive as long as the supply is the same, and how far the two may be apart all the same: a drop is fitted
/// without a knee and a dead time with one, of which steady drives say nothing, so that they differ where next to no current flows.
const SAME_AT_ONE_SUPPLY: [([&str; 2], f64); 2] =
    [(["driver_drop", "driver_dead_time"], 1.1), (["driver_deadband", "driver_drop_by_command"], 1.01)];

/// The effect that a robot file of the diagnosis lists.
fn effect_of(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let (_, table) = text.split_once("[effects.").unwrap();
    table.split(']').next().unwrap().to_owned()
}

/// Writes the robot file of a bench as people believe it to be, `model.toml`, and as it is, `truth.toml`.
fn write_robots(directory: &Path) {
    let text = std::fs::read_to_string(root().join("robots/bench-linear.toml")).unwrap();
    let base = format!("base = {:?}", root().join("robot.toml"));
    let text = text.replace("base = \"../robot.toml\"", &base).replace("kind = \"ideal\"\n", ENCODER);
    std::fs::write(directory.join("model.toml"), &text).unwrap();
    std::fs::write(directory.join("truth.toml"), text + DROP).unwrap();
}

#[test]
fn the_proposed_recording_tells_what_the_first_ones_do_not() {
    let directory = temporary();
    let at = directory.path();
    write_robots(at);
    // Steady drives: what the bridge drops looks like a friction, and like a deadband.
    for (seed, duty) in [0.3, 0.4, -0.35, 0.45, -0.3, 0.35].iter().enumerate() {
        succeeds(
            at,
            &format!("sim --bench --robot truth.toml --drive duty:{duty} --seconds 3 --seed {seed} --out r{seed}"),
        );
    }
    let runs = "r0/run.mcap r1/run.mcap r2/run.mcap r3/run.mcap r4/run.mcap r5/run.mcap";
    let told = succeeds(at, &format!("diagnose {runs} --holdout r5/run.mcap --robot model.toml --out first"));
    assert!(told.contains("ambiguous"), "{told}");
    assert!(told.contains("tell them apart: scram design-experiment first/robot.toml first/robot-2.toml"), "{told}");

    let mut models = vec!["first/robot.toml".to_owned()];
    models.extend((2..).map(|i| format!("first/robot-{i}.toml")).take_while(|model| at.join(model).exists()));
    let designed =
        json(&succeeds(at, &format!("design-experiment {} --seconds 6 --out next --json", models.join(" "))));
    let pairs = designed["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), models.len() * (models.len() - 1));
    for pair in pairs {
        let [expected, simulated] = ["expected", "simulated"].map(|key| pair[key].as_f64().unwrap());
        let [truth, model] = ["truth", "model"].map(|key| effect_of(&at.join(pair[key].as_str().unwrap())));
        let are = |same: &&([&str; 2], f64)| same.0.contains(&truth.as_str()) && same.0.contains(&model.as_str());
        if let Some((_, apart)) = SAME_AT_ONE_SUPPLY.iter().find(are) {
            assert!(expected < *apart && simulated < apart + 0.04, "{pair}");
            continue;
        }
        // One is a model's own noiseless prediction, the other the firmware's run on the simulated robot, noise and all. Where
        // a shaft sticks, its stops make a part of what a wrong model leaves look like noise.
        let least = if truth == "coulomb_friction" { 0.25 } else { 0.5 };
        assert!(expected > 1.2, "{pair}");
        assert!((least..2.0).contains(&((simulated - 1.0) / (expected - 1.0))), "{pair}");
    }

    for seed in [10, 11] {
        let drive = "--drive script:next/experiment.txt --seconds 6";
        succeeds(at, &format!("sim --bench --robot truth.toml {drive} --seed {seed} --out x{seed}"));
    }
    let held_out = "--holdout r5/run.mcap --holdout x11/run.mcap";
    let told = succeeds(at, &format!("diagnose {runs} x10/run.mcap {held_out} --robot model.toml --out second --json"));
    let diagnosis = json(&told);
    // At one supply its dead time takes as much of the bridge's voltage as its drop.
    assert_eq!(diagnosis["verdict"], "ambiguous", "{told}");
    assert_eq!(diagnosis["models"], serde_json::json!([["driver_drop"], ["driver_dead_time"]]), "{told}");
    assert!(!at.join("second/robot-3.toml").exists(), "two models are left");
}

#[test]
fn what_cannot_be_designed_is_refused() {
    let directory = temporary();
    let at = directory.path();
    write_robots(at);
    fails(at, "design-experiment model.toml", 2, &["2 values required"]);
    fails(at, "design-experiment model.toml truth.toml --seconds 0", 2, &["from 1 to 120"]);
    fails(at, "design-experiment model.toml none.toml", 1, &["none.toml"]);
    let stuck = "[effects.coulomb_friction]\n\
        torque_nm = { value = 1e-2, low = 1e-2, high = 1e-2, source = \"test\" }\n\
        presliding_deg = { value = 0.2, low = 0.2, high = 0.2, source = \"test\" }\n";
    let text = std::fs::read_to_string(at.join("model.toml")).unwrap();
    std::fs::write(at.join("stuck.toml"), text + stuck).unwrap();
    fails(at, "design-experiment model.toml stuck.toml", 1, &["no drive of 8 s turns the shaft"]);
}
