//! Over the cable: who a robot obeys. The whole robot runs, in virtual time.

use std::path::Path;
use std::sync::LazyLock;

use control::protocol::VERSION;
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::pairing::{Pairing, PairingReply, PairingRequest};
use control::protocol::radio::{Answer, Request, Reset};
use control::{Command, Fault, State};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use testbed::bench::Bench;
use testbed::console::Console;
use testbed::event_log::Event;
use testbed::serial::Cable;
use testbed::setup::{DONGLE, Setup, address, pairing};

static ROBOT: LazyLock<robot_file::Robot> = LazyLock::new(|| {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
    robot_file::Robot::load(&file).expect("robot.toml is sound")
});

const SEED: u64 = 5;
/// Longer than any answer takes.
const SOON_US: u64 = 400_000;

/// A robot without a dongle.
fn bench(paired: Option<Pairing>) -> Bench {
    let mut setup = Setup::new(&ROBOT, 1, SEED).expect("robot.toml makes a bench");
    setup.dongle = None;
    setup.robots[0].pairing = paired;
    let mut bench = Bench::new(setup);
    wait(&mut bench, SOON_US);
    bench
}

fn wait(bench: &mut Bench, us: u64) {
    let now_us = bench.now_us();
    bench.run_until(now_us + us);
}

fn frame(message: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; LONGEST + 1];
    [&[0], encode(message, &mut buffer).expect("short")].concat()
}

fn say(bench: &Bench, bytes: &[u8]) {
    assert_eq!(bench.robots[0].line.write(bytes).expect("plugged in"), bytes.len());
}

fn answers(bench: &Bench) -> Vec<PairingReply> {
    let mut deframer = Deframer::default();
    let bytes = bench.robots[0].line.take();
    let answers = bytes.iter().filter_map(|byte| deframer.push(*byte)?.ok()).collect();
    assert_eq!(deframer.bad(), 0, "the robot speaks its own language");
    answers
}

/// Says something and waits for the answer to it.
fn ask(bench: &mut Bench, message: &PairingRequest) -> Vec<PairingReply> {
    say(bench, &frame(message));
    wait(bench, SOON_US);
    answers(bench)
}

fn hello(console: Option<[u8; 6]>) -> PairingReply {
    let name = ROBOT.name.as_str().try_into().expect("short");
    PairingReply::Hello { version: VERSION, address: address(0), name, console }
}

/// Why it booted, each time but the first.
fn boots(bench: &Bench) -> Vec<Reset> {
    let events = bench.robots[0].event_log.events();
    let boots =
        events.iter().filter_map(|(_, event)| if let Event::Booted(reset) = event { Some(*reset) } else { None });
    boots.skip(1).collect()
}

/// A console on the air: whether the robot talks with it.
fn is_obeyed(bench: &mut Bench, pairing: &Pairing) -> bool {
    let console = Console::new(bench, 0, pairing.clone(), SEED);
    let calling = console.clone();
    bench.spawn(async move { calling.begin().await });
    wait(bench, 500_000);
    !console.told().is_empty()
}

#[test]
fn a_robot_is_paired_and_obeys_from_the_next_boot_on() {
    let mut bench = bench(None);
    assert_eq!(ask(&mut bench, &PairingRequest::Hello), [hello(None)]);
    let pairing = pairing(DONGLE, SEED, 0);
    assert_eq!(ask(&mut bench, &PairingRequest::Pair(pairing.clone())), [PairingReply::Kept]);
    assert_eq!(boots(&bench), [Reset::Software]);
    assert_eq!(ask(&mut bench, &PairingRequest::Hello), [hello(Some(DONGLE))]);
    assert!(is_obeyed(&mut bench, &pairing));
}

#[test]
fn a_robot_that_is_paired_anew_obeys_the_old_console_no_more() {
    let (old, mut new) = (pairing(DONGLE, SEED, 0), pairing(DONGLE, SEED + 100, 0));
    new.console = [0x24, 0x6f, 0x28, 0, 0, 2];
    let mut bench = bench(Some(old.clone()));
    assert_eq!(ask(&mut bench, &PairingRequest::Pair(new.clone())), [PairingReply::Kept]);
    assert_eq!(ask(&mut bench, &PairingRequest::Hello), [hello(Some(new.console))]);
    assert!(!is_obeyed(&mut bench, &old));
    assert!(is_obeyed(&mut bench, &new));
}

#[test]
fn a_robot_that_has_forgotten_its_console_is_silent() {
    let pairing = pairing(DONGLE, SEED, 0);
    let mut bench = bench(Some(pairing.clone()));
    assert_eq!(ask(&mut bench, &PairingRequest::Forget), [PairingReply::Kept]);
    assert_eq!(boots(&bench), [Reset::Software]);
    assert_eq!(ask(&mut bench, &PairingRequest::Hello), [hello(None)]);
    assert!(!is_obeyed(&mut bench, &pairing));
    let events = bench.robots[0].event_log.events();
    assert!(!events.iter().any(|(_, event)| matches!(event, Event::Sending(..))));
}

#[test]
fn nobody_is_paired_while_the_motor_is_driven() {
    let old = pairing(DONGLE, SEED, 0);
    let mut bench = bench(Some(old.clone()));
    let console = Console::new(&mut bench, 0, old, SEED);
    let driver = console.clone();
    bench.spawn(async move {
        driver.begin().await;
        for command in [Command::ClearFault, Command::Speed { omega: 44.0 }] {
            assert_eq!(driver.order(Request::Command(command)).await, Some(Answer::Done(None)));
        }
    });
    wait(&mut bench, 1_000_000);
    assert_eq!(bench.robots[0].state(), Some((State::Speed, None)));
    let _ = bench.robots[0].event_log.take();
    for message in [PairingRequest::Pair(pairing(DONGLE, SEED + 100, 0)), PairingRequest::Forget] {
        assert_eq!(ask(&mut bench, &message), [PairingReply::NotKept]);
        assert_eq!(bench.robots[0].state(), Some((State::Speed, None)), "it goes on");
    }
    let flashed = bench.robots[0].event_log.events().iter().filter(|(_, event)| *event == Event::Flashed).count();
    assert_eq!(flashed, 0, "the flash is not touched");
    assert_eq!(ask(&mut bench, &PairingRequest::Hello), [hello(Some(DONGLE))]);
    // Stopped, it can be paired.
    bench.spawn(async move { console.stop().await });
    wait(&mut bench, SOON_US);
    assert_eq!(ask(&mut bench, &PairingRequest::Forget), [PairingReply::Kept]);
    assert_eq!(bench.robots[0].state(), Some((State::Fault, Some(Fault::Restarted))));
}

#[test]
fn text_rubbish_and_broken_frames_before_a_message_do_not_spoil_it() {
    let mut bench = bench(None);
    let mut random = Pcg64Mcg::seed_from_u64(30);
    for round in 0..300 {
        let mut bytes = match round % 3 {
            0 => b"scram-26 on ESP32, reset: PowerOn\r\n".to_vec(),
            1 => vec![0; random.random_range(0..3000)],
            _ => vec![7; random.random_range(0..3000)],
        };
        if round % 3 == 1 {
            random.fill_bytes(&mut bytes);
        }
        // A message that is cut off, or has a wrong bit.
        let mut broken = frame(&PairingRequest::Pair(pairing(DONGLE, SEED, 0)));
        let at = random.random_range(1..broken.len() - 1);
        if random.random() {
            broken.truncate(at)
        } else {
            broken[at] ^= 1 << random.random_range(0..8)
        }
        bytes.extend(broken);
        for part in bytes.chunks(1000) {
            say(&bench, part);
            wait(&mut bench, 2000);
        }
        if random.random() {
            bench.robots[0].line.fail_chip_read();
        }
        say(&bench, &frame(&PairingRequest::Hello));
        wait(&mut bench, 20_000);
        assert_eq!(answers(&bench).last(), Some(&hello(None)), "round {round}");
    }
    assert_eq!(boots(&bench), [], "nothing of that was a pairing");
}

#[test]
fn a_host_that_goes_keeps_the_robot_from_nothing() {
    for cable in [Cable::Idle, Cable::Broken, Cable::Gone] {
        let mut bench = bench(None);
        // What is said fills the driver's buffer, and nobody reads.
        bench.robots[0].line.plug(Cable::Idle);
        for _ in 0..4 {
            say(&bench, &frame(&PairingRequest::Hello));
        }
        say(&bench, &frame(&PairingRequest::Pair(pairing(DONGLE, SEED, 0))));
        bench.robots[0].line.plug(cable);
        wait(&mut bench, 5_000_000);
        assert_eq!(boots(&bench), [Reset::Software], "{cable:?}");
        bench.robots[0].line.plug(Cable::Reading);
        let _ = bench.robots[0].line.take();
        assert_eq!(ask(&mut bench, &PairingRequest::Hello), [hello(Some(DONGLE))], "{cable:?}");
    }
}
