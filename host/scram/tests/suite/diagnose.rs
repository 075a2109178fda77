//! A few short recordings, as somebody makes them first.

use crate::common::command::{json, succeeds, temporary};

/// One of the runs stands: so little duty does not turn the shaft, and the supervisor ends it. The held-out run is slower than the others.
const DRIVES: [&str; 4] = ["freq:7", "duty:0.6", "oscillate:-100..100", "duty:-0.8"];

#[test]
fn short_runs_of_the_files_own_robot_lack_nothing() {
    let directory = temporary();
    for seed in [2, 3, 8] {
        for (index, drive) in DRIVES.iter().enumerate() {
            let sim = format!("sim --robot @/robot.toml --bench --seed {seed} --seconds 2 --drive={drive}");
            succeeds(directory.path(), &format!("{sim} --out {seed}-{index}"));
        }
        let runs = [0, 1, 2].map(|index| format!("{seed}-{index}/run.mcap")).join(" ");
        let diagnose = format!("diagnose {runs} --holdout {seed}-3/run.mcap --robot @/robot.toml --json");
        let found = json(&succeeds(directory.path(), &diagnose));
        assert_eq!(found["verdict"], "nothing", "seed {seed}: {}", found["causes"]);
    }
}
