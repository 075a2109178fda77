//! Writes what in `fuzz/corpus-seed` is made by the project's own writers: `cargo run -p fuzz-cases --example seeds`, after
//! a message or a file format has changed. What was found by fuzzing (`found-*`) and typed by hand (`hand-*`) stays.

use std::fs;
use std::path::{Path, PathBuf};

use control::gait::Name;
use control::protocol::dongle::{FromDongle, Payload, ToDongle};
use control::protocol::frame::{LONGEST, encode};
use control::protocol::lockstep::{Answer, AnswerFrame, Hello, Question, QuestionFrame, Target};
use control::protocol::pairing;
use control::protocol::radio::{
    self, BATCH, Batch, Downlink, Echo, PackedTick, Report, Request, RequestFrame, Status, Uplink,
};
use control::protocol::secure::Key;
use control::{Command, Fault, Gait, Sample, State, Stroke};
use recording::{
    AngleReading, Drive, LinkQuality, Metadata, Outcome, Recording, SessionEvent, SessionRecorder, Stated,
    TelemetryRow, write_csv, write_mcap_with,
};
use robot_file::Robot;
use robot_file::design::design;
use serde::Serialize;

fn main() {
    for (target, name, bytes) in
        [serial(), air(), session(), robot_commands(), recordings(), imports(), texts(), store()].into_iter().flatten()
    {
        let directory = room().join("corpus-seed").join(target);
        fs::create_dir_all(&directory).expect("a directory");
        fs::write(directory.join(name), bytes).expect("a file");
    }
}

type Seeds = Vec<(&'static str, String, Vec<u8>)>;

fn room() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn plain(message: &impl Serialize) -> Vec<u8> {
    postcard::to_slice(message, &mut [0; 2048]).expect("short").to_vec()
}

fn uplink(message: Report) -> Uplink {
    Uplink { uptime_ms: 1234, echo: Echo { counter: 3, age_ms: 5 }, report: message }
}

fn uplinks() -> [Uplink; 3] {
    let row = PackedTick { after_us: 1000, code: 2000, second: None, duty: Some(12_000), angle: -3000, speed: 11_000 };
    let batch = Batch {
        first_tick: 4000,
        time_us: 4_000_000,
        state: State::Speed,
        fault: None,
        tracking: true,
        failed_sensor: None,
        battery_mv: 3700,
        rows: std::iter::repeat_n(row, BATCH).collect(),
    };
    let answer = Report::Answer { number: 1, tick: 4003, answer: radio::Answer::Done(None) };
    [uplink(Report::Status(Status::default())), uplink(Report::Telemetry(batch)), uplink(answer)]
}

fn orders() -> [Downlink; 7] {
    let name = Name::new("to-and-fro").expect("a name");
    let gait = Gait::new(name, &[44.0, -44.0], &[[-1.0, 1.0]], &[0, 1, 2], 20, true).expect("sound");
    let give = |request| Downlink::Request(RequestFrame { number: 1, deadline_ms: 500, request });
    [
        Downlink::Heartbeat { heard_ms: Some(0) },
        Downlink::Stop,
        give(Request::Command(Command::Speed { omega: 44.0 })),
        give(Request::Command(Command::Oscillate { from: -1.5, to: 1.5, style: Stroke::Proportional })),
        give(Request::Set { index: 13, value: 1.5 }),
        give(Request::KeepGait(gait)),
        give(Request::Command(Command::Gait { id: gait.id() })),
    ]
}

/// As bodies of good frames, and one as it is on the line.
fn serial() -> Seeds {
    let robot = Robot::load(&room().join("../robot.toml")).expect("robot.toml");
    let parameters = design(&robot).expect("a controller").parameters;
    let pairing = pairing::Pairing { console: [2; 6], primary: [3; 16], local: [4; 16], key: Key([5; 32]) };
    let payload = Payload::from_slice(&[7; 40]).expect("short");
    let received = FromDongle::Received { from: [1; 6], rssi: -60, payload: payload.clone() };
    let hello = Hello { version: 1, target: Target::Rv32, controller_bytes: 900 };
    let bodies = [
        (0, plain(&ToDongle::Send { number: 9, to: [1; 6], payload })),
        (0, plain(&ToDongle::Meet { address: [1; 6], local: [2; 16] })),
        (1, plain(&received)),
        (2, plain(&pairing::PairingRequest::Pair(pairing))),
        (4, plain(&QuestionFrame { number: 1, question: Question::Start(parameters) })),
        (4, plain(&QuestionFrame { number: 2, question: Question::Tick(Sample::default()) })),
        (5, plain(&AnswerFrame { number: 0, bad_frames: 1, answer: Answer::Hello(hello) })),
        (6, plain(&orders()[2])),
        (7, plain(&uplinks()[1])),
    ];
    let framed = bodies
        .into_iter()
        .enumerate()
        .map(|(index, (kind, body))| ("serial", format!("body-{index}"), [&[0x80 | kind], &body[..]].concat()));
    let mut buffer = [0; LONGEST + 1];
    let line = encode(&received, &mut buffer).expect("short");
    framed.chain([("serial", "line".to_owned(), [&[1], line, line].concat())]).collect()
}

/// Commands of `air_robot.rs` and `air_console.rs`.
fn air() -> Seeds {
    let good: Vec<u8> = orders().iter().flat_map(|order| [&[0], &plain(order)[..]].concat()).collect();
    let late = [&[3], &plain(&orders()[1])[..], &good, &[9, 0, 5], &[9, 0, 6]].concat();
    let attacks =
        [&good[..], &[9, 0, 0], &[9, 2, 1, 40, 0], &[9, 3, 0, 9, 0], &[9, 5, 0, 2, 8, 0], &[7], &[8]].concat();
    let anew = [&good[..], &[4, 6, 0], &plain(&orders()[0]), &[9, 0, 200], &[5], &good].concat();
    let told: Vec<u8> = uplinks().iter().flat_map(|uplink| [&[0], &plain(uplink)[..]].concat()).collect();
    let lies = [&told[..], &[9, 0, 0], &[9, 2, 1, 40, 0], &[9, 5, 0, 2, 8, 0], &[7], &told].concat();
    let again = [&told[..], &[4, 8, 0, 0, 6], &told, &[8, 0, 9], &[5], &told].concat();
    vec![
        ("air_robot", "good".into(), good),
        ("air_robot", "late".into(), late),
        ("air_robot", "attacks".into(), attacks),
        ("air_robot", "anew".into(), anew),
        ("air_console", "good".into(), told),
        ("air_console", "lies".into(), lies),
        ("air_console", "again".into(), again),
    ]
}

fn session() -> Seeds {
    let told: Vec<u8> = uplinks().iter().flat_map(|uplink| [&[0xC0], &plain(uplink)[..]].concat()).collect();
    let typed: Vec<u8> = (0..8).flat_map(|line| [0xC6, line, 0xC0].into_iter().chain(plain(&uplinks()[2]))).collect();
    let greeting = FromDongle::Hello { version: control::protocol::VERSION, address: [2, 0, 0, 0, 0, 1], channel: 1 };
    let again =
        [&told[..], &[0xC3], &plain(&greeting), &[0x44, 3, 1, 0, 2], &[0x45, 2, 9, 9], &[7, 255], &told].concat();
    vec![
        ("session", "told".into(), told),
        ("session", "typed".into(), typed),
        ("session", "dongle-again".into(), again),
    ]
}

/// Drives, turns, stops; parameters; a set with changed bytes.
fn robot_commands() -> Seeds {
    let [_, stop, speed, oscillate, set, keep, play] = orders().map(|order| [&[0], &plain(&order)[..]].concat());
    let turn = [6, 29, 255];
    let driven = [&[0][..], &speed, &turn, &turn, &oscillate, &turn, &stop, &turn].concat();
    let tuned = [&[0][..], &set, &[3, 13, 128], &speed, &turn, &[2, 0, 0, 0xC0, 0x7F, 3], &turn].concat();
    let damaged = [&[3, 2, 40, 0, 1, 90, 0, 2][..], &driven].concat();
    let rough = [&driven[..], &[4, 232, 3, 0, 8, 0, 8], &[5, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1], &turn].concat();
    let gait = [&[0][..], &keep, &play, &turn, &stop, &turn, &play, &turn].concat();
    vec![
        ("robot_commands", "gait".into(), gait),
        ("robot_commands", "driven".into(), driven),
        ("robot_commands", "tuned".into(), tuned),
        ("robot_commands", "damaged".into(), damaged),
        ("robot_commands", "rough".into(), rough),
    ]
}

fn recordings() -> Seeds {
    let directory = tempfile::tempdir().expect("a directory");
    let metadata = Metadata { robot: Some("one".into()), seed: Some(3), ..Metadata::default() };
    let t_s: Vec<f64> = (0..12).map(|tick| f64::from(tick) * 1e-3).collect();
    let recording = Recording {
        enable: vec![true; t_s.len()],
        drive: Drive::Duty(vec![0.5; t_s.len()]),
        angle: AngleReading::Adc((0..12).map(|tick| (tick != 5).then_some(1000 + 3 * tick)).collect()),
        t_s,
        ..Recording::default()
    };
    let (run, table) = (directory.path().join("run.mcap"), directory.path().join("run.csv"));
    write_mcap_with(&run, &recording, &[], &metadata).expect("written");
    write_csv(&table, &recording).expect("written");
    let console = directory.path().join("session.mcap");
    record(&console, &metadata);
    let read = |path| fs::read(path).expect("it was written");
    let told = [&read(&table)[..], b"\0robot = \"one\"\nseed = 3\ntilt_deg = 1.5\n"].concat();
    vec![
        ("recording_mcap", "run".into(), read(&run)),
        ("recording_mcap", "session".into(), read(&console)),
        ("recording_csv", "run".into(), told),
    ]
}

/// Files of another rig, and the mapping of one.
fn imports() -> Seeds {
    let root = room().join("..");
    let with = |kind: u8, mapped: u8, bytes: &[u8]| [&[kind, mapped], bytes].concat();
    let file = |path: &str| fs::read(root.join(path)).expect("a file of the project");
    let lines = |first: &str, row: &dyn Fn(u8) -> String| (0..12).fold(first.to_owned(), |text, k| text + &row(k));
    let table = lines("# rig 7\nt;a;u;v;mode\n", &|k| format!("{k};{},5;{};1;x\n", 3 * k, 20 * k));
    let entry = |k: u8| {
        let comma = if k == 0 { "" } else { "," };
        format!(
            r#"{comma}{{"timestamp": 0.00{k:02}, "position": 0.{k}, "goal_position": 0.5, "input_volts": 7.3, "torque_enable": true}}"#
        )
    };
    let log = lines(r#"{"motor": "xl330", "kp": 100, "vin": 7.4, "entries": ["#, &entry) + "]}";
    let mut all = vec![
        ("import", "table".into(), with(0, 0, table.as_bytes())),
        ("import", "table-window".into(), with(0, 0xDA, table.as_bytes())),
        ("import", "table-rate".into(), with(0, 0x31, table.as_bytes())),
        ("import", "bam".into(), with(2, 0, log.as_bytes())),
        ("import", "mapping".into(), with(3, 0, &file("examples/another-rig/rig.toml"))),
    ];
    for name in ["scipy", "scipy-compressed"] {
        let bytes = file(&format!("host/recording/tests/fixtures/{name}.mat"));
        all.push(("import", name.into(), with(1, 0x20, &bytes)));
    }
    all
}

/// Two robots, everything that a console session can hold.
fn record(path: &Path, metadata: &Metadata) {
    let mut recorder = SessionRecorder::create(path, metadata).expect("a new file");
    for name in ["one", "two"] {
        let robot = recorder.robot(name).expect("room");
        for tick in 0..6_u16 {
            let stated = Stated {
                state: State::Speed,
                fault: (tick > 4).then_some(Fault::Stall),
                tracking: true,
                failed_sensor: None,
            };
            let row = TelemetryRow {
                t_s: f64::from(tick) * 1e-3,
                tick: u64::from(tick),
                time_us: Some(4_000_000 + 1000 * u64::from(tick)),
                adc: 2000 + tick,
                adc_second: None,
                duty: (tick > 1).then_some(0.5),
                angle_rad: 0.1,
                speed_rad_per_s: 44.0,
                battery_v: Some(3.7),
                supply_v: None,
                pose: None,
                stated,
            };
            recorder.sample(robot, &row).expect("written");
        }
        let answer =
            SessionEvent::Answer { text: "done".into(), outcome: Outcome::Done, tick: Some(4), parameter: None };
        recorder.event(0.003, Some(robot), &answer).expect("written");
        let quality = LinkQuality { rate_hz: 99.0, loss: 0.01, latency_s: Some(0.006), rssi_dbm: None };
        recorder.link(0.004, robot, &quality).expect("written");
    }
    recorder.event(0.005, None, &SessionEvent::Stop).expect("written");
    recorder.finish().expect("written");
}

fn texts() -> Seeds {
    let variant = |name: &str| fs::read(room().join("../robots").join(name)).expect("a robot file");
    vec![
        ("robot_file", "robot".into(), fs::read(room().join("../robot.toml")).expect("robot.toml")),
        ("robot_file", "linear".into(), variant("bench-linear.toml")),
        ("robot_file", "xl330".into(), variant("bench-xl330.toml")),
        ("robot_file", "gait".into(), variant("gaits/alternate.toml")),
    ]
}

/// Commands of `store.rs`.
fn store() -> Seeds {
    let seeds = [
        ("kept-and-damaged", vec![0, 0, 7, 0, 8, 0x82, 200, 0, 1, 0, 9, 0x83, 10, 0, 4, 0, 0, 0, 0]),
        ("right-checksum", vec![0, 0, 7, 0x81, 2, 40, 0, 1, 90, 0, 2, 3, 0x81, 0, 4]),
        ("torn", vec![0, 0, 7, 0, 8, 0x85, 100, 1, 0x84, 0, 32, 0, 16, 0, 0x86, 0, 0, 0, 48, 0x87, 0, 16, 1, 2, 3, 4]),
        ("pairing", vec![1, 0, 7, 0, 8, 0x82, 200, 0, 1, 0x81, 3, 1, 2, 3, 9, 0, 0, 0x87, 0, 0, 9, 9, 9, 9, 5]),
        ("gait", vec![3, 0, 7, 0, 8, 0x82, 200, 0, 1, 0x81, 3, 2, 76, 0, 1, 90, 0, 2, 3, 0x81, 0, 4]),
    ];
    seeds.map(|(name, bytes)| ("store", name.to_owned(), bytes)).to_vec()
}
