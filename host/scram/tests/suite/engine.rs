//! The console without a screen on a robot of the workbench, in virtual time.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use crate::common::bench::{bench, session};
use crate::common::policy::steering_policy;
use control::State;
use recording::{ReadOptions, load_with};
use robot_file::gait::GaitFile;
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

/// A console that hears poses, and who sends them.
struct WithPoses {
    engine: Engine<HostEnd>,
    sender: UdpSocket,
    to: SocketAddr,
    sent: usize,
    directory: tempfile::TempDir,
    policy: String,
}

impl WithPoses {
    /// With one robot, and a policy that chooses between −7 and 7 Hz ten times a second.
    fn one() -> Self {
        Self::new(1, 0.1, [-7.0, 7.0])
    }

    /// With so many robots, and a policy that chooses one of two frequencies in this interval.
    fn new(robots: usize, interval_s: f64, left_right_hz: [f64; 2]) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let policy = steering_policy(directory.path(), interval_s, left_right_hz).display().to_string();
        let poses = Poses::listen((Ipv4Addr::LOCALHOST, 0).into()).expect("a free port");
        let to = poses.address().expect("it listens");
        let mut engine = Engine::new(session(&bench(robots, 9, |_| {}), robots, 9), "the bench");
        engine.hear_poses(poses);
        engine.record(directory.path(), 1e-3).expect("a recording");
        let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        let mut console = Self { engine, sender, to, sent: 0, directory, policy };
        for _ in 0..3 {
            console.half_a_second(None);
        }
        console
    }

    fn type_in(&mut self, line: &str) {
        let line = line.replace("POLICY", &self.policy);
        self.engine.submit(&line).expect("it can be typed");
    }

    fn send(&mut self, robot: usize, yaw_rad: f64) {
        let t_s = self.engine.model().now.as_secs_f64();
        let pose = PoseDatagram { robot: Some(format!("robot-{robot}")), t_s, x_m: 0.5, y_m: 0.25, yaw_rad };
        let bytes = serde_json::to_vec(&pose).expect("text");
        self.sender.send_to(&bytes, self.to).expect("sent");
        self.sent += 1;
    }

    /// So long, with a pose every 20 ms of every robot for which `yaw` has one; it is told how many were sent before.
    fn go_on(&mut self, time: Duration, yaw: &dyn Fn(usize, usize) -> Option<f64>) {
        let (end, mut due, mut count) = (self.engine.model().now + time, Duration::ZERO, 0);
        while self.engine.model().now < end {
            if self.engine.model().now >= due {
                due = self.engine.model().now + Duration::from_millis(20);
                for robot in 0..self.engine.model().robots.len() {
                    if let Some(yaw_rad) = yaw(robot, count) {
                        self.send(robot, yaw_rad);
                    }
                }
                count += 1;
            }
            self.engine.poll().expect("the line holds");
        }
    }

    /// Half a second of a robot that looks this way, or is not seen; what it does then.
    fn half_a_second(&mut self, yaw_rad: Option<f64>) -> (Option<String>, Option<State>) {
        self.go_on(Duration::from_millis(500), &|_, _| yaw_rad);
        self.does(0)
    }

    fn does(&self, robot: usize) -> (Option<String>, Option<State>) {
        let robot = &self.engine.model().robots[robot];
        (robot.target.clone(), robot.state)
    }

    /// The policy drives, and holds this frequency.
    fn by_policy(&self, hz: f64) -> (Option<String>, Option<State>) {
        (Some(format!("freq {hz} ({})", self.policy)), Some(State::Speed))
    }

    fn said(&self, text: &str) -> bool {
        self.engine.model().log.iter().any(|line| line.text.contains(text))
    }

    fn recorded(&self) -> Vec<[f64; 3]> {
        let path = self.engine.model().recording.as_ref().expect("a recording").path.clone();
        let recording = load_with(&path, &ReadOptions::default()).expect("a recording").recording;
        recording.pose.iter().copied().flatten().collect()
    }
}

const STANDS: (Option<String>, Option<State>) = (None, Some(State::Idle));

#[test]
fn a_policy_drives_by_poses_and_stops_the_robot_where_they_stay_away() {
    let mut console = WithPoses::one();
    // Before any pose it does not drive at all.
    console.type_in("clear; policy POLICY");
    assert_eq!(console.half_a_second(None).1, Some(State::Idle));
    assert!(console.said("no pose of the robot has come for 0.3 s"));

    console.half_a_second(Some(1.0));
    console.type_in("policy POLICY");
    console.half_a_second(Some(1.0));
    assert_eq!(console.half_a_second(Some(1.1)), console.by_policy(-7.0), "it looks to the left of where it began");
    assert_eq!(console.half_a_second(Some(0.9)), console.by_policy(7.0));
    // What does not drive leaves it alone, refused or not.
    console.type_in("note here; save");
    assert_eq!(console.half_a_second(Some(1.1)), console.by_policy(-7.0));

    assert_eq!(console.half_a_second(None), STANDS, "nobody sees where it is");
    console.half_a_second(Some(0.5));
    assert_eq!(console.half_a_second(Some(1.5)), STANDS, "it stays with that");
    console.type_in("policy POLICY");
    console.half_a_second(Some(1.0));
    console.engine.stop_all();
    assert_eq!(console.half_a_second(Some(0.9)), STANDS, "stop is the end of it");
    console.type_in("policy POLICY");
    console.half_a_second(Some(1.0));
    console.engine.finish();
    let sent = console.sent;
    assert_eq!(console.half_a_second(Some(0.9)).1, Some(State::Idle), "and so is the end of the console");

    let poses = console.recorded();
    // The last ones wait for a tick that did not come any more.
    assert!((sent - 5..=sent).contains(&poses.len()), "{} of {sent} poses", poses.len());
    assert!(poses.iter().all(|[x, y, yaw]| *x == 0.5 && *y == 0.25 && (0.5..=1.5).contains(yaw)));
}

#[test]
fn what_takes_the_place_of_a_policy_is_done_or_the_robot_stops() {
    let mut console = WithPoses::one();
    console.half_a_second(Some(1.0));
    console.type_in("clear; policy POLICY");
    console.half_a_second(Some(1.0));
    // What cannot even be sent changes nothing.
    for line in ["policy nowhere.json", "gait nowhere"] {
        console.type_in(line);
        assert_eq!(console.half_a_second(Some(1.1)), console.by_policy(-7.0), "{line}");
        assert_eq!(console.half_a_second(Some(0.9)), console.by_policy(7.0), "{line}");
    }
    console.type_in("freq 6");
    console.half_a_second(Some(0.9));
    assert_eq!(console.half_a_second(Some(1.1)), (Some("freq 6".to_owned()), Some(State::Speed)));
    console.type_in("freq 50");
    assert_eq!(console.half_a_second(None).1, Some(State::Speed), "a person's order may be refused: it goes on");
    // Another gait than the robot has is refused while it drives; of a policy nothing is left then.
    let gait = console.directory.path().join("turn.toml");
    GaitFile::new("turn", 0.4, true, &[7.0, -7.0]).and_then(|gait_file| gait_file.save(&gait)).expect("written");
    for line in ["freq 50".to_owned(), format!("gait {}", gait.display())] {
        console.half_a_second(Some(1.0));
        console.type_in("policy POLICY");
        console.half_a_second(Some(1.0));
        assert_eq!(console.half_a_second(Some(1.1)), console.by_policy(-7.0), "{line}");
        console.type_in(&line);
        console.half_a_second(Some(1.1));
        assert_eq!(console.half_a_second(Some(0.9)), STANDS, "{line}");
    }
}

#[test]
fn policies_of_several_robots_keep_no_command_waiting() {
    let mut console = WithPoses::new(2, 0.02, [6.9, 7.0]);
    // Each pose changes what is to be done.
    let shaking = |_: usize, count: usize| Some(if count.is_multiple_of(2) { 0.9 } else { 1.1 });
    console.go_on(Duration::from_millis(500), &|_, _| Some(1.0));
    console.type_in("clear; policy POLICY; robot 2; clear; policy POLICY; robot 1");
    console.go_on(Duration::from_secs(1), &|_, _| Some(1.0));
    console.go_on(Duration::from_secs(1), &shaking);
    assert_eq!([0, 1].map(|robot| console.does(robot).1), [Some(State::Speed); 2]);
    console.type_in("idle");
    console.go_on(Duration::from_millis(300), &shaking);
    assert_eq!([0, 1].map(|robot| console.does(robot).1), [Some(State::Idle), Some(State::Speed)]);
    // A script of one robot is not ended by a policy of another one that sees nothing any more.
    let script = console.directory.path().join("script.txt");
    std::fs::write(&script, "freq 6\nwait 1.5s\nfreq 7\nwait 0.5s").expect("written");
    console.type_in(&format!("script {}", script.display()));
    console.go_on(Duration::from_secs(1), &|_, _| None);
    assert_eq!([0, 1].map(|robot| console.does(robot).1), [Some(State::Speed), Some(State::Idle)]);
    console.go_on(Duration::from_millis(700), &|_, _| None);
    assert_eq!(console.does(0).0.as_deref(), Some("freq 7"));
    // `stop` means what acts by itself, whichever robot is looked at.
    console.go_on(Duration::from_secs(1), &|_, _| Some(1.0));
    console.type_in("policy POLICY");
    console.go_on(Duration::from_secs(1), &|_, _| Some(1.0));
    console.type_in("robot 2");
    console.type_in("stop");
    console.go_on(Duration::from_millis(500), &|_, _| Some(1.0));
    assert_eq!([0, 1].map(|robot| console.does(robot)), [STANDS; 2]);
}

#[test]
fn every_pose_is_recorded_and_its_heading_is_not_wrapped() {
    let mut console = WithPoses::one();
    let at = |count: usize| 3.0 + 0.1 * count as f64;
    // Twice two at once.
    console.go_on(Duration::from_millis(100), &|_, count| Some(at(count)));
    let before = console.sent;
    for twin in 0..4 {
        console.send(0, at(before + twin));
        if twin == 1 {
            console.go_on(Duration::from_millis(40), &|_, _| None);
        } else {
            std::thread::yield_now();
        }
    }
    console.go_on(Duration::from_millis(200), &|_, _| None);
    console.engine.finish();
    let yaws: Vec<f64> = console.recorded().iter().map(|pose| pose[2]).collect();
    // Two of one time are one pose that is repeated.
    assert!(yaws.len() == before + 2, "{} of {}", yaws.len(), console.sent);
    assert!(yaws.windows(2).all(|pair| (0.05..0.25).contains(&(pair[1] - pair[0]))), "{yaws:?}");
    assert!(yaws[yaws.len() - 1] > std::f64::consts::PI + 0.1, "{yaws:?}");
}

#[test]
fn a_policy_that_cannot_be_played_is_refused() {
    let mut console = WithPoses::one();
    let problem = |engine: &mut Engine<HostEnd>, text: &str| {
        engine.submit(text).expect("it can be typed");
        engine.next_reply().expect("it is told").outcome.expect_err("it is refused")
    };
    assert!(problem(&mut console.engine, "policy Cargo.toml").contains("Cargo.toml: expected value"));
    assert!(problem(&mut console.engine, "policy nowhere.json").contains("nowhere.json: No such file"));
    // One bench a thread.
    drop(console);
    let line = bench(1, 9, |_| {});
    let mut deaf = Engine::new(session(&line, 1, 9), "the bench");
    assert!(problem(&mut deaf, "policy any.json").contains("begin it with --poses"));
}
