//! The robot's tasks on the host, under virtual time: a whole minute, again and again.

#[expect(dead_code, reason = "the robot's other tests use the rest")]
mod common;
#[expect(dead_code, reason = "the parameter store's tests use the rest")]
#[path = "store/nor_flash.rs"]
mod nor_flash;

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::Instant;

use common::bench::{Bench, PlainTick, Run, SETTINGS, plain, punctual, simulated};
use common::journal::{Event, text};
use common::radio::{Arrival, Script, console, numbered};
use control::protocol::radio::{Batch, FromRobot, Reset, Source, decode};
use control::{Command, Fault, Refusal, State, Stroke};
use embassy_futures::block_on;
use nor_flash::Flash;
use shell::robot::boot;
use shell::store;

const SECONDS: f64 = 60.0;
/// The motor's wire to the sensor breaks.
const BROKEN_S: f64 = 50.0;
const SEED: u64 = 3;
/// Half of three conversions.
const MIDDLE_US: u64 = 55;

/// A minute of commands: every mode, silence, a fault and its clearing; one message in twenty is lost, and at 46 s the
/// radio is given 15 at once.
fn script() -> Script {
    let speed = |omega| Some(Command::Speed { omega });
    let swing = Some(Command::Oscillate { from: -2.0, to: 1.0, style: Stroke::BangBang });
    let orders = [
        (0.4, Some(Command::Idle)),
        (0.7, Some(Command::ClearFault)),
        (1.0, speed(44.0)),
        (10.0, speed(-44.0)),
        (15.0, swing),
        (25.0, Some(Command::Position { angle: 1.0 })),
        (30.0, speed(f32::NAN)),
        (30.2, speed(40.0)),
        (35.0, None),
        (37.0, speed(40.0)),
        (37.2, Some(Command::ClearFault)),
        (37.5, speed(40.0)),
        (41.0, Some(Command::Coast)),
        (41.2, speed(40.0)),
        (49.0, Some(Command::Coast)),
        (49.3, speed(40.0)),
        (55.0, Some(Command::ClearFault)),
        (56.0, speed(40.0)),
    ];
    let mut script = console(&orders, SECONDS, 0.05, SEED);
    script.extend((0..15).map(|_| (46_000_321, Command::Speed { omega: 40.0 }, false)));
    script
}

/// Boots from parameters in flash that are not the factory's after a brown-out, and runs the script. From 40 to 42 s a message takes the
/// radio 60 ms, from 43 to 44 s nothing is acknowledged.
fn minute() -> (Bench, Vec<Arrival>) {
    let arrivals = numbered(script());
    let mut bench = Bench::new(SEED, arrivals.clone());
    let mut stored = bench.settings.parameters;
    stored.motor.drag *= 1.1;
    let mut flash = Flash::<4096>::blank(6);
    let range = flash.range();
    block_on(store::save(&mut flash, range.clone(), &bench.settings.parameters, &stored)).expect("the flash works");
    let (about, controller) = block_on(boot(&mut flash, range, &bench.settings, Reset::BrownOut));
    bench.about = about;
    bench.controller = controller.expect("sound parameters");
    assert_eq!(*bench.controller.parameters(), stored);
    bench.robot.schedule(hal_sim::Fault::SensorOpen, BROKEN_S);
    bench.fate = Box::new(|at_us| match at_us {
        40_000_000..42_000_000 => (60_000, true),
        43_000_000..44_000_000 => (1500, false),
        _ => (1500, true),
    });
    (bench, arrivals)
}

fn run_minute() -> (Run, Vec<PlainTick>, Vec<Arrival>) {
    let (bench, arrivals) = minute();
    let controller = bench.controller;
    let run = bench.run(SECONDS);
    let mut robot = simulated(SEED);
    robot.schedule(hal_sim::Fault::SensorOpen, BROKEN_S);
    let plain = plain(controller, robot, MIDDLE_US, &heard(&run, &arrivals), run.actuations().len() as u64);
    (run, plain, arrivals)
}

/// When the receiving task took which command.
fn heard(run: &Run, arrivals: &[Arrival]) -> Vec<(u64, Command)> {
    let said: HashMap<u32, Command> =
        arrivals.iter().map(|arrival| (arrival.number, decode(&arrival.payload).expect("a command").1)).collect();
    let taken = run.events.iter();
    taken
        .filter_map(|(at, event)| if let Event::Heard(number) = event { Some((*at, said[number])) } else { None })
        .collect()
}

#[test]
fn a_minute_takes_well_under_a_second_and_is_the_same_in_three_runs() {
    let mut first = String::new();
    for number in 1..=3 {
        let (bench, _) = minute();
        let begun = Instant::now();
        let run = bench.run(SECONDS);
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
fn the_shell_changes_no_decision_and_every_command_is_obeyed_in_the_next_tick() {
    let (run, plain, arrivals) = run_minute();
    let actuations = run.actuations();
    assert_eq!(actuations.len(), 60_000);
    for (index, ((at_us, told), plain)) in actuations.iter().zip(&plain).enumerate() {
        assert_eq!(*told, plain.actuation, "tick {index} at {at_us} us");
    }
    // Nothing keeps the receiving task from taking a message but a tick's four conversions with their jitter.
    let arrived: HashMap<u32, u64> = arrivals.iter().map(|arrival| (arrival.number, arrival.at_us)).collect();
    for (at_us, event) in &run.events {
        if let Event::Heard(number) = event {
            assert!(at_us - arrived[number] <= 148 + 100, "message {number} at {at_us}");
        }
    }
    let bound_s = f64::from(broken_bound_s());
    let broken = (BROKEN_S * 1e6) as u64..55_000_000;
    let still_on = actuations.iter().filter(|(at, told)| broken.contains(at) && told.enable).map(|(at, _)| *at).max();
    let off_after_s = still_on.expect("it was driving") as f64 * 1e-6 - BROKEN_S;
    println!("the bridge went off {off_after_s:.3} s after the wire broke, at most {bound_s:.3} s");
    assert!(off_after_s < bound_s);
    let driven = plain.iter().filter(|tick| tick.actuation.enable).count();
    println!("{} of {} ticks drive", driven, plain.len());
    assert!(driven > 40_000);
}

/// From a broken wire to the bridge off at the latest, s.
fn broken_bound_s() -> f32 {
    SETTINGS.parameters.supervisor.sensor_open.bound
}

#[test]
fn telemetry_is_complete_and_says_what_the_controller_said() {
    let (run, plain, _) = run_minute();
    let sent: Vec<Batch> = run.sent().into_iter().filter_map(|sent| telemetry(sent.2)).collect();
    for batch in &sent {
        for (row, index) in batch.rows.iter().zip(batch.first_tick as usize..) {
            let said = &plain[index];
            assert_eq!(*row, said.row, "tick {index}");
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
    assert!(sent[0].first_tick < 460, "it begins with the first command");
    let last = sent.last().expect("some");
    assert!(last.first_tick + last.rows.len() as u32 > 59_985, "and goes on to the end");
}

fn telemetry(message: FromRobot) -> Option<Batch> {
    if let FromRobot::Telemetry(batch) = message { Some(batch) } else { None }
}

#[test]
fn without_trouble_no_row_is_missing_and_at_most_a_hundred_and_one_messages_a_second_are_sent() {
    let arrivals = numbered(console(&[(0.0, Some(Command::Speed { omega: 44.0 }))], 5.0, 0.0, 1));
    let mut bench = Bench::new(1, arrivals);
    bench.robot = punctual(1);
    let run = bench.run(5.0);
    let batches = run.batches();
    let mut next = batches[0].first_tick;
    assert!(next < 10, "{next}");
    for batch in &batches {
        assert_eq!(batch.first_tick, next);
        next += batch.rows.len() as u32;
    }
    assert!(next >= 4990, "{next}");
    let in_a_second = batches.iter().filter(|batch| (2000..3000).contains(&batch.first_tick)).count();
    assert!(in_a_second <= 101, "{in_a_second}");
    assert_eq!((run.counters.rows_dropped, run.counters.missed_deadlines, run.counters.lost), (0, 0, 0));
    assert_eq!(run.counters.ticks, 5000);
    assert_eq!((run.counters.shortest_period_us, run.counters.longest_period_us), (1000, 1000));
    assert_eq!(run.counters.longest_tick_us, 4 * 37);
}

#[test]
fn the_minute_in_its_answers_statuses_and_counters() {
    let (run, _, arrivals) = run_minute();
    // A new command has an answer, and so has one of its repetitions where the outcome changes or a second has passed.
    let said: HashMap<u32, String> = arrivals
        .iter()
        .map(|arrival| (arrival.number, format!("{:?}", decode::<Command>(&arrival.payload).expect("a command").1)))
        .collect();
    let answers = run.answers();
    let mut answers: Vec<_> =
        answers.iter().map(|(at_us, number, outcome)| (at_us / 100_000, &said[&u32::from(*number)], outcome)).collect();
    answers.dedup_by(|after, before| {
        let again = (after.1, after.2) == (before.1, before.2);
        assert!(!again || after.0 - before.0 >= 9, "{before:?} {after:?}");
        if again {
            *before = *after;
        }
        again
    });
    let outcomes: Vec<_> = answers.into_iter().map(|(at, _, outcome)| (at, *outcome)).collect();
    for answer in &outcomes {
        println!("{:.1} s {:?}", answer.0 as f64 * 0.1, answer.1);
    }
    let refused: Vec<_> = outcomes.iter().filter_map(|(at, outcome)| outcome.err().map(|why| (*at, why))).collect();
    let non_finite = Refusal::NonFinite { name: control::Field::Omega };
    let expected = [
        Refusal::Faulted(Fault::Restarted),
        non_finite,
        Refusal::Faulted(Fault::CommandTooOld),
        Refusal::Faulted(Fault::SensorOpen),
        // Cleared at rest, and the wire is still broken.
        Refusal::Faulted(Fault::SensorOpen),
    ];
    assert_eq!(refused.iter().map(|(_, why)| *why).collect::<Vec<_>>(), expected);
    assert_eq!(outcomes.iter().filter(|(_, outcome)| outcome.is_ok()).count(), 14);

    let statuses = run.statuses();
    assert!(statuses[0].0 < 1000, "at boot, after the first tick");
    assert!((59..=61).contains(&statuses.len()), "{}", statuses.len());
    for (_, status) in &statuses {
        assert_eq!(
            (status.reset, status.parameters, status.name.as_str()),
            (Reset::BrownOut, Source::Stored, "scram-26")
        );
    }
    assert!(run.sent()[0].1 == shell::robot::BROADCAST, "nobody has spoken yet");
    assert!(run.sent().iter().skip(2).all(|sent| sent.1 == common::radio::HOST));

    let heard = run.count(|event| matches!(event, Event::Heard(_)));
    let overflowed = run.count(|event| *event == Event::Overflowed);
    assert_eq!(overflowed, 5, "15 came at once, and the radio holds 10");
    let all = u32::from((arrivals.last().expect("some").number as u16).wrapping_sub(arrivals[0].number as u16)) + 1;
    assert_eq!(run.counters.received as usize, heard);
    assert_eq!(run.counters.lost, all - run.counters.received, "lost on the air or in the queue");
    assert!(run.counters.lost > 40 + overflowed as u32);
    let sent = run.sent();
    let acknowledged = sent.iter().filter(|sent| sent.3).count();
    assert_eq!(
        (run.counters.sent as usize, run.counters.send_failed as usize),
        (acknowledged, sent.len() - acknowledged)
    );
    assert!(run.counters.send_failed > 90);
    assert_eq!(run.count(|event| *event == Event::SendDropped), 0);
    assert_eq!(
        run.count(|event| *event == Event::Fed),
        run.counters.ticks as usize,
        "every tick feeds the watchdog once"
    );
}

#[test]
fn the_state_is_shown_by_the_led() {
    let (run, plain, _) = run_minute();
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
        // The console has not noticed: it goes on with the command that it holds.
        let hold = Command::Speed { omega: 44.0 };
        let orders = [(0.0, Some(hold)), (2.0, Some(Command::ClearFault)), (2.5, Some(hold))];
        let mut bench = Bench::new(SEED, numbered(console(&orders, 4.0, 0.0, SEED)));
        let mut flash = Flash::<4096>::blank(6);
        let range = flash.range();
        let (about, controller) = block_on(boot(&mut flash, range, &bench.settings, reset));
        bench.about = about;
        bench.controller = controller.expect("sound parameters");
        let run = bench.run(4.0);
        assert_eq!(run.statuses()[0].1.reset, reset);
        let on = run.actuations().into_iter().filter(|(_, told)| told.enable).map(|(at_us, _)| at_us);
        let (first, count) = (on.clone().min().expect("driven in the end"), on.count());
        assert!((2_500_000..2_510_000).contains(&first), "{reset:?}: {first} us");
        assert!(count > 1480, "{reset:?}: {count}");
        let told = run.batches()[0].clone();
        assert_eq!((told.state, told.fault), (State::Fault, Some(Fault::Restarted)), "{reset:?}");
        assert_eq!(run.answers()[0].2, Err(Refusal::Faulted(Fault::Restarted)), "{reset:?}");
    }
}
