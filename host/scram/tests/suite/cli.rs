//! The command as people and scripts use it: exit codes, messages, files.

use std::fmt::Write as _;
use std::path::Path;

use crate::common::command::{command, fails, json, scram, succeeds, succeeds_saying, temporary};
use crate::common::{self, root};

#[test]
fn sim_holds_seven_hertz_and_says_where_it_wrote() {
    let directory = temporary();
    let table = succeeds(directory.path(), "sim --robot @/robot.toml");
    for part in ["scram-26", "mean frequency", "Hz", "blind arc", "written: out/run-0001/run.mcap"] {
        assert!(table.contains(part), "{table}");
    }
    let mut written: Vec<String> = std::fs::read_dir(directory.path().join("out/run-0001"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    written.sort();
    let expected = [
        "current.svg",
        "estimate.svg",
        "feet.svg",
        "gait.svg",
        "overview.svg",
        "path.svg",
        "phase.svg",
        "run.csv",
        "run.mcap",
        "run.toml",
        "speed.svg",
        "track.csv",
        "voltage.svg",
    ];
    assert_eq!(written, expected, "and no temporary file");
    for name in written.iter().filter(|name| name.ends_with(".svg")) {
        let svg = std::fs::read_to_string(directory.path().join("out/latest").join(name)).unwrap();
        assert!(svg.contains(">scram-26, freq:7 for 2 s, seed 1, on the ground, α 60°</text>"), "{name}");
    }
    for name in ["run.csv", "run.mcap"] {
        let loaded =
            recording::load_with(&directory.path().join("out/latest").join(name), &Default::default()).unwrap();
        assert_eq!(loaded.recording.len(), 2000);
        assert_eq!(loaded.metadata.robot.as_deref(), Some("scram-26"));
        assert_eq!(loaded.metadata.excitation.as_deref(), Some("freq:7"));
    }
}

#[test]
fn json_has_the_figures_and_a_seed_gives_the_same_bytes() {
    let directory = temporary();
    let line = |seed: u32, out: &str| {
        succeeds(directory.path(), &format!("sim --robot @/robot.toml --json --seed {seed} --out {out}"))
    };
    let (first, second) = (line(2, "a"), line(2, "b"));
    let figures = json(&first);
    for key in [
        "mean_frequency_hz",
        "phase_rms_deg",
        "settling_s",
        "settling_instantaneous_s",
        "estimate_rms_deg",
        "estimate_rms_blind_deg",
        "peak_current_a",
        "turning_points_deg",
        "faults",
        "energy_j",
    ] {
        assert!(figures.get(key).is_some(), "{key}");
    }
    let mean = figures["mean_frequency_hz"].as_f64().unwrap();
    assert!((mean / 7.0 - 1.0).abs() < 1e-3, "{mean} Hz");
    assert_eq!(first.replace("\"a/", "\"b/"), second);
    line(4, "c");
    for name in ["run.csv", "run.mcap", "overview.svg", "speed.svg"] {
        let bytes = |out: &str| std::fs::read(directory.path().join(out).join(name)).unwrap();
        assert_eq!(bytes("a"), bytes("b"), "{name}");
        assert_ne!(bytes("a"), bytes("c"), "{name}");
    }
}

#[test]
fn sim_oscillates_and_follows_a_script() {
    let directory = temporary();
    let swing =
        json(&succeeds(directory.path(), "sim --robot @/robot.toml --drive oscillate:-100..100 --seconds 3 --json"));
    let points = swing["turning_points_deg"].as_array().unwrap();
    assert!(points.len() > 10, "{points:?}");
    assert!(points.iter().all(|deg| (deg.as_f64().unwrap().abs() - 100.0).abs() < 15.0), "{points:?}");
    assert_eq!(swing["strokes_ran_away"], 0);

    std::fs::write(directory.path().join("steps.txt"), "freq 7\nwait 0.7\nfreq -7 # back\nwait 0.8\n").unwrap();
    let table = succeeds(directory.path(), "sim --robot @/robot.toml --drive script:steps.txt");
    assert!(table.contains("freq 7") && table.contains("freq -7"), "{table}");
    let back = json(&succeeds(directory.path(), "sim --robot @/robot.toml --drive script:steps.txt --json"));
    assert_eq!(back["seconds"], 1.5);
    assert!((back["mean_frequency_hz"].as_f64().unwrap() + 7.0).abs() < 2.0);
}

#[test]
fn what_this_run_does_not_write_is_left_and_said() {
    let directory = temporary();
    succeeds(directory.path(), "sim --robot @/robot.toml --out out");
    let words = "sim --robot @/robot.toml --drive oscillate:-60..60 --out out --overwrite";
    let (_, message) = succeeds_saying(directory.path(), words);
    assert!(message.contains("not of this run, but in out: phase.svg\n"), "{message}");
    assert!(directory.path().join("out/phase.svg").exists(), "it may be somebody's own");
    assert!(directory.path().join("out/angle.svg").exists());
}

#[test]
fn every_run_has_a_directory_of_its_own_and_latest_is_the_last() {
    let directory = temporary();
    let at = |name: &str| directory.path().join("out").join(name);
    let bytes = |name: &str| std::fs::read(at(name)).unwrap();
    let words = "sim --bench --robot @/robot.toml --seconds 0.2 --json --seed";
    let first = json(&succeeds(directory.path(), &format!("{words} 1")));
    assert_eq!(first["files"][0], "out/run-0001/run.mcap");
    let before = bytes("run-0001/run.csv");
    assert_eq!(bytes("latest/run.csv"), before);
    // Two at once: neither is written into the other's.
    let start = |seed| {
        let mut run = command(directory.path(), &format!("{words} {seed}"));
        run.stdout(std::process::Stdio::piped()).spawn().unwrap()
    };
    let running = [2, 3].map(start);
    let files = running.map(|run| {
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success());
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        (said["seed"].as_u64().unwrap(), said["files"][1].as_str().unwrap().to_owned())
    });
    assert_ne!(files[0].1, files[1].1);
    for (seed, file) in files {
        let loaded = recording::load_with(&directory.path().join(&file), &Default::default()).unwrap();
        assert_eq!(loaded.metadata.seed, Some(seed), "{file}");
    }
    assert_eq!(bytes("run-0001/run.csv"), before, "the first is as it was");
    let mut names: Vec<_> = std::fs::read_dir(at("")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["latest", "run-0001", "run-0002", "run-0003"], "and no temporary link");
    assert_ne!(bytes("latest/run.csv"), before);
}

#[test]
fn a_recording_that_is_there_is_written_over_only_on_request() {
    let directory = temporary();
    let words = |seed: u32| format!("sim --bench --robot @/robot.toml --seconds 0.2 --out mine --seed {seed}");
    succeeds(directory.path(), &words(1));
    let bytes = || std::fs::read(directory.path().join("mine/run.csv")).unwrap();
    let before = bytes();
    fails(directory.path(), &words(2), 1, &["mine/run.mcap is there already", "--overwrite"]);
    std::fs::remove_file(directory.path().join("mine/run.mcap")).unwrap();
    fails(directory.path(), &words(2), 1, &["mine/run.csv is there already", "--overwrite"]);
    assert_eq!(bytes(), before);
    succeeds(directory.path(), &format!("{} --overwrite", words(2)));
    assert_ne!(bytes(), before);
    // Of two at once into one directory the first to end is kept whole, and the other is refused.
    let both = [3, 4].map(|seed| command(directory.path(), &words(seed).replace("mine", "both")).spawn().unwrap());
    let done = both.map(|run| run.wait_with_output().unwrap().status.code());
    if cfg!(unix) {
        assert!(done == [Some(0), Some(1)] || done == [Some(1), Some(0)], "{done:?}");
        let seeds = ["run.mcap", "run.csv"].map(|name| {
            let path = directory.path().join("both").join(name);
            recording::load_with(&path, &Default::default()).unwrap().metadata.seed
        });
        assert_eq!(seeds[0], seeds[1]);
    }
}

#[test]
fn faults_end_with_the_bridge_off() {
    let directory = temporary();
    for (fault, cause) in [("link-lost", "CommandTooOld"), ("sensor-open", "Sensor"), ("battery-low", "SupplyLow")] {
        let words = format!("sim --robot @/robot.toml --seconds 3 --faults {fault}@1 --json");
        let report = &json(&succeeds(directory.path(), &words))["faults"][0];
        assert!(report["cause"].as_str().is_some_and(|found| found.starts_with(cause)), "{fault}: {report}");
        assert_eq!(report["at_s"], 1.0);
        assert!(report["bridge_off_after_s"].as_f64().is_some_and(|after| after > 0.0 && after < 1.5), "{report}");
    }
}

#[test]
fn what_is_said_of_a_fault_is_what_happened() {
    let directory = temporary();
    let said = |words: &str| {
        let all = succeeds(directory.path(), &format!("sim --bench --robot @/robot.toml {words}"));
        let lines: Vec<String> = all.lines().filter(|line| line.starts_with("fault at")).map(str::to_owned).collect();
        lines.join("\n")
    };
    let off = said("--drive idle --faults stall@1");
    assert!(off.ends_with("stalled: not noticed, the bridge was off already"), "{off}");
    for (fault, ending) in [
        ("sensor-noisy", "a held speed is to bear it"),
        ("sensor-drifting", "nothing is made to find it"),
        ("adc-saturated", "nothing is made to find it"),
    ] {
        let line = said(&format!("--seconds 3 --faults {fault}@1"));
        let wanted = format!("{fault}: not noticed, the bridge stays on; estimate off by ");
        assert!(line.contains(&wanted) && line.ends_with(&format!("° RMS since; {ending}")), "{line}");
    }
}

#[test]
fn wrong_usage_ends_with_2() {
    let directory = temporary();
    let bad = |words: &str, says: &[&str]| fails(directory.path(), words, 2, says);
    bad("sim --robot @/robot.toml --drive spin:3", &["`spin`", "oscillate:FROM..TO"]);
    bad("sim --robot @/robot.toml --drive freq:seven", &["`seven`"]);
    bad("sim --robot @/robot.toml --seconds=-1", &["--seconds", "above 0"]);
    bad("sim --robot @/robot.toml --seconds 1e9", &["up to 600"]);
    bad("sim --robot @/robot.toml --faults fire@1", &["`fire`", "sensor-open"]);
    bad("sim --robot @/robot.toml --seconds 2 --faults stall@100", &["`stalled@100`", "the run ends at 2 s"]);
    bad("sim --speed 3", &["--speed"]);
    bad("diagnose", &["RUNS"]);
    bad("fly", &["fly"]);
    bad("", &["Usage"]);
}

#[test]
fn what_cannot_be_done_ends_with_1() {
    let directory = temporary();
    let bad = |words: &str, says: &[&str]| fails(directory.path(), words, 1, says);
    bad("sim", &["no robot file robot.toml", "project's root", "--robot"]);
    for hz in ["40", "-40", "0.5"] {
        let says = [&format!("refuses `freq {hz}`"), "must be from 1.00 to 12.00 Hz in either direction"];
        bad(&format!("sim --robot @/robot.toml --drive freq:{hz}"), &says);
    }
    bad("sim --robot @/robot.toml --drive position:270", &["refuses `position 270`", "180°"]);
    bad("sim --robot @/robot.toml --drive script:none.txt", &["none.txt", "script:"]);
    std::fs::write(directory.path().join("steps.txt"), "freq 7\nfly 3\n").unwrap();
    bad("sim --robot @/robot.toml --drive script:steps.txt", &["steps.txt, line 2", "`fly`"]);
    bad("sim --robot @/robots/bench-xl330.toml", &["[controller]"]);
    bad("design --robot @/robots/bench-xl330.toml", &["[controller]"]);
    let text = std::fs::read_to_string(root().join("robot.toml")).unwrap();
    std::fs::write(directory.path().join("bad.toml"), text.replacen("resistance_ohm", "resistence_ohm", 1)).unwrap();
    bad("sim --robot bad.toml", &["bad.toml", "resistence_ohm"]);
}

#[test]
fn design_prints_poles_inside_the_unit_circle() {
    let directory = temporary();
    let design = json(&succeeds(directory.path(), "design --robot @/robot.toml --json"));
    for poles in ["regulator_poles", "filter_poles"] {
        let poles = design[poles].as_array().unwrap();
        assert!(!poles.is_empty());
        for pole in poles {
            let (re, im) = (pole[0].as_f64().unwrap(), pole[1].as_f64().unwrap());
            assert!(re.hypot(im) < 1.0, "{re} + {im}i");
        }
    }
    assert!(succeeds(directory.path(), "design --robot @/robot.toml").contains("margins"));
}

#[test]
fn a_calibrated_sensor_makes_a_better_estimate() {
    let directory = temporary();
    succeeds(directory.path(), "sim --robot @/robot.toml --bench --seed 5 --drive duty:1 --seconds 2.5 --out cal");
    let fit =
        json(&succeeds(directory.path(), "identify potentiometer cal/run.mcap --robot @/robot.toml --out cal --json"));
    assert!(fit["after_rms_deg"].as_f64().unwrap() < fit["before_rms_deg"].as_f64().unwrap());
    let rms = |robot: &str| {
        let words = format!("sim --robot {robot} --bench --seed 5 --json");
        json(&succeeds(directory.path(), &words))["estimate_rms_deg"].as_f64().unwrap()
    };
    let (before, after) = (rms("@/robot.toml"), rms("cal/robot.toml"));
    assert!(after < before, "{after}° after, {before}° before");
}

#[test]
fn the_robot_file_that_was_read_is_never_written_over() {
    let directory = temporary();
    let file = directory.path().join("robot.toml");
    std::fs::copy(root().join("robot.toml"), &file).unwrap();
    let before = std::fs::read(&file).unwrap();
    succeeds(directory.path(), "sim --drive duty:1 --seconds 2.5 --out cal");
    fails(directory.path(), "identify potentiometer cal/run.mcap --out .", 1, &["not written over", "--out"]);
    assert_eq!(std::fs::read(&file).unwrap(), before);
    assert!(!directory.path().join("potentiometer.svg").exists(), "nothing else is written either");
}

#[test]
fn help_has_an_example_for_every_subcommand() {
    let directory = temporary();
    for command in ["sim", "design", "identify potentiometer", "identify backbone", "diagnose"] {
        let help = succeeds(directory.path(), &format!("{command} --help"));
        for part in ["Example", "--json", "--seed", "--robot", "--out"] {
            assert!(help.contains(part), "{command}: no {part}");
        }
    }
}

/// Writes a recording of `rows` rows through a function of the row.
fn csv(directory: &Path, name: &str, header: &str, rows: usize, row: impl Fn(usize) -> String) {
    let mut text = format!("{header}\n");
    for i in 0..rows {
        writeln!(text, "{}", row(i)).unwrap();
    }
    std::fs::write(directory.join(name), text).unwrap();
}

#[test]
fn bad_recordings_are_refused_before_anything_is_written() {
    let directory = temporary();
    let path = directory.path();
    let header = "t_s,duty,angle_rad";
    let t = |i: usize| i as f64 * 1e-3;
    let still = |i: usize| format!("{},0.5,0.1", t(i));
    csv(path, "good.csv", header, 500, still);
    std::fs::write(path.join("empty.csv"), "").unwrap();
    csv(path, "header.csv", header, 0, still);
    csv(path, "one.csv", header, 1, still);
    csv(path, "missing.csv", "t_s,duty,speed", 500, still);
    csv(path, "back.csv", header, 500, |i| if i == 250 { "0.1,0.5,0.1".into() } else { still(i) });
    csv(path, "nan.csv", header, 500, |i| if i == 250 { format!("{},0.5,NaN", t(i)) } else { still(i) });
    csv(path, "degrees.csv", header, 500, |i| format!("{},0.5,{}", t(i), 2520.0 * t(i)));
    csv(path, "percent.csv", header, 500, |i| format!("{},50,0.1", t(i)));
    csv(path, "other.csv", header, 500, |i| format!("{},0.4,0.1", t(i)));
    std::fs::write(path.join("other.toml"), "robot = \"walker-9\"\n").unwrap();
    csv(path, "supply.csv", "t_s,duty,angle_rad,supply_v", 500, |i| format!("{},24", still(i)));

    for (file, says) in [
        ("empty.csv", ["empty.csv", "the file is empty"]),
        ("header.csv", ["header.csv", "no sample"]),
        ("one.csv", ["one.csv", "1 sample"]),
        ("missing.csv", ["`angle_rad`", "`speed`"]),
        ("back.csv", ["line 252", "does not increase"]),
        ("nan.csv", ["line 252", "NaN"]),
        ("degrees.csv", ["degrees", "π/180"]),
        ("percent.csv", ["line 2", "percent"]),
        ("other.csv", ["walker-9", "scram-26"]),
        ("supply.csv", ["24.00 V", "scram-26"]),
        ("nowhere.csv", ["nowhere.csv", "check the name"]),
    ] {
        let words = format!("diagnose good.csv {file} --holdout good.csv --robot @/robot.toml");
        fails(path, &words, 1, &says);
        fails(path, &format!("identify potentiometer {file} --robot @/robot.toml"), 1, &[]);
    }
    fails(path, "identify potentiometer good.csv --robot @/robot.toml", 1, &["`adc`"]);
    fails(path, "diagnose good.csv --robot @/robot.toml", 2, &["at least two"]);
    fails(path, "diagnose good.csv --holdout good.csv --robot @/robot.toml", 2, &["0 run(s) to fit on"]);
}

#[test]
fn a_recording_of_another_rig_is_refused() {
    let directory = temporary();
    succeeds(directory.path(), "sim --robot @/robot.toml --out runs --seconds 1");
    let words = "diagnose runs/run.mcap runs/run.csv --robot @/robots/bench-xl330.toml";
    fails(directory.path(), words, 1, &["scram-26", "--robot"]);
}

#[test]
fn a_held_out_run_is_never_fitted_on() {
    let directory = temporary();
    for (name, duty) in [("a.csv", 0.5), ("b.csv", 0.6), ("c.csv", 0.7)] {
        csv(directory.path(), name, "t_s,duty,angle_rad", 30, |i| format!("{},{duty},0.1", i as f64 * 1e-3));
    }
    let says = |words: &str, part: &str| {
        let output = scram(directory.path(), &format!("diagnose {words} --robot @/robots/bench-linear.toml"));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(part), "{words}: {message}");
    };
    says("a.csv b.csv c.csv --holdout ./b.csv", "fitting on a.csv, c.csv; judging on ./b.csv");
    says("a.csv --holdout c.csv --holdout b.csv", "fitting on a.csv; judging on c.csv, b.csv");
    says("a.csv b.csv c.csv", "fitting on a.csv, b.csv; judging on c.csv");
}

#[test]
fn a_hole_in_a_recording_is_not_simulated() {
    let directory = temporary();
    // Three stretches of a swinging shaft, eleven days between them.
    let row = |i: usize| {
        let t = (i % 400) as f64 * 1e-3 + (i / 400) as f64 * 1e6;
        format!("{t},0.5,{}", 0.5 * (20.0 * t).sin())
    };
    csv(directory.path(), "holes.csv", "t_s,duty,angle_rad", 1200, row);
    csv(directory.path(), "whole.csv", "t_s,duty,angle_rad", 400, row);
    let diagnose = command(directory.path(), "diagnose holes.csv whole.csv --robot @/robots/bench-linear.toml");
    let mut diagnose = assert_cmd::Command::from_std(diagnose);
    let output = diagnose.timeout(std::time::Duration::from_secs(120)).output().unwrap();
    assert!(output.status.code().is_some(), "it takes for ever");
}

#[test]
fn a_run_that_is_listed_twice_is_refused() {
    let directory = temporary();
    for (name, duty) in [("a.csv", "0.5"), ("b.csv", "0.6")] {
        csv(directory.path(), name, "t_s,duty,angle_rad", 30, |i| format!("{},{duty},0.1", i as f64 * 1e-3));
    }
    std::fs::copy(directory.path().join("a.csv"), directory.path().join("copy.csv")).unwrap();
    for (words, says) in [
        ("a.csv a.csv", "a.csv is listed twice"),
        ("a.csv b.csv ./a.csv", "./a.csv is listed twice"),
        ("a.csv b.csv copy.csv", "copy.csv has the same content as a.csv"),
        ("a.csv b.csv --holdout copy.csv", "copy.csv has the same content as a.csv"),
    ] {
        fails(directory.path(), &format!("diagnose {words} --robot @/robots/bench-linear.toml"), 2, &[says, "once"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn what_is_printed_onto_a_full_disk_is_not_called_done() {
    let directory = temporary();
    for words in [
        "export mjcf --robot @/robot.toml",
        "design --robot @/robot.toml --json",
        "design --robot @/robot.toml",
        "completions bash",
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = common::command::to_file(directory.path(), words, full);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{words}: {message}");
        assert!(message.contains("stdout: the disk is full"), "{words}: {message}");
    }
}

#[test]
fn a_value_of_the_robot_file_is_set_for_one_run() {
    let directory = temporary();
    let design = |more: &str| succeeds(directory.path(), &format!("design --robot @/robot.toml --json {more}"));
    let ceiling = |text: &str| json(text)["ceiling_hz"].as_f64().unwrap();
    let (usual, set) = (ceiling(&design("")), ceiling(&design("--set motor.resistance_ohm=25")));
    assert!(set < 0.9 * usual, "{usual} Hz, {set} Hz");
    let bench = |more: &str| succeeds(directory.path(), &format!("sim --bench --robot @/robot.toml --json {more}"));
    let peak = |text: &str| json(text)["peak_current_a"].as_f64().unwrap();
    assert!(peak(&bench("--set motor.resistance_ohm=25")) < peak(&bench("")));
    for (set, code, says) in [
        ("motor.resistance=18", 2, ["has no such quantity", "motor.resistance_ohm"]),
        ("motor.resistance_ohm", 2, ["PATH=VALUE", "motor.resistance_ohm=18"]),
        ("motor.resistance_ohm=x", 2, ["not a finite number", "--set"]),
        ("motor.resistance_ohm=15000", 1, ["--set motor.resistance_ohm=15000", "outside the allowed 0.01 … 1000"]),
    ] {
        common::command::refuses(directory.path(), &format!("sim --robot @/robot.toml --set {set}"), code, &says);
    }
}

#[test]
fn a_page_is_not_written_over_data() {
    let directory = temporary();
    for name in ["run.csv", "notes.html"] {
        std::fs::write(directory.path().join(name), "t_s,duty\n0,1\n").unwrap();
    }
    for (name, says) in [("run.csv", "ends in .html"), ("notes.html", "no page"), ("new.csv", "ends in .html")] {
        common::command::refuses(directory.path(), &format!("sim --robot @/robot.toml --view {name}"), 1, &[says]);
        let text = std::fs::read_to_string(directory.path().join(name)).unwrap_or_default();
        assert!(name == "new.csv" || text.starts_with("t_s,duty"), "{name}: {text}");
    }
    for _ in 0..2 {
        succeeds(directory.path(), "sim --robot @/robot.toml --seconds 0.2 --view page.html");
    }
}
