//! `scram replay`: a recording decided again gives the same to the bit, other gains do not, and what cannot be compared is
//! told.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::common;
use assert_cmd::Command;
use control::Controller;
use control::protocol::radio::PackedTick;
use recording::{
    LinkQuality, Metadata, RobotChannel, SessionEvent, SessionRecorder, Stated, TelemetryRow, load, write_csv,
    write_mcap,
};
use robot_file::Robot;
use robot_file::gait::GaitFile;
use scram::console::Engine;
use scram::replay::{Findings, replay};
use serde_json::Value;
use simulation::{Drive, Plan, Scheduled, Trace};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn robot() -> Robot {
    Robot::load(&root().join("robot.toml")).unwrap()
}

/// Every mode, there and back, with 3.9 s.
const SCRIPT: &str = "freq 7\nwait 1\nfreq -6\nwait 0.9\noscillate -100..100\nwait 0.9\nposition 30\nwait 0.5\n\
                      duty 0.4\nwait 0.3\ncoast\nwait 0.2\nidle\nwait 0.1\n";

fn scram(directory: &Path, words: &[&str]) -> String {
    let output = Command::cargo_bin("scram").unwrap().current_dir(directory).args(words).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{words:?}: {text}{}", String::from_utf8_lossy(&output.stderr));
    text
}

/// Runs `scram sim` with a robot file into a directory.
fn simulate(directory: &Path, robot: &Path, drive: &str, faults: &str) {
    std::fs::write(directory.join("steps.txt"), SCRIPT).unwrap();
    let robot = robot.to_str().unwrap();
    scram(directory, &["sim", "--robot", robot, "--drive", drive, "--faults", faults, "--out", "run", "--overwrite"]);
}

fn replayed(directory: &Path, robot: &Path, run: &str) -> Value {
    let words = ["replay", run, "--robot", robot.to_str().unwrap(), "--out", "seen", "--overwrite", "--json"];
    serde_json::from_str(&scram(directory, &words)).unwrap()
}

#[track_caller]
fn assert_identical(found: &Value) {
    assert_eq!(found["same"], true, "{found}");
    assert_eq!(found["verdict"], "the current controller decides the same");
    let compared = found["compared"].as_array().unwrap();
    assert_eq!((compared.len(), found["not_compared"].as_array().unwrap().len()), (7, 0), "{found}");
    for quantity in compared {
        assert!(quantity["compared"].as_u64().unwrap() > 500, "{quantity}");
        assert_eq!(quantity["different"], 0, "{quantity}");
        assert!(quantity["rms"].is_null() || quantity["rms"] == 0.0, "{quantity}");
    }
}

#[test]
fn a_simulated_run_is_decided_again_to_the_bit() {
    let file = root().join("robot.toml");
    for (drive, faults) in [
        ("script:steps.txt", ""),
        ("freq:7", "sensor-open@0.6"),
        ("oscillate:-100..100", "link-lost@1"),
        ("freq:-5", "battery-low@0.8,stall@1.5"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        simulate(directory.path(), &file, drive, faults);
        for run in ["run/run.mcap", "run/run.csv"] {
            assert_identical(&replayed(directory.path(), &file, run));
        }
        for name in ["replay.svg", "replay-comparison.svg"] {
            let svg = std::fs::read_to_string(directory.path().join("seen").join(name)).unwrap();
            roxmltree::Document::parse(&svg).unwrap();
            assert!(svg.contains("polyline"), "{name} has no line");
        }
    }
}

#[test]
fn a_gait_is_in_the_recording_and_played_again_to_the_bit() {
    let directory = tempfile::tempdir().unwrap();
    let gait = GaitFile::new("turn", 0.04, false, &[7.0, 7.0, -8.0, -8.0, -8.0, 6.0].repeat(8)).unwrap();
    gait.save(&directory.path().join("turn.toml")).unwrap();
    let script = "freq 7\nwait 0.5\ngait ./turn.toml\nwait 2.5\nidle\nwait 0.2\n";
    std::fs::write(directory.path().join("gait.txt"), script).unwrap();
    let file = root().join("robot.toml");
    simulate(directory.path(), &file, "script:gait.txt", "");
    // The recording alone holds it.
    std::fs::remove_file(directory.path().join("turn.toml")).unwrap();
    assert_identical(&replayed(directory.path(), &file, "run/run.mcap"));
    // A table has its name only.
    let found = replayed(directory.path(), &file, "run/run.csv");
    assert_eq!(found["same"], false);
    assert!(found.to_string().contains("the gait is not in this file"), "{found}");
}

#[test]
fn every_kind_of_sensor_is_decided_again() {
    for variant in std::fs::read_dir(root().join("robots")).unwrap() {
        let file = variant.unwrap().path();
        let Ok(robot) = Robot::load(&file) else { continue };
        if robot_file::design::design(&robot).is_err() {
            continue;
        }
        let directory = tempfile::tempdir().unwrap();
        let seconds = ["sim", "--robot", file.to_str().unwrap(), "--drive", "position:30", "--out", "run"];
        scram(directory.path(), &seconds);
        let found = replayed(directory.path(), &file, "run/run.mcap");
        assert_eq!(found["same"], true, "{}: {found}", file.display());
        assert!(found["compared"].as_array().unwrap().iter().all(|q| q["different"] == 0), "{found}");
    }
}

#[test]
fn two_sensors_are_decided_again_and_one_that_failed_is_in_the_recording() {
    let directory = tempfile::tempdir().unwrap();
    let two = root().join("robots/two-sensors.toml");
    scram(
        directory.path(),
        &[
            "sim",
            "--bench",
            "--robot",
            two.to_str().unwrap(),
            "--drive",
            "freq:7",
            "--faults",
            "second-sensor-open@0.8",
            "--out",
            "run",
        ],
    );
    let csv = std::fs::read_to_string(directory.path().join("run/run.csv")).unwrap();
    let header: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    let failed = header.iter().position(|name| *name == "failed_sensor").expect("a column");
    assert!(header.contains(&"adc_second"));
    let cells = |line: &str| line.split(',').nth(failed).unwrap().to_owned();
    assert_eq!(cells(csv.lines().nth(500).unwrap()), "");
    assert_eq!(cells(csv.lines().last().unwrap()), "Second");
    for run in ["run/run.csv", "run/run.mcap"] {
        assert_identical(&replayed(directory.path(), &two, run));
    }
}

#[test]
fn another_gain_shows_where_and_by_how_much() {
    let directory = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(root().join("robot.toml")).unwrap();
    let gain = "proportional_v_per_rad = { value = 12.0, low = 1.0";
    assert!(text.contains(gain));
    let changed = directory.path().join("changed.toml");
    std::fs::write(&changed, text.replacen(gain, "proportional_v_per_rad = { value = 6.0, low = 1.0", 1)).unwrap();
    simulate(directory.path(), &root().join("robot.toml"), "script:steps.txt", "");
    let found = replayed(directory.path(), &changed, "run/run.mcap");
    assert_eq!(found["same"], false, "{found}");
    let duty = found["compared"].as_array().unwrap().iter().find(|q| q["name"] == "duty").unwrap().clone();
    // The gain is the position control's, which begins at 2.8 s.
    let first = duty["first"]["t_s"].as_f64().unwrap();
    assert!((2.8..2.95).contains(&first), "{duty}");
    let (recorded, replayed) =
        (duty["first"]["recorded"].as_f64().unwrap(), duty["first"]["replayed"].as_f64().unwrap());
    assert!(recorded != replayed && duty["rms"].as_f64().unwrap() > 1e-3, "{duty}");
    assert!(duty["worst"]["difference"].as_f64().unwrap().abs() <= 2.0);
    assert!(found["verdict"].as_str().unwrap().contains("decides otherwise; first duty at 2.8"), "{found}");
    let table = scram(directory.path(), &["replay", "run/run.mcap", "--robot", "changed.toml"]);
    assert!(table.contains("first duty at 2.8") && table.contains("estimated speed"), "{table}");
}

#[test]
fn recordings_without_orders_are_plotted_and_say_why_there_is_no_more() {
    let directory = tempfile::tempdir().unwrap();
    let file = root().join("robot.toml");
    simulate(directory.path(), &file, "freq:7", "");
    // As `scram sim` wrote them before it recorded commands, and as `scram calibrate` does.
    let bare = load(&directory.path().join("run/run.csv")).unwrap();
    write_csv(&directory.path().join("old.csv"), &bare).unwrap();
    write_mcap(&directory.path().join("old.mcap"), &bare).unwrap();
    replayed(directory.path(), &file, "run/run.mcap");
    assert!(directory.path().join("seen/replay-comparison.svg").exists());
    for run in ["old.csv", "old.mcap"] {
        let found = replayed(directory.path(), &file, run);
        assert!(found["same"].is_null() && found["compared"].as_array().unwrap().is_empty(), "{found}");
        assert!(found["not_compared"][0].as_str().unwrap().contains("no orders are recorded"), "{found}");
        assert!(directory.path().join("seen/replay.svg").exists());
    }
    // The comparison of the replay before stays, and is named.
    let robot = file.to_str().unwrap();
    let words = ["replay", "old.csv", "--robot", robot, "--out", "seen", "--overwrite"];
    let output = Command::cargo_bin("scram").unwrap().current_dir(directory.path()).args(words).output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(message, "warning: not of this run, but in seen: replay-comparison.svg\n");
    assert!(directory.path().join("seen/replay-comparison.svg").exists());
    let rows: String = (0..900).map(|i| format!("{},2.5,{}\n", f64::from(i) * 1e-3, f64::from(i) * 1e-2)).collect();
    std::fs::write(directory.path().join("foreign.csv"), format!("t_s,voltage_v,angle_rad\n{rows}")).unwrap();
    let found = replayed(directory.path(), &file, "foreign.csv").to_string();
    for reason in ["no orders", "voltages and no duty", "no codes of the angle sensor"] {
        assert!(found.contains(reason), "{found}");
    }
}

#[test]
fn another_robots_recording_is_plotted_only() {
    let directory = tempfile::tempdir().unwrap();
    simulate(directory.path(), &root().join("robot.toml"), "freq:7", "");
    let text = std::fs::read_to_string(root().join("robot.toml")).unwrap();
    let other = directory.path().join("other.toml");
    std::fs::write(&other, text.replacen("scram-26", "another", 1)).unwrap();
    let found = replayed(directory.path(), &other, "run/run.mcap");
    assert!(found["same"].is_null());
    assert!(found["not_compared"][0].as_str().unwrap().contains("recorded on `scram-26`"), "{found}");
}

/// What a robot would have told of a run, through a radio that loses some batches: rows of ten ticks, values on its steps.
fn tell(recorder: &mut SessionRecorder, channel: RobotChannel, trace: &Trace, loses: impl Fn(usize) -> bool) {
    let mut commands = trace.told.iter().filter(|told| !told.repeat).peekable();
    for (index, tick) in trace.ticks.iter().enumerate() {
        let t_s = index as f64 * 1e-3;
        // It takes 7 ms from the console to the robot.
        while let Some(told) = commands.next_if(|told| told.tick <= index + 7) {
            let (text, command) = (told.command.to_string(), Some(told.command.to_control()));
            recorder
                .event(t_s, Some(channel), &SessionEvent::Command { text, command, repeat: false, gait: None })
                .unwrap();
        }
        if index % 100 == 0 {
            let far = (index as f32 * 2e-3).sin();
            let (loss, latency_s) = (0.02 + 0.02 * far, Some(0.007 + 0.002 * far));
            let quality = LinkQuality { rate_hz: 98.0 - far, loss, latency_s, rssi_dbm: Some(-60.0 - 8.0 * far) };
            recorder.link(t_s, channel, &quality).unwrap();
        }
        if loses(index / 10) {
            continue;
        }
        let t = &tick.telemetry;
        let row = PackedTick::new(tick.sample.angle, t).with_second(tick.sample.second);
        let told = TelemetryRow {
            t_s,
            tick: 5000 + index as u64,
            time_us: None,
            adc: row.code,
            adc_second: row.second,
            duty: row.duty(),
            angle_rad: row.angle(),
            speed_rad_per_s: row.speed(),
            battery_v: Some(t.battery),
            supply_v: None,
            pose: None,
            stated: Stated { state: t.state, fault: t.fault, tracking: t.tracking, failed_sensor: t.failed_sensor },
        };
        recorder.sample(channel, &told).unwrap();
    }
}

fn run(script: &str, faults: &str) -> Trace {
    let drive = Drive::parse_script(script, Path::new("s")).unwrap();
    let seconds = drive.end_s.unwrap();
    let plan = Plan { drive, seconds, faults: Scheduled::parse_list(faults).unwrap() };
    simulation::run(&robot(), 5, &hal_sim::Settings::default(), &plan).unwrap()
}

fn quantity<'f>(findings: &'f Findings, name: &str) -> &'f scram::replay::Quantity {
    findings.compared.iter().find(|quantity| quantity.name == name).unwrap()
}

#[test]
fn a_session_is_replayed_robot_by_robot() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("session.mcap");
    let mut recorder = SessionRecorder::create(&path, &Metadata::default()).unwrap();
    let (whole, lossy) = (recorder.robot("scram-26").unwrap(), recorder.robot("scram-26").unwrap());
    let trace = run(SCRIPT, "");
    tell(&mut recorder, whole, &trace, |_| false);
    tell(&mut recorder, lossy, &run(SCRIPT, "sensor-open@1.5"), |batch| batch % 40 == 7);
    recorder.finish().unwrap();

    let none = replay(&path, None, &robot()).err().expect("two robots").to_string();
    assert!(none.contains("scram-26, scram-26-2"), "{none}");
    let seen = replay(&path, Some("scram-26"), &robot()).unwrap();
    let found = &seen.findings;
    assert_eq!((found.rows, found.missed_ticks, found.gaps), (3900, 0, 0));
    // The clock jitters by microseconds that telemetry does not tell: many ticks differ a little.
    for name in ["bridge", "state", "fault", "angle known"] {
        assert!(quantity(found, name).share < 0.002, "{:?}", quantity(found, name));
    }
    assert!(quantity(found, "duty").rms.unwrap() < 0.05, "{:?}", quantity(found, "duty"));
    assert!(quantity(found, "estimated speed").rms.unwrap() < 0.5, "{:?}", quantity(found, "estimated speed"));
    assert_eq!(seen.pictures().unwrap().len(), 2);
    let overview = &seen.pictures().unwrap()[0].1;
    for part in ["RSSI / dBm", "ticks lost", "order to its answer", "oscillate -100..100", "Battery", "Oscillate"] {
        assert!(overview.to_lowercase().contains(&part.to_lowercase()), "{part}");
    }

    let seen = replay(&path, Some("scram-26-2"), &robot()).unwrap();
    let found = &seen.findings;
    assert_eq!((found.missed_ticks, found.gaps), (100, 10));
    // The fault and the commands that it refused are decided again, too.
    assert!(quantity(found, "state").share < 0.01, "{:?}", quantity(found, "state"));
    assert!(quantity(found, "fault").share < 0.01, "{:?}", quantity(found, "fault"));
    let overview = &seen.pictures().unwrap()[0].1;
    assert!(overview.contains("Fault: Sensor"));
    // For people: how a session looks.
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("session-replay.svg"), overview).unwrap();
}

/// The run decided again on a clock without jitter, whose tick numbers say everything about its time.
fn on_a_steady_clock(mut trace: Trace) -> Trace {
    let mut controller = Controller::new(&trace.parameters).unwrap();
    let mut told = trace.told.iter().peekable();
    for (index, tick) in trace.ticks.iter_mut().enumerate() {
        tick.sample.time_us = 1000 * (5000 + index as u64);
        while let Some(told) = told.next_if(|told| told.tick <= index) {
            controller.command(told.command.to_control(), tick.sample.time_us).unwrap();
        }
        tick.actuation = controller.tick(&tick.sample);
        tick.telemetry = controller.telemetry();
    }
    trace
}

#[test]
fn telemetry_of_a_steady_clock_is_decided_again_to_half_a_step() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("session.mcap");
    let mut recorder = SessionRecorder::create(&path, &Metadata::default()).unwrap();
    let channel = recorder.robot("scram-26").unwrap();
    tell(&mut recorder, channel, &on_a_steady_clock(run(SCRIPT, "")), |_| false);
    recorder.finish().unwrap();
    let found = replay(&path, None, &robot()).unwrap().findings;
    assert_eq!(found.same, Some(true), "{found:?}");
    assert!(found.compared.len() == 7 && found.compared.iter().all(|q| q.different == 0), "{:?}", found.compared);
    assert!(found.notes.iter().any(|note| note.contains("half a step")), "{:?}", found.notes);
}

/// Types into a console on a robot whose radio loses nothing, with half a second after each line; the recording.
fn record_session(directory: &Path, seed: u64, lines: &[&str]) -> PathBuf {
    let line = common::bench::bench(1, seed, |setup| {
        (setup.radio.loss_share.value, setup.radio.quiet_loss_share.value) = (0.0, 0.0);
        (setup.radio.corruption_share.value, setup.radio.reorder_share.value) = (0.0, 0.0);
    });
    let mut engine = Engine::new(common::bench::session(&line, 1, seed), "the bench");
    engine.record(directory, 1e-3).unwrap();
    while engine.model().robots[0].state.is_none() {
        engine.poll().expect("the line holds");
    }
    for text in lines {
        match *text {
            "Esc" => engine.stop_all(),
            text => engine.submit(text).unwrap(),
        }
        let end = engine.model().now + Duration::from_millis(500);
        while engine.model().now < end {
            engine.poll().expect("the line holds");
        }
    }
    engine.finish();
    engine.model().recording.as_ref().unwrap().path.clone()
}

#[track_caller]
fn assert_no_difference(path: &Path) -> Findings {
    let own = Robot { name: "robot-0".into(), ..robot() };
    let found = replay(path, None, &own).unwrap().findings;
    assert_eq!(found.same, Some(true), "{found:?}");
    assert_eq!(found.compared.len(), 7, "{found:?}");
    for quantity in &found.compared {
        assert!(quantity.compared > 500, "{quantity:?}");
        assert_eq!(quantity.different, 0, "{quantity:?}");
    }
    assert_eq!(found.verdict, "the current controller decides the same");
    assert!(!found.notes.iter().any(|note| note.contains("exact times") || note.contains("seen to")), "{found:?}");
    found
}

#[test]
fn a_session_with_a_refused_order_is_decided_again_without_a_difference() {
    let directory = tempfile::tempdir().unwrap();
    for seed in 1..=4 {
        let path = record_session(directory.path(), seed, &["clear", "freq 7", "freq 70", "", "Esc"]);
        assert_no_difference(&path);
    }
}

#[test]
fn a_session_with_every_kind_of_order_is_decided_again_without_a_difference() {
    let directory = tempfile::tempdir().unwrap();
    let lines = [
        "clear",
        "freq 7",
        "freq 70",
        "freq 7.3",
        "",
        "set controller.position.proportional_v_per_rad 6",
        "get controller.position.proportional_v_per_rad",
        "position 30",
        "set controller.position.proportional_v_per_rad 20",
        "position -60",
        "",
        "undo",
        "position 90",
        "oscillate -100..100",
        "save",
        "set controller.supervisor.command_age_s 0.6",
        "",
        "duty 0.4",
        "coast",
        "Esc",
        "freq 7",
        "factory",
        "Esc",
        "factory",
        "position 10",
        "Esc",
    ];
    let path = record_session(directory.path(), 5, &lines);
    assert_no_difference(&path);
}
