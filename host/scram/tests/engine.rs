//! The console without a screen on a robot of the workbench, in virtual time.

mod common;

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::time::Duration;

use common::bench::{bench, session};
use control::State;
use learn::{Direction, PolicyFile, Settings};
use recording::{ReadOptions, load_with};
use scram::console::{Engine, PoseDatagram, Poses};
use testbed::host_end::HostEnd;

/// What the screen shows as a robot's target is what the robot does.
#[test]
fn a_refused_order_leaves_the_target_at_what_the_robot_does() {
    let line = bench(1, 9, |_| {});
    let mut engine = Engine::new(session(&line, 1, 9), "the bench");
    let mut typed = |text: &str| {
        engine.submit(text).expect("it can be typed");
        let end = engine.model().now + Duration::from_millis(300);
        while engine.model().now < end {
            engine.poll().expect("the line holds");
        }
        let robot = &engine.model().robots[0];
        (robot.target.clone(), robot.state)
    };
    typed("status");
    typed("status");
    typed("status");
    let driving = (Some("freq 7".to_owned()), Some(State::Speed));
    assert_eq!(typed("clear; freq 7"), driving);
    assert_eq!(typed("freq 50"), driving, "refused");
    assert_eq!(typed("save"), driving, "refused while it drives");
    assert_eq!(typed("clear"), driving, "there is nothing to clear");
    assert_eq!(typed("position 30").0.as_deref(), Some("position 30"));
    assert_eq!(typed("coast").0, None);
    assert_eq!(typed("freq 50").0, None);
    assert_eq!(typed("freq 7"), driving);
    assert_eq!(typed("stop").0, None);
}

/// A policy of one layer that turns to the left where the robot looks to the right of where it began to, and the other way round.
fn policy(directory: &Path) -> PathBuf {
    let settings: Settings =
        toml::from_str("[turn]\nfrequencies_hz = [-7, 7]\ninterval_s = 0.1\nepisode_s = 100").expect("a learning file");
    let network = serde_json::json!({ "layers": [{ "weights": [[0, 0, 1], [0, 0, -1]], "bias": [0, 0] }] });
    let policy = serde_json::from_value(network).expect("a network");
    let file =
        PolicyFile { robot: "robot-0".into(), direction: Direction::Left, seed: 1, updates: 0, settings, policy };
    let path = directory.join("policy.json");
    std::fs::write(&path, serde_json::to_string(&file).expect("text")).expect("written");
    path
}

/// A console that hears poses, and who sends them.
struct WithPoses {
    engine: Engine<HostEnd>,
    sender: UdpSocket,
    to: SocketAddr,
    sent: usize,
}

impl WithPoses {
    fn new(directory: &Path) -> Self {
        let poses = Poses::listen((Ipv4Addr::LOCALHOST, 0).into()).expect("a free port");
        let to = poses.address().expect("it listens");
        let mut engine = Engine::new(session(&bench(1, 9, |_| {}), 1, 9), "the bench");
        engine.take_poses(poses);
        engine.record(directory, 1e-3).expect("a recording");
        Self { engine, sender: UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port"), to, sent: 0 }
    }

    /// Half a second, with a pose every 20 ms of a robot that looks this way, or none.
    fn half_a_second(&mut self, yaw_rad: Option<f64>) -> (Option<String>, Option<State>) {
        let (end, mut due) = (self.engine.model().now + Duration::from_millis(500), Duration::ZERO);
        while self.engine.model().now < end {
            if let Some(yaw_rad) = yaw_rad.filter(|_| self.engine.model().now >= due) {
                due = self.engine.model().now + Duration::from_millis(20);
                let pose = PoseDatagram { robot: None, t_s: None, x_m: 0.5, y_m: 0.25, yaw_rad };
                let bytes = serde_json::to_vec(&pose).expect("text");
                self.sender.send_to(&bytes, self.to).expect("sent");
                self.sent += 1;
            }
            self.engine.poll().expect("the line holds");
        }
        let robot = &self.engine.model().robots[0];
        (robot.target.clone(), robot.state)
    }

    fn said(&self, text: &str) -> bool {
        self.engine.model().log.iter().any(|line| line.text.contains(text))
    }
}

#[test]
fn a_policy_drives_by_poses_and_stops_the_robot_where_they_stay_away() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = policy(directory.path()).display().to_string();
    let mut console = WithPoses::new(directory.path());
    for _ in 0..3 {
        console.half_a_second(None);
    }
    // Before any pose it does not drive at all.
    console.engine.submit(&format!("clear; policy {file}")).expect("it can be typed");
    assert_eq!(console.half_a_second(None).1, Some(State::Idle));
    assert!(console.said("no pose of the robot has come"));

    let target = |hz: f64| (Some(format!("freq {hz} ({file})")), Some(State::Speed));
    console.half_a_second(Some(1.0));
    console.engine.submit(&format!("policy {file}")).expect("it can be typed");
    console.half_a_second(Some(1.0));
    assert_eq!(console.half_a_second(Some(1.1)), target(-7.0), "it looks to the left of where it began");
    assert_eq!(console.half_a_second(Some(0.9)), target(7.0));
    // What does not drive leaves it alone, refused or not.
    console.engine.submit("note here; save").expect("it can be typed");
    assert_eq!(console.half_a_second(Some(1.1)), target(-7.0));
    // Another order takes its place.
    console.engine.submit("freq 6").expect("it can be typed");
    console.half_a_second(Some(0.9));
    assert_eq!(console.half_a_second(Some(1.1)), (Some("freq 6".to_owned()), Some(State::Speed)));

    console.engine.submit(&format!("policy {file}")).expect("it can be typed");
    console.half_a_second(Some(1.0));
    assert_eq!(console.half_a_second(Some(0.9)), target(7.0));
    assert_eq!(console.half_a_second(None), (None, Some(State::Idle)), "nobody sees where it is");
    console.half_a_second(Some(0.5));
    assert_eq!(console.half_a_second(Some(1.5)), (None, Some(State::Idle)), "it stays with that");

    console.engine.submit(&format!("policy {file}")).expect("it can be typed");
    console.half_a_second(Some(1.0));
    console.engine.stop_all();
    assert_eq!(console.half_a_second(Some(0.9)), (None, Some(State::Idle)), "stop is the end of it");
    console.engine.submit(&format!("policy {file}")).expect("it can be typed");
    console.half_a_second(Some(1.0));
    console.engine.finish();
    let sent = console.sent;
    assert_eq!(console.half_a_second(Some(0.9)).1, Some(State::Idle), "and so is the end of the console");

    let path = console.engine.model().recording.as_ref().expect("a recording").path.clone();
    let recording = load_with(&path, &ReadOptions::default()).expect("a recording").recording;
    let poses: Vec<[f64; 3]> = recording.pose.iter().copied().flatten().collect();
    // The last ones wait for a tick that did not come any more.
    assert!((sent - 5..=sent).contains(&poses.len()), "{} of {sent} poses", poses.len());
    assert!(poses.iter().all(|[x, y, yaw]| *x == 0.5 && *y == 0.25 && (0.5..=1.5).contains(yaw)));
}

#[test]
fn a_policy_that_cannot_be_played_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let line = bench(1, 9, |_| {});
    let mut engine = Engine::new(session(&line, 1, 9), "the bench");
    let problem = |engine: &mut Engine<HostEnd>, text: &str| {
        engine.submit(text).expect("it can be typed");
        engine.next_reply().expect("it is told").outcome.expect_err("it is refused")
    };
    let file = policy(directory.path()).display().to_string();
    assert!(problem(&mut engine, &format!("policy {file}")).contains("begin it with --poses"));
    engine.take_poses(Poses::listen((Ipv4Addr::LOCALHOST, 0).into()).expect("a free port"));
    assert!(problem(&mut engine, "policy Cargo.toml").contains("Cargo.toml: expected value"));
    assert!(problem(&mut engine, "policy nowhere.json").contains("nowhere.json: No such file"));
}
