//! `scram learn` as people use it: a training that was killed goes on to the same policy, and says what it does not understand.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::common::command::{command, refuses, succeeds, temporary};
use serde_json::Value;

/// A training of seconds: it learns nothing, and does all that a long one does.
const SHORT: &str = "[turn]\nepisode_s = 0.4\nenvironments = 4\nupdates = 3\n[ppo]\nsteps = 40\nbatch_size = 20\nepochs = 2\n\
                     [straight]\nheld = [1, 3]\nepisode_s = 0.6\nstarts = 2\npatience_s = 0.5\n\
                     [maze]\npatience_s = 1.0\n\
                     [terrain]\nslopes_deg = [5.0]\nsteps_m = [0.001]\npatches = [0.5]\nepisode_s = 0.4\n\
                     [design]\ndesigns = 3\nupdates = 1\nheld = [1]\nepisode_s = 0.4\n";

fn settings(directory: &Path) {
    fs::write(directory.join("learn.toml"), SHORT).unwrap();
}

fn read(path: &Path) -> Vec<u8> {
    fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn a_training_that_was_killed_goes_on_to_the_same_policy() {
    let directory = temporary();
    settings(directory.path());
    let words = "learn turn --direction right --settings learn.toml --robot @/robot.toml --seed 5";
    let text = succeeds(directory.path(), &format!("{words} --out whole"));
    for part in ["learned", "constant", "± 100°", "turning / °/s", "whole/policy.json"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let mut child = command(directory.path(), &format!("{words} --out killed"));
    let mut child = child.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let (saved, begun) = (directory.path().join("killed/training.json"), Instant::now());
    while !saved.exists() {
        assert!(begun.elapsed() < Duration::from_secs(120), "nothing was saved");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!directory.path().join("killed/policy.json").exists(), "it was not killed in the middle");
    succeeds(directory.path(), "learn turn --resume killed --robot @/robot.toml");
    for file in ["policy.json", "curve.csv", "training.json", "learn.toml"] {
        let [whole, killed] = ["whole", "killed"].map(|name| read(&directory.path().join(name).join(file)));
        assert!(whole == killed, "{file} differs");
    }
    let curve = String::from_utf8(read(&directory.path().join("whole/curve.csv"))).unwrap();
    assert_eq!(curve.lines().count(), 1 + 3, "{curve}");
    roxmltree::Document::parse(&String::from_utf8(read(&directory.path().join("whole/turn.svg"))).unwrap()).unwrap();
    let gait = robot_file::gait::GaitFile::load(&directory.path().join("whole/gait.toml")).unwrap();
    assert_eq!(
        (gait.gait().name().to_string().as_str(), gait.steps().len()),
        ("turn-right", 20),
        "0.4 s by steps of 20 ms"
    );
}

#[test]
fn gaits_are_judged_on_drawn_robots_too() {
    let directory = temporary();
    settings(directory.path());
    let words = "learn turn --direction left --settings learn.toml --robot @/robot.toml --robots 3 --json";
    let output: Value = serde_json::from_str(&succeeds(directory.path(), words)).unwrap();
    let gaits = output["gaits"].as_array().unwrap();
    let names: Vec<&str> = gaits.iter().map(|gait| gait["name"].as_str().unwrap()).collect();
    assert_eq!((names[0], gaits.len()), ("learned", 4), "{names:?}");
    for gait in gaits {
        assert!(gait["nominal"]["rate_deg_per_s"].is_number() && gait["drawn"]["to_the_end"].is_number(), "{gait}");
    }
}

/// Among the controller's swings and two frequencies, with motor; the gait says which.
#[test]
fn a_gait_may_swing_the_shaft() {
    let directory = temporary();
    let text = "[turn]\ndrive = \"motor\"\nfrequencies_hz = [-7.0, 7.0]\noscillations_deg = [[-45.0, 105.0], [70.0, 190.0]]\n\
                interval_s = 0.5\nepisode_s = 2.0\nenvironments = 8\nupdates = 2\n[ppo]\nsteps = 64\nbatch_size = 32\n";
    fs::write(directory.path().join("learn.toml"), text).unwrap();
    let words = "learn turn --direction right --settings learn.toml --robot @/robot.toml --out swings";
    let said = succeeds(directory.path(), words);
    assert!(said.contains("constant -45°..105°") || said.contains("constant 70°..190°"), "{said}");
    let gait = robot_file::gait::GaitFile::load(&directory.path().join("swings/gait.toml")).unwrap();
    assert_eq!((gait.steps().len(), gait.interval_s()), (4, 0.5));
    let picture = read(&directory.path().join("swings/turn.svg"));
    assert!(String::from_utf8(picture).unwrap().contains("angle of the shaft"), "what the swings are is drawn");
}

/// Through controller, motor, sensor and body, other starts than those on which they were learned.
#[test]
fn the_shipped_gaits_turn_the_robot_in_their_direction() {
    let directory = temporary();
    for (direction, sign) in [("left", 1.0), ("right", -1.0)] {
        for seed in [101, 102, 103] {
            let words = format!(
                "sim --robot @/robot.toml --alpha 90 --drive gait:@/robots/gaits/turn-{direction}.toml --seconds 20 --seed {seed} --json"
            );
            let run: Value = serde_json::from_str(&succeeds(directory.path(), &words)).unwrap();
            assert_eq!(run["faults"].as_array().map(Vec::len), Some(0), "{run}");
            let turned = sign * run["walk"]["turned_deg"].as_f64().unwrap() / 20.0;
            assert!(turned > 3.0, "{direction}, seed {seed}: {turned} °/s");
        }
    }
}

/// Through controller, motor, sensor and body: half a turn and a whole one.
#[test]
fn the_robot_that_turns_in_place_does() {
    let directory = temporary();
    for seed in [101, 102, 103] {
        for (seconds, least_deg, most_mm) in [(14, 160.0, 50.0), (28, 340.0, 20.0)] {
            let words = format!(
                "sim --robot @/robots/three-modules.toml --drive freq:-7.5 --seconds {seconds} --seed {seed} --json --overwrite"
            );
            let run: Value = serde_json::from_str(&succeeds(directory.path(), &words)).unwrap();
            let [turned, ahead, left] = ["turned_deg", "displacement_mm/0", "displacement_mm/1"]
                .map(|key| run.pointer(&format!("/walk/{key}")).and_then(Value::as_f64).unwrap());
            let moved = ahead.hypot(left);
            assert!(turned > least_deg && moved < most_mm, "seed {seed}, {seconds} s: {turned}°, {moved} mm");
        }
    }
}

#[test]
fn walking_straight_is_searched_for_and_steered() {
    let directory = temporary();
    settings(directory.path());
    let words = "learn straight --settings learn.toml --robot @/robot.toml --robots 2";
    let text = succeeds(directory.path(), words);
    for part in ["turns a metre", "7 Hz for 0.1 s", "walked 200 mm", "by their pose", "0 of 2", "straight.svg"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let found: Value = serde_json::from_slice(&read(&directory.path().join("out/latest-learn/straight.json"))).unwrap();
    assert_eq!(found["found"]["alternations"].as_array().unwrap().len(), 4);
    let ends: Vec<&str> = found["steered"].as_array().unwrap().iter().map(|one| one["end"].as_str().unwrap()).collect();
    assert_eq!(ends, ["out_of_time"; 2]);
}

#[test]
fn a_maze_is_drawn_in_nine_frames_and_as_a_page_with_its_walls() {
    let directory = temporary();
    settings(directory.path());
    let words = "learn maze --settings learn.toml --robot @/robot.toml --robots 2";
    let text = succeeds(directory.path(), words);
    // A second is not enough: each of them says so.
    for part in ["the file's robot: out of time", "by their pose", "0 of 2", "script", "maze.html"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let out = directory.path().join("out/latest-learn");
    let svg = String::from_utf8(read(&out.join("maze.svg"))).unwrap();
    let drawn = roxmltree::Document::parse(&svg).unwrap();
    assert_eq!(
        drawn.descendants().filter(|node| node.has_tag_name("polygon")).count(),
        9 * 4,
        "frames of four modules"
    );
    let page = String::from_utf8(read(&out.join("maze.html"))).unwrap();
    assert!(page.contains("\"walls\":[["), "the walls of the maze are in the page");
    let found: Value = serde_json::from_slice(&read(&out.join("maze.json"))).unwrap();
    assert_eq!(found["first"]["end"], "out_of_time");
    assert_eq!([&found["by_pose"], &found["by_script"]].map(|list| list.as_array().unwrap().len()), [2, 2]);
    let alone = succeeds(directory.path(), "learn maze --settings learn.toml --robot @/robot.toml");
    assert!(alone.contains("the file's robot") && !alone.contains("by their pose"), "{alone}");
}

#[test]
fn randomize_says_how_much_of_the_spreads_the_judged_robots_have() {
    let directory = temporary();
    for (task, results) in [("straight", "/steered"), ("maze", "/by_pose"), ("terrain", "/0/by_pose")] {
        let judged = |share: &str| -> Value {
            // In TOML a table may come once.
            let text = SHORT.replace(&format!("[{task}]"), &format!("[{task}]\nrandomize = {share}"));
            fs::write(directory.path().join("learn.toml"), text).unwrap();
            let words = format!(
                "learn {task} --settings learn.toml --robot @/robot.toml --robots 2 --json --overwrite --out {task}"
            );
            let found: Value = serde_json::from_str(&succeeds(directory.path(), &words)).unwrap();
            found.pointer(results).unwrap_or_else(|| panic!("{found}")).clone()
        };
        let [none, half, all] = ["0", "0.5", "1"].map(judged);
        assert!(none != half && half != all, "{task}: {none}, {half}, {all}");
    }
}

#[test]
fn every_random_maze_has_robots_of_its_own() {
    let directory = temporary();
    fs::write(directory.path().join("learn.toml"), "[maze]\npatience_s = 0.5\nsize = [3, 2]\n").unwrap();
    let words = "learn maze --maze random --settings learn.toml --robot @/robot.toml --robots 11 --json";
    let found: Value = serde_json::from_str(&succeeds(directory.path(), words)).unwrap();
    let left: Vec<f64> =
        found["by_pose"].as_array().unwrap().iter().map(|one| one["left_m"].as_f64().unwrap()).collect();
    assert_eq!(left.len(), 11, "ten in the first maze, one in the second");
}

#[test]
fn every_terrain_is_crossed_by_the_pose_and_without() {
    let directory = temporary();
    settings(directory.path());
    let text = succeeds(directory.path(), "learn terrain --settings learn.toml --robot @/robot.toml --robots 2");
    for part in ["even ground", "5° uphill", "a step of 1 mm up", "50 % of the friction", "by the pose", "in turn"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let rows: Value = serde_json::from_slice(&read(&directory.path().join("out/latest-learn/terrain.json"))).unwrap();
    let row = |place: usize| &rows[place];
    assert_eq!(rows.as_array().unwrap().len(), 4);
    assert_eq!(row(3)["by_pose"].as_array().unwrap().len(), 2);
    // The slope acts on the same robots.
    assert_ne!(row(0)["in_turn"], row(1)["in_turn"]);
}

#[test]
fn a_search_for_designs_that_was_stopped_goes_on_to_the_same_ones() {
    let directory = temporary();
    settings(directory.path());
    let words = "learn design --direction left --settings learn.toml --robot @/robot.toml --seed 2 --out whole";
    let text = succeeds(directory.path(), words);
    for part in ["the file's", "60, 120, 180", "3 designs", "whole/designs.svg"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let path = directory.path().join("whole/designs.json");
    let whole = read(&path);
    let mut saved: Value = serde_json::from_slice(&whole).unwrap();
    let tried = saved["tried"].as_array_mut().unwrap();
    assert_eq!(tried.len(), 3);
    tried.truncate(1);
    fs::write(&path, saved.to_string()).unwrap();
    succeeds(directory.path(), "learn design --resume whole --robot @/robot.toml");
    assert!(read(&path) == whole, "other designs");
    refuses(directory.path(), "learn design --resume whole --robot @/robots/thesis.toml", 1, &["scram-thesis"]);
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let directory = temporary();
    let wrong = |text: &str, words: &str, says: &[&str]| {
        fs::write(directory.path().join("learn.toml"), text).unwrap();
        refuses(directory.path(), &format!("learn {words} --settings learn.toml --robot @/robot.toml"), 1, says);
    };
    wrong("[turn]\nk_poss = 1\n", "turn --direction left", &["learn.toml", "line 2", "k_poss"]);
    wrong("[ppo]\nsteps = 7\n", "turn --direction left", &["steps: expected a multiple of 16"]);
    wrong("[maze]\nsize = [1, 1]\n", "maze", &["maze.size: expected two whole numbers"]);
    wrong("[terrain]\nslopes_deg = [80.0]\n", "terrain", &["ahead_deg", "60"]);
    wrong("[design]\nmodules = [5, 3]\n", "design --direction left", &["design.modules: expected"]);
    wrong("[straight]\nheld = []\n", "straight", &["straight.held: expected"]);
    wrong("[turn]\ninterval_s = 0.00015\n", "turn --direction left", &["interval_s", "whole number of steps"]);
    refuses(directory.path(), "learn turn --resume nowhere --robot @/robot.toml", 1, &["nowhere/training.json"]);
}
