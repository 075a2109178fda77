//! The bench behind a pseudo-terminal: any program finds a serial port.
#![cfg(unix)]

use std::io::{Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use control::protocol::VERSION;
use control::protocol::dongle::{Address, FromDongle, Payload, ToDongle};
use control::protocol::frame::{BAUD, Deframer, LONGEST, encode};
use control::protocol::secure::{Caller, Nonce};
use control::{Fault, State};
use robot_file::Robot;
use serialport::TTYPort;
use testbed::injected_event::InjectedEvent;
use testbed::realtime::{Options, Simulation};
use testbed::setup::{address, pairing};

const CONSOLE: Address = [2, 2, 2, 2, 2, 2];

fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).expect("robot.toml is sound")
}

fn open(simulation: &Simulation) -> TTYPort {
    let port = simulation.port().to_str().expect("UTF-8");
    serialport::new(port, BAUD).timeout(Duration::from_millis(10)).open_native().expect("a serial port")
}

fn write(port: &mut TTYPort, message: &ToDongle) {
    let mut buffer = [0; LONGEST + 1];
    port.write_all(&[&[0], encode(message, &mut buffer).expect("short")].concat()).expect("it takes some bytes");
}

/// Everything that comes until this is found.
fn wait<T>(port: &mut TTYPort, mut found: impl FnMut(FromDongle) -> Option<T>) -> T {
    let (begun, mut deframer, mut bytes) = (Instant::now(), Deframer::default(), [0; 256]);
    while begun.elapsed() < Duration::from_secs(10) {
        // Nothing for a moment.
        let count = port.read(&mut bytes).unwrap_or(0);
        for byte in &bytes[..count] {
            if let Some(Ok(message)) = deframer.push(*byte)
                && let Some(found) = found(message)
            {
                return found;
            }
        }
    }
    panic!("nothing in ten seconds");
}

fn greeted(port: &mut TTYPort) -> Address {
    write(port, &ToDongle::Hello);
    wait(port, |message| match message {
        FromDongle::Hello { version, address, .. } => {
            assert_eq!(version, VERSION);
            Some(address)
        }
        _ => None,
    })
}

#[test]
fn a_program_finds_a_dongle_and_the_paired_robot_answers_it() {
    let pairings = (0..2).map(|index| Some(pairing(CONSOLE, 77, index))).collect();
    let simulation = Simulation::start(&robot(), Options { pairings, ..Options::default() }).expect("it starts");
    let mut port = open(&simulation);
    assert_eq!(greeted(&mut port), CONSOLE);
    for index in 0..2 {
        let keys = pairing(CONSOLE, 77, index);
        if index == 0 {
            write(&mut port, &ToDongle::Primary(keys.primary));
        }
        write(&mut port, &ToDongle::Meet { address: address(index), local: keys.local });
        let caller = Caller::new(keys.key, Nonce([index as u8; 8]));
        // One in a hundred is lost for good: three calls are enough.
        for number in 0..3 {
            let payload = Payload::from_slice(&caller.hello()).expect("short");
            write(&mut port, &ToDongle::Send { number, to: address(index), payload });
        }
        wait(&mut port, |message| match message {
            FromDongle::Received { from, payload, .. } if from == address(index) => caller.welcomed(&payload).ok(),
            _ => None,
        });
    }
    let robots = simulation.robots();
    assert_eq!(robots.len(), 2);
    assert_eq!(robots[0].state, Some((State::Fault, Some(Fault::Restarted))));
    assert!(!robots[0].actuation.enable);
}

#[test]
fn a_program_may_come_back_and_time_has_gone_on() {
    let injected_events = vec![(Duration::from_millis(300), InjectedEvent::PowerCut(0))];
    let simulation = Simulation::start(&robot(), Options { injected_events, ..Options::default() }).expect("it starts");
    let begun = Instant::now();
    let mut port = open(&simulation);
    greeted(&mut port);
    drop(port);
    while simulation.robots()[0].state.is_some() {
        assert!(begun.elapsed() < Duration::from_secs(10), "the battery falls out at 0.3 s");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(begun.elapsed() > Duration::from_millis(250), "not before its time: {:?}", begun.elapsed());
    simulation.apply(InjectedEvent::Boot(0, control::protocol::radio::Reset::PowerOn));
    while simulation.robots()[0].state.is_none() {
        assert!(begun.elapsed() < Duration::from_secs(10), "it boots again");
    }
    greeted(&mut open(&simulation));
}

#[test]
fn when_the_plug_is_pulled_the_port_fails_and_the_thread_ends() {
    let mut simulation = Simulation::start(&robot(), Options::default()).expect("it starts");
    let mut port = open(&simulation);
    greeted(&mut port);
    simulation.unplug();
    let begun = Instant::now();
    loop {
        match port.read(&mut [0; 64]) {
            Ok(_) => {}
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {}
            Err(_) => break,
        }
        assert!(begun.elapsed() < Duration::from_secs(5), "reading goes on as if nothing had happened");
    }
    assert_eq!(simulation.robots(), []);
}

#[test]
fn a_file_without_a_radio_says_what_is_missing() {
    let mut file = robot();
    file.radio = None;
    let error = Simulation::start(&file, Options::default()).expect_err("no air").to_string();
    assert!(error.starts_with("radio: missing"), "{error}");
}
