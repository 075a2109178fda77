//! A day of telemetry, played fast through a whole console: a tick every 10 ms of the day. Memory must stay flat, and the
//! recording be readable to its end.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, Instant};

use control::State;
use control::protocol::dongle::{Address, FromDongle, Payload, ToDongle};
use control::protocol::frame::{self, Deframer};
use control::protocol::radio::{BATCH, Batch, Downlink, Echo, LONGEST, PackedTick as Tick, Report, Uplink};
use control::protocol::secure::{Accepted, Nonce, Sealer, SessionReceiver};
use control::protocol::{VERSION, pairing::Pairing};
use link::{Keys, KnownRobot, Line, Session};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use recording::{Entry, entries};
use scram::console::Engine;
use serde_json::json;
use testbed::setup::{DONGLE, address, pairing};

use super::Options;
use crate::figures::run::DesignedRobot;
use crate::row::FigureRow;

/// Ticks of a day, one every 10 ms.
const DAY: u64 = 8_640_000;
/// The control period here, s.
const TICK_S: f64 = 0.01;
/// Share of messages that are lost on the way.
const LOST_SHARE: f64 = 0.01;
/// Memory is compared between this share of the day and its end.
const EARLY_SHARE: f64 = 0.05;
/// Growth that counts as none, KiB: what the allocator keeps.
const FLAT_KIB: u64 = 4096;
const PATIENCE: Duration = Duration::from_secs(1);

/// A dongle and a robot that do nothing but tell, as fast as somebody reads. Their clock is the telemetry's.
struct Player {
    receiver: SessionReceiver,
    sealer: Option<Sealer>,
    deframer: Deframer,
    to_host: VecDeque<u8>,
    random: Pcg64,
    now: Duration,
    tick: u32,
    ticks: u64,
    /// Ticks that went out.
    told: u64,
    /// Ticks that were lost on the way, the last ones aside: nobody can miss those.
    lost: u64,
    robot: Address,
}

impl Player {
    fn new(keys: &Pairing, ticks: u64) -> Self {
        Self {
            receiver: SessionReceiver::new(keys.key.clone()),
            sealer: None,
            deframer: Deframer::default(),
            to_host: VecDeque::new(),
            random: Pcg64::seed_from_u64(1),
            now: Duration::ZERO,
            tick: 0,
            ticks,
            told: 0,
            lost: 0,
            robot: address(0),
        }
    }

    fn is_over(&self) -> bool {
        u64::from(self.tick) >= self.ticks && self.to_host.is_empty()
    }

    fn tell(&mut self, message: &FromDongle) {
        let mut buffer = [0; frame::LONGEST + 1];
        let bytes = frame::encode(message, &mut buffer).expect("short");
        self.to_host.extend([0].iter().chain(bytes));
    }

    fn say(&mut self, bytes: &[u8]) {
        let payload = Payload::from_slice(bytes).expect("short");
        self.tell(&FromDongle::Received { from: self.robot, rssi: -50, payload });
    }

    fn take(&mut self, message: ToDongle) {
        match message {
            ToDongle::Hello => self.tell(&FromDongle::Hello { version: VERSION, address: DONGLE, channel: 1 }),
            ToDongle::Send { number, payload, .. } => {
                self.tell(&FromDongle::Sent { number, acknowledged: true });
                let nonce = Nonce(self.random.random());
                match self.receiver.accept::<Downlink>(&payload, || nonce) {
                    Ok(Accepted::Hello(welcome)) => self.say(&welcome),
                    Ok(Accepted::Downlink { began: Some(key), .. }) => self.sealer = Some(Sealer::robot(key)),
                    _ => {}
                }
            }
            ToDongle::Count | ToDongle::Primary(_) | ToDongle::Meet { .. } => {}
        }
    }

    /// The next message, or another one that is lost.
    fn play(&mut self) {
        let Some(mut sealer) = self.sealer.take() else {
            self.now += Duration::from_millis(1);
            return;
        };
        if u64::from(self.tick) < self.ticks {
            let message = Report::Telemetry(self.batch());
            self.now += Duration::from_secs_f64(TICK_S * BATCH as f64);
            let uptime_ms = self.now.as_millis() as u32;
            let mut buffer = [0; LONGEST];
            let uplink = Uplink { uptime_ms, echo: Echo::default(), report: message };
            let (bytes, _) = sealer.seal(&uplink, &mut buffer).expect("short");
            let last = u64::from(self.tick) >= self.ticks;
            if last || !self.random.random_bool(LOST_SHARE) {
                let bytes = bytes.to_vec();
                self.say(&bytes);
                self.told += BATCH as u64;
            } else if self.told > 0 {
                self.lost += BATCH as u64;
            }
        } else {
            self.now += Duration::from_millis(1);
        }
        self.sealer = Some(sealer);
    }

    fn batch(&mut self) -> Batch {
        let first_tick = self.tick;
        self.tick += BATCH as u32;
        let rows = (first_tick..self.tick).map(|tick| Tick {
            after_us: if tick == first_tick { 0 } else { 1000 },
            second: None,
            code: (tick % 4096) as u16,
            duty: Some((tick % 30_000) as i16),
            angle: (tick % 32_000) as i16,
            speed: self.random.random_range(10_000..12_000),
        });
        Batch {
            first_tick,
            time_us: 1000 * u64::from(first_tick),
            state: State::Speed,
            fault: None,
            failed_sensor: None,
            tracking: true,
            battery_mv: 4100 - (f64::from(first_tick) / self.ticks as f64 * 700.0) as u16,
            rows: rows.collect(),
        }
    }
}

/// The player as a line. Clones are the same one: one for the session, one to watch it.
#[derive(Clone)]
struct ScriptedPeer(Rc<RefCell<Player>>);

impl Read for ScriptedPeer {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut player = self.0.borrow_mut();
        if player.to_host.is_empty() {
            player.play();
        }
        if player.to_host.is_empty() {
            return Err(io::Error::from(ErrorKind::TimedOut));
        }
        player.to_host.read(buffer)
    }
}

impl Write for ScriptedPeer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut player = self.0.borrow_mut();
        for byte in bytes {
            if let Some(Ok(message)) = player.deframer.push(*byte) {
                player.take(message);
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for ScriptedPeer {
    fn now(&self) -> Duration {
        self.0.borrow().now
    }
}

/// The row. Its size goes with the runs of the fault campaign.
///
/// # Panics
/// There is no room for the recording.
#[must_use]
pub fn rows(_: &DesignedRobot, options: &Options) -> Vec<FigureRow> {
    let ticks = (DAY * options.runs / 10_000).clamp(DAY / 100, DAY) / BATCH as u64 * BATCH as u64;
    let directory = tempfile::tempdir().expect("a directory for the recording");
    vec![day(ticks, directory.path())]
}

fn day(ticks: u64, directory: &Path) -> FigureRow {
    let known = KnownRobot { name: "day".into(), address: address(0), pairing: pairing(DONGLE, 1, 0) };
    let scripted_peer = ScriptedPeer(Rc::new(RefCell::new(Player::new(&known.pairing, ticks))));
    let keys = Keys::of(known.pairing.primary, vec![known]);
    let mut random = Pcg64::seed_from_u64(2);
    let nonces = Box::new(move || Nonce(random.random()));
    let session = Session::open(scripted_peer.clone(), &keys, nonces, PATIENCE).expect("it answers");
    let mut engine = Engine::new(session, "a day");
    engine.record(directory, TICK_S).expect("room for a recording");
    let start = Instant::now();
    let (mut early_kib, mut peak_kib) = (None, 0);
    let early = (ticks as f64 * EARLY_SHARE) as u32;
    while !scripted_peer.0.borrow().is_over() {
        for _ in 0..1000 {
            engine.poll().expect("a healthy line");
        }
        if scripted_peer.0.borrow().tick >= early {
            let kib = resident_kib();
            early_kib.get_or_insert(kib);
            peak_kib = peak_kib.max(kib);
        }
    }
    engine.poll().expect("a healthy line");
    let (told, lost) = (scripted_peer.0.borrow().told, scripted_peer.0.borrow().lost);
    let (shown, missing) = engine.model().robots[0].ticks;
    engine.finish();
    let played_s = start.elapsed().as_secs_f64();
    let recording = engine.model().recording.clone().expect("it records");
    let (rows, last_tick, error) = read(&recording.path);
    let read_s = start.elapsed().as_secs_f64() - played_s;
    let bytes = std::fs::metadata(&recording.path).map_or(0, |metadata| metadata.len());
    let grown_kib = peak_kib.saturating_sub(early_kib.unwrap_or_default());
    let holds = grown_kib <= FLAT_KIB
        && rows == told
        && shown == told
        && missing == lost
        && last_tick.is_some()
        && recording.failed.is_none()
        && error.is_none();
    FigureRow::new(
        "a day of telemetry through a console",
        "memory flat, recording readable to its end",
        format!(
            "{ticks} ticks, of which {told} came, {missing} known to be missing ({lost} were lost); in {played_s:.1} s; {} KiB \
             resident after 5 %, {peak_kib} at most later, {grown_kib} more; {:.0} MB, {rows} rows read in {read_s:.1} s{}",
            early_kib.unwrap_or_default(),
            bytes as f64 * 1e-6,
            error.map_or(String::new(), |error| format!(": {error}"))
        ),
        holds,
        json!({
            "ticks": ticks, "told": told, "lost": lost, "missing": missing, "rows": rows, "bytes": bytes,
            "played_s": played_s, "early_kib": early_kib, "peak_kib": peak_kib,
        }),
    )
}

/// Rows of a recording, its last tick, and why it could not be read further.
fn read(path: &Path) -> (u64, Option<u64>, Option<String>) {
    let (mut rows, mut last) = (0, None);
    let ended = entries(path, None, &mut |entry| {
        if let Entry::Row(row) = entry {
            rows += 1;
            last = row.tick;
        }
    });
    (rows, last, ended.err().map(|error| error.to_string()))
}

/// Memory of this process in use, KiB; 0 on a system that does not tell.
fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or_default()
}
