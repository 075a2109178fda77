//! The bench itself: the dongle between the host's line and the robots, what is broken on purpose, and the time it takes.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use control::protocol::dongle::{Address, FromDongle, Payload, ToDongle};
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::radio::{Answer, Downlink, Report, Request, RequestFrame, Reset, Uplink};
use control::protocol::secure::{Caller, Nonce, Opener, Sealer};
use control::{Command, Fault, State};
use hal_sim::radio::Trouble;
use robot_file::Robot;
use testbed::bench::Bench;
use testbed::event_log::{Detail, Event, driven, text, ticks};
use testbed::host_end::HostEnd;
use testbed::injected_event::InjectedEvent;
use testbed::serial::Cable;
use testbed::setup::{DONGLE, Setup, address, pairing};

static ROBOT: LazyLock<Robot> = LazyLock::new(|| {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")).expect("robot.toml is sound")
});
const SEED: u64 = 5;
const DRIVE: Request = Request::Command(Command::Speed { omega: 44.0 });

/// What a robot's session needs.
#[derive(Default)]
struct Peer {
    caller: Option<Caller>,
    session: Option<(Sealer, Opener)>,
    told: Vec<Uplink>,
}

/// As little of a host as can drive: it says hello, meets its robots, and beats while it reads.
struct Host<L> {
    line: L,
    now: fn(&L) -> Duration,
    deframer: Deframer,
    peers: BTreeMap<Address, Peer>,
    number: u16,
    beat: Duration,
    hello: Option<Address>,
    acknowledged: u32,
}

impl<L: Read + Write> Host<L> {
    fn new(line: L, now: fn(&L) -> Duration) -> Self {
        let (beat, peers) = (Duration::ZERO, BTreeMap::new());
        Self { line, now, deframer: Deframer::default(), peers, number: 0, beat, hello: None, acknowledged: 0 }
    }

    fn write(&mut self, message: &ToDongle) {
        let mut buffer = [0; LONGEST + 1];
        let frame = [&[0], encode(message, &mut buffer).expect("short")].concat();
        // What is not taken is lost, as the test expects where the line is broken.
        let _ = self.line.write_all(&frame);
    }

    fn send(&mut self, to: Address, frame: &[u8]) {
        self.number = self.number.wrapping_add(1);
        let payload = Payload::from_slice(frame).expect("short");
        self.write(&ToDongle::Send { number: self.number, to, payload });
    }

    fn say(&mut self, to: Address, order: &Downlink) {
        let mut buffer = [0; 250];
        let Some((sealer, _)) = &mut self.peers.get_mut(&to).expect("met").session else { return };
        let frame = sealer.seal(order, &mut buffer).expect("short").0.to_vec();
        self.send(to, &frame);
    }

    /// Runs for a time, reads, and sends heartbeats.
    fn turn(&mut self, time: Duration) {
        let end = (self.now)(&self.line) + time;
        let mut bytes = [0; 512];
        while (self.now)(&self.line) < end {
            match self.line.read(&mut bytes) {
                Ok(count) => bytes[..count].iter().for_each(|byte| self.take(*byte)),
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                Err(_) => return,
            }
            if (self.now)(&self.line) >= self.beat {
                self.beat = (self.now)(&self.line) + Duration::from_millis(50);
                for to in self.peers.keys().copied().collect::<Vec<_>>() {
                    let heard_ms = self.peers[&to].told.last().map(|uplink| uplink.uptime_ms);
                    self.say(to, &Downlink::Heartbeat { heard_ms });
                }
            }
        }
    }

    fn take(&mut self, byte: u8) {
        match self.deframer.push(byte) {
            Some(Ok(FromDongle::Hello { address, .. })) => self.hello = Some(address),
            Some(Ok(FromDongle::Sent { acknowledged, .. })) => self.acknowledged += u32::from(acknowledged),
            Some(Ok(FromDongle::Received { from, payload, .. })) => {
                let Some(peer) = self.peers.get_mut(&from) else { return };
                if let Some(session) = peer.caller.as_ref().and_then(|caller| caller.welcomed(&payload).ok()) {
                    (peer.caller, peer.session) = (None, Some(session));
                } else if let Some((_, opener)) = &mut peer.session
                    && let Ok(opened) = opener.open(&payload)
                {
                    peer.told.push(opened.body);
                }
            }
            _ => {}
        }
    }

    /// Meets a robot and begins a session.
    fn begin(&mut self, index: usize) {
        let (robot, keys) = (address(index), pairing(DONGLE, SEED, index));
        if index == 0 {
            self.write(&ToDongle::Primary(keys.primary));
        }
        self.write(&ToDongle::Meet { address: robot, local: keys.local });
        let caller = Caller::new(keys.key, Nonce([index as u8; 8]));
        let hello = caller.hello();
        self.peers.insert(robot, Peer { caller: Some(caller), ..Peer::default() });
        while self.peers[&robot].told.is_empty() {
            if self.peers[&robot].session.is_none() {
                self.send(robot, &hello);
            }
            self.turn(Duration::from_millis(50));
            assert!((self.now)(&self.line) < Duration::from_secs(5), "no session");
        }
    }

    fn order(&mut self, index: usize, request: Request) -> Answer {
        self.number = self.number.wrapping_add(1);
        let wanted = RequestFrame { number: self.number, deadline_ms: 60_000, request };
        for _ in 0..40 {
            self.say(address(index), &Downlink::Request(wanted));
            self.turn(Duration::from_millis(50));
            let told = self.peers[&address(index)].told.iter().rev();
            for uplink in told {
                if let Report::Answer { number, answer, .. } = uplink.report
                    && number == wanted.number
                {
                    return answer;
                }
            }
        }
        panic!("no answer to {request:?}");
    }

    fn drive(&mut self, index: usize) {
        self.begin(index);
        assert_eq!(self.order(index, Request::Command(Command::ClearFault)), Answer::Done(None));
        assert_eq!(self.order(index, DRIVE), Answer::Done(None));
    }
}

fn setup(robots: usize) -> Setup {
    Setup::new(&ROBOT, robots, SEED).expect("robot.toml has all")
}

fn host(bench: Bench) -> (Host<HostEnd>, HostEnd) {
    let end = HostEnd::new(bench);
    (Host::new(end.clone(), HostEnd::now), end)
}

#[test]
fn a_host_drives_five_robots_through_the_dongle_and_two_runs_are_the_same() {
    let run = || {
        let (mut host, end) = host(Bench::new(setup(5)));
        (0..5).for_each(|index| host.drive(index));
        host.turn(Duration::from_secs(2));
        let bench = end.bench();
        for robot in &bench.robots {
            assert_eq!(robot.state(), Some((State::Speed, None)), "{:?}", robot.address());
            assert!((robot.truth().speed - 44.0).abs() < 4.0, "{:?}", robot.truth());
            // Everybody has a processor: nobody's conversions hold the others up.
            assert_eq!(robot.counters().missed_deadlines, 0);
            assert_eq!(robot.settings().name.len(), if robot.address() == address(0) { 8 } else { 10 });
        }
        assert_eq!(host.hello, Some(DONGLE));
        assert!(host.acknowledged > 200);
        bench.robots.iter().map(|robot| text(&robot.event_log.events())).collect::<Vec<_>>()
    };
    assert!(run() == run());
}

#[test]
fn a_journal_has_every_tick_with_its_code() {
    let (mut host, end) = host(Bench::new(setup(1)));
    host.drive(0);
    host.turn(Duration::from_millis(500));
    let bench = end.bench();
    let robot = &bench.robots[0];
    let ticks = ticks(&robot.event_log.events());
    assert_eq!(ticks.len(), robot.counters().ticks as usize);
    let driven = ticks.iter().filter(|(.., told)| told.enable).count();
    assert!(driven > 400 && driven as u64 == robot.plant(|plant| plant.driven()));
    assert!(ticks.windows(2).filter(|pair| pair[0].1 != pair[1].1).count() > 100, "it turns");
}

#[test]
fn ten_seconds_of_robot_dongle_and_air_are_timed() {
    let mut setup = setup(1);
    setup.detail = Detail::Bridge;
    let (mut host, end) = host(Bench::new(setup));
    host.drive(0);
    let (begun, from) = (Instant::now(), end.now());
    host.turn(Duration::from_secs(10));
    let simulated = end.now() - from;
    println!("{:.5} s of wall time for each simulated second", begun.elapsed().as_secs_f64() / simulated.as_secs_f64());
    assert_eq!(end.bench().robots[0].state(), Some((State::Speed, None)));
}

/// Drives, lets something happen at 2 s, and says when the bridge was on last, s after it.
fn off_after(injected_events: &[InjectedEvent]) -> (f64, HostEnd) {
    let mut bench = Bench::new(setup(1));
    for injected_event in injected_events {
        bench.at(2_000_000, *injected_event);
    }
    let (mut host, end) = host(bench);
    host.drive(0);
    let rest = || Duration::from_secs(4).saturating_sub(end.now());
    host.turn(rest());
    // The line may have failed before.
    end.wait(rest());
    let spans = driven(&end.bench().robots[0].event_log.events());
    assert_eq!(spans.len(), 1, "driven once: {spans:?}");
    let off_us = spans[0].1.unwrap_or_else(|| panic!("still driven after {injected_events:?}"));
    ((off_us as f64 - 2e6) * 1e-6, end)
}

#[test]
fn whatever_breaks_between_person_and_motor_the_bridge_opens() {
    let out_of_reach = InjectedEvent::Place(0, 5000.0);
    for (injected_event, bound_s) in [
        (InjectedEvent::DongleHangs, 0.6),
        (InjectedEvent::DongleBoots, 0.6),
        (InjectedEvent::Cable(Cable::Broken), 0.6),
        (InjectedEvent::Cable(Cable::Gone), 0.6),
        (InjectedEvent::Air(Trouble { silence: true, ..Trouble::NONE }), 0.6),
        (out_of_reach, 0.6),
        (InjectedEvent::PowerCut(0), 0.001),
        (InjectedEvent::Boot(0, Reset::BrownOut), 0.001),
        (InjectedEvent::ProcessorHold(0, 10_000_000), 0.042),
        (InjectedEvent::DongleSpins, 0.6),
        (InjectedEvent::DongleRadioStuck, 0.6),
        (InjectedEvent::RadioStuck(0), 0.6),
        (InjectedEvent::RadioFull(0), 0.6),
        (InjectedEvent::Fault(0, hal_sim::Fault::SensorOpen), 1.0),
        (InjectedEvent::Fault(0, hal_sim::Fault::BatteryLow { open_circuit_v: 2.9 }), 0.2),
    ] {
        let (after_s, end) = off_after(&[injected_event]);
        println!("{injected_event:?}: bridge off after {after_s:.4} s");
        assert!((-0.001..bound_s).contains(&after_s), "{injected_event:?}: {after_s}");
        let bench = end.bench();
        match injected_event {
            // It has forgotten the keys.
            InjectedEvent::DongleBoots => {
                assert!(bench.ether.unreadable(&address(0)) > 5, "the robot's radio decrypts nothing that has no key");
            }
            InjectedEvent::PowerCut(_) => {
                assert_eq!(bench.robots[0].state(), None);
                assert!(!bench.robots[0].actuation().enable && bench.robots[0].truth().speed.abs() < 1.0);
            }
            InjectedEvent::Boot(..) => {
                assert_eq!(bench.robots[0].state(), Some((State::Fault, Some(Fault::Restarted))));
            }
            InjectedEvent::ProcessorHold(..) => {
                let events = bench.robots[0].event_log.events();
                assert!(events.iter().any(|(_, event)| *event == Event::Booted(Reset::Watchdog)));
            }
            _ => assert!(matches!(bench.robots[0].state(), Some((State::Fault, Some(_))))),
        }
    }
}

#[test]
fn a_second_talker_stops_nothing_and_is_counted() {
    let mut bench = Bench::new(setup(2));
    bench.at(1_500_000, InjectedEvent::Attack(3_000));
    let (mut host, end) = host(bench);
    host.drive(0);
    host.drive(1);
    host.turn(Duration::from_secs(9));
    let bench = end.bench();
    assert!(bench.ether.counts().injected > 1000, "{:?}", bench.ether.counts());
    for robot in &bench.robots {
        let counters = robot.counters();
        assert_eq!(robot.state(), Some((State::Speed, None)), "{counters:?}");
        assert!(
            counters.forged > 50
                && counters.outdated > 10
                && counters.misunderstood > 50
                && counters.other_version > 50,
            "{counters:?}"
        );
    }
}

#[test]
fn a_robot_is_paired_over_its_own_serial_line() {
    use control::protocol::pairing;
    let mut setup = setup(1);
    let keys = setup.robots[0].pairing.take().expect("paired");
    let mut bench = Bench::new(setup);
    bench.run_until(10_000);
    assert_eq!(bench.ether.counts().sent, 0);
    let mut buffer = [0; LONGEST + 1];
    for message in [pairing::PairingRequest::Hello, pairing::PairingRequest::Pair(keys)] {
        let frame = encode(&message, &mut buffer).expect("short");
        assert_eq!(bench.robots[0].line.write(frame).ok(), Some(frame.len()));
        bench.run_until(bench.now_us() + 500_000);
    }
    let mut deframer = Deframer::default();
    let answers: Vec<pairing::PairingReply> =
        bench.robots[0].line.take().iter().filter_map(|byte| deframer.push(*byte)?.ok()).collect();
    assert!(matches!(&answers[0], pairing::PairingReply::Hello { console: None, .. }), "{answers:?}");
    assert_eq!(answers[1], pairing::PairingReply::Kept);
    let booted = |event: &Event| matches!(event, Event::Booted(_));
    let boots: Vec<_> = bench.robots[0]
        .event_log
        .events()
        .iter()
        .filter(|(_, event)| booted(event))
        .map(|(_, event)| event.clone())
        .collect();
    assert_eq!(boots, [Event::Booted(Reset::PowerOn), Event::Booted(Reset::Software)]);
    let (mut host, end) = host(bench);
    host.drive(0);
    assert_eq!(end.bench().robots[0].state(), Some((State::Speed, None)));
}
