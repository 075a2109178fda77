//! The robot's tasks when something goes wrong: silence, a stuck converter, ticks that take too long, full queues.

#[expect(dead_code, reason = "the robot's other tests use the rest")]
mod common;

use std::collections::HashSet;

use common::bench::{Bench, Run, SETTINGS, punctual};
use common::journal::{Event, Journal};
use common::parts::{FOR_EVER, Hold, HostLed, HostParts, HostWatchdog, Written};
use common::radio::{Arrival, console, numbered, radio};
use common::time::World;
use control::protocol::radio::{FromRobot, Reset, Source};
use control::{Actuation, AdcCode, Command, Controller, State};
use embassy_futures::join::join;
use embassy_time::Timer;
use shell::board::{Bridge, Converter, Watchdog};
use shell::robot::{About, Parts, Settings, Shared, control_loop, led, receive, send};

const DRIVE: Command = Command::Speed { omega: 44.0 };
/// The watchdog's period in these tests, µs.
const WATCHDOG_US: u64 = 100_000;

/// A console that gives this command until a time.
fn driven_until(until_s: f64) -> Vec<Arrival> {
    numbered(console(&[(0.0, Some(DRIVE))], until_s, 0.0, 1))
}

/// On a robot without jitter, so that times are known to the microsecond.
fn bench(seed: u64, arrivals: Vec<Arrival>) -> Bench {
    Bench { robot: punctual(seed), ..Bench::new(seed, arrivals) }
}

/// How long a tick takes: three conversions of the wiper, one of the cell.
const TICK_US: u64 = 4 * 37;

/// Times at which ticks were done, µs.
fn ticks(run: &Run) -> Vec<u64> {
    run.times(|event| *event == Event::Fed)
}

/// The periods of `length` µs in which a tick began: ticks end soon after their beginning.
fn periods(run: &Run, length: u64) -> HashSet<u64> {
    run.times(|event| matches!(event, Event::Converted(_))).into_iter().map(|at_us| at_us / length).collect()
}

#[test]
fn the_bridge_is_off_within_the_bound_after_the_last_command_and_stays_off() {
    let arrivals = driven_until(2.0);
    let last_us = arrivals.last().expect("some").at_us;
    let run = bench(2, arrivals).run(6.0);
    let mut on = run.actuations().into_iter().filter(|(_, actuation)| actuation.enable).map(|(at_us, _)| at_us);
    let silence_s = (on.next_back().expect("it drove") - last_us) as f64 * 1e-6;
    let command_old = SETTINGS.parameters.supervisor.command_old;
    println!("the bridge went off {silence_s:.3} s after the last command, at most {} s", command_old.bound);
    assert!(silence_s < f64::from(command_old.bound));
    assert!(silence_s > f64::from(command_old.limit) - 0.01, "and not before the command was too old");
    let last = run.batches().pop().expect("telemetry goes on");
    assert_eq!((last.state, last.fault), (State::Fault, Some(control::Fault::CommandTooOld)));
    assert_eq!(run.bitten(WATCHDOG_US), None, "the loop goes on");
}

#[test]
fn a_tick_converts_decides_and_feeds_the_watchdog_last() {
    let run = bench(2, driven_until(1.0)).run(1.0);
    assert_eq!(run.events[0].1, Event::Applied(Actuation::OFF), "before anything else");
    let own: Vec<_> = run.events[1..]
        .iter()
        .filter_map(|(_, event)| match event {
            Event::Converted(_) => Some('c'),
            Event::Applied(_) => Some('a'),
            Event::Fed => Some('f'),
            _ => None,
        })
        .collect();
    assert_eq!(own.len(), 5000);
    assert!(own.chunks(5).all(|tick| tick == ['c', 'c', 'c', 'a', 'f']));
}

#[test]
fn a_stuck_converter_starves_the_watchdog_and_the_robot_boots_with_the_bridge_off() {
    let mut bench = bench(2, driven_until(3.0));
    bench.holds = vec![Hold { at_us: 2_000_000, for_us: FOR_EVER }];
    let run = bench.run(3.0);
    let last_feed = *ticks(&run).last().expect("some");
    assert!((1_999_000..2_000_000).contains(&last_feed), "{last_feed}");
    assert_eq!(run.bitten(WATCHDOG_US), Some(last_feed + WATCHDOG_US));
    assert!(run.actuations().iter().all(|(at_us, _)| *at_us < 2_000_000));

    let mut again = Bench::new(2, Vec::new());
    again.about.reset = Reset::Watchdog;
    let run = again.run(2.0);
    assert!(run.events.iter().all(|(_, event)| !matches!(event, Event::Applied(told) if told.enable)));
    let statuses = run.statuses();
    assert_eq!(statuses.len(), 2);
    assert!(statuses.iter().all(|(_, status)| status.reset == Reset::Watchdog));
    assert!(run.batches().is_empty(), "nobody listens");
}

#[test]
fn a_tick_that_takes_too_long_costs_its_periods_and_is_not_made_up_for() {
    let mut bench = bench(2, driven_until(5.0));
    // Takes 3.3 ms and four conversions: over three periods.
    bench.holds = vec![Hold { at_us: 2_000_000, for_us: 3_300 }];
    let run = bench.run(5.0);
    assert_eq!((run.counters.ticks, run.counters.missed_deadlines), (4997, 3));
    let ends = ticks(&run);
    let around: Vec<u64> = ends.iter().copied().filter(|at| (1_999_000..2_006_000).contains(at)).collect();
    assert_eq!(around, [1_999_148, 2_003_448, 2_004_148, 2_005_148]);
    let told = run.statuses().into_iter().map(|(_, status)| status.counters);
    let told: Vec<_> = told.map(|c| (c.longest_tick_us, c.shortest_period_us, c.longest_period_us)).collect();
    // The first tick has no period. The status at 2 s comes after the long tick and before the next one: each is told once.
    assert_eq!(told, [(148, 0, 0), (148, 1000, 1000), (3_448, 1000, 1000), (148, 1000, 4000), (148, 1000, 1000)]);
    assert!(run.actuations().iter().filter(|(at, _)| *at > 1_000_000).all(|(_, told)| told.enable), "it drives on");
    // The telemetry says which periods had no tick.
    let gaps =
        run.batches().windows(2).map(|pair| pair[1].first_tick - pair[0].first_tick - pair[0].rows.len() as u32).sum();
    assert_eq!((gaps, run.counters.rows_dropped), (3_u32, 0));
}

#[test]
fn a_tick_that_is_kept_out_counts_for_the_nearest_period_and_the_next_is_on_the_grid() {
    for (late_us, ends, missed) in [
        (499, [1_001_499, 1_002_000, 1_003_000].map(|at| at + TICK_US), 0),
        (500, [1_001_500, 1_003_000, 1_004_000].map(|at| at + TICK_US), 1),
        (5_600, [1_006_600, 1_008_000, 1_009_000].map(|at| at + TICK_US), 6),
    ] {
        let mut bench = bench(2, driven_until(2.0));
        bench.busy = vec![Hold { at_us: 1_000_900, for_us: late_us + 100 }];
        let run = bench.run(2.0);
        let around: Vec<u64> = ticks(&run).into_iter().filter(|at| *at > 1_001_000).take(3).collect();
        assert_eq!(around, ends, "{late_us} us late");
        assert_eq!(run.counters.missed_deadlines, missed, "{late_us} us late");
        assert_eq!(run.counters.ticks + missed, 2000);
    }
}

#[test]
fn a_processor_that_is_too_slow_ticks_every_other_period_and_the_radio_goes_on() {
    let mut bench = bench(2, driven_until(3.0));
    bench.conversion_us = 300;
    let run = bench.run(3.0);
    assert_eq!((run.counters.ticks, run.counters.missed_deadlines), (1500, 1499));
    assert_eq!(periods(&run, 2000).len(), 1500);
    assert_eq!(run.counters.received as usize, driven_until(3.0).len());
    assert_eq!(run.counters.rows_dropped, 0);
    assert!(run.statuses().len() == 3 && run.batches().len() > 1400);
}

#[test]
fn a_slow_radio_keeps_neither_answers_nor_the_status_waiting_behind_telemetry() {
    // Every message takes as long as ten rows: telemetry alone would fill the radio.
    let mut bench = bench(2, numbered(console(&[(0.0, Some(Command::Idle)), (5.0, Some(DRIVE))], 9.99, 0.0, 1)));
    bench.fate = Box::new(|_| (12_000, true));
    let arrival = bench.arrivals.iter().find(|arrival| arrival.at_us > 5_000_000).expect("one").clone();
    let run = bench.run(10.0);
    assert!(run.counters.rows_dropped > 1000);
    let answer = run.answers().into_iter().find(|(_, number, _)| u32::from(*number) == arrival.number);
    let at_us = answer.expect("it is answered").0;
    assert!(at_us - arrival.at_us < 13_500, "{} us", at_us - arrival.at_us);
    let times: Vec<u64> = run.statuses().into_iter().map(|(at_us, _)| at_us).collect();
    // Behind the message that is underway and the answer of every second.
    assert!(times.len() == 10 && times.windows(2).all(|pair| pair[1] - pair[0] < 1_025_000), "{times:?}");
}

#[test]
fn answers_that_the_radio_cannot_take_are_counted() {
    // A new command every 10 ms, and a radio that is stuck in one message.
    let command = |index: u32| Command::Speed { omega: 40.0 + 0.01 * index as f32 };
    let script = (0..100).map(|index| (10_000 * u64::from(index) + 5, command(index), false)).collect();
    let mut bench = bench(2, numbered(script));
    bench.fate = Box::new(|_| (60_000_000, true));
    let run = bench.run(1.0);
    assert_eq!(run.counters.received, 100);
    assert_eq!(run.counters.answers_dropped, 100 - 12, "the queue holds 12; the radio is busy with the status");
    assert_eq!(run.count(|event| *event == Event::SendDropped), 0);
}

#[test]
fn an_answer_that_was_lost_is_given_again_to_a_repetition() {
    // Forty commands while the radio is stuck in a message, then the last one on and on.
    let command = |index: u32| Command::Speed { omega: 40.0 + 0.01 * index as f32 };
    let mut script: Vec<_> = (0..40).map(|index| (5_000 * u64::from(index) + 5, command(index), false)).collect();
    script.extend((0..78).map(|index| (200_005 + 50_000 * index, command(39), false)));
    let arrivals = numbered(script);
    let last = arrivals[39].number;
    let mut bench = bench(2, arrivals);
    bench.fate = Box::new(|at_us| if at_us < 200_000 { (200_100 - at_us, true) } else { (1500, true) });
    let run = bench.run(4.0);
    assert_eq!(run.counters.answers_dropped, 40 - 12);
    let answers = run.answers().into_iter().filter(|(_, number, _)| u32::from(*number) >= last);
    let heard: Vec<u64> = answers.map(|(at_us, ..)| at_us).collect();
    assert_eq!(heard.len(), 4, "{heard:?}");
    assert!(heard[0] < 300_000, "the next repetition is answered: {heard:?}");
    assert!(heard.windows(2).all(|pair| (950_000..1_060_000).contains(&(pair[1] - pair[0]))), "{heard:?}");
}

#[test]
fn a_command_that_comes_late_or_twice_is_not_obeyed() {
    let stop = 500_005;
    let mut script: Vec<_> = (0..10).map(|index| (50_000 * index + 5, DRIVE, false)).collect();
    script.extend((0..20).map(|index| (stop + 50_000 * index, Command::Idle, false)));
    let mut arrivals = numbered(script);
    // The radio brings three of the earlier ones again, and one that took its time.
    for (index, at_us) in [(9, 510_000), (9, 520_000), (3, 900_000), (8, 1_440_000)] {
        let mut again = arrivals[index].clone();
        again.at_us = at_us;
        arrivals.push(again);
    }
    let run = bench(2, arrivals).run(2.0);
    assert_eq!((run.counters.received, run.counters.outdated), (34, 4));
    let on = run.actuations().into_iter().filter(|(_, told)| told.enable).map(|(at_us, _)| at_us).max();
    assert!(on.expect("it drove before") < stop + 2_000, "{on:?}");
}

#[test]
fn a_console_that_starts_anew_is_obeyed_at_once_from_elsewhere_and_within_a_second_from_the_same_address() {
    let old = numbered((0..10).map(|index| (50_000 * index + 5, DRIVE, false)).collect());
    let restarted = |from, number: u16| {
        let again = (0..30_u16).map(|index| Arrival {
            from,
            ..Arrival::command(500_005 + 50_000 * u64::from(index), number + index, Command::Idle)
        });
        let run = bench(2, old.iter().cloned().chain(again).collect()).run(2.0);
        let first = run.answers().into_iter().find(|(at_us, ..)| *at_us > 500_000).expect("an answer").0;
        (first, run.counters.outdated)
    };
    let (first, outdated) = restarted([7; 6], 60_000);
    assert!(first < 502_000 && outdated == 0, "{first}");
    // The last one was heard at 450 ms.
    let (first, outdated) = restarted(common::radio::HOST, 60_000);
    assert!((1_450_000..1_452_000).contains(&first) && outdated == 19, "{first} {outdated}");
}

#[test]
fn of_too_many_commands_the_oldest_are_dropped_and_counted() {
    let journal = Journal::default();
    let shared = Shared::new();
    let mut script: Vec<_> = (0..19).map(|index| (100 * index, DRIVE, false)).collect();
    script.push((1_900, Command::Coast, false));
    let (receiver, _) = radio(&numbered(script), Box::new(|_| (0, true)), &journal);
    let parts = HostParts::new(punctual(1), 3, 0, &[], &journal);
    let parts = Parts { converter: parts.clone(), bridge: parts, watchdog: HostWatchdog(journal.clone()) };
    let controller = Controller::new(&SETTINGS.parameters).expect("sound");
    let mut world = World::new();
    world.spawn(receive(receiver, &shared));
    world.run_until(2_000);
    assert_eq!((shared.counters().received, shared.counters().commands_dropped), (20, 8));
    world.spawn(control_loop(parts, controller, &SETTINGS, &shared));
    world.run_until(2_500);
    assert_eq!(shared.shown(), shell::robot::Shown::State(State::Coast, None), "the last one counts");
    assert_eq!(shared.counters().commands_dropped, 8);
}

#[test]
fn the_median_is_what_the_controller_sees_and_conversions_far_from_it_are_counted() {
    let journal = Journal::default();
    let shared = Shared::new();
    let settings = Settings { conversions: 5, outlier_lsb: 100, ..SETTINGS.clone() };
    let spikes = [2000, 2010, 4095, 1990, 2005, 2001, 1000, 0, 2101, 2102];
    let written = Written { codes: spikes.into(), last: 2000 };
    let bridge = HostParts::new(punctual(1), 3, 0, &[], &journal);
    let parts = Parts { converter: written, bridge, watchdog: HostWatchdog(journal.clone()) };
    let controller = Controller::new(&settings.parameters).expect("sound");
    let (receiver, sender) = radio(&driven_until(0.1), Box::new(|_| (1000, true)), &journal);
    let about = about();
    let mut world = World::new();
    // The peer is known before the first batch is full.
    world.spawn(control_loop(parts, controller, &settings, &shared));
    world.spawn(receive(receiver, &shared));
    world.spawn(send(sender, &about, &shared));
    world.run_until(30_000);
    // Of the first five, 4095; of the second, whose median is 2001, 1000, 0 and 2102.
    assert_eq!(shared.counters().adc_outliers, 4);
    let sent = Run { end_us: 30_000, events: journal.take(), counters: shared.counters() };
    let codes: Vec<u16> = sent.batches().iter().flat_map(|batch| batch.rows.iter().map(|row| row.code)).collect();
    assert_eq!(codes[..4], [2005, 2001, 2000, 2000]);
}

fn about() -> About {
    About { name: SETTINGS.name.clone(), reset: Reset::PowerOn, parameters: Source::Factory }
}

#[test]
fn without_a_controller_the_led_says_so_and_the_status_is_sent() {
    let journal = Journal::default();
    let shared = Shared::new();
    let (_, sender) = radio(&[], Box::new(|_| (1000, true)), &journal);
    let about = about();
    let mut world = World::new();
    world.spawn(send(sender, &about, &shared));
    world.spawn(led(HostLed(journal.clone(), None), &shared));
    world.run_until(999_999);
    let run = Run { end_us: 1_000_000, events: journal.take(), counters: shared.counters() };
    assert_eq!(run.count(|event| matches!(event, Event::Lit(_))), 20, "10 Hz");
    let sent = run.sent();
    assert!(
        matches!(&sent[0], (0, shell::robot::BROADCAST, FromRobot::Status(status), true) if status.counters.ticks == 0)
    );
}

#[test]
fn being_woken_for_nothing_makes_no_tick() {
    let journal = Journal::default();
    let shared = Shared::new();
    let host = HostParts::new(punctual(1), 3, 37, &[], &journal);
    let parts = Parts { converter: host.clone(), bridge: host, watchdog: HostWatchdog(journal.clone()) };
    let controller = Controller::new(&SETTINGS.parameters).expect("sound");
    let alarm = async {
        loop {
            Timer::after_micros(170).await;
        }
    };
    let mut world = World::new();
    // Polled together: every alarm wakes both.
    world.spawn(join(control_loop(parts, controller, &SETTINGS, &shared), alarm));
    world.run_until(99_999);
    let times: Vec<u64> =
        journal.take().into_iter().filter(|(_, event)| *event == Event::Fed).map(|(at, _)| at).collect();
    assert_eq!(times, (0..100).map(|tick| 1000 * tick + TICK_US).collect::<Vec<_>>());
}

/// Parts without a connection to anything, as in an interrupt executor.
struct Bare;

impl Converter for Bare {
    fn angle(&mut self) -> AdcCode {
        AdcCode(0)
    }
    fn battery(&mut self) -> AdcCode {
        AdcCode(0)
    }
}

impl Bridge for Bare {
    fn apply(&mut self, _: Actuation) {}
}

impl Watchdog for Bare {
    fn feed(&mut self) {}
}

#[test]
fn the_control_loop_may_run_in_an_interrupt_and_its_size_is_known() {
    fn sendable<T: Send>(task: &T) -> usize {
        size_of_val(task)
    }
    static SHARED: Shared = Shared::new();
    let parts = Parts { converter: Bare, bridge: Bare, watchdog: Bare };
    let controller = Controller::new(&SETTINGS.parameters).expect("sound");
    let size = sendable(&control_loop(parts, controller, &SETTINGS, &SHARED));
    println!(
        "control loop {size} bytes, of which the controller {}, Shared {}",
        size_of::<Controller>(),
        size_of::<Shared>()
    );
    // The controller, as an argument and in the loop, and little more.
    assert!(size < 2 * size_of::<Controller>() + 1024, "{size}");
}
