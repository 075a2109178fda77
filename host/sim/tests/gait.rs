//! A drive that plays a gait.

use std::path::Path;

use control::State;
use hal_sim::Settings;
use miette::Diagnostic;
use robot_file::Robot;
use robot_file::gait::GaitFile;
use simulation::{Drive, DriveCommand, Plan, Step, Trace, run};

fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).expect("robot.toml")
}

fn gait(name: &str, steps_hz: &[f64], repeat: bool) -> DriveCommand {
    DriveCommand::Gait(*GaitFile::new(name, 0.4, repeat, steps_hz).expect("good").gait())
}

fn ran(steps: &[(f64, DriveCommand)], seconds: f64) -> Trace {
    let steps = steps.iter().map(|&(at_s, command)| Step { at_s, command }).collect();
    let plan = Plan { drive: Drive { steps, end_s: None }, seconds, faults: Vec::new() };
    run(&robot(), 1, &Settings::default(), &plan).expect("it runs")
}

#[test]
fn a_gait_drives_the_shaft_as_its_frequencies_commanded_one_by_one_do() {
    let steps_hz = [7.0, -6.0, 8.0];
    let played = ran(&[(0.0, gait("three", &steps_hz, false))], 1.2);
    let freq = |index: usize| (0.4 * index as f64, DriveCommand::Freq { hz: steps_hz[index] });
    let commanded = ran(&[freq(0), freq(1), freq(2)], 1.2);
    for (one, other) in played.ticks.iter().zip(&commanded.ticks) {
        assert_eq!((one.actuation, one.truth.angle), (other.actuation, other.truth.angle), "{} s", one.time_s);
        assert_eq!((one.telemetry.state, other.telemetry.state), (State::Gait, State::Speed));
    }
}

#[test]
fn it_ends_once_and_is_not_begun_again_by_what_keeps_it_fresh() {
    let trace = ran(&[(0.1, gait("once", &[7.0, -7.0], false))], 2.0);
    let playing = trace.ticks.iter().filter(|tick| tick.telemetry.state == State::Gait).count();
    assert_eq!(playing, 800);
    assert_eq!(trace.ticks.last().map(|tick| tick.telemetry.state), Some(State::Coast));
    let repeats = ran(&[(0.1, gait("again", &[7.0, -7.0], true))], 2.0);
    assert_eq!(repeats.ticks.iter().filter(|tick| tick.telemetry.state == State::Gait).count(), 1900);
}

#[test]
fn the_first_gait_is_stored_before_and_another_one_is_taken_only_at_rest() {
    let (first, second) = (gait("first", &[7.0], true), gait("second", &[-7.0], true));
    let freq = DriveCommand::Freq { hz: 7.0 };
    let trace = ran(&[(0.0, freq), (0.3, first), (0.6, second), (0.9, DriveCommand::Idle), (1.0, second)], 1.5);
    let refusals: Vec<Option<&str>> = trace.commands.iter().map(|given| given.refusal.as_deref()).collect();
    assert_eq!(refusals[..2], [None, None]);
    assert!(refusals[2].is_some_and(|why| why.contains("stop it first")), "{refusals:?}");
    assert_eq!(refusals[3..], [None, None]);
    let kept: Vec<(usize, &str)> =
        trace.kept.iter().map(|(tick, gait)| (*tick, if gait.repeats() { "repeats" } else { "once" })).collect();
    assert_eq!(kept, [(0, "repeats"), (1000, "repeats")]);
}

#[test]
fn what_the_robot_cannot_do_is_refused_in_hertz() {
    let trace = ran(&[(0.0, gait("fast", &[7.0, 13.0], true))], 0.1);
    let why = trace.commands[0].refusal.as_deref().expect("refused");
    assert!(why.contains("the frequencies of the gait fast must be from 1.00 to 12.00 Hz, not 13.00 Hz"), "{why}");
    assert!(trace.ticks.iter().all(|tick| !tick.actuation.enable));
}

#[test]
fn a_drive_reads_a_gaits_file_and_a_script_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, script) = (folder.path().join("turn.toml"), folder.path().join("script.txt"));
    GaitFile::new("turn", 0.4, false, &[7.0, -7.0]).and_then(|gait| gait.save(&file)).expect("a file");
    let drive = Drive::parse(&format!("gait:{}", file.display())).expect("a drive");
    assert_eq!((drive.steps[0].command.to_string().as_str(), drive.end_s), ("gait turn", Some(0.8)));
    std::fs::write(&script, format!("freq 7\n1 gait {}\nwait 2\n", file.display())).expect("a script");
    let drive = Drive::parse(&format!("script:{}", script.display())).expect("a script");
    assert_eq!(drive.steps[1].command.to_string(), "gait turn");
    for wrong in ["gait", "gait:", "gait:no/such.toml"] {
        assert!(Drive::parse(wrong).is_err(), "{wrong}");
    }
    // Of a robot's file the gaits by their names are beside it, too.
    let gaits = folder.path().join("robots/gaits");
    std::fs::create_dir_all(&gaits).expect("a folder");
    std::fs::copy(&file, gaits.join("beside.toml")).expect("a copy");
    for robot in ["robot.toml", "robots/other.toml"].map(|name| folder.path().join(name)) {
        let drive = Drive::parse_for("gait:beside", Some(&robot)).expect("a gait beside the robot");
        assert_eq!(drive.steps[0].command.to_string(), "gait turn");
        let error = Drive::parse_for("gait:none", Some(&robot)).expect_err("no such gait");
        let (said, help) = (error.to_string(), error.help().expect("a help").to_string());
        assert!(said.starts_with("no gait `none`: there is no robots/gaits/none.toml and no "), "{said}");
        assert!(help.ends_with("or one of beside"), "{help}");
    }
    // A text that comes from elsewhere reads no file.
    let text = format!("gait {}", file.display());
    assert!(Drive::parse_script(&text, Path::new("s")).expect_err("refused").to_string().contains("read from a file"));
}
