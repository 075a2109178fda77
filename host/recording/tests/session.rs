//! Recordings of console sessions: what was flushed survives whatever ends the process, every prefix of the file is
//! readable, and a long session takes no more memory than a short one.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use control::{Fault, State, Stroke};
use recording::{
    AngleReading, Drive, Entry, LinkQuality, Metadata, Outcome, ParameterValue, ReadOptions, RecordedEvent,
    RecordingError, SessionEvent, SessionRecorder, Stated, TelemetryRow, entries, events, load, load_with,
};

fn row(tick: u64) -> TelemetryRow {
    let wave = (tick as f32 * 0.013).sin();
    TelemetryRow {
        t_s: tick as f64 * 1e-3,
        tick: 90_000 + tick,
        time_us: Some(90_000_003 + 1001 * tick),
        adc: (tick % 4096) as u16,
        adc_second: None,
        duty: (!tick.is_multiple_of(50)).then_some(wave),
        angle_rad: wave,
        speed_rad_per_s: 40.0 * wave,
        battery_v: Some(3.9),
        supply_v: None,
        pose: None,
        stated: Stated {
            state: if tick < 40 { State::Idle } else { State::Speed },
            fault: None,
            tracking: tick > 60,
            failed_sensor: None,
        },
    }
}

fn order(text: &str, command: Option<control::Command>) -> SessionEvent {
    SessionEvent::Command { text: text.into(), command, repeat: false, gait: None }
}

fn answer(text: &str, outcome: Outcome, tick: Option<u64>) -> SessionEvent {
    let parameter = (outcome == Outcome::Done).then(|| ParameterValue { name: "frequency_hz".into(), value: 9.1 });
    SessionEvent::Answer { text: text.into(), outcome, tick, parameter }
}

/// Every kind, with the awkward characters that a person types.
fn happenings() -> Vec<SessionEvent> {
    let swing = control::Command::Oscillate { from: -1.745_329_3, to: 0.1, style: Stroke::Proportional };
    vec![
        order("freq 7", Some(control::Command::Speed { omega: -43.982_297 })),
        order("oscillate -100..5.7 proportional", Some(swing)),
        order("coast", Some(control::Command::Coast)),
        SessionEvent::Command {
            text: "coast".into(),
            command: Some(control::Command::Coast),
            repeat: true,
            gait: None,
        },
        order("get \"ä\\n\u{1}", None),
        answer("12 V/rad", Outcome::Done, Some(41)),
        answer("no", Outcome::Refused, Some(42)),
        answer("", Outcome::TooLate, None),
        SessionEvent::Fault { fault: Fault::SensorOpen },
        SessionEvent::LinkLost,
        SessionEvent::LinkRegained,
        SessionEvent::Stop,
        SessionEvent::Note { text: "paired".into() },
    ]
}

fn quality() -> LinkQuality {
    LinkQuality { rate_hz: 98.5, loss: 0.015, latency_s: None, rssi_dbm: Some(-61.0) }
}

#[test]
fn what_a_session_holds_is_read_back() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("deep/session.mcap");
    let metadata = Metadata { notes: Some("on glass".into()), ..Metadata::default() };
    let mut recorder = SessionRecorder::create(&path, &metadata).unwrap();
    let first = recorder.robot("scram/26 a").unwrap();
    let second = recorder.robot("scram-26-a").unwrap();
    assert_eq!((recorder.robot_name(first), recorder.robot_name(second)), ("scram-26-a", "scram-26-a-2"));
    for tick in 0..200 {
        recorder.sample(first, &row(tick)).unwrap();
        recorder.sample(second, &TelemetryRow { adc: 7, supply_v: Some(5.0), ..row(tick) }).unwrap();
    }
    for (index, event) in happenings().iter().enumerate() {
        recorder.event(index as f64, (index % 2 == 0).then_some(first), event).unwrap();
    }
    recorder.link(0.2, first, &quality()).unwrap();
    recorder.finish().unwrap();

    let of = |name: &str| load_with(&path, &ReadOptions { robot: Some(name.into()), ..ReadOptions::default() });
    let loaded = of("scram-26-a").unwrap();
    assert_eq!((loaded.recording.len(), loaded.notes.len()), (200, 0), "{:?}", loaded.notes);
    assert_eq!(loaded.metadata.robot.as_deref(), Some("scram/26 a"));
    assert_eq!(loaded.metadata.notes.as_deref(), Some("on glass"));
    let Drive::Duty(duty) = &loaded.recording.drive else { panic!("telemetry has duties") };
    for (tick, duty) in duty.iter().enumerate() {
        assert_eq!(*duty as f32, row(tick as u64).duty.unwrap_or(0.0));
        assert_eq!(loaded.recording.enable[tick], row(tick as u64).duty.is_some());
    }
    let second = of("scram-26-a-2").unwrap();
    assert_eq!(second.recording.angle, AngleReading::Adc(vec![Some(7); 200]));
    assert_eq!(second.recording.supply_v, [5.0; 200]);
    assert!(matches!(load(&path), Err(RecordingError::SeveralRobots { names, .. }) if names.len() == 2));
    assert!(matches!(of("nobody"), Err(RecordingError::NoSuchRobot { .. })));

    let found = events(&path).unwrap();
    let expected = happenings().into_iter().enumerate().map(|(index, event)| RecordedEvent {
        t_s: index as f64,
        robot: (index % 2 == 0).then(|| "scram-26-a".to_owned()),
        event,
    });
    assert_eq!(found, expected.collect::<Vec<_>>());
    let (mut rows, mut links) = (Vec::new(), Vec::new());
    entries(&path, Some("scram-26-a"), &mut |entry| match entry {
        Entry::Row(row) => rows.push(row),
        Entry::Link { quality, .. } => links.push(quality),
        Entry::Event(_) => {}
    })
    .unwrap();
    assert_eq!(links, [quality()]);
    for (tick, read) in rows.iter().enumerate() {
        let told = row(tick as u64);
        assert_eq!((read.tick, read.stated), (Some(told.tick), Some(told.stated)));
        assert_eq!(read.estimate_angle_rad.map(|angle| angle as f32), Some(told.angle_rad));
        assert_eq!(read.battery_v.map(|volt| volt as f32), told.battery_v);
    }
}

#[test]
fn a_recording_is_never_written_over_and_goes_on_after_a_row_that_comes_twice() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("session.mcap");
    let mut recorder = SessionRecorder::create(&path, &Metadata::default()).unwrap();
    assert!(matches!(SessionRecorder::create(&path, &Metadata::default()), Err(RecordingError::Exists { .. })));
    let robot = recorder.robot("a").unwrap();
    recorder.sample(robot, &row(5)).unwrap();
    for late in [5, 4] {
        assert!(recorder.sample(robot, &row(late)).unwrap_err().to_string().contains("left out"));
    }
    recorder.sample(robot, &TelemetryRow { angle_rad: f32::NAN, duty: Some(f32::NAN), ..row(6) }).unwrap();
    drop(recorder);
    let loaded = load_with(&path, &ReadOptions::default()).unwrap();
    assert_eq!((loaded.recording.t_s, loaded.notes), (vec![0.005, 0.006], vec![]));
}

#[test]
fn a_file_cut_off_at_any_byte_gives_all_whole_rows_before() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("session.mcap");
    let mut recorder = SessionRecorder::create(&path, &Metadata::default()).unwrap();
    let robot = recorder.robot("a").unwrap();
    let mut ends = Vec::new();
    for tick in 0..30 {
        if tick == 10 {
            recorder.event(0.01, Some(robot), &order("freq 7", None)).unwrap();
        }
        recorder.sample(robot, &row(tick)).unwrap();
        recorder.flush().unwrap();
        ends.push(std::fs::metadata(&path).unwrap().len() as usize);
    }
    recorder.finish().unwrap();
    let whole = std::fs::metadata(&path).unwrap().len() as usize;
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    for length in (0..=whole).rev() {
        file.set_len(length as u64).unwrap();
        let expected = ends.iter().filter(|end| **end <= length).count();
        match load_with(&path, &ReadOptions::default()) {
            Ok(loaded) => {
                assert_eq!(loaded.recording.len(), expected, "{length} bytes");
                assert_eq!(loaded.notes.is_empty(), length == whole, "{length} bytes: {:?}", loaded.notes);
            }
            Err(error) => assert_eq!(expected, 0, "{length} bytes: {error}"),
        }
        if length >= ends[10] || (ends[0]..=ends[9]).contains(&length) {
            assert_eq!(events(&path).unwrap().len(), usize::from(length >= ends[10]), "{length} bytes");
        }
        // What a crash of the whole computer may leave: zeros where the last bytes should be. No panic, no more rows.
        file.set_len(length as u64 + 40).unwrap();
        let rows = load_with(&path, &ReadOptions::default()).map_or(0, |loaded| loaded.recording.len());
        assert!(rows == 0 || rows == expected, "{length} bytes and zeros: {rows} rows of {expected}");
    }
}

/// Where a child process of these tests writes, if this is one.
const CHILD: &str = "SCRAM_TEST_SESSION";
/// What it does: `rows` to write, or for ever with a line on stdout for every flush.
const CHILD_ROWS: &str = "SCRAM_TEST_ROWS";

/// Not a test of its own: the other tests start it as a process that they can kill, starve or measure.
#[test]
fn child_that_records() {
    let Ok(path) = std::env::var(CHILD) else { return };
    let rows: u64 = std::env::var(CHILD_ROWS).map_or(u64::MAX, |rows| rows.parse().unwrap());
    let mut recorder = SessionRecorder::create(Path::new(&path), &Metadata::default()).unwrap();
    let robot = recorder.robot("a").unwrap();
    for tick in 0..rows {
        let recorded = recorder.sample(robot, &row(tick)).and_then(|()| match tick % 100 {
            99 => recorder.flush(),
            _ => Ok(()),
        });
        if let Err(error) = recorded {
            println!("stopped: {error}");
            // It stays stopped and says the same.
            assert_eq!(recorder.flush().unwrap_err().to_string(), error.to_string());
            return;
        }
        if rows == u64::MAX && tick % 100 == 99 {
            println!("flushed {}", tick + 1);
        }
    }
    recorder.finish().unwrap();
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let memory = status.lines().find(|line| line.starts_with("VmHWM:")).and_then(|line| line.split_whitespace().nth(1));
    println!("memory {}", memory.unwrap_or("0"));
}

fn child(path: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "child_that_records", "--nocapture", "--test-threads=1"]);
    command.env(CHILD, path).stdout(Stdio::piped());
    command
}

#[test]
fn a_killed_recorder_loses_nothing_that_was_flushed() {
    let directory = tempfile::tempdir().unwrap();
    for after in [1, 30, 200] {
        let path = directory.path().join(format!("{after}.mcap"));
        let mut writer = child(&path).spawn().unwrap();
        let lines = BufReader::new(writer.stdout.take().unwrap()).lines().map(Result::unwrap);
        let flushed = lines.filter_map(|line| line.split_once("flushed ")?.1.parse::<usize>().ok());
        let last = flushed.take(after).last().unwrap();
        writer.kill().unwrap();
        assert!(!writer.wait().unwrap().success());
        let loaded = load_with(&path, &ReadOptions::default()).unwrap();
        assert!(loaded.recording.len() >= last, "{} of {last} rows", loaded.recording.len());
        assert!(loaded.notes.iter().any(|note| note.contains("the file has no end")), "{:?}", loaded.notes);
    }
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_told_and_what_was_recorded_stays_readable() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("session.mcap");
    // A limit on the file's size stands in for the end of the disk; the signal that goes with it is ignored.
    let mut shell = Command::new("sh");
    let program = std::env::current_exe().unwrap();
    shell.args(["-c", "trap '' 25; ulimit -f 300; exec \"$0\" --exact child_that_records --nocapture"]).arg(program);
    let output = shell.env(CHILD, &path).env(CHILD_ROWS, "1000000").output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("stopped: "), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("session.mcap: the recording has stopped"), "{said}");
    let loaded = load_with(&path, &ReadOptions::default()).unwrap();
    assert!(loaded.recording.len() > 500, "{}", loaded.recording.len());
    assert!(loaded.recording.t_s.iter().enumerate().all(|(tick, t_s)| *t_s == tick as f64 / 1e3));
}

#[cfg(target_os = "linux")]
#[test]
fn ten_times_the_session_takes_no_more_memory() {
    let directory = tempfile::tempdir().unwrap();
    let memory = |rows: u64| -> (u64, PathBuf) {
        let path = directory.path().join(format!("{rows}.mcap"));
        let output = child(&path).env(CHILD_ROWS, rows.to_string()).output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        let kib = said.lines().find_map(|line| line.split_once("memory ")?.1.parse().ok());
        (kib.unwrap_or_else(|| panic!("{said}")), path)
    };
    let ((short, _), (long, path)) = (memory(30_000), memory(300_000));
    assert!(short > 0 && long < short + 1024, "{short} KiB for 30 000 rows, {long} KiB for 300 000");
    let loaded = load_with(&path, &ReadOptions { limit: 50_000, ..ReadOptions::default() }).unwrap();
    assert_eq!((loaded.kept.rows, loaded.kept.stride), (300_000, 8));
}
