//! What ends with a reset of the dongle, and what does not.

use std::path::Path;

use control::protocol::dongle::FromDongle;
use control::protocol::radio::Reset;
use embassy_time::Timer;
use hal_sim::radio::LONGEST_HEARD;
use robot_file::Robot;
use shell::board::{Sent, WatchdogTimeout};
use shell::bounded::REFUSED;
use testbed::bench::Bench as Whole;
use testbed::injected_event::InjectedEvent;
use testbed::serial::Cable;
use testbed::setup::Setup;

use super::rig::{DongleRig, Fate, Script, decode, number};

/// A host that sends a message every 10 ms for so many seconds, as long as the dongle runs.
fn chatter(rig: &DongleRig, seconds: u32) -> Script {
    let console = rig.clone();
    Box::pin(async move {
        for number in (0..seconds * 100).take_while(|_| console.power.is_running()) {
            console.send(number);
            Timer::after_millis(10).await;
        }
    })
}

/// For so many seconds from the second second on the driver has no buffer.
fn refused_for(number: u32, seconds: f64) -> (u64, Sent) {
    let after_s = f64::from(number) * 0.01 - 1.0;
    if (0.0..seconds).contains(&after_s) { (0, Sent::Refused) } else { (1500, Sent::Acknowledged) }
}

#[test]
fn a_send_that_never_ends_ends_with_a_reset_and_nothing_is_sent_after_it() {
    let rig = DongleRig::new();
    let stuck: Fate =
        |number| if number == 100 { (3_600_000_000, Sent::Acknowledged) } else { (1500, Sent::Acknowledged) };
    assert_eq!(rig.run(1_900_000, stuck, vec![chatter(&rig, 5)]).reset, None, "within its limit");

    let rig = DongleRig::new();
    assert_eq!(rig.run(5_000_000, stuck, vec![chatter(&rig, 5)]).reset, Some(Reset::Radio));
    let sent = rig.radio.sent();
    assert_eq!(
        (sent.len(), sent.last().map(|(at_us, payload)| (*at_us, number(payload)))),
        (101, Some((1_000_000, 100)))
    );
    assert_eq!(rig.counters().sent, 100);
}

#[test]
fn a_driver_that_refuses_for_long_is_reset_and_one_that_recovers_is_not() {
    let rig = DongleRig::new();
    let end = rig.run(8_000_000, |number| refused_for(number, 1.9), vec![chatter(&rig, 7)]);
    assert_eq!(end.reset, None);
    let counters = rig.counters();
    assert_eq!((counters.send_refused, counters.send_failed, counters.sent), (190, 190, 510));

    let rig = DongleRig::new();
    let end = rig.run(8_000_000, |number| refused_for(number, 60.0), vec![chatter(&rig, 7)]);
    assert_eq!(end.reset, Some(Reset::Radio));
    assert_eq!(rig.radio.sent().len(), 101 + (REFUSED.as_millis() / 10) as usize);
}

#[test]
fn nobody_s_acknowledgement_is_no_fault() {
    let rig = DongleRig::new();
    let end = rig.run(30_000_000, |_| (5_000, Sent::Unheard), vec![chatter(&rig, 30)]);
    assert_eq!((end.reset, rig.counters().send_failed), (None, 3000));
}

#[test]
fn the_watchdog_is_fed_by_an_idle_dongle_and_by_one_whose_host_has_gone() {
    for cable in [Cable::Reading, Cable::Idle, Cable::Gone, Cable::Broken] {
        let rig = DongleRig::new();
        let usb = rig.usb.clone();
        let host: Script = Box::pin(async move {
            Timer::after_millis(1500).await;
            usb.plug(cable);
        });
        let end = rig.run(20_000_000, |_| (1500, Sent::Unheard), vec![host, rig.robot_talks(50_000, 0..300)]);
        let left_us = end.bites_us - 20_000_000;
        assert!(
            (WatchdogTimeout::Resting.us() / 2..=WatchdogTimeout::Resting.us()).contains(&left_us),
            "{cable:?}: {left_us} us left"
        );
    }
}

fn whole() -> Whole {
    let robot = Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).expect("robot.toml is sound");
    Whole::new(Setup::new(&robot, 0, 1).expect("robot.toml has all"))
}

fn hellos(rig: &Whole) -> usize {
    let line = &rig.dongle.as_ref().expect("there is one").line;
    decode(&line.take()).0.iter().filter(|message| matches!(message, FromDongle::Hello { .. })).count()
}

#[test]
fn a_program_that_comes_to_nothing_is_reset_by_the_watchdog_and_the_host_hears_of_it() {
    let mut rig = whole();
    rig.run_until(10_000_000);
    assert_eq!((rig.dongle.as_ref().map(|dongle| dongle.boots()), hellos(&rig)), (Some(1), 1));
    rig.apply(InjectedEvent::DongleSpins);
    rig.run_until(10_000_000 + WatchdogTimeout::Resting.us() / 2);
    assert_eq!(rig.dongle.as_ref().map(|dongle| dongle.boots()), Some(1));
    rig.run_until(10_000_000 + WatchdogTimeout::Resting.us() + 20_000);
    assert_eq!((rig.dongle.as_ref().map(|dongle| dongle.boots()), hellos(&rig)), (Some(2), 1));
    rig.run_until(30_000_000);
    assert_eq!(rig.dongle.as_ref().map(|dongle| dongle.boots()), Some(2));
}

#[test]
fn a_stuck_radio_of_the_dongle_ends_with_its_reset_once_the_host_sends() {
    for injected_event in [InjectedEvent::DongleRadioStuck, InjectedEvent::DongleRadioFull] {
        let mut rig = whole();
        rig.run_until(1_000_000);
        rig.apply(injected_event);
        for step in 1..=50 {
            let line = &rig.dongle.as_ref().expect("there is one").line;
            let to = [9; 6];
            let message = control::protocol::dongle::ToDongle::Send { number: step, to, payload: super::payload(4) };
            assert!(line.write(&super::frame(&message)).is_ok());
            rig.run_until(1_000_000 + u64::from(step) * 100_000);
        }
        assert_eq!(
            (rig.dongle.as_ref().map(|dongle| dongle.boots()), hellos(&rig)),
            (Some(2), 2),
            "{injected_event:?}"
        );
    }
}

#[test]
fn no_flood_of_frames_of_any_length_resets_the_dongle_and_what_is_dropped_is_counted() {
    for (length, every_us) in [(LONGEST_HEARD, 100), (251, 50), (250, 50), (1, 20)] {
        let mut rig = whole();
        rig.at(1_000_000, InjectedEvent::Flood { every_us, length });
        rig.at(3_000_000, InjectedEvent::Flood { every_us: 0, length });
        rig.run_until(3_500_000);
        let dongle = rig.dongle.as_ref().expect("there is one");
        let counters = dongle.counters();
        assert_eq!(dongle.boots(), 1);
        let flood = 2_000_000 / every_us as u32;
        // Those in its own name do not reach it: half of what comes is somebody else's.
        let heard = if length > 250 { counters.too_long } else { counters.received + counters.overrun };
        assert!((flood / 3..flood).contains(&heard), "{length} bytes: {heard} of {flood}, {counters:?}");
        assert_eq!(if length > 250 { counters.received } else { counters.too_long }, 0);
        // It serves its host as before.
        drop(dongle.line.take());
        let count = super::frame(&control::protocol::dongle::ToDongle::Count);
        assert!(dongle.line.write(&count).is_ok());
        rig.run_until(3_600_000);
        let messages = decode(&rig.dongle.as_ref().expect("there is one").line.take()).0;
        assert!(
            messages
                .iter()
                .any(|message| matches!(message, FromDongle::Counted(told) if told.too_long == counters.too_long))
        );
    }
}
