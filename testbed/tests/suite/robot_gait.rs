//! A gait through the robot's tasks: sent over the radio, kept in flash, played by the control loop, with a motor behind it.

use crate::common::{DRIVE, Run, Trial, give, ready, until};
use control::gait::Name;
use control::protocol::radio::{Answer, Batch, Request, Reset};
use control::{Command, Fault, Field, Gait, Refusal, State};
use testbed::console::Console;
use testbed::event_log::Event;
use testbed::injected_event::InjectedEvent;

const DONE: Option<Answer> = Some(Answer::Done(None));
/// rad/s.
const SPEEDS: [f32; 3] = [44.0, -40.0, 30.0];
const STEPS: [u8; 5] = [0, 1, 2, 1, 0];
const INTERVAL_MS: u16 = 400;

fn gait(speeds: &[f32], repeats: bool) -> Gait {
    Gait::new(Name::new("turn-left").expect("a name"), speeds, &[], &STEPS, INTERVAL_MS, repeats).expect("sound")
}

fn play(gait: &Gait) -> Command {
    Command::Gait { id: gait.id() }
}

async fn keep(console: &Console, gait: &Gait) -> Option<Answer> {
    console.order(Request::KeepGait(*gait)).await
}

/// Estimated speeds of the ticks in which the gait was played, rad/s, without a gap.
fn played(run: &Run) -> Vec<f32> {
    let batches = run.batches();
    let playing: Vec<&Batch> = batches.iter().filter(|batch| batch.state == State::Gait).collect();
    for pair in playing.windows(2) {
        assert_eq!(pair[1].first_tick - pair[0].first_tick, pair[0].rows.len() as u32, "nothing is lost on calm air");
    }
    playing.iter().flat_map(|batch| batch.rows.iter().map(|row| row.speed())).collect()
}

#[test]
fn the_shaft_follows_the_steps_each_for_its_ticks_and_then_turns_out() {
    let gait = gait(&SPEEDS, false);
    let run = Trial::punctual(1).run(4.0, move |console| async move {
        ready(&console).await;
        assert_eq!(give(&console, play(&gait)).await, Some(Answer::Refused(Refusal::NoGait)));
        assert_eq!(keep(&console, &gait).await, DONE);
        assert_eq!(give(&console, play(&gait)).await, DONE);
    });
    let speeds = played(&run);
    let interval = usize::from(INTERVAL_MS);
    assert_eq!(speeds.len(), STEPS.len() * interval, "every step for its ticks");
    for (step, held) in STEPS.iter().zip(speeds.chunks(interval)) {
        let wanted = SPEEDS[usize::from(*step)];
        let settled = &held[held.len() - 100..];
        let mean = settled.iter().sum::<f32>() / settled.len() as f32;
        assert!((mean / wanted - 1.0).abs() < 0.05, "{mean} rad/s instead of {wanted}");
    }
    // Alternating within a step or two: the shaft does turn round, and not only its estimate.
    let duties: Vec<f32> = run.actuations().iter().map(|(_, told)| told.duty).collect();
    assert!(duties.iter().any(|duty| *duty > 0.3) && duties.iter().any(|duty| *duty < -0.3));
    assert_eq!(run.batches().pop().map(|batch| (batch.state, batch.fault)), Some((State::Coast, None)));
    let label = run.statuses().pop().expect("a status").1.gait;
    assert_eq!(label, Some(gait.label()));
    assert_eq!(label.map(|label| label.name.as_str().to_owned()), Some("turn-left".to_owned()));
}

#[test]
fn a_step_that_swings_turns_the_shaft_back_at_its_angles() {
    let bounds = [-0.8, 1.8];
    let name = Name::new("swing").expect("a name");
    let gait = Gait::new(name, &[], &[bounds], &[0, 0], INTERVAL_MS, true).expect("sound");
    let run = Trial::punctual(3).run(4.0, move |console| async move {
        ready(&console).await;
        assert_eq!(keep(&console, &gait).await, DONE);
        assert_eq!(give(&console, play(&gait)).await, DONE);
        until(3.5).await;
    });
    let batches = run.batches();
    let playing = batches.iter().filter(|batch| batch.state == State::Gait);
    let angles: Vec<f32> = playing.flat_map(|batch| batch.rows.iter().map(|row| row.angle())).skip(500).collect();
    assert!(angles.len() > 1000, "{} ticks", angles.len());
    let reached = [f32::min, f32::max].map(|farther| angles.iter().copied().reduce(farther).expect("angles"));
    for (reached, bound) in reached.into_iter().zip(bounds) {
        assert!((reached - bound).abs() < 0.1, "{reached} rad instead of {bound}");
    }
}

#[test]
fn it_survives_a_restart_and_is_replaced_only_at_rest_by_one_that_can_be_played() {
    let (first, second) = (gait(&SPEEDS, true), gait(&[50.0, -50.0, 20.0], true));
    let too_fast = gait(&[44.0, -40.0, 100.0], true);
    let mut trial = Trial::punctual(2);
    trial.injected_events = vec![(3_000_000, InjectedEvent::Boot(0, Reset::External))];
    let run = trial.run(6.0, move |console| async move {
        ready(&console).await;
        assert_eq!(keep(&console, &first).await, DONE);
        let refused = keep(&console, &too_fast).await;
        let is_speed = |refusal| matches!(refusal, Refusal::OutOfRange { name: Field::GaitSpeed, .. });
        assert!(matches!(refused, Some(Answer::Refused(refusal)) if is_speed(refusal)), "{refused:?}");
        assert_eq!(give(&console, DRIVE).await, DONE);
        assert_eq!(keep(&console, &second).await, Some(Answer::Refused(Refusal::Driving)));
        assert_eq!(give(&console, play(&second)).await, Some(Answer::Refused(Refusal::NoGait)));
        assert_eq!(give(&console, play(&first)).await, DONE, "from one drive to the other");
        console.stop().await;
        until(3.1).await;
        ready(&console).await;
        assert_eq!(give(&console, play(&first)).await, DONE, "it was there before the restart");
        console.stop().await;
        assert_eq!(keep(&console, &second).await, DONE);
        assert_eq!(give(&console, play(&first)).await, Some(Answer::Refused(Refusal::NoGait)));
        assert_eq!(give(&console, play(&second)).await, DONE);
    });
    let labels: Vec<_> = run.statuses().into_iter().map(|(at_us, status)| (at_us, status.gait)).collect();
    let after = labels.iter().find(|(at_us, _)| *at_us > 3_000_000).expect("a status after the restart");
    assert_eq!(after.1, Some(first.label()));
    assert_eq!(labels.last().and_then(|(_, label)| *label), Some(second.label()));
    for at_us in run.times(|event| *event == Event::Flashed) {
        let told = run.events.iter().take_while(|(time_us, _)| *time_us <= at_us);
        let last =
            told.filter_map(|(_, event)| if let Event::Applied(told) = event { Some(told.enable) } else { None });
        assert_eq!(last.last(), Some(false), "the flash is written with the bridge off only: {at_us} us");
    }
}

#[test]
fn a_restart_anywhere_in_the_saving_leaves_the_old_gait_or_the_new_one() {
    let (old, new) = (gait(&SPEEDS, true), gait(&[50.0, -50.0, 20.0], false));
    let mut found = [0, 0];
    for offset_us in (0..40_000).step_by(2_500) {
        let mut trial = Trial::punctual(3);
        trial.injected_events = vec![(1_000_000 + offset_us, InjectedEvent::Boot(0, Reset::BrownOut))];
        let run = trial.run(3.0, move |console| async move {
            ready(&console).await;
            assert_eq!(keep(&console, &old).await, DONE);
            until(1.0).await;
            let _ = console.order(Request::KeepGait(new)).await;
        });
        let restarted = run.statuses().into_iter().find(|(_, status)| status.reset == Reset::BrownOut);
        let Some((_, status)) = restarted else { continue };
        match status.gait {
            Some(label) if label == old.label() => found[0] += 1,
            Some(label) if label == new.label() => found[1] += 1,
            other => panic!("{other:?} after {offset_us} us"),
        }
    }
    println!("old {} times, new {} times", found[0], found[1]);
}

#[test]
fn silence_in_the_middle_ends_with_the_bridge_off() {
    let gait = gait(&SPEEDS, true);
    let run = Trial::punctual(4).run(4.0, move |console| async move {
        ready(&console).await;
        assert_eq!(keep(&console, &gait).await, DONE);
        assert_eq!(give(&console, play(&gait)).await, DONE);
        until(2.0).await;
        console.beat(false);
    });
    let last_us = run.last_on_us().expect("driven");
    assert!((2_400_000..2_560_000).contains(&last_us), "{last_us}");
    let batch = run.batches().pop().expect("telemetry");
    assert_eq!((batch.state, batch.fault), (State::Fault, Some(Fault::CommandTooOld)));
}

#[test]
fn a_broken_wire_in_the_middle_ends_with_the_bridge_off() {
    let gait = gait(&SPEEDS, true);
    let mut trial = Trial::punctual(5);
    trial.injected_events = vec![(2_000_000, InjectedEvent::Fault(0, hal_sim::Fault::SensorOpen))];
    let run = trial.run(4.0, move |console| async move {
        ready(&console).await;
        assert_eq!(keep(&console, &gait).await, DONE);
        assert_eq!(give(&console, play(&gait)).await, DONE);
    });
    let last_us = run.last_on_us().expect("driven");
    assert!((2_000_000..2_800_000).contains(&last_us), "{last_us}");
    assert_eq!(run.batches().pop().map(|batch| batch.state), Some(State::Fault));
}
