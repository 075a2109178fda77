//! Frames that nobody with the key has made for now: forged, replayed, of another version, another robot's. None is obeyed,
//! all are counted: a million straight at a robot's ear in the middle of a session, and some more through the whole bench.

use std::time::Duration;

use control::State;
use control::protocol::VERSION;
use control::protocol::radio::{Downlink, LONGEST};
use control::protocol::secure::{
    Accepted, Caller, Key, Kind, Nonce, Opener, Rejected, Sealer, SessionReceiver, kind, notice,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde_json::json;
use testbed::event_log::{Detail, Event};

use super::Options;
use super::mode::Mode;
use super::rig::{Rig, Template};
use crate::figures::run::{DesignedRobot, for_seeds};
use crate::row::FigureRow;

/// Attacks for each run of the fault campaign, straight at an ear.
const AT_AN_EAR: u64 = 100;
/// Attacks in a session: every so many of them the console itself says something.
const CHUNK: u64 = 10_000;
const GENUINE_EVERY: u64 = 40;
/// Attacks in a session of the whole bench, a ms apart.
const ON_THE_BENCH: u64 = 1000;

/// What became of attacks.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    given: u64,
    obeyed: u64,
    forged: u64,
    outdated: u64,
    misunderstood: u64,
    other_version: u64,
    /// A recorded call again: it is answered, and that is all.
    calls: u64,
    /// The console's own commands that did not get through.
    deaf: u64,
}

impl Tally {
    fn counted(&self) -> u64 {
        self.forged + self.outdated + self.misunderstood + self.other_version + self.calls
    }

    fn and(self, other: Self) -> Self {
        Self {
            given: self.given + other.given,
            obeyed: self.obeyed + other.obeyed,
            forged: self.forged + other.forged,
            outdated: self.outdated + other.outdated,
            misunderstood: self.misunderstood + other.misunderstood,
            other_version: self.other_version + other.other_version,
            calls: self.calls + other.calls,
            deaf: self.deaf + other.deaf,
        }
    }

    fn row(&self, what: &str, more: &str, holds: bool) -> FigureRow {
        let Self { given, obeyed, forged, outdated, misunderstood, other_version, calls, deaf } = *self;
        FigureRow::new(
            what,
            "none obeyed, all counted, the session undisturbed",
            format!(
                "{given} frames: obeyed {obeyed}; forged {forged}, outdated {outdated}, misunderstood {misunderstood}, \
                 other version {other_version}, old calls answered {calls}, not counted {}; {more}",
                given.abs_diff(self.counted())
            ),
            given > 0 && obeyed == 0 && deaf == 0 && given == self.counted() && holds,
            json!({
                "frames": given, "obeyed": obeyed, "forged": forged, "outdated": outdated, "misunderstood": misunderstood,
                "other_version": other_version, "calls": calls, "genuine_lost": deaf,
            }),
        )
    }
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &DesignedRobot, options: &Options) -> Vec<FigureRow> {
    let chunks = (options.runs * AT_AN_EAR).div_ceil(CHUNK);
    let straight = (0..chunks).into_par_iter().map(at_an_ear).reduce(Tally::default, Tally::and);
    let template = Template::new(&bench.robot, 2, Detail::Everything);
    let sessions = for_seeds(options.runs.div_ceil(ON_THE_BENCH), |seed| on_the_bench(&template, seed));
    let injected: u64 = sessions.iter().map(|session| session.injected).sum();
    let through = sessions.iter().map(|session| session.tally).fold(Tally::default(), Tally::and);
    // A frame of the console that its radio brings twice is rejected, too.
    let twice: u64 = sessions.iter().map(|session| session.twice).sum();
    let dropped = (injected + twice).saturating_sub(through.given);
    let known: u64 = sessions.iter().map(|session| session.overflowed).sum();
    vec![
        straight.row("attacks straight at a robot's ear", "", true),
        through.row(
            "attacks through the whole bench",
            &format!("{injected} sent, {twice} others came twice, the radio's queue dropped {known}"),
            dropped <= known + twice && through.given <= injected + twice,
        ),
    ]
}

/// What an attacker has recorded.
#[derive(Default)]
struct Recorded {
    /// From a console to this robot, in this session and before: each has counted, or is too late to.
    orders: Vec<Vec<u8>>,
    /// Calls that began sessions.
    calls: Vec<Vec<u8>>,
    /// Uplinks of this robot.
    uplinks: Vec<Vec<u8>>,
    /// From the console to another robot.
    others: Vec<Vec<u8>>,
}

fn one(random: &mut Pcg64, frames: &[Vec<u8>]) -> Vec<u8> {
    frames[random.random_range(0..frames.len())].clone()
}

impl Recorded {
    /// A frame that must not be obeyed.
    fn forge(&self, random: &mut Pcg64) -> Vec<u8> {
        let mut frame = one(random, &self.orders);
        let length = frame.len();
        match random.random_range(0..13) {
            0 => {}
            1 => return one(random, &self.others),
            2 => return one(random, &self.uplinks),
            3 => return one(random, &self.calls),
            4 => {
                // Of another version, right or wrong otherwise.
                let other = VERSION ^ random.random_range(1..=u32::MAX);
                frame[..4].copy_from_slice(&other.to_le_bytes());
            }
            5 => (0..random.random_range(1..=8)).for_each(|_| {
                let bit = random.random_range(0..8 * length);
                frame[bit / 8] ^= 1 << (bit % 8);
            }),
            6 => frame.truncate(random.random_range(0..length)),
            7 => {
                let more = random.random_range(1..=LONGEST - length);
                frame.extend((0..more).map(|_| random.random::<u8>()));
            }
            8 => {
                // A counter that is new enough.
                let counter = u32::from_le_bytes([frame[5], frame[6], frame[7], frame[8]]);
                let newer = counter.wrapping_add(random.random_range(1..100_000));
                frame[5..9].copy_from_slice(&newer.to_le_bytes());
            }
            9 => {
                // The tag of another frame.
                let other = one(random, &self.others);
                let from = other.len() - 16;
                frame[length - 16..].copy_from_slice(&other[from..]);
            }
            10 => {
                let mut call = one(random, &self.calls);
                let place = random.random_range(5..call.len());
                call[place] ^= random.random_range(1..=255);
                return call;
            }
            11 => return notice().to_vec(),
            _ => return (0..random.random_range(0..=LONGEST)).map(|_| random.random()).collect(),
        }
        frame
    }
}

/// One end of a session.
struct Talk {
    sealer: Sealer,
    robot: Sealer,
    call: Vec<u8>,
    _opener: Opener,
}

fn begin(receiver: &mut SessionReceiver, key: &Key, random: &mut Pcg64) -> Talk {
    let caller = Caller::new(key.clone(), Nonce(random.random()));
    let call = caller.hello().to_vec();
    let Ok(Accepted::<Downlink>::Hello(welcome)) = receiver.accept(&call, || Nonce(random.random())) else {
        panic!("a call is answered")
    };
    let (mut sealer, opener) = caller.welcomed(&welcome).expect("the answer to this call");
    let Ok(Accepted::<Downlink>::Downlink { began: Some(session), .. }) =
        receiver.accept(&order(&mut sealer), || Nonce([0; 8]))
    else {
        panic!("the first order begins the session")
    };
    Talk { sealer, robot: Sealer::robot(session), call, _opener: opener }
}

fn order(sealer: &mut Sealer) -> Vec<u8> {
    sealer.seal(&Downlink::Heartbeat { heard_ms: Some(0) }, &mut [0; LONGEST]).expect("short").0.to_vec()
}

fn at_an_ear(seed: u64) -> Tally {
    let mut random = Pcg64::seed_from_u64(seed);
    let (key, other_key) = (Key(random.random()), Key(random.random()));
    let mut receiver = SessionReceiver::new(key.clone());
    let mut recorded = Recorded::default();
    let mut other = begin(&mut SessionReceiver::new(other_key.clone()), &other_key, &mut random);
    recorded.others = (0..50).map(|_| order(&mut other.sealer)).collect();
    let mut old = begin(&mut receiver, &key, &mut random);
    recorded.orders = (0..50).map(|_| order(&mut old.sealer)).collect();
    recorded.calls.push(old.call);
    // The old session's commands have not counted: they never shall.
    let mut talk = begin(&mut receiver, &key, &mut random);
    recorded.calls.push(talk.call);
    recorded.uplinks = (0..50).map(|_| order(&mut talk.robot)).collect();
    let mut tally = Tally::default();
    for index in 0..CHUNK {
        if index % GENUINE_EVERY == 0 {
            let genuine = order(&mut talk.sealer);
            tally.deaf +=
                u64::from(!matches!(hear(&mut receiver, &genuine, &mut random), Ok(Accepted::Downlink { .. })));
            recorded.orders.push(genuine);
        }
        let frame = recorded.forge(&mut random);
        tally.given += 1;
        match hear(&mut receiver, &frame, &mut random) {
            Ok(Accepted::Downlink { .. }) => tally.obeyed += 1,
            Ok(Accepted::Hello(_)) => tally.calls += 1,
            Err(Rejected::Forged) => tally.forged += 1,
            Err(Rejected::Outdated) => tally.outdated += 1,
            Err(Rejected::Misdirected | Rejected::Unreadable) => tally.misunderstood += 1,
            Err(Rejected::OtherVersion(_)) => tally.other_version += 1,
        }
    }
    tally
}

fn hear(receiver: &mut SessionReceiver, frame: &[u8], random: &mut Pcg64) -> Result<Accepted<Downlink>, Rejected> {
    receiver.accept(frame, || Nonce(random.random()))
}

/// A session of the whole bench under attack.
struct Session {
    tally: Tally,
    injected: u64,
    overflowed: u64,
    twice: u64,
}

fn on_the_bench(template: &Template, seed: u64) -> Session {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut rig = Rig::new(template.seeded(seed));
    rig.meet();
    rig.order(0, Mode::Forward.command(0));
    rig.run(Duration::from_millis(300));
    let recorded = record(&rig);
    let before = rig.end.bench().robots[0].counters();
    let air = rig.end.bench().ether.counts();
    for _ in 0..ON_THE_BENCH {
        rig.run(Duration::from_millis(1));
        let frame = recorded.forge(&mut random);
        let bench = rig.end.bench();
        let dongle = bench.dongle.as_ref().map_or([0; 6], |dongle| dongle.identity().address);
        bench.ether.inject(dongle, bench.robots[0].address(), &frame);
    }
    rig.run(Duration::from_millis(100));
    let goes_on = rig.state(0) == Some(State::Speed);
    let bench = rig.end.bench();
    let after = bench.robots[0].counters();
    let (mut heard, mut calls) = (0, 0);
    for (_, event) in bench.robots[0].event_log.events().iter() {
        if let Event::Heard { payload, .. } = event {
            heard += 1;
            calls += u64::from(recorded.calls.contains(payload));
        }
    }
    let counts = rig.session.counts();
    // Two may be under way.
    let sent = counts.acknowledged + counts.unacknowledged + counts.forgotten + 2;
    let tally = Tally {
        // What was not the console's.
        given: heard - u64::from(after.received - before.received),
        obeyed: u64::from(after.received.saturating_sub(sent)),
        forged: u64::from(after.forged - before.forged),
        outdated: u64::from(after.outdated - before.outdated),
        misunderstood: u64::from(after.misunderstood - before.misunderstood),
        other_version: u64::from(after.other_version - before.other_version),
        calls,
        deaf: u64::from(!goes_on),
    };
    let now = bench.ether.counts();
    let (overflowed, twice) = (now.overflowed - air.overflowed, now.duplicated - air.duplicated);
    Session { tally, injected: ON_THE_BENCH, overflowed, twice }
}

/// What an attacker has heard until now.
fn record(rig: &Rig) -> Recorded {
    let mut recorded = Recorded::default();
    let bench = rig.end.bench();
    for (_, event) in bench.robots[0].event_log.take() {
        match event {
            Event::Heard { payload, .. } if kind(&payload) == Ok(Kind::Hello) => recorded.calls.push(payload),
            Event::Heard { payload, .. } => recorded.orders.push(payload),
            Event::Sending(_, payload) => recorded.uplinks.push(payload),
            _ => {}
        }
    }
    for (_, event) in bench.robots[1].event_log.take() {
        if let Event::Heard { payload, .. } = event {
            recorded.others.push(payload);
        }
    }
    recorded
}
