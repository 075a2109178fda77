//! `scram calibrate` on a pseudo-terminal: the real program and the real serial code, a dongle and a robot behind it.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use crate::common::{robot_file, tty};
use control::State;
use hal_sim::Fault;
use recording::load;
use robot_file::Robot;
use testbed::injected_event::InjectedEvent;
use testbed::realtime::Simulation;

/// A bench on the far end of a pseudo-terminal, in real time, and the keys to it.
struct OnTty {
    simulation: Simulation,
    keys: tempfile::TempDir,
}

impl OnTty {
    fn new(injected_events: &[InjectedEvent]) -> Self {
        let keys = tempfile::tempdir().expect("a directory");
        Self { simulation: tty::start(1, 1, injected_events, keys.path()), keys }
    }

    fn calibrate(&self, out: &Path, arguments: &[&str]) -> Child {
        self.command(arguments).arg("--out").arg(out).spawn().expect("scram runs")
    }

    /// What reads and writes relative to a directory.
    fn calibrate_in(&self, directory: &Path, arguments: &[&str]) -> Child {
        self.command(arguments).current_dir(directory).spawn().expect("scram runs")
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_scram"));
        command.args(["calibrate", "--port"]).arg(self.simulation.port());
        command.arg("--keys").arg(self.keys.path().join("keys.toml")).arg("--robot").arg(robot_file()).args(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// How the program left the robot.
    fn state(&self) -> State {
        self.simulation.robots()[0].state.expect("it runs").0
    }
}

fn finished(child: Child) -> (ExitStatus, String, String) {
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status, text(output.stdout), text(output.stderr))
}

#[test]
fn the_program_calibrates_a_robot_over_a_serial_line() {
    let tty = OnTty::new(&[]);
    let out = tempfile::tempdir().expect("a directory");
    let mut child = tty.calibrate(out.path(), &[]);
    // Enter, long before it is asked for.
    child.stdin.take().expect("a pipe").write_all(b"\n").expect("it reads");
    let (status, stdout, stderr) = finished(child);
    assert!(status.success(), "{stdout}{stderr}");
    assert!(stdout.contains("blind arc") && stdout.contains("cargo flash-robot esp32"), "{stdout}");
    assert!(stderr.contains("scram-26 at 7c:df:a1:00:00:00, -"), "{stderr}");
    for line in stderr.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let calibrated = Robot::load(&out.path().join("robot.toml")).expect("a robot file");
    let robot_file::robot::Sensor::Potentiometer(sensor) = calibrated.sensor else { panic!("a potentiometer") };
    let correction = sensor.correction.expect("a correction");
    assert!(correction.source.contains("run.mcap") && correction.residual_deg < 0.2, "{correction:?}");
    for name in ["run.mcap", "run.csv", "run.toml", "potentiometer.svg"] {
        assert!(out.path().join(name).exists(), "{name}");
    }
    // What it wrote is what a second look at its own recording gives.
    let again = Command::new(env!("CARGO_BIN_EXE_scram"))
        .args(["identify", "potentiometer"])
        .arg(out.path().join("run.mcap"))
        .arg("--robot")
        .arg(robot_file())
        .arg("--out")
        .arg(out.path().join("again"))
        .output()
        .expect("scram runs");
    let table =
        |text: &str| text.lines().take_while(|line| !line.starts_with("written")).collect::<Vec<_>>().join("\n");
    assert_eq!(table(&String::from_utf8_lossy(&again.stdout)), table(&stdout));
    let read = |path: &Path| std::fs::read_to_string(path).expect("a file");
    assert_eq!(read(&out.path().join("again/robot.toml")), read(&out.path().join("robot.toml")));
    assert_eq!(tty.state(), State::Idle);
}

#[test]
fn every_calibration_has_a_directory_and_the_link_leads_to_the_last_that_succeeded() {
    let place = tempfile::tempdir().expect("a directory");
    let at = |name: &str| place.path().join("out").join(name);
    let leads_to = |number: &str| {
        let link = std::fs::read_link(at("latest-calibrate")).expect("a link");
        assert_eq!(link, Path::new(&format!("calibrate-{number}")));
    };
    let tty = OnTty::new(&[]);
    for number in ["0001", "0002"] {
        let (status, stdout, stderr) = finished(tty.calibrate_in(place.path(), &["--yes"]));
        assert!(status.success(), "{stdout}{stderr}");
        let flash = format!("SCRAM_ROBOT=$PWD/out/calibrate-{number}/robot.toml cargo flash-robot");
        assert!(stdout.contains(&flash), "{stdout}");
        for name in ["robot.toml", "run.mcap", "run.csv", "potentiometer.svg"] {
            assert!(at(&format!("calibrate-{number}")).join(name).exists(), "{name}");
        }
        leads_to(number);
    }
    let swapped = OnTty::new(&[InjectedEvent::Fault(0, Fault::MotorReversed)]);
    let (status, stdout, stderr) = finished(swapped.calibrate_in(place.path(), &["--yes"]));
    assert_eq!(status.code(), Some(1), "{stdout}{stderr}");
    assert!(stderr.contains("the recording is out/calibrate-0003/failed.mcap"), "{stderr}");
    assert!(load(&at("calibrate-0003/failed.mcap")).is_ok());
    leads_to("0002");
}

#[test]
fn a_calibration_is_written_over_only_on_request() {
    let tty = OnTty::new(&[]);
    for name in ["robot.toml", "potentiometer.svg", "run.mcap", "run.csv", "failed.mcap", "failed.csv"] {
        let out = tempfile::tempdir().expect("a directory");
        std::fs::write(out.path().join(name), "mine").expect("writes");
        let (status, stdout, stderr) = finished(tty.calibrate(out.path(), &["--yes"]));
        assert_eq!(status.code(), Some(1), "{name}: {stdout}{stderr}");
        assert!(stderr.contains(&format!("{name} is there already")) && stderr.contains("--overwrite"), "{stderr}");
        assert!(!stderr.contains("1/4"), "it is said before anything moves: {stderr}");
        assert_eq!(std::fs::read_dir(out.path()).expect("a directory").count(), 1);
        assert_eq!(std::fs::read(out.path().join(name)).expect("a file"), b"mine");
    }
    let out = tempfile::tempdir().expect("a directory");
    for name in ["robot.toml", "failed.csv"] {
        std::fs::write(out.path().join(name), "mine").expect("writes");
    }
    let (status, stdout, stderr) = finished(tty.calibrate(out.path(), &["--yes", "--overwrite"]));
    assert!(status.success(), "{stdout}{stderr}");
    assert!(Robot::load(&out.path().join("robot.toml")).is_ok());
    assert!(stderr.contains(&format!("not of this run, but in {}: failed.csv\n", out.path().display())), "{stderr}");
    assert_eq!(std::fs::read(out.path().join("failed.csv")).expect("a file"), b"mine", "nothing is deleted");
}

#[test]
fn ctrl_c_stops_the_motor_and_keeps_the_recording() {
    let tty = OnTty::new(&[]);
    let out = tempfile::tempdir().expect("a directory");
    let mut child = tty.calibrate(out.path(), &["--yes"]);
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines().map(|line| line.expect("UTF-8"));
    lines.find(|line| line.starts_with("3/4")).expect("it comes to the spin");
    // Two and a half seconds of motor begin now.
    std::thread::sleep(Duration::from_millis(1000));
    let signalled = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(signalled.success());
    let stderr: String = lines.collect();
    let (status, stdout, _) = finished(child);
    assert_eq!(status.code(), Some(1), "{stdout}{stderr}");
    assert!(stderr.contains("stopped on request") && stderr.contains("failed.mcap"), "{stderr}");
    assert_eq!(tty.state(), State::Idle);
    let recording = load(&out.path().join("failed.mcap")).expect("a recording");
    let driven = recording.enable.iter().filter(|on| **on).count();
    assert!((100..2400).contains(&driven), "{driven}");
    assert!(!out.path().join("robot.toml").exists());
}

#[test]
fn a_motor_with_swapped_wires_is_said() {
    let tty = OnTty::new(&[InjectedEvent::Fault(0, Fault::MotorReversed)]);
    let out = tempfile::tempdir().expect("a directory");
    let (status, stdout, stderr) = finished(tty.calibrate(out.path(), &["--yes"]));
    assert_eq!(status.code(), Some(1), "{stdout}{stderr}");
    assert!(stderr.contains("swapped"), "{stderr}");
    assert!(!out.path().join("robot.toml").exists());
    assert!(!tty.state().is_driving());
}

#[test]
fn without_a_dongle_nothing_is_written() {
    let tty = OnTty::new(&[InjectedEvent::DongleHangs]);
    let out = tempfile::tempdir().expect("a directory");
    let (status, stdout, stderr) = finished(tty.calibrate(out.path(), &["--yes"]));
    assert_eq!(status.code(), Some(1), "{stdout}{stderr}");
    assert!(stderr.contains("no dongle answers: not a byte came"), "{stderr}");
    assert_eq!(std::fs::read_dir(out.path()).expect("a directory").count(), 0);
}

#[test]
fn nobody_at_the_keyboard_starts_nothing() {
    let tty = OnTty::new(&[]);
    let out = tempfile::tempdir().expect("a directory");
    let mut child = tty.calibrate(out.path(), &[]);
    drop(child.stdin.take());
    let (status, _, stderr) = finished(child);
    assert_eq!(status.code(), Some(1));
    assert!(stderr.contains("nobody pressed Enter"), "{stderr}");
    assert!(!tty.state().is_driving());
}

#[test]
fn without_keys_nothing_is_asked_of_the_port() {
    let out = tempfile::tempdir().expect("a directory");
    let missing = out.path().join("keys.toml");
    let output = Command::new(env!("CARGO_BIN_EXE_scram"))
        .args(["calibrate", "--port", "/dev/none", "--yes", "--robot"])
        .arg(robot_file())
        .arg("--keys")
        .arg(&missing)
        .output()
        .expect("scram runs");
    assert_eq!(output.status.code(), Some(1));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("no robot is paired") && stderr.contains("scram pair"), "{stderr}");
}
