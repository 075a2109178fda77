//! `scram sweep` as people use it: tables that a kill cannot spoil, the same bytes however it is run, errors that help.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::command::{refuses, succeeds_saying, temporary};
use crate::common::{self, root};
use serde_json::Value;

/// Few, short runs of a robot with three segments a backbone.
const QUICK: &str =
    "--drive ideal --repeats 2 --seconds 0.4 --axis backbone.segments=3 --axis alpha=0,90 --axis f=-8,7,8";

/// `scram sweep` with these words, of the project's robot unless another is named.
fn in_words(words: &str) -> String {
    if words.contains("--robot") { format!("sweep {words}") } else { format!("sweep {words} --robot @/robot.toml") }
}

fn command(directory: &Path, words: &str) -> Command {
    common::command::command(directory, &in_words(words))
}

#[track_caller]
fn succeeds(directory: &Path, words: &str) -> (String, String) {
    succeeds_saying(directory, &in_words(words))
}

#[track_caller]
fn fails(directory: &Path, words: &str, code: i32, says: &[&str]) {
    refuses(directory, &in_words(words), code, says);
}

/// Every file of a directory with its bytes, by name.
fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found: Vec<(String, Vec<u8>)> = fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    found.sort();
    found
}

fn rows(directory: &Path) -> usize {
    fs::read_to_string(directory.join("out/sweep.csv")).map_or(0, |text| text.lines().count().saturating_sub(1))
}

#[track_caller]
fn same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b));
    for ((name, a), (_, b)) in a.iter().zip(&b) {
        assert!(a == b, "{name} differs");
    }
}

#[test]
fn a_sweep_has_a_row_a_run_and_plots() {
    let directory = temporary();
    let words = "--drive ideal --repeats 2 --seconds 0.3 --sensitivity --json";
    let (text, _) = succeeds(directory.path(), words);
    let summary: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((summary["runs"].as_u64(), summary["blown_up"].as_u64()), (Some(96), Some(0)));
    assert_eq!(summary["conditions"].as_array().unwrap().len(), 48);
    let names: Vec<String> = files(&directory.path().join("out")).into_iter().map(|(name, _)| name).collect();
    let expected =
        ["maps.svg", "sensitivity.svg", "sweep.csv", "sweep.json", "sweep.toml", "sweep_paths.csv", "trajectories.svg"];
    assert_eq!(names, expected, "and no temporary file");
    let mut table = csv::Reader::from_path(directory.path().join("out/sweep.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let start = [
        "run",
        "alpha_deg",
        "f_hz",
        "friction_factor",
        "robot_seed",
        "seed",
        "vx_mm_per_s",
        "vy_mm_per_s",
        "yaw_deg_per_s",
    ];
    assert_eq!(header.iter().take(start.len()).collect::<Vec<_>>(), start);
    for (index, record) in table.records().map(Result::unwrap).enumerate() {
        assert_eq!(record[0].parse::<usize>().unwrap(), index + 1, "sorted");
        for cell in record.iter().take(8) {
            assert!(cell.parse::<f64>().unwrap().is_finite());
        }
    }
    let maps = fs::read_to_string(directory.path().join("out/maps.svg")).unwrap();
    roxmltree::Document::parse(&maps).unwrap();
    for part in ["Longitudinal", "Lateral", "Rotational", "α / °", "f / Hz", "±"] {
        assert!(maps.contains(part), "{part}");
    }
}

#[test]
fn robots_scatter_apart_from_their_runs() {
    let directory = temporary();
    let words = "--robot @/robot.toml --drive ideal --repeats 2 --robots 3 --seconds 0.4 --axis backbone.segments=3 --axis alpha=90 --axis f=7,8";
    let (text, _) = succeeds(directory.path(), words);
    assert!(text.contains("runs of one robot scatter by") && text.contains("robots beyond that by"), "{text}");
    let mut table = csv::Reader::from_path(directory.path().join("out/sweep.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let place = |name: &str| header.iter().position(|column| column == name).unwrap();
    let seeds: Vec<(String, String)> = table
        .records()
        .map(Result::unwrap)
        .map(|row| (row[place("robot_seed")].to_owned(), row[place("seed")].to_owned()))
        .collect();
    let wanted = [("1", "1"), ("1", "2"), ("3", "3"), ("3", "4"), ("5", "5"), ("5", "6")];
    assert_eq!(seeds.len(), 12);
    for (at, (robot, run)) in seeds.iter().enumerate() {
        assert_eq!((robot.as_str(), run.as_str()), wanted[at % 6]);
    }
    let (json, _) = succeeds(directory.path(), &format!("{words} --json"));
    let summary: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(summary["scatter"].as_array().unwrap().len(), 3, "{}", summary["scatter"]);
}

#[test]
fn the_terminal_has_sensitivity_and_effectiveness_too() {
    let directory = temporary();
    let words = "--drive ideal --repeats 1 --seconds 0.3 --axis backbone.segments=3 --axis f=-8,8 --sensitivity";
    let (text, _) = succeeds(directory.path(), words);
    let (json, _) = succeeds(directory.path(), &format!("{words} --json"));
    let summary: Value = serde_json::from_str(&json).unwrap();
    let (_, table) = text.split_once("σ vx / %").unwrap_or_else(|| panic!("no second table: {text}"));
    for unit in ["φ vx / mm/s", "σ vy / %", "φ vy / mm/s", "σ yaw / %", "φ yaw / °/s"] {
        assert!(table.contains(unit), "{unit}: {table}");
    }
    let cells: Vec<Vec<&str>> = table.lines().map(|line| line.split_whitespace().collect()).collect();
    for (index, f) in ["-8", "8"].into_iter().enumerate() {
        let row =
            cells.iter().find(|row| row.get(1) == Some(&f)).unwrap_or_else(|| panic!("no row of {f} Hz: {table}"));
        let kinds = summary["robustness"].as_array().unwrap();
        for (kind, shown) in kinds.iter().zip(row[2..].chunks(2)) {
            let expected = |key: &str, scale: f64, digits: usize| {
                kind[1][key][index].as_f64().map_or("–".to_owned(), |value| format!("{:.digits$}", scale * value))
            };
            assert_eq!(
                shown,
                [expected("sensitivity", 100.0, 1), expected("effectiveness", 1.0, 2)],
                "{f} Hz: {table}"
            );
        }
    }
}

/// Waits until the table has more rows than before, or the sweep is done.
fn killed_after_more_rows(directory: &Path, words: &str, before: usize) -> usize {
    let mut child: Child = command(directory, words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let patience = Instant::now() + Duration::from_secs(120);
    while rows(directory) <= before && child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < patience, "no row comes");
        std::thread::sleep(Duration::from_millis(1));
    }
    // SIGKILL.
    let _ = child.kill();
    child.wait().unwrap();
    rows(directory)
}

#[test]
fn a_killed_sweep_goes_on_and_gives_the_same_bytes() {
    let words = "--drive ideal --repeats 8 --seconds 1 --threads 1 --axis alpha=0,60 --axis f=-8,7,8";
    let (whole, killed) = (temporary(), temporary());
    succeeds(whole.path(), words);
    let mut before = 0;
    let mut kills = 0;
    while before < 48 && kills < 4 {
        before = killed_after_more_rows(killed.path(), words, before);
        kills += 1;
    }
    assert!(kills >= 2, "it was killed on the way");
    let (_, message) = succeeds(killed.path(), words);
    assert!(message.contains("of 48 runs were in"), "{message}");
    same(&whole.path().join("out"), &killed.path().join("out"));
}

#[test]
fn a_torn_table_is_mended_wherever_it_is_torn() {
    let (whole, torn) = (temporary(), temporary());
    succeeds(whole.path(), QUICK);
    succeeds(torn.path(), QUICK);
    let path = torn.path().join("out/sweep.csv");
    let full = fs::read(&path).unwrap();
    for cut in [0, 3, full.len() / 7, full.len() / 2, full.len() - 20, full.len() - 1] {
        fs::write(&path, &full[..cut]).unwrap();
        succeeds(torn.path(), QUICK);
        same(&whole.path().join("out"), &torn.path().join("out"));
    }
    // Nothing is run again where all is there.
    let (_, message) = succeeds(torn.path(), QUICK);
    assert!(message.contains("12 of 12 runs were in"), "{message}");
}

#[test]
fn threads_make_no_difference_with_motor_or_without() {
    let motor = QUICK.replace("--drive ideal", "--drive motor");
    for words in [QUICK, &motor] {
        let (one, many) = (temporary(), temporary());
        succeeds(one.path(), &format!("{words} --threads 1"));
        succeeds(many.path(), &format!("{words} --threads 3"));
        same(&one.path().join("out"), &many.path().join("out"));
    }
}

#[test]
fn another_sweep_is_refused_with_what_differs() {
    let directory = temporary();
    succeeds(directory.path(), QUICK);
    let before = files(&directory.path().join("out"));
    let longer = QUICK.replace("0.4", "0.5");
    fails(directory.path(), &longer, 1, &["sweep.toml", "`seconds` is 0.4 there and 0.5 here", "--fresh"]);
    let other = QUICK.replace("f=-8,7,8", "f=-8,6,8");
    fails(directory.path(), &other, 1, &["`axes.f_hz`"]);
    fails(directory.path(), &format!("{QUICK} --seed 9"), 1, &["`seeds`"]);
    fs::copy(root().join("robot.toml"), directory.path().join("robot.toml")).unwrap();
    let text = fs::read_to_string(directory.path().join("robot.toml")).unwrap();
    let text = text.replace("friction = { value = 0.8", "friction = { value = 0.9");
    fs::write(directory.path().join("robot.toml"), text).unwrap();
    fails(directory.path(), &format!("{QUICK} --robot robot.toml"), 1, &["`robot.ground.friction.value` is 0.8 there"]);
    assert_eq!(files(&directory.path().join("out")), before, "nothing is lost");
    succeeds(directory.path(), &format!("{longer} --fresh"));
    fs::remove_file(directory.path().join("out/sweep.toml")).unwrap();
    fails(directory.path(), &longer, 1, &["nothing says what it is of"]);
}

#[test]
fn a_directory_belongs_to_one_sweep_at_a_time() {
    let directory = temporary();
    let long = format!("{QUICK} --threads 1").replace("--repeats 2 --seconds 0.4", "--repeats 100 --seconds 2");
    let mut first = command(directory.path(), &long).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let patience = Instant::now() + Duration::from_secs(120);
    while rows(directory.path()) == 0 {
        assert!(Instant::now() < patience && first.try_wait().unwrap().is_none(), "no row comes");
        std::thread::sleep(Duration::from_millis(1));
    }
    let there = fs::read_to_string(directory.path().join("out/sweep.toml")).unwrap();
    for words in [format!("{QUICK} --fresh"), long.clone(), "--claims".into(), "--search 1 --fresh".into()] {
        fails(directory.path(), &words, 1, &["a sweep is running in out", "--out"]);
    }
    assert!(first.try_wait().unwrap().is_none(), "it ran all the while");
    assert_eq!(fs::read_to_string(directory.path().join("out/sweep.toml")).unwrap(), there);
    assert!(rows(directory.path()) > 0, "and its table is there");
    // Killed, it leaves no lock.
    first.kill().unwrap();
    first.wait().unwrap();
    succeeds(directory.path(), &format!("{QUICK} --fresh"));
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_said_and_nothing_is_lost() {
    let (whole, full) = (temporary(), temporary());
    let words = QUICK.replace("--repeats 2 --seconds 0.4", "--repeats 100 --seconds 0.1 --threads 1");
    succeeds(whole.path(), &words);
    let limited = |blocks: u32| {
        let mut inner = command(full.path(), &words);
        // A limit on the size of files stands for a full disk; ignored, its signal is an error of the write.
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let mut shell = Command::new("bash");
        shell.arg("-c").arg(script).arg(inner.get_program()).args(inner.get_args()).current_dir(full.path());
        let output = shell.output().unwrap();
        let _ = &mut inner;
        output
    };
    // Enough for what is swept, not for the table.
    let bytes = fs::metadata(whole.path().join("out/sweep.toml")).unwrap().len();
    let output = limited(u32::try_from(bytes / 1024 + 1).unwrap());
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(
        message.contains("cannot be written") && message.contains("every row that is in the table stays"),
        "{message}"
    );
    let text = fs::read_to_string(full.path().join("out/sweep.csv")).unwrap();
    assert!(text.ends_with('\n'), "no torn row is left");
    let kept = rows(full.path());
    assert!((1..600).contains(&kept), "{kept} rows were written");
    let (_, message) = succeeds(full.path(), &words);
    assert!(message.contains("of 600 runs were in"), "{message}");
    same(&whole.path().join("out"), &full.path().join("out"));
}

#[test]
fn a_directory_that_cannot_be_is_said() {
    let directory = temporary();
    fs::write(directory.path().join("taken"), "a file").unwrap();
    fails(directory.path(), &format!("{QUICK} --out taken/here"), 1, &["taken/here", "cannot be made"]);
}

#[test]
fn axes_that_lead_nowhere_are_wrong_usage() {
    let directory = temporary();
    for (axis, says) in [
        ("ground.frition=0.5,1", vec!["axis `ground.frition`", "no such quantity", "[ground] has ground.friction"]),
        ("gruond.friction=1", vec!["no such quantity", "eccentric", "backbone"]),
        ("effects.foot_anisotropy.lateral_share=0.5", vec!["an effect's table must be in the file"]),
        ("ground.friction=-1,0.5", vec!["axis `ground.friction=-1`", "outside the allowed 0 … 10", "0.45 … 1.3"]),
        ("backbone.segments=2.5", vec!["axis `backbone.segments=2.5`", "whole number"]),
        ("body.modules=1:3:3", vec!["axis `body.modules=1`", "2 to 64"]),
        ("body.modules=3.5", vec!["axis `body.modules=3.5`", "whole number"]),
        ("backbone.roll_deg[4]=10", vec!["there is no backbone 4", "backbones 1 to 3"]),
        ("backbone.roll_deg[1]=9999", vec!["outside", "-1080 … 1080"]),
        ("alpha=400", vec!["axis `alpha=400`", "-360 … 360"]),
        ("alpha=0:90", vec!["from:to:count"]),
        ("f=7,NaN", vec!["`NaN` is not a finite number"]),
        ("feet.radius_m=0.05", vec!["axis `feet.radius_m=0.05`", "larger than its leg"]),
        ("robot.name=1", vec!["no such quantity"]),
    ] {
        fails(directory.path(), &format!("--axis {axis}"), 2, &says);
    }
    fails(directory.path(), "--axis f=1 --axis f=2", 2, &["axis `f` is given twice"]);
    fails(directory.path(), "--axis f=1:9:9000 --axis alpha=0:90:9000", 2, &["243000000 runs are more than"]);
    fails(directory.path(), "--axis f=40", 1, &["axis `f`: 40 Hz", "to 12.00 Hz"]);
    fails(directory.path(), "--axis controller.limits.frequency_hz=29", 1, &["no controller", "runaway_rad_per_s"]);
    fails(directory.path(), "--robot @/robots/bench-linear.toml", 1, &["no [body]"]);
    fails(directory.path(), "--step 3e-4", 2, &["--step 0.0003 does not go into"]);
    assert!(!directory.path().join("out").exists(), "nothing is written");
}

#[test]
fn the_robot_is_brought_where_the_axes_say() {
    let directory = temporary();
    let words = "--drive ideal --repeats 1 --seconds 0.3";
    let axes = "--axis body.modules=2,5 --axis backbone.roll_deg[1]=0,45 --axis eccentric.radius_m=0.009,0.02";
    let (_, message) = succeeds(directory.path(), &format!("{words} {axes}"));
    assert!(message.contains("axis `eccentric.radius_m`: 0.02 outside the 0.008 … 0.012"), "{message}");
    assert_eq!(rows(directory.path()), 8);
    let text = fs::read_to_string(directory.path().join("out/sweep.csv")).unwrap();
    let speeds: Vec<&str> = text.lines().skip(1).map(|line| line.split(',').nth(6).unwrap()).collect();
    for (index, speed) in speeds.iter().enumerate() {
        assert!(!speeds[..index].contains(speed), "two conditions gave the same speed {speed}: {text}");
    }
    // An angle by itself that is what α gives changes nothing.
    let given = temporary();
    succeeds(given.path(), &format!("{words} --axis alpha=60"));
    let by_hand = temporary();
    succeeds(by_hand.path(), &format!("{words} --axis backbone.roll_deg[2]=120"));
    let speed = |directory: &Path| {
        let text = fs::read_to_string(directory.join("out/sweep.csv")).unwrap();
        text.lines().nth(1).unwrap().split(',').skip(2).map(String::from).collect::<Vec<_>>()
    };
    assert_eq!(speed(given.path()), speed(by_hand.path()));
}

#[test]
fn a_run_that_blows_up_has_empty_cells_and_a_note() {
    let directory = temporary();
    let words = "--drive ideal --repeats 1 --seconds 0.3 --axis f=7 --axis backbone.stiff_nm_per_rad=0.1,1000";
    let (text, message) = succeeds(directory.path(), &format!("{words} --json"));
    assert!(message.contains("1 of 2 runs have no speeds"), "{message}");
    let summary: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["blown_up"].as_u64(), Some(1));
    let table = fs::read_to_string(directory.path().join("out/sweep.csv")).unwrap();
    assert!(!table.contains("NaN") && !table.contains("inf"), "{table}");
    let broken: Vec<&str> = table.lines().nth(2).unwrap().split(',').collect();
    assert!(broken[5..14].iter().all(|cell| cell.is_empty()) && !broken[14].is_empty(), "{table}");
    let good: Vec<&str> = table.lines().nth(1).unwrap().split(',').collect();
    assert!(!good[5].is_empty() && good[14].is_empty(), "its neighbour is whole: {table}");
}

#[test]
fn measured_speeds_stand_beside() {
    let directory = temporary();
    fs::write(
        directory.path().join("m.csv"),
        "f_hz,alpha_deg,vx_mm_per_s,vy_mm_per_s,yaw_deg_per_s\n7,0,10,1,2\n7,0,12,1,2\n8,90,-20,0,\n9,90,1,1,1\n",
    )
    .unwrap();
    let (_, message) = succeeds(directory.path(), &format!("{QUICK} --measured m.csv"));
    assert!(message.contains("not in the sweep: 9 Hz at 90°"), "{message}");
    let maps = fs::read_to_string(directory.path().join("out/maps.svg")).unwrap();
    for part in ["measured", "simulated", "Error (5.1)"] {
        assert!(maps.contains(part), "{part}");
    }
    fs::write(directory.path().join("m.csv"), "f_hz,alpha_deg\n7,0\n").unwrap();
    fails(directory.path(), &format!("{QUICK} --measured m.csv"), 1, &["m.csv:1", "vx_mm_per_s"]);
}

#[test]
fn claims_are_judged_with_their_numbers() {
    let directory = temporary();
    let words = "--claims --drive ideal --repeats 1 --seconds 0.3";
    let (text, _) = succeeds(directory.path(), &format!("{words} --json"));
    let judged: Value = serde_json::from_str(&text).unwrap();
    let claims = judged["claims"].as_array().unwrap();
    assert_eq!(claims.len(), 12);
    for claim in claims {
        assert!(claim["holds"].is_boolean(), "{claim}");
        assert!(claim["numbers"].as_array().unwrap().iter().all(|number| number["value"].is_number()), "{claim}");
    }
    let (text, _) = succeeds(directory.path(), words);
    assert!(text.contains("of 12 claims hold") && text.contains("onset:"), "{text}");
}

#[test]
fn a_search_goes_on_after_a_kill_and_writes_a_robot_within_the_spreads() {
    let words = "--search 3 --seconds 0.3";
    let (whole, torn) = (temporary(), temporary());
    let (text, _) = succeeds(whole.path(), words);
    assert!(text.contains("best: set"), "{text}");
    succeeds(torn.path(), words);
    let path = torn.path().join("out/search.csv");
    let full = fs::read(&path).unwrap();
    fs::write(&path, &full[..full.len() - 30]).unwrap();
    succeeds(torn.path(), &format!("{words} --threads 1"));
    same(&whole.path().join("out"), &torn.path().join("out"));
    let text = fs::read_to_string(&path).unwrap();
    let set = text.lines().nth(2).unwrap();
    let (first, rest) = set.strip_prefix("2,").unwrap().split_once(',').unwrap();
    fs::write(&path, text.replacen(set, &format!("2,{first} g,{rest}"), 1)).unwrap();
    fails(torn.path(), words, 1, &["out/search.csv, line 3", "row 2", "--fresh"]);
    let nominal = robot_file::Robot::load(&root().join("robot.toml")).unwrap();
    let best = robot_file::Robot::load(&whole.path().join("out/best.toml")).unwrap();
    let (old, new) = (&nominal.ground.unwrap().friction, &best.ground.unwrap().friction);
    assert!((old.low..=old.high).contains(&new.value) && (new.low, new.high) == (old.low, old.high));
}
