//! `scram calibrate` on a pseudo-terminal: the real program and the real serial code, a dongle and a robot behind it.
#![cfg(unix)]

mod bench;

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bench::{Bench, Trouble, robot_file};
use control::State;
use description::Robot;
use hal_sim::Fault;
use serialport::{SerialPort, TTYPort};

/// How the program left the robot.
struct Left {
    driven: usize,
    state: State,
}

/// A bench on the far end of a pseudo-terminal, in real time.
struct OnTty {
    port: String,
    /// Keeps the near end open between the program's reads.
    _near: TTYPort,
    ended: Arc<AtomicBool>,
    thread: JoinHandle<Left>,
}

impl OnTty {
    fn new(trouble: Trouble, breaks: Option<Fault>) -> Self {
        let (mut far, near) = TTYPort::pair().expect("a pseudo-terminal");
        far.set_timeout(Duration::from_millis(2)).expect("a timeout");
        let ended = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&ended);
        let thread = std::thread::spawn(move || {
            let robot = Robot::load(&robot_file()).expect("robot.toml");
            let mut bench = Bench::new(&robot, 1, trouble);
            if let Some(fault) = breaks {
                bench.inject(fault);
            }
            let start = Instant::now();
            let mut bytes = [0; 1024];
            while !stop.load(Ordering::Relaxed) {
                match far.read(&mut bytes) {
                    Ok(count) => assert_eq!(bench.feed(&bytes[..count]), count, "the dongle reads"),
                    Err(error) if error.kind() == ErrorKind::TimedOut => {}
                    Err(error) => panic!("the pseudo-terminal: {error}"),
                }
                while bench.ms() < start.elapsed().as_millis() as u64 {
                    bench.advance();
                }
                let count = bench.drain(&mut bytes);
                far.write_all(&bytes[..count]).expect("room for telemetry");
            }
            Left { driven: bench.driven(), state: bench.state().0 }
        });
        Self { port: near.name().expect("a name"), _near: near, ended, thread }
    }

    fn calibrate(&self, out: &Path, arguments: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_scram"))
            .args(["calibrate", "--port", &self.port, "--robot"])
            .arg(robot_file())
            .arg("--out")
            .arg(out)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("scram runs")
    }

    fn end(self) -> Left {
        self.ended.store(true, Ordering::Relaxed);
        self.thread.join().expect("the bench ran")
    }
}

fn finished(child: Child) -> (ExitStatus, String, String) {
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status, text(output.stdout), text(output.stderr))
}

#[test]
fn the_program_calibrates_a_robot_over_a_serial_line() {
    let tty = OnTty::new(Trouble { loss: 0.01, ..Trouble::default() }, None);
    let out = tempfile::tempdir().expect("a directory");
    let mut child = tty.calibrate(out.path(), &[]);
    // Enter, long before it is asked for.
    child.stdin.take().expect("a pipe").write_all(b"\n").expect("it reads");
    let (status, stdout, stderr) = finished(child);
    let left = tty.end();
    assert!(status.success(), "{stdout}{stderr}");
    assert!(stdout.contains("blind arc") && stdout.contains("cargo flash-robot esp32"), "{stdout}");
    assert!(stderr.contains("scram-26 at 7c:df:a1:00:11:22, -48 dBm, battery"), "{stderr}");
    for line in stderr.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let calibrated = Robot::load(&out.path().join("robot.toml")).expect("a robot file");
    let description::robot::Sensor::Potentiometer(sensor) = calibrated.sensor else { panic!("a potentiometer") };
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
    let ticks = left.driven;
    assert!((2500..2700).contains(&ticks), "{ticks}");
    assert_eq!(left.state, State::Idle);
}

#[test]
fn ctrl_c_stops_the_motor_and_keeps_the_recording() {
    let tty = OnTty::new(Trouble::default(), None);
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
    let left = tty.end();
    assert_eq!(status.code(), Some(1), "{stdout}{stderr}");
    assert!(stderr.contains("stopped on request") && stderr.contains("failed.mcap"), "{stderr}");
    let ticks = left.driven;
    assert!((100..2400).contains(&ticks), "{ticks}");
    assert_eq!(left.state, State::Idle);
    let recording = scram::recording::load(&out.path().join("failed.mcap")).expect("a recording");
    assert!(recording.len() >= ticks - 50);
    assert!(!out.path().join("robot.toml").exists());
}

#[test]
fn a_motor_with_swapped_wires_is_said() {
    let tty = OnTty::new(Trouble::default(), Some(Fault::MotorReversed));
    let out = tempfile::tempdir().expect("a directory");
    let (status, stdout, stderr) = finished(tty.calibrate(out.path(), &["--yes"]));
    let left = tty.end();
    assert_eq!(status.code(), Some(1), "{stdout}{stderr}");
    assert!(stderr.contains("swapped"), "{stderr}");
    assert!(!out.path().join("robot.toml").exists());
    assert!(!left.state.is_driving());
}

#[test]
fn without_a_dongle_nothing_is_written() {
    let tty = OnTty::new(Trouble { dongle_hangs: Some(0), ..Trouble::default() }, None);
    let out = tempfile::tempdir().expect("a directory");
    let (status, stdout, stderr) = finished(tty.calibrate(out.path(), &["--yes"]));
    assert_eq!(status.code(), Some(1), "{stdout}{stderr}");
    assert!(stderr.contains("no dongle answers: not a byte came"), "{stderr}");
    assert_eq!(std::fs::read_dir(out.path()).expect("a directory").count(), 0);
    tty.end();
}

#[test]
fn nobody_at_the_keyboard_starts_nothing() {
    let tty = OnTty::new(Trouble::default(), None);
    let out = tempfile::tempdir().expect("a directory");
    let mut child = tty.calibrate(out.path(), &[]);
    drop(child.stdin.take());
    let (status, _, stderr) = finished(child);
    let left = tty.end();
    assert_eq!(status.code(), Some(1));
    assert!(stderr.contains("nobody pressed Enter"), "{stderr}");
    assert_eq!(left.driven, 0);
}
