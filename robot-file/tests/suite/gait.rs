//! Files of gaits: read, written, and refused with line and field.

use std::path::Path;

use control::Motion;
use robot_file::RobotFileError;
use robot_file::gait::{GaitFile, GaitStep};

const GOOD: &str = "\
name = \"turn-left\"
interval_s = 0.04
repeat = false
steps_hz = [
    7, -6.5, 7,
    8,
]

[made_by]
robot = \"robots/thesis.toml\"
seed = \"3\"
";

#[test]
fn a_file_is_what_the_robot_plays() {
    let file = GaitFile::parse(GOOD, "turn-left.toml").expect("good");
    let gait = file.gait();
    assert_eq!((gait.name().as_str(), gait.interval_ms(), gait.repeats()), ("turn-left", 40, false));
    assert_eq!(file.steps(), [7.0, -6.5, 7.0, 8.0].map(GaitStep::Frequency));
    assert!((file.length_s() - 0.16).abs() < 1e-12);
    assert_eq!(file.made_by["seed"], "3");
    // The same numbers as those of `freq`: hertz clockwise, as radians a second counter-clockwise.
    let expected = [7.0, -6.5, 7.0, 8.0].map(|hz: f64| Motion::Speed((-std::f64::consts::TAU * hz) as f32));
    assert_eq!(played(&file), expected);
}

fn played(file: &GaitFile) -> Vec<Motion> {
    let motions: Vec<Motion> = file.gait().motions().collect();
    file.gait().steps().map(|index| motions[usize::from(index)]).collect()
}

#[test]
fn a_step_may_be_an_oscillation() {
    let steps = "steps = [\n    { hz = 7 },\n    { from_deg = -45, to_deg = 90 },\n    { hz = 7 },\n]\n";
    let text = format!("name = \"turn\"\ninterval_s = 0.5\nrepeat = true\n{steps}");
    let file = GaitFile::parse(&text, "turn.toml").expect("good");
    assert_eq!(file.to_toml(), text);
    let swing = GaitStep::Oscillation([-45.0, 90.0]);
    assert_eq!(file, GaitFile::new("turn", 0.5, true, &[GaitStep::Frequency(7.0), swing, 7.0.into()]).expect("good"));
    let (from, to) = ((-std::f64::consts::FRAC_PI_4) as f32, std::f64::consts::FRAC_PI_2 as f32);
    let turn = Motion::Speed((-7.0 * std::f64::consts::TAU) as f32);
    assert_eq!(played(&file), [turn, Motion::Oscillation { from, to }, turn]);
    for (wrong, expected) in [
        (text.replace("hz = 7", "hz = 7, to_deg = 3"), "g.toml:5: steps[0]: is neither a frequency nor an oscill"),
        (text.replace("{ from_deg = -45, to_deg = 90 }", "7"), "g.toml:6: steps[1]: is neither a frequency nor"),
        (text.replace("-45", "inf"), "g.toml:4: steps: inf is not a finite number"),
        (format!("{text}steps_hz = [7]\n"), "g.toml:4: steps: there is `steps_hz`, too"),
        (text.replace("steps = [", "steps = 3\nunknown = ["), "g.toml:4: steps: expected frequencies and oscillations"),
    ] {
        let said = refused(&wrong).to_string();
        assert!(said.contains(expected), "{wrong}\n{said}\ninstead of {expected}");
    }
    let many: Vec<GaitStep> = (0..9).map(|step| GaitStep::Oscillation([f64::from(step), 90.0])).collect();
    let said = GaitFile::new("turn", 0.5, true, &many).expect_err("too many").to_string();
    assert!(said.contains("0 different frequencies and 9 oscillations, which count twice, at most 16 fit"), "{said}");
}

#[test]
fn what_is_written_is_read_again_and_written_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("new/turn.toml");
    let steps: Vec<f64> = (0..250).map(|step| [-8.0, -7.5, -6.0, 6.125, 1e-3 + 7.0][step * step % 5]).collect();
    let mut file = GaitFile::new("turn", 0.04, true, &steps).expect("good");
    file.made_by.insert("command".into(), "scram learn \"turn\"\nwith a second line".into());
    file.made_by.insert("a key with spaces".into(), "ü".into());
    file.save(&path).expect("written");
    let read = GaitFile::load(&path).expect("read");
    assert_eq!(read, file);
    assert_eq!(read.to_toml(), std::fs::read_to_string(&path).expect("a file"));
    assert!(read.to_toml().lines().all(|line| line.len() <= 140));
}

fn refused(text: &str) -> RobotFileError {
    GaitFile::parse(text, "g.toml").expect_err(text)
}

#[test]
fn what_is_wrong_is_said_with_line_and_field() {
    let seventeen = (0..17).map(|step| format!("{}", 6.0 + 0.1 * f64::from(step))).collect::<Vec<_>>().join(", ");
    let many = vec!["7"; 251].join(", ");
    let with = |from: &str, to: &str| GOOD.replace(from, to);
    for (text, expected) in [
        (with("turn-left\"", "a name that is too long\""), "g.toml:1: name: `a name that is too long` is not 1 to 12"),
        (with("0.04", "0.0405"), "g.toml:2: interval_s: 0.0405 s is not a whole number of milliseconds"),
        (with("0.04", "0.001"), "g.toml:2: interval_s: 0.001 is outside the allowed 0.01 … 2 s"),
        (with("0.04", "2.5"), "g.toml:2: interval_s: 2.5 is outside"),
        (with("0.04", "nan"), "g.toml:2: interval_s: NaN is outside"),
        (with("0.04", "\"soon\""), "g.toml:2: interval_s: expected a number in s, found a text"),
        (with("false", "0"), "g.toml:3: repeat: expected true or false, found a number"),
        (with("repeat = false\n", ""), "repeat: field is missing in the file; add `repeat = true` or `false`"),
        (with("8,", "\"8\","), "g.toml:6: steps_hz[3]: expected a number in Hz, found a text"),
        (with("8,", "inf,"), "g.toml:4: steps_hz: inf is not a finite number"),
        (with("8,", "1e300,"), "g.toml:4: steps_hz:"),
        (with("8,", &seventeen), "g.toml:4: steps_hz: 18 different frequencies, at most 16 fit"),
        (with("8,", &many), "g.toml:4: steps_hz: the number of a gait's steps must be from 1 to 250, not 254"),
        (with("    7, -6.5, 7,\n    8,\n", ""), "steps_hz: the number of a gait's steps must be from 1 to 250, not 0"),
        (with("steps_hz", "step_hz"), "g.toml:4: step_hz: unknown field"),
        (with("\"3\"", "3"), "g.toml:11: made_by.seed: expected a text, found a number"),
        (with("repeat = false", "repeat ="), "g.toml:3: not valid TOML"),
        (format!("base = \"other.toml\"\n{GOOD}"), "g.toml:1: base: unknown"),
    ] {
        let said = refused(&text).to_string();
        assert!(said.contains(expected), "{text}\n{said}\ninstead of {expected}");
    }
    // Everything at once.
    assert_eq!(refused("name = 3\nrepeat = 3\n").problems().len(), 4);
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let said = GaitFile::load(Path::new("no/such/gait.toml")).expect_err("none").to_string();
    assert!(said.contains("no/such/gait.toml: cannot be read") && said.contains("name a gait's file"), "{said}");
}

#[test]
fn a_name_is_a_gait_of_the_project_and_anything_else_a_path() {
    assert_eq!(GaitFile::path_of("turn-left"), Path::new("robots/gaits/turn-left.toml"));
    let places = |name, robot| {
        GaitFile::places(name, robot).into_iter().map(|place| place.display().to_string()).collect::<Vec<_>>()
    };
    assert_eq!(places("turn-left", None), ["robots/gaits/turn-left.toml"]);
    // Of a file in the working directory it is the same place, which is looked at once.
    assert_eq!(places("turn-left", Some(Path::new("robot.toml"))), ["robots/gaits/turn-left.toml"]);
    let beside = ["robots/gaits/a.toml", "/p/robots/robots/gaits/a.toml", "/p/robots/gaits/a.toml"];
    assert_eq!(places("a", Some(Path::new("/p/robots/b.toml"))), beside);
    assert_eq!(places("mine/a.toml", Some(Path::new("/p/robot.toml"))), ["mine/a.toml"]);
    for path in ["turn.toml", "./turn", "out/turn.toml", "/tmp/turn"] {
        assert_eq!(GaitFile::path_of(path), Path::new(path));
    }
}

/// Every gait that is shipped can be played by the robot that it was made for, and has its file's name.
#[test]
fn the_shipped_gaits_can_be_played() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut count = 0;
    for entry in std::fs::read_dir(root.join("robots/gaits")).expect("a folder").flatten() {
        let path = entry.path();
        let file = GaitFile::load(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(path.file_stem().and_then(|stem| stem.to_str()), Some(file.gait().name().as_str()));
        assert!(!file.made_by.is_empty(), "{}: what made it?", path.display());
        let robot = file.made_by.get("robot").map_or("robot.toml", String::as_str);
        let robot = robot_file::Robot::load(&root.join(robot)).unwrap_or_else(|error| panic!("{error}"));
        let parameters = robot_file::design::design(&robot).expect("a controller").parameters;
        let checked = file.gait().check(&parameters.limits, parameters.tick);
        assert!(checked.is_ok(), "{}: {checked:?}", path.display());
        count += 1;
    }
    assert!(count > 0);
}
