//! Sessions with robots through a dongle, in virtual time: `testbed` plays both.

mod common;

use std::io::{self, Read, Write};
use std::time::Duration;

use common::bench::{PATIENCE, bench, keys, nonces, session};
use common::robot;
use control::parameters::table;
use control::protocol::dongle::{FromDongle, ToDongle};
use control::protocol::frame::{self, Deframer};
use control::protocol::radio::{Request, Reset};
use control::protocol::secure::{Caller, Key, Nonce};
use control::{Command, Fault, Refusal, State};
use hal_sim::radio::Trouble;
use identify::potentiometer::{PotentiometerFit, potentiometer};
use link::{Event, Line, LinkError, Outcome, RobotId, Session, Spin, spin};
use recording::{AngleReading, Drive, Recording, load, write_mcap};
use robot_file::angle_code::{AdcCurve, corrected_angle};
use robot_file::robot::Sensor;
use testbed::event_log::{Event as Journaled, actuations, driven};
use testbed::host_end::HostEnd;
use testbed::injected_event::InjectedEvent;
use testbed::serial::Cable;
use testbed::setup::{DONGLE, address, pairing};
use testbed::time::{now_us, until};

const TICKS: u64 = 2500;
const TICK_S: f64 = 1e-3;
const FIRST: RobotId = RobotId(0);
const FREQUENCY: Command = Command::Speed { omega: -44.0 };

/// Finds the only robot and spins it.
fn calibrate(line: &HostEnd, seed: u64) -> Spin {
    let mut session = session(line, 1, seed);
    assert_eq!((session.address(), session.channel()), (DONGLE, 1));
    let found = session.find(None, PATIENCE).expect("a robot");
    assert_eq!(found, FIRST);
    spin(&mut session, found, 1.0, TICKS, &mut |_| true)
}

/// A robot that is ready to drive.
fn ready(line: &HostEnd, robots: usize, seed: u64) -> Session<HostEnd> {
    let mut session = session(line, robots, seed);
    for index in 0..robots {
        let found = session.find(Some(address(index)), PATIENCE).expect("a robot");
        assert_eq!(ask(&mut session, found, Command::ClearFault), Outcome::Done(None));
    }
    session
}

fn ask(session: &mut Session<HostEnd>, id: RobotId, command: Command) -> Outcome {
    session.ask(id, Request::Command(command), |_| {}).expect("the line holds")
}

/// Lets time pass for both ends; what happened.
fn go_on(session: &mut Session<HostEnd>, time: Duration) -> Vec<Event> {
    let end = session.now() + time;
    let mut happened = Vec::new();
    while session.now() < end {
        happened.extend(session.poll().expect("the line holds").map(|heard| heard.event));
    }
    happened
}

fn state(line: &HostEnd) -> (State, Option<Fault>) {
    line.bench().robots[0].state().expect("it runs")
}

/// Codes as the robot had them, one a tick.
fn codes(line: &HostEnd) -> Vec<u16> {
    let bench = line.bench();
    let events = bench.robots[0].event_log.events();
    // Three conversions a tick, of one median.
    let converted = events.iter().filter_map(|(_, event)| match event {
        Journaled::Converted(code) => Some(code.0),
        _ => None,
    });
    converted.collect::<Vec<_>>().chunks(3).map(|three| three[0]).collect()
}

/// The whole recording, without the radio's losses, of the driven ticks.
fn whole(line: &HostEnd) -> Recording {
    let codes = codes(line);
    let bench = line.bench();
    let events = bench.robots[0].event_log.events();
    let told: Vec<_> = actuations(&events).skip(1).collect();
    let from = told.iter().position(|(_, told)| told.enable).expect("it was driven");
    let to = told.iter().rposition(|(_, told)| told.enable).expect("it was driven");
    Recording {
        t_s: (from..=to).map(|tick| (tick - from) as f64 * TICK_S).collect(),
        enable: vec![true; to + 1 - from],
        drive: Drive::Duty(told[from..=to].iter().map(|(_, told)| f64::from(told.duty)).collect()),
        angle: AngleReading::Adc(codes[from..=to].iter().copied().map(Some).collect()),
        ..Recording::default()
    }
}

#[test]
fn a_calibration_through_a_lossy_radio_is_what_the_whole_recording_gives() {
    let robot = robot();
    let Sensor::Potentiometer(sensor) = &robot.sensor else { panic!("robot.toml has a potentiometer") };
    let curve = AdcCurve::new(&sensor.adc);
    let mut lost = 0;
    for seed in [1, 2, 3] {
        let line = bench(1, seed, |_| {});
        // In long bursts: single losses are made good by the radio.
        let lossy = Trouble { loss_share: Some(0.04), burst_us: Some(30_000), ..Trouble::NONE };
        line.bench().apply(InjectedEvent::Air(lossy));
        let spin = calibrate(&line, seed);
        spin.end.expect("it spins");
        assert!(spin.stopped);
        lost += spin.recorder.lost().0;
        assert!(spin.recorder.lost_share() < 0.1);
        assert!(spin.recorder.driven() >= TICKS && spin.recorder.driven() < TICKS + 100);

        let through = potentiometer(&robot, &spin.recorder.recording(TICK_S)).expect("a correction");
        let whole = potentiometer(&robot, &whole(&line)).expect("a correction");
        for code in (400..3600).step_by(100) {
            let angle = |fit: &PotentiometerFit| corrected_angle(&fit.correction, &curve, f64::from(code)).to_degrees();
            // Modulo a turn, −180 … 180.
            let apart = (angle(&through) - angle(&whole) + 180.0).rem_euclid(360.0) - 180.0;
            assert!(apart.abs() < 0.1, "seed {seed}, code {code}: {apart}°");
        }
        assert_eq!(state(&line).0, State::Idle);
    }
    assert!(lost > 20, "ticks are lost in three runs: {lost}");
}

#[test]
fn without_loss_every_tick_arrives() {
    let line = bench(1, 4, |_| {});
    line.bench().apply(InjectedEvent::Air(Trouble { loss_share: Some(0.0), ..Trouble::NONE }));
    let spin = calibrate(&line, 4);
    spin.end.expect("it spins");
    assert_eq!(spin.recorder.lost(), (0, 0));
    let recording = spin.recorder.recording(TICK_S);
    let AngleReading::Adc(received) = &recording.angle else { panic!("raw codes") };
    let received: Vec<u16> = received.iter().copied().map(|code| code.expect("every tick has a code")).collect();
    let known = codes(&line);
    assert!(known.windows(received.len()).any(|some| some == received), "the codes as the robot had them");
}

/// Runs into a trouble one second into the spin.
fn interrupted(injected_event: InjectedEvent) -> (HostEnd, Spin) {
    let quiet = bench(1, 5, |_| {});
    calibrate(&quiet, 5).end.expect("it spins");
    let (from_us, _) = driven(&quiet.bench().robots[0].event_log.events())[0];
    // A thread has one bench at a time.
    drop(quiet);
    let line = bench(1, 5, |_| {});
    line.bench().at(from_us + 1_000_000, injected_event);
    let spin = calibrate(&line, 5);
    (line, spin)
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

/// When the bridge was switched off for good, after the trouble, ms.
fn off_after_ms(line: &HostEnd) -> u64 {
    let bench = line.bench();
    let spans = driven(&bench.robots[0].event_log.events());
    let (from, to) = *spans.last().expect("it was driven");
    assert_eq!(spans.len(), 1, "it did not drive on");
    (to.expect("off") - from - 1_000_000) / 1000
}

#[test]
fn a_robot_that_dies_leaves_its_recording() {
    let (_, spin) = interrupted(InjectedEvent::PowerCut(0));
    assert!(matches!(spin.end, Err(LinkError::RobotSilent { .. })), "{:?}", spin.end);
    assert!(!spin.stopped);
    kept_about_a_second(&spin);
}

#[test]
fn a_dongle_that_hangs_leaves_the_recording_and_the_robot_stops_by_itself() {
    let (line, spin) = interrupted(InjectedEvent::DongleHangs);
    assert!(matches!(spin.end, Err(LinkError::DongleSilent { .. } | LinkError::RobotSilent { .. })), "{:?}", spin.end);
    kept_about_a_second(&spin);
    line.wait(Duration::from_millis(600));
    assert_eq!(state(&line), (State::Fault, Some(Fault::CommandTooOld)));
    assert!(off_after_ms(&line) <= 501, "{}", off_after_ms(&line));
}

#[test]
fn a_line_that_cannot_be_read_still_tells_the_robot_to_stop() {
    let (line, spin) = interrupted(InjectedEvent::ReadsFail);
    assert!(matches!(spin.end, Err(LinkError::Line(_))), "{:?}", spin.end);
    kept_about_a_second(&spin);
    line.wait(Duration::from_millis(100));
    assert_eq!(state(&line), (State::Idle, None));
    assert!(off_after_ms(&line) < 60, "{}", off_after_ms(&line));
}

#[test]
fn when_the_dongle_is_pulled_out_the_robot_stops_by_itself() {
    let (line, spin) = interrupted(InjectedEvent::Cable(Cable::Broken));
    assert!(matches!(spin.end, Err(LinkError::Line(_))), "{:?}", spin.end);
    assert!(!spin.stopped);
    kept_about_a_second(&spin);
    line.wait(Duration::from_millis(600));
    assert_eq!(state(&line).1, Some(Fault::CommandTooOld));
    assert!(off_after_ms(&line) <= 501, "{}", off_after_ms(&line));
}

#[test]
fn a_robot_that_restarts_is_noticed_and_not_driven_on() {
    let (line, spin) = interrupted(InjectedEvent::Boot(0, Reset::BrownOut));
    // Its session is over: it is silent until it is called again.
    assert!(
        matches!(spin.end, Err(LinkError::RobotSilent { .. } | LinkError::RobotRestarted { .. })),
        "{:?}",
        spin.end
    );
    assert!(spin.stopped, "it is found again, and says that its bridge is off");
    kept_about_a_second(&spin);
    assert_eq!(state(&line), (State::Fault, Some(Fault::Restarted)));
    assert_eq!(off_after_ms(&line), 0);
}

#[test]
fn on_request_the_motor_stops_within_a_tenth_of_a_second() {
    let line = bench(1, 6, |_| {});
    let mut session = session(&line, 1, 6);
    let found = session.find(None, PATIENCE).expect("a robot");
    let spin = spin(&mut session, found, 1.0, TICKS, &mut |ticks| ticks < 700);
    drop(session);
    assert!(matches!(spin.end, Err(LinkError::Cancelled)), "{:?}", spin.end);
    assert!(spin.stopped);
    let (from, to) = driven(&line.bench().robots[0].event_log.events())[0];
    let driven_ms = (to.expect("off") - from) / 1000;
    assert!((700..800).contains(&driven_ms), "{driven_ms}");
}

#[test]
fn a_session_that_is_dropped_while_a_robot_drives_stops_it() {
    let line = bench(1, 6, |_| {});
    let mut session = ready(&line, 1, 6);
    assert_eq!(ask(&mut session, FIRST, FREQUENCY), Outcome::Done(None));
    go_on(&mut session, Duration::from_millis(300));
    assert_eq!(state(&line).0, State::Speed);
    drop(session);
    line.wait(Duration::from_millis(50));
    assert_eq!(state(&line).0, State::Idle);
}

#[test]
fn a_console_that_stops_polling_is_noticed_and_nothing_starts_again_by_itself() {
    let line = bench(1, 7, |_| {});
    let mut session = ready(&line, 1, 7);
    assert_eq!(ask(&mut session, FIRST, FREQUENCY), Outcome::Done(None));
    go_on(&mut session, Duration::from_secs(1));
    let asleep = line.now();
    line.wait(Duration::from_secs(5));
    assert_eq!(state(&line), (State::Fault, Some(Fault::CommandTooOld)));
    let slowed = line.bench().robots[0].truth().speed.abs();
    assert!(slowed < 1.0, "{slowed} rad/s");
    go_on(&mut session, Duration::from_secs(3));
    assert_eq!(state(&line), (State::Fault, Some(Fault::CommandTooOld)), "a person clears it");
    assert_eq!(ask(&mut session, FIRST, FREQUENCY), Outcome::Refused(Refusal::Faulted(Fault::CommandTooOld)));
    assert_eq!(ask(&mut session, FIRST, Command::ClearFault), Outcome::Done(None));
    go_on(&mut session, Duration::from_millis(300));
    assert_eq!(state(&line).0, State::Idle, "cleared, and still not driving");
    let off = driven(&line.bench().robots[0].event_log.events())[0].1.expect("off");
    let off_after = Duration::from_micros(off).saturating_sub(asleep);
    assert!(off_after <= Duration::from_millis(501), "{off_after:?}");
}

#[test]
fn parameters_are_told_changed_kept_and_refused() {
    let line = bench(1, 8, |_| {});
    let mut session = ready(&line, 1, 8);
    let index = table::find("controller.limits.frequency_hz").expect("in the table");
    let get = |session: &mut Session<HostEnd>| match session.ask(FIRST, Request::Get(index), |_| {}).expect("the line")
    {
        Outcome::Done(Some(value)) => (value.now, value.factory),
        other => panic!("{other:?}"),
    };
    assert_eq!(get(&mut session), (12.0, 12.0));
    let too_fast = Command::Speed { omega: -70.0 };
    let set = |session: &mut Session<HostEnd>, value| {
        session.ask(FIRST, Request::Set { index, value }, |_| {}).expect("the line holds")
    };
    assert!(matches!(set(&mut session, 8.0), Outcome::Done(Some(_))));
    assert!(matches!(ask(&mut session, FIRST, too_fast), Outcome::Refused(Refusal::OutOfRange { .. })));
    assert_eq!(set(&mut session, f32::NAN), Outcome::Refused(Refusal::Parameter));
    let none = session.ask(FIRST, Request::Get(u16::MAX), |_| {}).expect("the line holds");
    assert_eq!(none, Outcome::Refused(Refusal::NoParameter));
    // Kept over a boot, and forgotten with the factory's.
    let order = |session: &mut Session<HostEnd>, request| session.ask(FIRST, request, |_| {}).expect("the line holds");
    assert_eq!(order(&mut session, Request::Save), Outcome::Done(None));
    line.bench().boot(0, Reset::PowerOn);
    go_on(&mut session, Duration::from_secs(3));
    assert_eq!(get(&mut session), (8.0, 12.0));
    assert_eq!(order(&mut session, Request::Factory), Outcome::Done(None));
    assert_eq!(get(&mut session), (12.0, 12.0));
    ask(&mut session, FIRST, Command::ClearFault);
    assert_eq!(ask(&mut session, FIRST, too_fast), Outcome::Done(None));
    go_on(&mut session, Duration::from_millis(50));
    assert_eq!(order(&mut session, Request::Save), Outcome::Refused(Refusal::Driving));
}

#[test]
fn both_ends_count_and_the_quality_of_the_link_is_known() {
    let line = bench(1, 11, |_| {});
    let mut session = ready(&line, 1, 11);
    line.bench().apply(InjectedEvent::Air(Trouble { loss_share: Some(0.1), burst_us: Some(20_000), ..Trouble::NONE }));
    go_on(&mut session, Duration::from_secs(4));
    let dongle = session.count(PATIENCE).expect("the line holds").expect("an answer");
    let counts = session.counts();
    assert!(counts.unacknowledged > 0 && dongle.send_failed >= counts.unacknowledged, "{counts:?} {dongle:?}");
    assert_eq!((counts.forgotten, counts.bad_frames, counts.stuck_writes), (0, 0, 0));
    let robot = session.robot(FIRST);
    let status = robot.status().expect("told once a second");
    assert_eq!(status.name.as_str(), common::robot().name);
    assert!(status.counters.lost > 0, "orders that the robot missed");
    assert_eq!(status.counters.forged, 0);
    let quality = robot.quality(session.now());
    assert!((60.0..101.0).contains(&quality.rate_hz), "{quality:?}");
    assert!((0.005..0.35).contains(&quality.loss.expect("frames came")), "{quality:?}");
    let trip = quality.round_trip.expect("orders were echoed").as_secs_f64() * 1e3;
    assert!((0.5..20.0).contains(&trip), "{trip} ms");
    assert!(quality.rssi_dbm.is_some_and(|rssi| (-60..-30).contains(&rssi)), "{quality:?}");
    assert!(robot.missing() > 0);
}

#[test]
fn a_blocked_shaft_is_said_in_words() {
    let line = bench(1, 7, |_| {});
    line.bench().apply(InjectedEvent::Fault(0, hal_sim::Fault::Stalled));
    let spin = calibrate(&line, 7);
    let text = spin.end.expect_err("it cannot turn").to_string();
    assert!(text.starts_with("the robot stopped itself: "), "{text}");
    assert!(spin.stopped, "a robot in a fault has its bridge off");
}

#[test]
fn a_fault_that_persists_is_not_cleared() {
    let line = bench(1, 8, |_| {});
    let mut session = ready(&line, 1, 8);
    assert_eq!(ask(&mut session, FIRST, FREQUENCY), Outcome::Done(None));
    line.bench().apply(InjectedEvent::Fault(0, hal_sim::Fault::BatteryLow { open_circuit_v: 2.9 }));
    go_on(&mut session, Duration::from_millis(300));
    assert_eq!(state(&line).1, Some(Fault::SupplyLow));
    let outcome = ask(&mut session, FIRST, Command::ClearFault);
    assert_eq!(outcome, Outcome::Refused(Refusal::CausePersists(Fault::SupplyLow)));
    assert!(link::outcome(outcome).ends_with("the battery is below its limit"));
}

/// Somebody hears the length of frames and keeps every `Stop` from the air, nothing else: encryption does not hide lengths.
struct WithoutStops(HostEnd, Vec<u8>);

/// A `Stop` on the air: version, kind, counter, the console's nonce, one byte, tag.
const STOP_BYTES: usize = 4 + 1 + 4 + 8 + 1 + 16;

impl Read for WithoutStops {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.1.is_empty() {
            return self.0.read(buffer);
        }
        let count = self.1.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.1[..count]);
        self.1.drain(..count);
        Ok(count)
    }
}

impl Write for WithoutStops {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let mut deframer = Deframer::default();
        for message in buffer.iter().filter_map(|byte| deframer.push::<ToDongle>(*byte)) {
            if let Ok(ToDongle::Send { number, payload, .. }) = message
                && payload.len() == STOP_BYTES
            {
                // The dongle says what it says of every frame that nobody acknowledges.
                let mut answer = [0; frame::LONGEST + 1];
                let sent = FromDongle::Sent { number, acknowledged: false };
                self.1.push(0);
                self.1.extend(frame::encode(&sent, &mut answer).expect("short"));
                return Ok(buffer.len());
            }
        }
        self.0.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for WithoutStops {
    fn now(&self) -> Duration {
        self.0.now()
    }
}

#[test]
fn a_robot_that_no_stop_reaches_stops_for_lack_of_heartbeats() {
    let line = bench(1, 12, |_| {});
    let mut session =
        Session::open(WithoutStops(line.clone(), Vec::new()), &keys(1, 12), nonces(), PATIENCE).expect("a dongle");
    let found = session.find(None, PATIENCE).expect("a robot");
    for command in [Command::ClearFault, FREQUENCY] {
        let outcome = session.ask(found, Request::Command(command), |_| {}).expect("the line holds");
        assert_eq!(outcome, Outcome::Done(None));
    }
    let drive = |session: &mut Session<WithoutStops>, time| {
        let end = session.now() + time;
        while session.now() < end {
            session.poll().expect("the line holds");
        }
    };
    drive(&mut session, Duration::from_secs(1));
    assert_eq!(state(&line).0, State::Speed);
    let pressed = line.now();
    session.stop(found).expect("the line holds");
    drive(&mut session, Duration::from_millis(400));
    // Once more: it must not begin to hope.
    session.stop(found).expect("the line holds");
    drive(&mut session, Duration::from_secs(1));
    let off = driven(&line.bench().robots[0].event_log.events())[0].1.expect("off");
    let took = Duration::from_micros(off).saturating_sub(pressed);
    assert!(took <= Duration::from_millis(501), "{took:?}");
    assert_eq!(state(&line), (State::Fault, Some(Fault::CommandTooOld)));
}

#[test]
fn a_session_that_is_dropped_stops_every_robot_even_one_that_has_only_just_begun() {
    let line = bench(3, 13, |_| {});
    let mut session = ready(&line, 3, 13);
    for index in [1, 2] {
        // Dropped before telemetry can tell of it.
        assert_eq!(ask(&mut session, RobotId(index), FREQUENCY), Outcome::Done(None));
    }
    drop(session);
    line.wait(Duration::from_millis(100));
    let bench = line.bench();
    let states: Vec<_> = bench.robots.iter().map(|robot| robot.state().expect("it runs")).collect();
    assert_eq!(states, [(State::Idle, None); 3]);
}

/// A line on which somebody says the same repeatedly.
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
    let opening = |bytes: &[u8]| {
        let line = Canned(bytes.to_vec(), Duration::ZERO);
        match Session::open(line, &keys(1, 1), nonces(), PATIENCE) {
            Ok(_) => panic!("this is no dongle of the robots"),
            Err(error) => error,
        }
    };
    let mut buffer = [0; frame::LONGEST + 1];
    let hello = FromDongle::Hello { version: 2, address: DONGLE, channel: 1 };
    let error = opening(frame::encode(&hello, &mut buffer).expect("short"));
    assert!(matches!(error, LinkError::Version { dongle: 2 }), "{error:?}");
    let version = control::protocol::VERSION;
    let other = FromDongle::Hello { version, address: [9; 6], channel: 1 };
    let error = opening(frame::encode(&other, &mut buffer).expect("short")).to_string();
    assert!(error.starts_with("this is dongle 09:09:09:09:09:09; the robots"), "{error}");
    assert_eq!(opening(b"").to_string(), "no dongle answers: not a byte came");
    let error = opening(b"I (312) boot: ESP-IDF\r\n").to_string();
    assert!(error.ends_with("bytes came, but no whole message"), "{error}");
    let error = opening(b"I (312) boot: ESP-IDF\r\n\0").to_string();
    assert!(error.ends_with("which are no dongle's messages of this version"), "{error}");
}

#[test]
fn of_two_robots_one_must_be_named_and_each_obeys_for_itself() {
    let line = bench(2, 10, |_| {});
    let mut both = ready(&line, 2, 10);
    let error = both.find(None, PATIENCE).expect_err("which one?").to_string();
    assert!(error.contains("7c:df:a1:00:00:00") && error.contains("7c:df:a1:00:00:01"), "{error}");
    let error = both.find(Some([1; 6]), PATIENCE).expect_err("not ours").to_string();
    assert!(error.starts_with("robot 01:01:01:01:01:01 is not paired"), "{error}");
    assert_eq!(ask(&mut both, RobotId(1), FREQUENCY), Outcome::Done(None));
    go_on(&mut both, Duration::from_millis(200));
    let states: Vec<_> = line.bench().robots.iter().map(|robot| robot.state().expect("runs").0).collect();
    assert_eq!(states, [State::Idle, State::Speed]);
    assert_eq!(ask(&mut both, FIRST, FREQUENCY), Outcome::Done(None));
    both.stop_all().expect("the line holds");
    go_on(&mut both, Duration::from_millis(100));
    assert!(line.bench().robots.iter().all(|robot| !robot.actuation().enable));
}

#[test]
fn a_robot_that_is_not_there_is_not_found_and_nothing_is_sent_to_it() {
    let line = bench(1, 10, |_| {});
    line.bench().apply(InjectedEvent::PowerCut(0));
    let mut session = session(&line, 1, 10);
    let error = session.find(None, PATIENCE).expect_err("nobody").to_string();
    assert_eq!(error, "a robot does not answer on channel 1; nothing else either");
    assert_eq!(ask(&mut session, FIRST, FREQUENCY), Outcome::Absent);
}

#[test]
fn keys_of_another_console_drive_nothing() {
    let line = bench(1, 10, |_| {});
    // Past the radio's own encryption.
    let mut keys = keys(1, 10);
    keys.robots[0].pairing.key = Key([99; 32]);
    let mut stranger = Session::open(line.clone(), &keys, nonces(), PATIENCE).expect("a dongle");
    let error = stranger.find(None, PATIENCE).expect_err("it does not obey").to_string();
    assert_eq!(error, "a robot does not answer on channel 1; nothing else either");
    assert!(line.bench().robots[0].counters().forged > 3);
}

/// A stop goes to everybody, and is signed for one.
#[test]
fn the_robots_of_one_console_take_each_others_stops_for_no_forgeries() {
    let line = bench(3, 7, |_| {});
    let mut session = ready(&line, 3, 7);
    let forged = |line: &HostEnd| line.bench().robots.iter().map(|robot| robot.counters().forged).sum::<u32>();
    let others = |line: &HostEnd| line.bench().robots.iter().map(|robot| robot.counters().misunderstood).sum::<u32>();
    for index in 0..3 {
        assert_eq!(ask(&mut session, RobotId(index), FREQUENCY), Outcome::Done(None));
    }
    session.stop(FIRST).expect("the line holds");
    go_on(&mut session, Duration::from_millis(300));
    let states: Vec<State> = line.bench().robots.iter().map(|robot| robot.state().expect("it runs").0).collect();
    assert_eq!(states, [State::Idle, State::Speed, State::Speed]);
    session.stop_all().expect("the line holds");
    go_on(&mut session, Duration::from_millis(300));
    assert_eq!(forged(&line), 0, "nobody forged anything");
    assert!(others(&line) >= 2, "the others heard the stops: {}", others(&line));
}

/// Somebody has recorded how sessions began, and plays that back all the time.
#[test]
fn a_console_begins_while_recorded_hellos_are_played_back() {
    let line = bench(1, 8, |_| {});
    let recorded: Vec<Vec<u8>> = (0..60_u64)
        .map(|number| {
            let nonce = Nonce((number + 1_000_000).to_le_bytes());
            Caller::new(pairing(DONGLE, 8, 0).key, nonce).hello().to_vec()
        })
        .collect();
    let ether = line.bench().ether.clone();
    // One every 2 ms: each is another call than the one before.
    let replay = async move {
        for hello in recorded.iter().cycle() {
            ether.inject(DONGLE, address(0), hello);
            until(now_us() + 2000).await;
        }
    };
    line.bench().spawn(replay);
    for begins in 0..5 {
        let mut number = 1000 * begins;
        let nonces = Box::new(move || {
            number += 1;
            Nonce(u64::to_le_bytes(number))
        });
        let mut session = Session::open(line.clone(), &keys(1, 8), nonces, PATIENCE).expect("a dongle");
        let start = session.now();
        session.find(Some(address(0)), PATIENCE).expect("the robot");
        let took = session.now() - start;
        assert!(took < Duration::from_secs(1), "session {begins} began after {took:?}");
        assert_eq!(ask(&mut session, FIRST, Command::ClearFault), Outcome::Done(None));
    }
    let counters = line.bench().robots[0].counters();
    assert!(counters.calls > 100, "they were heard: {counters:?}");
}
