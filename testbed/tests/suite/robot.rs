//! The robot's tasks on the host, under virtual time: a whole minute, repeatedly.

use std::cell::RefCell;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::rc::Rc;
use std::time::Instant;

use crate::common::plain::{PlainTick, heard, plain};
use crate::common::{self, DRIVE, Frame, Run, SETTINGS, Trial, driving, give, until};
use control::protocol::radio::{Answer, Downlink, Reset, Source};
use control::{Command, Controller, Fault, Parameters, Refusal, State, Stroke};
use hal_sim::SimulatedRobot;
use hal_sim::radio::Trouble;
use testbed::console::Console;
use testbed::event_log::{Event, text};
use testbed::injected_event::InjectedEvent;
use testbed::setup::{DONGLE, address};

const SECONDS: f64 = 60.0;
/// The motor's wire to the sensor breaks.
const BROKEN_S: f64 = 50.0;
const SEED: u64 = 3;
/// Half of three conversions.
const MIDDLE_US: u64 = 55;

/// An air that loses half of all tries: one frame in sixty, after six of them.
const LOSSY: Trouble = Trouble {
    loss_share: Some(0.5),
    quiet_loss_share: Some(0.5),
    burst_loss_share: Some(0.5),
    burst_us: Some(0),
    ..common::CALM
};

type Answers = Rc<RefCell<Vec<(f64, Option<Answer>)>>>;

/// A minute of commands: every mode, silence, a fault and its clearing; at 46 s the robot's radio is given 15 frames at once.
async fn script(console: Console, answers: Answers) {
    let speed = |omega| Command::Speed { omega };
    let swing = Command::Oscillate { from: -2.0, to: 1.0, style: Stroke::BangBang };
    until(0.3).await;
    console.begin().await;
    for (at_s, command) in [
        (0.4, Command::Idle),
        (0.7, Command::ClearFault),
        (1.0, speed(44.0)),
        (10.0, speed(-44.0)),
        (15.0, swing),
        (25.0, Command::Position { angle: 1.0 }),
        (30.0, speed(f32::NAN)),
        (30.2, speed(40.0)),
        (37.0, speed(40.0)),
        (37.2, Command::ClearFault),
        (37.5, speed(40.0)),
        (41.025, Command::Coast),
        (41.3, speed(40.0)),
        (49.0, Command::Coast),
        (49.3, speed(40.0)),
        (54.0, speed(40.0)),
        (55.0, Command::ClearFault),
        (56.0, speed(40.0)),
        (58.0, speed(40.0)),
    ] {
        until(at_s).await;
        console.beat(true);
        let answer = give(&console, command).await;
        answers.borrow_mut().push((at_s, answer));
        if at_s == 30.2 {
            until(35.0).await;
            console.beat(false);
        }
    }
}

fn stored() -> Parameters {
    let mut stored = SETTINGS.parameters;
    stored.motor.drag *= 1.1;
    stored
}

fn simulated() -> SimulatedRobot {
    let mut robot = SimulatedRobot::new(&common::ROBOT, SEED);
    robot.schedule(hal_sim::Fault::SensorOpen, BROKEN_S);
    robot
}

/// Boots from parameters in flash that are not the factory's after a brown-out, and runs the script. From 40 to 42 s a
/// message takes the radio 60 ms more, from 43 s on nothing passes for 0.2 s.
fn minute() -> (Run, Vec<(f64, Option<Answer>)>) {
    let mut trial = Trial::new(SEED);
    let robot = &mut trial.setup.robots[0];
    (robot.simulated, robot.stored, robot.reset) = (simulated().into(), Some(stored()), Reset::BrownOut);
    trial.air = LOSSY;
    trial.injected_events = vec![
        (40_000_000, InjectedEvent::SlowRadio(0, 60_000)),
        (42_000_000, InjectedEvent::SlowRadio(0, 0)),
        (43_000_000, InjectedEvent::Air(Trouble { silence: true, ..LOSSY })),
        (43_200_000, InjectedEvent::Air(LOSSY)),
    ];
    let answers = Answers::default();
    let given = Rc::clone(&answers);
    let run = trial.run(SECONDS, |console| script(console, given));
    (run, answers.take())
}

fn run_minute() -> (Run, Vec<PlainTick>) {
    let (run, _) = minute();
    let controller = Controller::restarted(&stored(), &stored()).expect("sound parameters");
    let plain = plain(controller, simulated(), MIDDLE_US, &heard(&run), run.actuations().len() as u64);
    (run, plain)
}

#[test]
fn a_minute_takes_well_under_a_second_and_is_the_same_in_three_runs() {
    let mut first = String::new();
    for number in 1..=3 {
        let begun = Instant::now();
        let (run, _) = minute();
        let took = begun.elapsed();
        let log = text(&run.events);
        let mut hasher = DefaultHasher::new();
        log.hash(&mut hasher);
        println!(
            "run {number}: {SECONDS} s of robot in {:.3} s, {} events, hash {:016x}",
            took.as_secs_f64(),
            run.events.len(),
            hasher.finish()
        );
        if first.is_empty() {
            first = log;
        }
        let differs = first.lines().zip(text(&run.events).lines().map(str::to_owned)).find(|(a, b)| a != b);
        assert_eq!(differs, None, "run {number}");
        assert_eq!(first.lines().count(), run.events.len());
    }
}

#[test]
fn the_shell_changes_no_decision_and_every_order_is_obeyed_in_the_next_tick() {
    let (run, plain) = run_minute();
    let actuations = run.actuations();
    assert_eq!(actuations.len(), 60_000);
    for (index, ((at_us, told), plain)) in actuations.iter().zip(&plain).enumerate() {
        assert_eq!(*told, plain.actuation, "tick {index} at {at_us} us");
    }
    // Nothing keeps the receiving task from taking a message but a tick's four conversions with their jitter.
    for (at_us, event) in &run.events {
        if let Event::Heard { arrived_us, .. } = event {
            assert!(at_us - arrived_us <= 148 + 100, "{arrived_us} is taken at {at_us}");
        }
    }
    let bound_s = f64::from(SETTINGS.parameters.supervisor.sensor_open.bound);
    let broken = (BROKEN_S * 1e6) as u64..55_000_000;
    let still_on = actuations.iter().filter(|(at, told)| broken.contains(at) && told.enable).map(|(at, _)| *at).max();
    let off_after_s = still_on.expect("it was driving") as f64 * 1e-6 - BROKEN_S;
    println!("the bridge went off {off_after_s:.3} s after the wire broke, at most {bound_s:.3} s");
    assert!(off_after_s < bound_s);
    let driven = plain.iter().filter(|tick| tick.actuation.enable).count();
    println!("{} of {} ticks drive", driven, plain.len());
    assert!(driven > 40_000);
}

#[test]
fn telemetry_is_complete_and_says_what_the_controller_said() {
    let (run, plain) = run_minute();
    let sent = run.batches();
    for batch in &sent {
        for ((row, time_us), index) in batch.rows.iter().zip(batch.times_us()).zip(batch.first_tick as usize..) {
            let said = &plain[index];
            assert_eq!(time_us, said.time_us, "tick {index}");
            assert_eq!(*row, said.row.after(row.after_us), "tick {index}");
            let about = (batch.state, batch.fault, batch.tracking);
            assert_eq!(about, (said.telemetry.state, said.telemetry.fault, said.telemetry.tracking), "tick {index}");
        }
        let last = &plain[batch.first_tick as usize + batch.rows.len() - 1];
        assert!((f32::from(batch.battery_mv) * 1e-3 - last.telemetry.battery).abs() < 0.51e-3);
    }
    // The gaps are the rows that were dropped while the radio was slow, every one of them counted.
    let gaps: u32 =
        sent.windows(2).map(|pair| pair[1].first_tick - pair[0].first_tick - pair[0].rows.len() as u32).sum();
    println!("{} messages, {gaps} rows dropped, {} sends failed", sent.len(), run.counters.send_failed);
    assert_eq!(gaps, run.counters.rows_dropped);
    assert!(!gaps.is_multiple_of(10), "a change of state makes a short message, which is dropped as well");
    assert!(gaps > 1000, "in 2 s at 60 ms a message most cannot be sent");
    assert!(sent[0].first_tick < 360, "it begins with the session");
    let last = sent.last().expect("some");
    assert!(last.first_tick + last.rows.len() as u32 > 59_980, "and goes on to the end");
}

#[test]
fn without_trouble_no_row_is_missing_and_at_most_a_hundred_and_one_messages_a_second_are_sent() {
    let run = Trial::punctual(1).run(5.0, driving(5.0));
    let batches = run.batches();
    let mut next = batches[0].first_tick;
    assert!(next < 30, "{next}");
    for batch in &batches {
        assert_eq!(batch.first_tick, next);
        next += batch.rows.len() as u32;
    }
    assert!(next >= 4980, "{next}");
    let in_a_second = batches.iter().filter(|batch| (2000..3000).contains(&batch.first_tick)).count();
    assert!(in_a_second <= 101, "{in_a_second}");
    assert_eq!((run.counters.rows_dropped, run.counters.missed_deadlines, run.counters.lost), (0, 0, 0));
    assert_eq!(run.counters.ticks, 5000);
    assert_eq!((run.counters.shortest_period_us, run.counters.longest_period_us), (1000, 1000));
    assert_eq!(run.counters.longest_tick_us, 4 * 37);
    // The console has all of it.
    assert!(run.told.iter().all(|told| told.missing == 0));
    assert_eq!(run.told.len(), run.messages().len());
}

#[test]
fn the_minute_in_its_answers_statuses_and_counters() {
    let (run, answers) = minute();
    for (at_s, answer) in &answers {
        println!("{at_s:.1} s {answer:?}");
    }
    let refused: Vec<_> = answers
        .iter()
        .filter_map(|(at_s, answer)| if let Some(Answer::Refused(why)) = answer { Some((*at_s, *why)) } else { None })
        .collect();
    let non_finite = Refusal::NonFinite { name: control::Field::Omega };
    let expected = [
        (0.4, Refusal::Faulted(Fault::Restarted)),
        (30.0, non_finite),
        (37.0, Refusal::Faulted(Fault::CommandTooOld)),
        (54.0, Refusal::Faulted(Fault::SensorOpen)),
        // Cleared at rest, and the wire is still broken.
        (58.0, Refusal::Faulted(Fault::SensorOpen)),
    ];
    assert_eq!(refused, expected);
    assert_eq!(answers.iter().filter(|(_, answer)| *answer == Some(Answer::Done(None))).count(), 14);
    assert_eq!(answers.len(), 19);

    let statuses = run.statuses();
    assert!(matches!(run.sent()[..2], [(_, Frame::Welcome, _), ..]), "nobody has spoken before");
    assert!((300_000..400_000).contains(&statuses[0].0), "at the beginning of the session: {}", statuses[0].0);
    assert!((58..=61).contains(&statuses.len()), "{}", statuses.len());
    for (_, status) in &statuses {
        assert_eq!(
            (status.reset, status.parameters, status.name.as_str()),
            (Reset::BrownOut, Source::Stored, "scram-26")
        );
    }
    let orders = heard(&run);
    assert_eq!(run.counters.received as usize, orders.len());
    // Between the first and the last that came.
    let position =
        |order: &(u64, Downlink)| run.said.iter().position(|said| said.order == order.1 && said.at_us <= order.0);
    assert!(position(&orders[0]).is_some());
    assert!(run.counters.lost > 5, "{}", run.counters.lost);
    assert_eq!((run.counters.forged, run.counters.misunderstood, run.counters.outdated), (0, 0, 0));
    let sent = run.sent();
    let acknowledged = sent.iter().filter(|(.., acknowledged)| *acknowledged).count();
    assert_eq!(
        (run.counters.sent as usize, run.counters.send_failed as usize),
        (acknowledged, sent.len() - acknowledged)
    );
    assert!(run.counters.send_failed > 30, "{}", run.counters.send_failed);
    assert_eq!(run.count(|event| *event == Event::SendDropped), 0);
    assert_eq!(
        run.count(|event| *event == Event::Fed),
        run.counters.ticks as usize,
        "every tick feeds the watchdog once"
    );
}

#[test]
fn the_state_is_shown_by_the_led() {
    let (run, plain) = run_minute();
    let lit = |at_us: u64| {
        let before = run.events.iter().take_while(|(time_us, _)| *time_us <= at_us);
        before.filter_map(|(_, event)| if let Event::Lit(on) = event { Some(*on) } else { None }).last()
    };
    assert_eq!(lit(5_000_000), Some(true), "steady while it drives");
    let changes = |from_us: u64, to_us: u64| {
        let within = run.events.iter().filter(|(at, _)| (from_us..to_us).contains(at));
        within.filter(|(_, event)| matches!(event, Event::Lit(_))).count()
    };
    assert_eq!(changes(5_000_000, 9_000_000), 0);
    assert_eq!(plain[53_000].telemetry.state, State::Fault);
    assert_eq!(plain[53_000].telemetry.fault, Some(Fault::SensorOpen));
    // Three flashes of 0.2 s, with 0.2 s between them and 1.2 s after: 2.4 s.
    assert_eq!(changes(52_000_000, 54_400_000), 6);
}

#[test]
fn after_any_reset_the_motor_stays_off_until_the_fault_is_cleared() {
    let resets = [
        Reset::PowerOn,
        Reset::External,
        Reset::Software,
        Reset::Panic,
        Reset::Watchdog,
        Reset::BrownOut,
        Reset::Other,
    ];
    for reset in resets {
        let mut trial = Trial::new(SEED);
        trial.injected_events = vec![(1_500_300, InjectedEvent::Boot(0, reset))];
        let run = trial.run(4.0, |console| async move {
            driving(4.0)(console.clone()).await;
        });
        assert!(run.last_on_us().is_some_and(|at_us| (1_499_000..1_501_000).contains(&at_us)), "{reset:?}");
        // The console goes on in a session that the robot knows nothing of.
        assert!(run.counters.forged > 30, "{reset:?}: {:?}", run.counters);
        assert_eq!(run.counters.received, 0, "{reset:?}");

        let mut trial = Trial::new(SEED);
        trial.injected_events = vec![(1_500_300, InjectedEvent::Boot(0, reset))];
        let run = trial.run(4.0, |console| async move {
            common::ready(&console).await;
            assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
            until(2.0).await;
            console.begin().await;
            assert_eq!(give(&console, DRIVE).await, Some(Answer::Refused(Refusal::Faulted(Fault::Restarted))));
            until(2.5).await;
            assert_eq!(give(&console, Command::ClearFault).await, Some(Answer::Done(None)));
            assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
        });
        let on: Vec<u64> = run
            .actuations()
            .into_iter()
            .filter(|(at, told)| *at > 1_501_000 && told.enable)
            .map(|(at, _)| at)
            .collect();
        assert!((2_500_000..2_540_000).contains(&on[0]), "{reset:?}: {} us", on[0]);
        assert!(on.len() > 1440, "{reset:?}: {}", on.len());
        let told = run.statuses().into_iter().find(|(at_us, _)| *at_us > 1_600_000).expect("a status").1;
        assert_eq!(told.reset, reset);
        let first = run.told.iter().find(|told| told.at_us > 2_000_000).expect("a session");
        assert!(first.uplink.uptime_ms < 1000, "its clock begins anew");
    }
}

#[test]
fn a_robot_that_is_paired_with_nobody_says_nothing() {
    let mut trial = Trial::new(SEED);
    trial.setup.robots[0].pairing = None;
    let run = trial.run(2.0, |console| async move { console.begin().await });
    assert_eq!(run.sent(), []);
    assert!(run.arrivals(DONGLE).is_empty() && run.counters.ticks == 2000);
    assert_ne!(address(0), DONGLE);
}
