//! The robot's tasks when something goes wrong: silence, a stuck converter, ticks that take too long, full queues.

use std::collections::HashSet;

use crate::common::{DRIVE, Run, SETTINGS, Trial, driving, give, punctual, ready, until};
use control::protocol::radio::{Answer, Downlink, Report, Request, RequestFrame, Reset};
use control::{Actuation, AdcCode, Command, Controller, Refusal, State, Unready};
use embassy_futures::join::join;
use embassy_time::Timer;
use shell::board::{Bridge, Converter, Watchdog, WatchdogTimeout};
use shell::robot::{Parts, Settings, Shared, Shown, control_loop, led};
use std::cell::RefCell;
use std::rc::Rc;
use testbed::event_log::{Detail, Event, EventLog};
use testbed::injected_event::InjectedEvent;
use testbed::parts::{Board, Plant, ProcessorHold, StatusLed, WATCHDOG_US};
use testbed::power::Power;
use testbed::setup::DONGLE;
use testbed::time::World;

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
fn after_the_last_sign_of_life_the_duty_fades_and_the_bridge_is_off_within_the_bound_and_stays_off() {
    let run = Trial::punctual(2).run(6.0, driving(2.0));
    let last_us = *run.arrivals(DONGLE).last().expect("some");
    assert!((1_950_000..2_003_000).contains(&last_us), "{last_us}");
    let supervisor = SETTINGS.parameters.supervisor;
    let silence_s = |at_us: u64| (at_us as f64 - last_us as f64) * 1e-6;
    let off_s = silence_s(run.last_on_us().expect("it drove"));
    println!("the bridge went off {off_s:.3} s after the last frame, at most {} s", supervisor.command_old.bound);
    assert!(off_s < f64::from(supervisor.command_old.bound));
    assert!(
        off_s > f64::from(supervisor.command_old.limit) - 0.03,
        "and not before the link was too old: what the console had heard is as old"
    );
    let strongest = |from_s: f64, to_s: f64| {
        let within = run.actuations().into_iter().filter(|(at_us, _)| (from_s..to_s).contains(&silence_s(*at_us)));
        within.map(|(_, told)| told.duty.abs()).fold(0.0, f32::max)
    };
    let slow_s = f64::from(supervisor.slow_after);
    assert!(strongest(0.0, slow_s) > 0.3, "{}", strongest(0.0, slow_s));
    assert!(strongest(slow_s + 0.05, 1.0) < 0.85);
    assert!(strongest(slow_s + 0.2, 1.0) < 0.25, "{}", strongest(slow_s + 0.2, 1.0));
    assert!(strongest(off_s - 0.005, 1.0) < 0.03);
    let last = run.batches().pop().expect("telemetry goes on for a while");
    assert_eq!((last.state, last.fault), (State::Fault, Some(control::Fault::CommandTooOld)));
    assert_eq!(run.counters.ticks, 6000, "the loop goes on");
    // Who was silent for 2 s has gone: telemetry is not for nobody.
    let mut telemetry = run.messages().into_iter().filter(|(_, told)| matches!(told, Report::Telemetry(_)));
    let told_us = telemetry.next_back().expect("some").0 - last_us;
    assert!((1_980_000..2_030_000).contains(&told_us), "{told_us}");
}

#[test]
fn a_heartbeat_alone_keeps_the_motor_going() {
    let run = Trial::punctual(2).run(6.0, driving(6.0));
    let orders = run.said.iter().filter(|said| matches!(said.order, Downlink::Request(_))).count();
    assert_eq!(orders, 2, "said once each");
    let since_us = run.actuations().into_iter().find(|(_, told)| told.enable).expect("driven").0;
    assert!(since_us < 150_000, "{since_us}");
    let on = run.actuations().into_iter().filter(|(at_us, _)| *at_us >= since_us);
    assert!(on.clone().all(|(_, told)| told.enable) && on.count() > 5800);
}

#[test]
fn a_tick_converts_decides_and_feeds_the_watchdog_last() {
    let run = Trial::punctual(2).run(1.0, driving(1.0));
    assert_eq!(
        run.events[..2].iter().map(|(_, event)| event.clone()).collect::<Vec<_>>(),
        [Event::Booted(Reset::PowerOn), Event::Applied(Actuation::OFF)]
    );
    let own: Vec<_> = run.events[2..]
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
    let mut trial = Trial::punctual(2);
    trial.injected_events = vec![(2_000_000, InjectedEvent::ProcessorHold(0, 60_000_000))];
    let run = trial.run(4.0, driving(4.0));
    let last_feed = *ticks(&run).iter().rfind(|at_us| **at_us < 2_030_000).expect("some");
    assert!((1_999_000..2_002_000).contains(&last_feed), "{last_feed}");
    assert_eq!(run.times(|event| *event == Event::Fell), [last_feed + WATCHDOG_US]);
    assert_eq!(run.count(|event| *event == Event::Booted(Reset::Watchdog)), 1);
    assert!(run.last_on_us().expect("it drove") <= last_feed, "and drives no more");
    assert!(run.counters.ticks > 1890, "it ticks again: {}", run.counters.ticks);
    assert!(run.sent().iter().all(|(at_us, ..)| *at_us < last_feed), "nobody is told anything without a session");
}

#[test]
fn the_watchdog_bears_with_the_erasing_of_a_sector_at_rest_and_with_nothing_while_the_motor_is_driven() {
    // At rest, for as long as the flash's data sheet allows; then while it drives, a little less and a little more than allowed.
    for (driven_us, bitten) in [(WATCHDOG_US - 2_000, false), (WATCHDOG_US + 1_000, true)] {
        let mut trial = Trial::punctual(2);
        trial.injected_events = vec![
            (500_000, InjectedEvent::ProcessorHold(0, 400_000)),
            (2_000_000, InjectedEvent::ProcessorHold(0, driven_us)),
        ];
        let run = trial.run(3.0, |console| async move {
            until(1.3).await;
            ready(&console).await;
            assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
            until(3.0).await;
        });
        let boots = run.times(|event| *event == Event::Booted(Reset::Watchdog));
        assert_eq!(boots.len(), usize::from(bitten), "{driven_us}");
        assert!(boots.iter().all(|at| (2_000_000..2_000_000 + WATCHDOG_US + 2_000).contains(at)), "{boots:?}");
        // It is impatient from before the bridge is on until after it is off.
        let mut patience = WatchdogTimeout::Starting;
        for (at_us, event) in &run.events {
            match event {
                Event::Expected(changed) => patience = *changed,
                Event::Booted(_) => patience = WatchdogTimeout::Starting,
                Event::Applied(told) => assert!(!told.enable || patience == WatchdogTimeout::Driving, "{at_us} us"),
                _ => {}
            }
        }
        assert_eq!(patience == WatchdogTimeout::Driving, !bitten);
    }
}

#[test]
fn a_tick_that_takes_too_long_costs_its_periods_and_is_not_made_up_for() {
    let mut trial = Trial::punctual(2);
    // Takes 3.3 ms and four conversions: over three periods.
    trial.injected_events = vec![(1_999_500, InjectedEvent::ProcessorHold(0, 3_300))];
    let run = trial.run(5.0, driving(5.0));
    assert_eq!((run.counters.ticks, run.counters.missed_deadlines), (4997, 3));
    let ends = ticks(&run);
    let around: Vec<u64> = ends.iter().copied().filter(|at| (1_999_000..2_006_000).contains(at)).collect();
    assert_eq!(around, [1_999_148, 2_003_448, 2_004_148, 2_005_148]);
    let told = run.statuses().into_iter().map(|(_, status)| status.counters);
    let told: Vec<_> = told.map(|c| (c.longest_tick_us, c.shortest_period_us, c.longest_period_us)).collect();
    // Told once.
    let usual = (148, 1000, 1000);
    assert_eq!(told, [usual, usual, (3_448, 1000, 4000), usual, usual]);
    let driven = run.actuations().into_iter().filter(|(at, _)| *at > 1_000_000);
    assert!(driven.into_iter().all(|(_, told)| told.enable), "it drives on");
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
        let mut trial = Trial::punctual(2);
        trial.busy = vec![ProcessorHold { at_us: 1_000_900, for_us: late_us + 100 }];
        let run = trial.run(2.0, driving(2.0));
        let around: Vec<u64> = ticks(&run).into_iter().filter(|at| *at > 1_001_000).take(3).collect();
        assert_eq!(around, ends, "{late_us} us late");
        assert_eq!(run.counters.missed_deadlines, missed, "{late_us} us late");
        assert_eq!(run.counters.ticks + missed, 2000);
    }
}

#[test]
fn a_processor_that_is_too_slow_is_not_driven_ticks_every_other_period_and_the_radio_goes_on() {
    let mut trial = Trial::punctual(2);
    trial.setup.robots[0].conversion_us = 300;
    let run = trial.run(3.0, |console| async move {
        ready(&console).await;
        until(0.5).await;
        let answer = give(&console, DRIVE).await;
        assert!(matches!(answer, Some(Answer::Refused(Refusal::NotReady(Unready::LoopStarved(_))))), "{answer:?}");
    });
    assert_eq!(run.last_on_us(), None);
    assert_eq!((run.counters.ticks, run.counters.missed_deadlines), (1500, 1499));
    assert_eq!(periods(&run, 2000).len(), 1500);
    assert_eq!(run.counters.received as usize, run.said.len());
    assert_eq!(run.counters.rows_dropped, 0);
    assert!(run.statuses().len() == 3 && run.batches().len() > 1350, "{}", run.batches().len());
}

#[test]
fn a_clock_that_jitters_and_one_that_leaps() {
    let mut trial = Trial::punctual(2);
    trial.injected_events = vec![(1_000_000, InjectedEvent::Jitter(0, 300)), (2_000_000, InjectedEvent::Jitter(0, 0))];
    let run = trial.run(3.0, driving(3.0));
    assert_eq!(run.counters.missed_deadlines, 0);
    let late = |from_us: u64, to_us: u64| {
        let ends = ticks(&run).into_iter().filter(|at_us| (from_us..to_us).contains(at_us));
        ends.map(|at_us| at_us % 1000 - TICK_US).max().expect("some")
    };
    assert_eq!((late(0, 1_000_000), late(2_002_000, 3_000_000)), (0, 0));
    assert!((200..=300).contains(&late(1_000_000, 2_000_000)), "{}", late(1_000_000, 2_000_000));
    assert!(run.last_on_us().expect("driven") > 2_998_000, "{:?}", run.batches().last());

    let mut trial = Trial::punctual(2);
    trial.injected_events = vec![(1_000_500, InjectedEvent::Leap(0, 3_000_000))];
    let run = trial.run(2.0, driving(2.0));
    let bound_us = (SETTINGS.parameters.supervisor.clock.bound * 1e6) as u64;
    let on_us = run.last_on_us().expect("driven");
    println!("after a leap of the clock the bridge is on until {on_us} us, bound {bound_us} us");
    assert!(run.counters.missed_deadlines >= 2999, "{:?}", run.counters);
}

#[test]
fn a_slow_radio_keeps_neither_answers_nor_the_status_waiting_behind_telemetry() {
    let mut trial = Trial::punctual(2);
    // Every message takes longer than ten rows: telemetry alone would fill the radio.
    trial.injected_events = vec![(0, InjectedEvent::SlowRadio(0, 11_500))];
    let waited = Rc::new(RefCell::new(Vec::new()));
    let noted = Rc::clone(&waited);
    let run = trial.run(10.0, |console| async move {
        ready(&console).await;
        for number in 1..80 {
            until(0.1234 * f64::from(number)).await;
            let before_us = testbed::time::now_us();
            assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
            noted.borrow_mut().push(testbed::time::now_us() - before_us);
        }
    });
    assert!(run.counters.rows_dropped > 1000);
    // Behind the message that is underway.
    let longest = *waited.borrow().iter().max().expect("some");
    assert!(longest < 17_500, "{longest} us");
    let times: Vec<u64> = run.statuses().into_iter().map(|(at_us, _)| at_us).collect();
    // Behind the message that is underway and an answer.
    assert!(times.len() == 10 && times.windows(2).all(|pair| pair[1] - pair[0] < 1_027_000), "{times:?}");
}

fn numbered(number: u16, request: Request) -> Downlink {
    Downlink::Request(RequestFrame { number, deadline_ms: 60_000, request })
}

#[test]
fn answers_that_the_radio_cannot_take_are_counted() {
    // A new command every 5 ms, and a radio that is stuck in one message, for less than its limit.
    let mut trial = Trial::punctual(2);
    trial.injected_events = vec![(500_000, InjectedEvent::SlowRadio(0, 60_000_000))];
    let run = trial.run(1.4, |console| async move {
        ready(&console).await;
        until(0.6).await;
        for number in 0..100 {
            console.say(numbered(number, Request::Get(0))).await;
            until(0.61 + 0.005 * f64::from(number)).await;
        }
    });
    assert_eq!(run.counters.answers_dropped, 100 - 12, "the queue holds 12");
    assert_eq!(run.count(|event| *event == Event::SendDropped), 0);
}

#[test]
fn an_answer_that_was_lost_is_given_again_to_a_repetition() {
    // Forty commands while the radio is stuck in a message, then the last one on and on.
    let mut trial = Trial::punctual(2);
    trial.injected_events =
        vec![(200_000, InjectedEvent::SlowRadio(0, 300_000)), (300_000, InjectedEvent::SlowRadio(0, 0))];
    let command = |index: u16| Request::Command(Command::Speed { omega: 40.0 + 0.01 * f32::from(index) });
    let run = trial.run(2.0, move |console| async move {
        ready(&console).await;
        until(0.25).await;
        for index in 0..40 {
            console.say(numbered(index, command(index))).await;
            until(0.25 + 0.005 * f64::from(index)).await;
        }
        for _ in 0..10 {
            console.say(numbered(39, command(39))).await;
            until(testbed::time::now_us() as f64 * 1e-6 + 0.05).await;
        }
    });
    // The repetitions until the radio was free again found no room either.
    assert!((28..32).contains(&run.counters.answers_dropped), "{}", run.counters.answers_dropped);
    let answers = run.answers();
    assert_eq!(answers.len() + run.counters.answers_dropped as usize, 1 + 40 + 10);
    let heard: Vec<u64> = answers.into_iter().filter(|answer| answer.1 == 39).map(|(at_us, ..)| at_us).collect();
    assert!(heard.len() >= 7, "every repetition from then on is answered: {heard:?}");
    assert!(heard[0] < 600_000);
}

#[test]
fn of_too_many_orders_the_oldest_are_dropped_and_counted_and_the_last_counts() {
    let mut trial = Trial::punctual(2);
    // Nobody serves them for 20 ms.
    trial.busy = vec![ProcessorHold { at_us: 1_000_000, for_us: 20_000 }];
    let run = trial.run(1.5, |console| async move {
        ready(&console).await;
        assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
        until(0.96).await;
        console.beat(false);
        until(0.98).await;
        console.say(console.heartbeat()).await;
        until(1.001).await;
        for number in 0..19 {
            console.say(numbered(number, Request::Command(DRIVE))).await;
        }
        console.say(numbered(19, Request::Command(Command::Coast))).await;
    });
    // The radio holds ten, the queue twelve.
    assert_eq!(run.air.overflowed, 10);
    assert_eq!(run.counters.lost, 10);
    assert_eq!(run.counters.commands_dropped, 0, "what the radio holds fits");
    assert!((1_018_000..1_022_000).contains(&run.last_on_us().expect("driven")), "{:?}", run.last_on_us());
}

/// The parts of a robot that nothing else is known of.
fn parts(robot: hal_sim::SimulatedRobot, event_log: &EventLog) -> Parts<Board, Board, Board> {
    let plant = Rc::new(RefCell::new(Plant::new(robot, 3, 37)));
    let board = Board::new(&plant, &Power::new(|| {}), event_log);
    Parts { converter: board.clone(), bridge: board.clone(), watchdog: board }
}

/// A converter with codes that a test wrote down; the last one from then on.
struct Written {
    codes: std::collections::VecDeque<u16>,
    last: u16,
}

impl Converter for Written {
    fn angle(&mut self) -> AdcCode {
        AdcCode(self.codes.pop_front().unwrap_or(self.last))
    }

    fn battery(&mut self) -> AdcCode {
        AdcCode(2048)
    }
}

/// Lends what lives as long as the test.
fn lent<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

#[test]
fn the_median_is_what_the_controller_sees_and_conversions_far_from_it_are_counted() {
    let (event_log, shared) = (EventLog::new(Detail::Everything), lent(Shared::new()));
    let settings: &Settings = lent(Settings { conversions: 5, outlier_lsb: 100, ..SETTINGS.clone() });
    let spikes = [2000, 2010, 4095, 1990, 2005, 2001, 1000, 0, 2101, 2102];
    let Parts { bridge, watchdog, .. } = parts(punctual(1), &event_log);
    let parts = Parts { converter: Written { codes: spikes.into(), last: 2000 }, bridge, watchdog };
    let mut controller = Controller::new(&settings.parameters).expect("sound");
    let mut world = World::new();
    let processor = world.processor();
    world.spawn(processor, async move { control_loop(parts, &mut controller, settings, shared).await });
    world.run_until(30_000);
    // Of the first five, 4095; of the second, whose median is 2001, 1000, 0 and 2102.
    assert_eq!(shared.counters().adc_outliers, 4);
}

#[test]
fn without_a_controller_the_led_says_so() {
    let (event_log, shared) = (EventLog::new(Detail::Everything), lent(Shared::new()));
    let mut world = World::new();
    let processor = world.processor();
    world.spawn(processor, led(StatusLed::new(&event_log), shared));
    world.run_until(999_999);
    assert_eq!(event_log.events().iter().filter(|(_, event)| matches!(event, Event::Lit(_))).count(), 20, "10 Hz");
    assert_eq!(shared.shown(), Shown::NotStarted);
}

#[test]
fn being_woken_for_nothing_makes_no_tick() {
    let (event_log, shared) = (EventLog::new(Detail::Everything), lent(Shared::new()));
    let parts = parts(punctual(1), &event_log);
    let controller = Controller::new(&SETTINGS.parameters).expect("sound");
    let alarm = async {
        loop {
            Timer::after_micros(170).await;
        }
    };
    let mut world = World::new();
    let processor = world.processor();
    // Polled together: every alarm wakes both.
    world.spawn(processor, join(control_loop(parts, controller, &SETTINGS, shared), alarm));
    world.run_until(99_999);
    let times: Vec<u64> =
        event_log.take().into_iter().filter(|(_, event)| *event == Event::Fed).map(|(at, _)| at).collect();
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
    fn expect(&mut self, _: WatchdogTimeout) {}
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
    // The controller, as an argument and in the loop, one more while it is retuned, and little more.
    assert!(size < 2 * size_of::<Controller>() + 1024, "{size}");
}

#[test]
fn telemetry_and_status_wait_for_an_answer_that_is_ready() {
    let mut trial = Trial::punctual(2);
    // While one message takes 30 ms, an answer, telemetry and the status get ready.
    trial.injected_events =
        vec![(900_000, InjectedEvent::SlowRadio(0, 200_000)), (901_000, InjectedEvent::SlowRadio(0, 200_000))];
    let run = trial.run(2.0, |console| async move {
        ready(&console).await;
        until(0.95).await;
        console.say(numbered(7, Request::Get(0))).await;
    });
    let after: Vec<_> = run.messages().into_iter().filter(|(at_us, _)| *at_us > 950_000).take(3).collect();
    let kinds: Vec<char> = after
        .iter()
        .map(|(_, message)| match message {
            Report::Answer { number: 7, .. } => 'a',
            Report::Answer { .. } => '?',
            Report::Status(_) => 's',
            Report::Telemetry(_) => 't',
        })
        .collect();
    assert_eq!(kinds, ['a', 's', 't'], "{after:?}");
}
