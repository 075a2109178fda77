//! Who the robot obeys, what counts once, and what is too late.

use crate::common::{CALM, DRIVE, Trial, driving, give, ready, until};
use control::parameters::table;
use control::protocol::VERSION;
use control::protocol::radio::{Answer, Downlink, Request, RequestFrame, Reset, Source};
use control::{Command, Fault, Refusal, State};
use hal_sim::radio::{BROADCAST, Trouble};
use testbed::console::Console;
use testbed::event_log::Event;
use testbed::injected_event::InjectedEvent;
use testbed::setup::{DONGLE, address, pairing};
use testbed::time::now_us;

/// On the robot's clock, which begins with the bench's.
fn by(number: u16, deadline_ms: u32, request: Request) -> Downlink {
    Downlink::Request(RequestFrame { number, deadline_ms, request })
}

const COAST: Request = Request::Command(Command::Coast);

#[test]
fn an_order_that_is_repeated_is_done_once_and_answered_each_time() {
    let run = Trial::punctual(2).run(2.0, |console| async move {
        ready(&console).await;
        let drive = Request::Command(DRIVE);
        for _ in 0..3 {
            console.say(by(7, 5_000, drive)).await;
        }
        until(0.5).await;
        console.say(by(8, 5_000, COAST)).await;
        until(0.6).await;
        console.say(by(8, 5_000, COAST)).await;
        console.say(by(9, 5_000, drive)).await;
        until(1.0).await;
        console.say(Downlink::Stop).await;
        // The radio or the console says the last thing again.
        console.say(by(9, 5_000, drive)).await;
    });
    let answered = |wanted: u16| {
        let answers = run.answers().into_iter().filter(|(_, number, _)| *number == wanted);
        answers.map(|(.., answer)| answer).collect::<Vec<_>>()
    };
    assert_eq!(answered(7), [Answer::Done(None); 3]);
    assert_eq!(answered(8), [Answer::Done(None); 2]);
    assert_eq!(answered(9), [Answer::Done(None); 2]);
    assert!((1_000_000..1_004_000).contains(&run.last_on_us().expect("driven")), "{:?}", run.last_on_us());
}

#[test]
fn an_order_after_its_deadline_is_too_late() {
    let run = Trial::punctual(2).run(1.5, |console| async move {
        ready(&console).await;
        until(0.9).await;
        assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
        until(1.0).await;
        console.say(by(3, 1000, COAST)).await;
        console.say(by(4, 999, COAST)).await;
        console.say(by(5, 1010, Request::Get(0))).await;
        // More than half a round of the clock ahead is behind.
        console.say(by(6, 1500 + (1 << 31), COAST)).await;
    });
    let answers = run.answers();
    let answer = |wanted: u16| answers.iter().find(|(_, number, _)| *number == wanted).expect("answered").2;
    assert_eq!((answer(3), answer(4), answer(6)), (Answer::TooLate, Answer::TooLate, Answer::TooLate));
    assert!(matches!(answer(5), Answer::Done(Some(_))));
    assert_eq!(run.counters.too_late, 3);
    assert!(run.last_on_us().expect("driven") > 1_499_000);
}

#[test]
fn stop_opens_the_bridge_in_the_next_tick_also_when_everybody_is_told() {
    for broadcast in [false, true] {
        let run = Trial::punctual(2).run(1.5, move |console| async move {
            ready(&console).await;
            give(&console, DRIVE).await;
            until(1.0).await;
            let frame = console.seal(Downlink::Stop).expect("a session");
            console.send(if broadcast { BROADCAST } else { address(0) }, &frame).await;
        });
        let stop = run.said.iter().find(|said| said.order == Downlink::Stop).expect("said").frame.clone();
        let arrived_us = run.events.iter().find_map(|(_, event)| match event {
            Event::Heard { arrived_us, payload, .. } if *payload == stop => Some(*arrived_us),
            _ => None,
        });
        let (arrived_us, on_us) = (arrived_us.expect("heard"), run.last_on_us().expect("driven"));
        // The next tick, which takes four conversions, opens it.
        assert!(on_us <= arrived_us + 148 && arrived_us < on_us + 1148, "{arrived_us} {on_us}");
        assert!(run.batches().last().is_some_and(|batch| batch.state == State::Idle));
    }
}

#[test]
fn the_console_s_stop_is_repeated_until_telemetry_says_so() {
    let mut trial = Trial::punctual(2);
    trial.air = Trouble {
        loss_share: Some(0.85),
        quiet_loss_share: Some(0.85),
        burst_loss_share: Some(0.85),
        burst_us: Some(0),
        ..CALM
    };
    let run = trial.run(3.0, |console| async move {
        ready(&console).await;
        give(&console, DRIVE).await;
        until(1.0).await;
        console.stop().await;
    });
    let last_us = run.last_on_us().expect("driven");
    assert!((1_000_000..1_300_000).contains(&last_us), "{last_us}");
    assert!(run.said.last().is_some_and(|said| matches!(said.order, Downlink::Heartbeat { .. })), "and then no more");
}

#[test]
fn a_new_session_begins_with_the_motor_off_and_the_old_one_is_over() {
    let run = Trial::punctual(2).run(3.0, |console| async move {
        ready(&console).await;
        give(&console, DRIVE).await;
        until(1.0).await;
        let kept = console.seal(console.heartbeat()).expect("a session");
        console.begin().await;
        until(1.5).await;
        console.send(address(0), &kept).await;
        until(2.0).await;
        assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)), "no fault");
    });
    let off: Vec<u64> =
        run.actuations().into_iter().filter(|(at, told)| *at > 900_000 && !told.enable).map(|(at, _)| at).collect();
    assert!((1_000_000..1_040_000).contains(&off[0]), "{}", off[0]);
    assert!(off.len() > 950, "{}", off.len());
    assert_eq!(run.counters.forged, 1, "the frame of the old session");
}

#[test]
fn a_replayed_call_ends_no_session_and_replayed_orders_do_nothing() {
    let run = Trial::punctual(2).run_besides(
        3.0,
        |console| async move {
            ready(&console).await;
            give(&console, DRIVE).await;
        },
        |console, ether| async move {
            until(1.0).await;
            let recorded: Vec<Vec<u8>> = console
                .radio()
                .iter()
                .filter_map(|(_, event)| if let Event::Sending(_, frame) = event { Some(frame.clone()) } else { None })
                .collect();
            for frame in recorded {
                ether.inject(DONGLE, address(0), &frame);
                testbed::time::until(now_us() + 5_000).await;
            }
        },
    );
    assert!(run.last_on_us().expect("driven") > 2_999_000);
    assert!(run.counters.outdated > 15, "{:?}", run.counters);
    assert_eq!((run.counters.forged, run.counters.lost), (0, 0));
}

#[test]
fn a_console_of_another_version_is_told_once_a_second() {
    let run = Trial::punctual(2).run(2.6, |console| async move {
        let mut hello = vec![0; 29];
        hello[..4].copy_from_slice(&(VERSION ^ 1).to_le_bytes());
        hello[4] = 1;
        until(0.05).await;
        for _ in 0..50 {
            console.send(address(0), &hello).await;
            testbed::time::until(now_us() + 48_000).await;
        }
    });
    assert_eq!(run.notices, 3);
    assert_eq!(run.counters.other_version, 50);
    assert_eq!(run.counters.received, 0);
}

#[test]
fn a_console_with_another_key_is_not_answered() {
    let mut trial = Trial::punctual(2);
    // The radio's own keys are right: only the signature is not.
    let mut other = trial.setup.robots[0].pairing.clone().expect("paired");
    other.key = pairing(other.console, 99, 0).key;
    trial.setup.robots[0].pairing = Some(other);
    let run = trial.run(1.0, |console| async move { console.begin().await });
    assert!(run.sent().is_empty() && run.counters.forged > 20, "{:?}", run.counters);

    let mut trial = Trial::punctual(2);
    let mut other = trial.setup.robots[0].pairing.clone().expect("paired");
    other.local = [1; 16];
    trial.setup.robots[0].pairing = Some(other);
    let run = trial.run(1.0, |console| async move { console.begin().await });
    assert!(
        run.sent().is_empty() && run.counters.forged == 0,
        "the radio does not even decrypt it: {:?}",
        run.counters
    );
}

#[test]
fn a_heartbeat_that_somebody_held_back_keeps_nothing_going() {
    let run = Trial::punctual(2).run_besides(
        3.0,
        |console| async move {
            ready(&console).await;
            give(&console, DRIVE).await;
            until(1.0).await;
            console.beat(false);
        },
        |console, ether| async move {
            until(1.02).await;
            // A hundred frames that never came, let go one by one.
            let held: Vec<_> = (0..100).filter_map(|_| console.seal(console.heartbeat())).collect();
            assert_eq!(held.len(), 100);
            until(1.06).await;
            for frame in held {
                ether.inject(DONGLE, address(0), &frame);
                testbed::time::until(now_us() + 20_000).await;
            }
        },
    );
    let last_us = run.last_on_us().expect("driven");
    assert!((1_480_000..1_540_000).contains(&last_us), "{last_us}");
    assert!(run.counters.received > 90, "they are the console's own: {:?}", run.counters);
}

#[test]
fn out_of_reach_and_back_needs_a_person() {
    let mut trial = Trial::punctual(2);
    trial.injected_events =
        vec![(1_000_000, InjectedEvent::Place(0, 1000.0)), (2_000_000, InjectedEvent::Place(0, 1.0))];
    let run = trial.run(3.5, driving(3.5));
    let last_us = run.last_on_us().expect("driven");
    assert!((1_400_000..1_550_000).contains(&last_us), "{last_us}");
    let batch = run.batches().pop().expect("it is heard again");
    assert_eq!((batch.state, batch.fault), (State::Fault, Some(Fault::CommandTooOld)));
}

/// Index of a parameter that every robot has.
fn index(name: &str) -> u16 {
    let found = (0..).zip(table::TABLE).find(|(_, entry)| entry.name == name);
    found.unwrap_or_else(|| panic!("no parameter {name}")).0
}

async fn drive_and_save(console: &Console, index: u16) {
    ready(console).await;
    let Some(Answer::Done(Some(before))) = console.order(Request::Get(index)).await else { panic!("a value") };
    let wanted = before.factory * 1.1;
    let set = console.order(Request::Set { index, value: wanted }).await;
    assert!(matches!(set, Some(Answer::Done(Some(now))) if (now.now - wanted).abs() < 1e-4 * wanted), "{set:?}");
    give(console, DRIVE).await;
    assert_eq!(console.order(Request::Save).await, Some(Answer::Refused(Refusal::Driving)));
    assert_eq!(console.order(Request::Factory).await, Some(Answer::Refused(Refusal::Driving)));
    console.stop().await;
    assert_eq!(console.order(Request::Save).await, Some(Answer::Done(None)));
}

#[test]
fn parameters_are_kept_at_rest_and_not_while_driving() {
    let name = "controller.position.proportional_v_per_rad";
    let index = index(name);
    let mut trial = Trial::punctual(2);
    trial.injected_events = vec![(3_000_000, InjectedEvent::Boot(0, Reset::External))];
    let run = trial.run(6.0, move |console| async move {
        drive_and_save(&console, index).await;
        until(3.1).await;
        ready(&console).await;
        let Some(Answer::Done(Some(kept))) = console.order(Request::Get(index)).await else { panic!("a value") };
        assert!((kept.now / kept.factory - 1.1).abs() < 1e-3, "{kept:?}");
        assert_eq!(console.order(Request::Factory).await, Some(Answer::Done(None)));
        let Some(Answer::Done(Some(factory))) = console.order(Request::Get(index)).await else { panic!("a value") };
        assert_eq!(factory.now.to_bits(), factory.factory.to_bits());
    });
    let status = run.statuses().pop().expect("a status").1;
    assert_eq!((status.parameters, status.reset), (Source::Stored, Reset::External));
    // The flash is written only while the bridge is off.
    for at_us in run.times(|event| *event == Event::Flashed) {
        let told = run.events.iter().take_while(|(time_us, _)| *time_us <= at_us);
        let last =
            told.filter_map(|(_, event)| if let Event::Applied(told) = event { Some(told.enable) } else { None });
        assert_eq!(last.last(), Some(false), "at {at_us} us");
    }
    assert!(run.count(|event| *event == Event::Flashed) > 2);
    assert_eq!(run.count(|event| *event == Event::Booted(Reset::Watchdog)), 0);
}
