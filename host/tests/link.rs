//! Sessions with a robot through a dongle, in virtual time: `tests/bench` plays both.

mod bench;

use std::io::{self, Read, Write};
use std::time::Duration;

use bench::{Bench, DONGLE, ROBOT, Trouble, robot_file};
use control::protocol::dongle::FromDongle;
use control::protocol::frame;
use control::{Command, State};
use description::Robot;
use description::angle_code::{AdcCurve, corrected_angle};
use description::robot::Sensor;
use hal_sim::Fault;
use scram::identify::{PotentiometerFit, potentiometer};
use scram::link::{Line, LinkError, Session, Spin, spin};
use scram::recording::{AngleReading, load, write_mcap};
use scram::sim::{self, Drive, Order, Plan, Step};

const PATIENCE: Duration = Duration::from_secs(3);
const TICKS: u64 = 2500;
const TICK_S: f64 = 1e-3;

fn robot() -> Robot {
    Robot::load(&robot_file()).expect("robot.toml")
}

/// Finds the only robot and spins it.
fn calibrate(bench: &mut Bench) -> Spin {
    let mut session = Session::open(bench, PATIENCE).expect("a dongle");
    assert_eq!((session.address(), session.channel()), (DONGLE, 1));
    let found = session.find(None, PATIENCE).expect("a robot");
    assert_eq!(found, ROBOT);
    spin(&mut session, found, 1.0, TICKS, &mut |_| true)
}

#[test]
fn a_calibration_through_a_lossy_radio_is_what_the_whole_recording_gives() {
    let robot = robot();
    let Sensor::Potentiometer(sensor) = &robot.sensor else { panic!("robot.toml has a potentiometer") };
    let curve = AdcCurve::new(&sensor.adc);
    let mut lost = 0;
    for seed in [1, 2, 3] {
        let mut bench = Bench::new(&robot, seed, Trouble { loss: 0.01, ..Trouble::default() });
        let spin = calibrate(&mut bench);
        spin.end.expect("it spins");
        assert!(spin.stopped);
        lost += spin.recorder.lost().0;
        assert!(spin.recorder.lost_share() < 0.05);
        assert!(spin.recorder.driven() >= TICKS && spin.recorder.driven() < TICKS + 60);

        let through = potentiometer(&robot, &spin.recorder.recording(TICK_S)).expect("a correction");
        let whole = potentiometer(&robot, &bench.whole(bench.first_driven() as usize)).expect("a correction");
        for code in (400..3600).step_by(100) {
            let angle = |fit: &PotentiometerFit| corrected_angle(&fit.correction, &curve, f64::from(code)).to_degrees();
            // Modulo a turn, −180 … 180.
            let apart = (angle(&through) - angle(&whole) + 180.0).rem_euclid(360.0) - 180.0;
            assert!(apart.abs() < 0.1, "seed {seed}, code {code}: {apart}°");
        }
        assert!((through.speed_rad_per_s / whole.speed_rad_per_s - 1.0).abs() < 1e-3);
        assert_eq!(bench.last_command(), Command::Idle);
        assert_eq!(bench.state().0, State::Idle);
    }
    assert!(lost > 20, "1 % of 250 messages of 10 ticks are lost in each of three runs: {lost}");
}

#[test]
fn without_loss_every_tick_arrives() {
    let robot = robot();
    let mut bench = Bench::new(&robot, 4, Trouble::default());
    let spin = calibrate(&mut bench);
    spin.end.expect("it spins");
    assert_eq!(spin.recorder.lost(), (0, 0));
    let recording = spin.recorder.recording(TICK_S);
    let AngleReading::Adc(codes) = &recording.angle else { panic!("raw codes") };
    let codes: Vec<u16> = codes.iter().copied().map(|code| code.expect("every tick has a code")).collect();
    let known: Vec<u16> = bench.ticks().iter().map(|(code, _)| *code).collect();
    let from = known.windows(codes.len()).position(|some| some == codes).expect("the codes as the robot had them");
    let whole = bench.whole(from);
    assert!(whole.enable[..codes.len()] == recording.enable[..] && whole.t_s[..codes.len()] == recording.t_s[..]);

    // `scram sim` on the same seed, driven from the same tick on.
    let at_s = bench.first_driven() as f64 * TICK_S;
    let steps = [(0.0, Order::Idle), (at_s, Order::Duty { duty: 1.0 })];
    let steps = steps.map(|(at_s, order)| Step { at_s, order }).to_vec();
    let plan = Plan { drive: Drive { steps, end_s: None }, seconds: at_s + 2.5, faults: Vec::new() };
    let trace = sim::run(&robot, 4, &hal_sim::Settings::default(), &plan).expect("it runs");
    let simulated: Vec<u16> = trace.ticks.iter().map(|tick| tick.sample.angle.0).collect();
    assert!(simulated[from..] == known[from..simulated.len()], "the same codes");
}

/// Runs into a trouble one second into the spin.
fn interrupted(trouble: impl Fn(u64) -> Trouble) -> (Bench, Spin) {
    let robot = robot();
    let mut quiet = Bench::new(&robot, 5, Trouble::default());
    calibrate(&mut quiet).end.expect("it spins");
    let at = quiet.first_driven() + 1000;
    let mut bench = Bench::new(&robot, 5, trouble(at));
    let spin = calibrate(&mut bench);
    (bench, spin)
}

fn kept_about_a_second(spin: &Spin) {
    let recording = spin.recorder.recording(TICK_S);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    write_mcap(&file, &recording).expect("writes");
    let read = load(&file).expect("reads");
    assert!((read.t_s, read.drive, read.angle) == (recording.t_s, recording.drive, recording.angle));
    assert!((950..1050).contains(&spin.recorder.driven()), "{}", spin.recorder.driven());
}

#[test]
fn a_robot_that_dies_leaves_its_recording_and_is_told_to_stop() {
    let (bench, spin) = interrupted(|at| Trouble { robot_dies: Some(at), ..Trouble::default() });
    assert!(matches!(spin.end, Err(LinkError::RobotSilent { .. })), "{:?}", spin.end);
    assert!(!spin.stopped);
    kept_about_a_second(&spin);
    assert_eq!(bench.last_command(), Command::Idle);
    let driven = bench.commands.iter().filter(|(_, command)| *command != Command::Idle);
    let (last, died) = (driven.map(|(ms, _)| *ms).max(), bench.trouble.robot_dies);
    assert!(last < died.map(|ms| ms + 600), "{last:?} {died:?}");
}

#[test]
fn a_dongle_that_hangs_leaves_the_recording_and_the_robot_stops_by_itself() {
    let (bench, spin) = interrupted(|at| Trouble { dongle_hangs: Some(at), ..Trouble::default() });
    assert!(matches!(spin.end, Err(LinkError::DongleSilent { .. })), "{:?}", spin.end);
    kept_about_a_second(&spin);
    assert_eq!(bench.last_command(), Command::Idle);
    assert_eq!(
        bench.state(),
        (State::Fault, Some(control::Fault::CommandTooOld)),
        "by itself: no command came through"
    );
}

#[test]
fn a_line_that_cannot_be_read_still_tells_the_robot_to_stop() {
    let (bench, spin) = interrupted(|at| Trouble { reading_breaks: Some(at), ..Trouble::default() });
    assert!(matches!(spin.end, Err(LinkError::Line(_))), "{:?}", spin.end);
    kept_about_a_second(&spin);
    assert_eq!(bench.last_command(), Command::Idle);
}

#[test]
fn when_the_dongle_is_pulled_out_the_robot_stops_by_itself() {
    let (mut bench, spin) = interrupted(|at| Trouble { unplugged: Some(at), ..Trouble::default() });
    assert!(matches!(spin.end, Err(LinkError::Line(_))), "{:?}", spin.end);
    assert!(!spin.stopped);
    kept_about_a_second(&spin);
    for _ in 0..600 {
        bench.advance();
    }
    assert_eq!(bench.state().1, Some(control::Fault::CommandTooOld));
    assert!(!bench.actuation().enable);
}

#[test]
fn a_robot_that_restarts_is_noticed_and_not_driven_on() {
    let (bench, spin) = interrupted(|at| Trouble { robot_restarts: Some(at), ..Trouble::default() });
    let Err(LinkError::RobotRestarted { why }) = spin.end else { panic!("{:?}", spin.end) };
    assert_eq!(why, Some("brown-out (its supply broke down)"));
    assert!(spin.stopped);
    kept_about_a_second(&spin);
    assert_eq!(bench.last_command(), Command::Idle);
    assert_eq!(bench.state(), (State::Fault, Some(control::Fault::Restarted)), "by itself: the host drove on");
}

#[test]
fn on_request_the_motor_stops_within_a_tenth_of_a_second() {
    let robot = robot();
    let mut bench = Bench::new(&robot, 6, Trouble::default());
    let mut session = Session::open(&mut bench, PATIENCE).expect("a dongle");
    let found = session.find(None, PATIENCE).expect("a robot");
    let spin = spin(&mut session, found, 1.0, TICKS, &mut |ticks| ticks < 700);
    drop(session);
    assert!(matches!(spin.end, Err(LinkError::Cancelled)), "{:?}", spin.end);
    assert!(spin.stopped);
    let driven = bench.driven();
    assert!((700..800).contains(&driven), "{driven}");
    assert_eq!(bench.last_command(), Command::Idle);
}

#[test]
fn a_session_that_is_dropped_while_a_robot_drives_stops_it() {
    let robot = robot();
    let mut bench = Bench::new(&robot, 6, Trouble::default());
    let mut session = Session::open(&mut bench, PATIENCE).expect("a dongle");
    session.hold(ROBOT, Command::Duty { duty: 0.5 }).expect("writes");
    drop(session);
    assert_eq!(bench.last_command(), Command::Idle);
}

#[test]
fn both_ends_count() {
    let robot = robot();
    let mut bench = Bench::new(&robot, 11, Trouble { loss: 0.1, ..Trouble::default() });
    let mut session = Session::open(&mut bench, PATIENCE).expect("a dongle");
    let found = session.find(None, PATIENCE).expect("a robot");
    let spin = spin(&mut session, found, 1.0, TICKS, &mut |_| true);
    let dongle = session.count(PATIENCE).expect("the line holds").expect("an answer");
    let counts = session.counts();
    // Some may be on their way.
    let told = u64::from(counts.acknowledged + counts.unacknowledged);
    let sent = u64::from(dongle.sent + dongle.send_failed);
    assert!(sent - told <= 1 && counts.unacknowledged > 0, "{counts:?} {dongle:?}");
    assert!((0.03..0.3).contains(&spin.recorder.lost_share()), "{}", spin.recorder.lost_share());
    let status = session.station(&found).and_then(|station| station.status.clone()).expect("told once a second");
    assert_eq!((status.name.as_str(), status.counters.missed_deadlines), (robot.name.as_str(), 0));
    assert!(status.counters.lost > 0, "commands that the robot missed");
    // Ten ticks a message, and the dongle drops none.
    let (missing, rows) = (session.station(&found).map_or(0, |station| station.lost), spin.recorder.lost().0);
    assert!(u64::from(missing) * 10 >= rows && rows > 100, "{missing} messages, {rows} ticks");
}

#[test]
fn a_blocked_shaft_is_said_in_words() {
    let robot = robot();
    let mut bench = Bench::new(&robot, 7, Trouble::default());
    bench.inject(Fault::Stalled);
    let spin = calibrate(&mut bench);
    let error = spin.end.expect_err("it cannot turn");
    let text = error.to_string();
    assert!(text.starts_with("the robot stopped itself: "), "{text}");
    assert!(spin.stopped, "a robot in a fault has its bridge off");
    assert_eq!(bench.last_command(), Command::Idle);
}

/// Another dongle drives the robot and falls silent.
fn drive_from_elsewhere(bench: &mut Bench) {
    bench.tell(Command::ClearFault);
    bench.advance();
    bench.tell(Command::Duty { duty: 0.3 });
}

#[test]
fn a_fault_of_an_earlier_run_is_cleared_and_one_that_persists_is_said() {
    let robot = robot();
    let mut bench = Bench::new(&robot, 8, Trouble::default());
    drive_from_elsewhere(&mut bench);
    for _ in 0..700 {
        bench.advance();
    }
    assert_eq!(bench.state().0, State::Fault);
    calibrate(&mut bench).end.expect("it was only the command's age");

    let mut bench = Bench::new(&robot, 8, Trouble::default());
    drive_from_elsewhere(&mut bench);
    bench.inject(Fault::BatteryLow { open_circuit_v: 2.9 });
    for _ in 0..700 {
        bench.advance();
    }
    assert_eq!(bench.state().1, Some(control::Fault::SupplyLow));
    let error = calibrate(&mut bench).end.expect_err("the battery is still empty").to_string();
    assert!(error.ends_with("the battery is below its limit"), "{error}");
    assert!(bench.ticks().iter().skip(700).all(|(_, actuation)| !actuation.enable), "it must not be driven");
}

/// A line on which somebody says the same again and again.
struct Canned(Vec<u8>, Duration);

impl Read for Canned {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.1 += Duration::from_millis(10);
        buffer[..self.0.len()].copy_from_slice(&self.0);
        if self.0.is_empty() { Err(io::ErrorKind::TimedOut.into()) } else { Ok(self.0.len()) }
    }
}

impl Write for Canned {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        Ok(buffer.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for Canned {
    fn now(&self) -> Duration {
        self.1
    }
}

#[test]
fn what_is_no_dongle_of_this_version_is_refused() {
    let opening = |bytes: &[u8]| match Session::open(Canned(bytes.to_vec(), Duration::ZERO), PATIENCE) {
        Ok(_) => panic!("this is no dongle"),
        Err(error) => error,
    };
    let mut buffer = [0; frame::LONGEST + 1];
    let hello = FromDongle::Hello { version: 2, address: DONGLE, channel: 1 };
    let error = opening(frame::encode(&hello, &mut buffer).expect("short"));
    assert!(matches!(error, LinkError::Version { dongle: 2 }), "{error:?}");
    assert_eq!(opening(b"").to_string(), "no dongle answers: not a byte came");
    let error = opening(b"I (312) boot: ESP-IDF\r\n").to_string();
    assert!(error.ends_with("bytes came, but no whole message"), "{error}");
    let error = opening(b"I (312) boot: ESP-IDF\r\n\0").to_string();
    assert!(error.ends_with("which are no dongle's messages of this version"), "{error}");
}

#[test]
fn the_robot_is_found_by_name_only_where_there_are_two() {
    let robot = robot();
    let trouble = Trouble { second: true, ..Trouble::default() };
    let find = |wanted| {
        let mut bench = Bench::new(&robot, 10, trouble);
        let mut session = Session::open(&mut bench, PATIENCE).expect("a dongle");
        session.find(wanted, PATIENCE)
    };
    let error = find(None).expect_err("which one?").to_string();
    assert!(error.contains("7c:df:a1:00:11:22") && error.contains("7c:df:a1:00:11:33"), "{error}");
    assert_eq!(find(Some(ROBOT)).expect("found"), ROBOT);
    let error = find(Some([1; 6])).expect_err("not there").to_string();
    assert!(error.starts_with("robot 01:01:01:01:01:01 is not heard on channel 1; heard: 7c:df:a1"), "{error}");
    let mut bench = Bench::new(&robot, 10, Trouble { robot_dies: Some(1), ..Trouble::default() });
    let mut session = Session::open(&mut bench, PATIENCE).expect("a dongle");
    let error = session.find(None, PATIENCE).expect_err("nobody").to_string();
    assert_eq!(error, "a robot is not heard on channel 1; nothing else is heard either");
}
