//! A radio that sends nothing any more, and floods of frames of any length: the motor's failsafes hold their bounds, and nothing but
//! a broken radio resets the robot, at rest.

use crate::common::{DRIVE, Run, SETTINGS, Trial, driving, give, ready, until};
use control::protocol::radio::{Answer, Downlink, Reset};
use control::{Fault, State};
use hal_sim::radio::LONGEST_HEARD;
use shell::bounded::{LIMIT, REFUSED};
use testbed::console::Console;
use testbed::event_log::Event;
use testbed::injected_event::InjectedEvent;
use testbed::parts::ProcessorHold;

/// When the robot was reset for its radio, µs.
fn resets(run: &Run) -> Vec<u64> {
    run.times(|event| *event == Event::Booted(Reset::Radio))
}

/// Boots of any kind, the first included.
fn boots(run: &Run) -> usize {
    run.count(|event| matches!(event, Event::Booted(_)))
}

/// Silence must have cut the bridge so long after it began, µs.
fn silence_us() -> u64 {
    (SETTINGS.parameters.supervisor.command_old.bound * 1e6) as u64
}

/// Drives and beats to the end.
async fn drive(console: Console) {
    ready(&console).await;
    assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
    until(60.0).await;
}

#[test]
fn while_it_drives_a_stuck_or_full_radio_ages_the_heartbeats_and_the_bridge_is_off_before_the_reset() {
    for (injected_event, limit) in [(InjectedEvent::RadioStuck(0), LIMIT), (InjectedEvent::RadioFull(0), REFUSED)] {
        let mut trial = Trial::punctual(3);
        trial.injected_events = vec![(3_000_000, injected_event)];
        let run = trial.run(9.0, |console| async move {
            ready(&console).await;
            assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
            until(7.0).await;
            console.begin().await;
        });
        let off_us = run.last_on_us().expect("it drove");
        let reset_us = resets(&run);
        println!("{injected_event:?}: bridge off after {} us, reset after {:?}", off_us - 3_000_000, reset_us);
        assert!(off_us <= 3_000_000 + silence_us(), "{off_us}");
        assert_eq!((reset_us.len(), boots(&run)), (1, 2));
        assert!(reset_us[0] > off_us, "the motor is off by then");
        assert!(reset_us[0].abs_diff(3_000_000 + limit.as_micros()) < 50_000, "{reset_us:?}");
        // Once it is let go of, nothing is sent until the reset.
        let dropped = run.times(|event| *event == Event::SendDropped);
        assert_eq!(dropped.len(), usize::from(injected_event == InjectedEvent::RadioStuck(0)));
        let sends = run.times(|event| matches!(event, Event::Sending(..)));
        assert!(dropped.iter().all(|at| sends.iter().all(|send| send <= at || *send >= reset_us[0])));
        // It comes back with its fault, and says why it booted.
        assert!(
            run.batches().last().is_some_and(|last| (last.state, last.fault) == (State::Fault, Some(Fault::Restarted)))
        );
        assert_eq!(run.statuses().last().map(|(_, status)| status.reset), Some(Reset::Radio));
    }
}

#[test]
fn a_broken_radio_waits_for_the_motor_however_long_that_is_driven() {
    let mut trial = Trial::punctual(3);
    trial.injected_events = vec![(3_000_000, InjectedEvent::RadioStuck(0))];
    let run = trial.run(9.0, |console| async move {
        ready(&console).await;
        assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
        console.beat(false);
        // A console that makes up what it has heard: nothing ages.
        while testbed::time::now_us() < 6_000_000 {
            let heard_ms = Some((testbed::time::now_us() / 1000) as u32);
            console.say(Downlink::Heartbeat { heard_ms }).await;
            until(testbed::time::now_us() as f64 * 1e-6 + 0.05).await;
        }
    });
    let (off_us, reset_us) = (run.last_on_us().expect("it drove"), resets(&run));
    assert!((5_990_000..6_000_000 + silence_us()).contains(&off_us), "driven far beyond the limit of a send: {off_us}");
    assert!(reset_us.len() == 1 && (1..20_000).contains(&(reset_us[0] - off_us)), "{off_us} {reset_us:?}");
}

#[test]
fn at_rest_a_stuck_radio_is_reset_within_its_limit_and_works_again() {
    let mut trial = Trial::punctual(3);
    trial.injected_events = vec![(2_000_000, InjectedEvent::RadioStuck(0))];
    let run = trial.run(8.0, |console| async move {
        ready(&console).await;
        until(5.0).await;
        // A session anew, for the robot has forgotten the one before.
        ready(&console).await;
        assert_eq!(give(&console, DRIVE).await, Some(Answer::Done(None)));
        until(8.0).await;
    });
    let reset_us = resets(&run);
    assert!(reset_us.len() == 1 && reset_us[0] < 2_010_000 + LIMIT.as_micros() + 20_000, "{reset_us:?}");
    assert!(run.last_on_us().expect("it drives again") > 7_990_000);
}

#[test]
fn a_console_that_has_gone_is_no_reason_for_a_reset() {
    let mut trial = Trial::punctual(3);
    trial.injected_events = vec![(2_000_000, InjectedEvent::Place(0, 5000.0))];
    let run = trial.run(30.0, drive);
    assert_eq!(boots(&run), 1);
    assert!(run.counters.send_failed > 20, "{:?}", run.counters);
    assert!(run.last_on_us().expect("it drove") <= 2_000_000 + silence_us());
}

#[test]
fn no_flood_resets_the_robot_or_keeps_it_from_its_console_and_what_is_dropped_is_counted() {
    for (length, every_us) in [(LONGEST_HEARD, 100), (251, 100), (250, 100), (1, 50)] {
        let mut trial = Trial::punctual(3);
        trial.injected_events = vec![(1_000_000, InjectedEvent::Flood { every_us, length })];
        let run = trial.run(6.0, driving(4.0));
        assert_eq!(boots(&run), 1, "{length} bytes");
        let flood = 5_000_000 / every_us as u32;
        let c = run.counters;
        let rubbish = c.misunderstood + c.forged + c.outdated + c.other_version + c.overrun;
        println!(
            "{length} bytes every {every_us} us: {} too long, {} overrun, {rubbish} in all",
            c.too_long, c.overrun
        );
        if length > 250 {
            assert!((flood / 3..=flood).contains(&c.too_long), "{c:?}");
            assert_eq!(rubbish - c.overrun, 0, "none takes a place: {c:?}");
        } else {
            assert_eq!(c.too_long, 0);
            // The encrypted peer's name without its key comes to nothing in the radio.
            assert!((flood / 4..=flood).contains(&rubbish), "{c:?}");
        }
        // It drives on, and silence stops it in time.
        let off_us = run.last_on_us().expect("it drove");
        assert!((4_000_000..=4_000_000 + silence_us()).contains(&off_us), "{length} bytes: off at {off_us}");
    }
}

#[test]
fn a_flood_while_the_robot_is_kept_out_of_its_radio_pushes_the_oldest_out_and_is_counted() {
    let mut trial = Trial::punctual(3);
    trial.injected_events = vec![(1_000_000, InjectedEvent::Flood { every_us: 500, length: 200 })];
    trial.busy = (0..20).map(|number| ProcessorHold { at_us: 1_500_000 + number * 50_000, for_us: 20_000 }).collect();
    let run = trial.run(4.0, driving(3.0));
    assert_eq!(boots(&run), 1);
    assert!(run.counters.overrun > 200, "{:?}", run.counters);
    let off_us = run.last_on_us().expect("it drove");
    assert!(off_us <= 3_000_000 + silence_us(), "{off_us}");
}
