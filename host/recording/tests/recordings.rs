//! Recordings: what is read back is what was written, and every broken file is told apart.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use control::{Command, State};
use miette::Diagnostic;
use recording::{
    AngleReading, Cells, Drive, ExtraColumn, LoggedCommand, Metadata, ReadOptions, Recording, RecordingError, Run,
    RunLog, Stated, load, load_with, write_csv, write_csv_with, write_mcap, write_mcap_with,
};

fn write(directory: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = directory.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// The message and the advice of the error that a CSV text gives.
fn refusal(text: impl AsRef<[u8]>) -> String {
    let directory = tempfile::tempdir().unwrap();
    let path = write(directory.path(), "run.csv", text);
    let error = load(&path).expect_err("this file must be refused");
    let help = error.help().map(|h| h.to_string()).unwrap_or_default();
    assert!(!help.is_empty(), "{error} comes without advice");
    format!("{error}; {help}")
}

#[track_caller]
fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{message}` does not say `{part}`");
    }
}

/// Awkward values in every column, long enough to fill several chunks.
fn awkward(samples: usize, adc: bool) -> Recording {
    let angle = |i: usize| 0.1 + (i as f64 * 0.043).sin() / 3.0;
    Recording {
        path: PathBuf::new(),
        t_s: (0..samples).map(|i| i as f64 * 1e-3 + 1.0 / 3.0).collect(),
        enable: (0..samples).map(|i| i % 7 != 0).collect(),
        drive: if adc {
            Drive::Duty((0..samples).map(|i| ((i * i) as f64).sin()).collect())
        } else {
            Drive::Voltage((0..samples).map(|i| 4.0 * ((i * i) as f64).sin()).collect())
        },
        angle: if adc {
            AngleReading::Adc((0..samples).map(|i| (i % 9 != 1).then_some((i % 4096) as u16)).collect())
        } else {
            AngleReading::Angle((0..samples).map(|i| (i % 9 != 1).then(|| angle(i))).collect())
        },
        adc_second: if adc {
            (0..samples).map(|i| (i % 5 != 1).then_some((i % 4093) as u16)).collect()
        } else {
            vec![]
        },
        supply_v: (0..samples).map(|i| 5.0 + 1e-17 * i as f64).collect(),
        current_a: (0..samples).map(|i| (i % 3 != 0).then_some(0.1 / 3.0)).collect(),
        temperature_c: (0..samples).map(|i| (i % 1000 == 0).then_some(21.7)).collect(),
        pose: (0..samples)
            .map(|i| (i % 7 != 3).then(|| [1e-3 * i as f64, -2e-3 * i as f64, 0.01 * i as f64]))
            .collect(),
    }
}

#[test]
fn what_is_written_is_read_back_exactly() {
    let directory = tempfile::tempdir().unwrap();
    for adc in [true, false] {
        for name in ["run.csv", "run.mcap"] {
            let path = directory.path().join(name);
            let written = Recording { path: path.clone(), ..awkward(25_000, adc) };
            if name.ends_with("csv") { write_csv(&path, &written) } else { write_mcap(&path, &written) }.unwrap();
            assert_eq!(load(&path).unwrap(), written, "{name}");
        }
    }
}

#[test]
fn metadata_and_extra_columns_travel_along() {
    let directory = tempfile::tempdir().unwrap();
    let recording = awkward(100, true);
    let column = |name: &str| ExtraColumn { name: name.into(), values: vec![Some(0.5); 100] };
    let extra = [column("truth_angle_rad"), column("lamp_lux")];
    let metadata = Metadata {
        robot: Some("scram-26".into()),
        excitation: Some("freq:7".into()),
        seed: Some(3),
        tilt_deg: Some(-1.5),
        ..Metadata::default()
    };
    for name in ["run.csv", "run.mcap"] {
        let path = directory.path().join(name);
        let write = if name.ends_with("csv") { write_csv_with } else { write_mcap_with };
        write(&path, &recording, &extra, &metadata).unwrap();
        let loaded = load_with(&path, &ReadOptions::default()).unwrap();
        assert_eq!(loaded.metadata, metadata, "{name}");
        assert_eq!(loaded.recording, Recording { path: path.clone(), ..recording.clone() }, "{name}");
    }
    let loaded = load_with(&directory.path().join("run.csv"), &ReadOptions::default()).unwrap();
    assert_eq!(loaded.notes, ["columns that are not read: lamp_lux"]);
}

#[test]
fn a_whole_run_is_read_back_and_written_the_same() {
    let directory = tempfile::tempdir().unwrap();
    let column = |name: &str, first: Option<f64>| ExtraColumn {
        name: name.into(),
        values: std::iter::once(first).chain((1..100).map(|k| Some(1.0 / f64::from(k)))).collect(),
    };
    let stated = |row: usize| Stated {
        state: if row < 40 { State::Idle } else { State::Speed },
        tracking: row > 10,
        ..Stated::default()
    };
    let command = |row, text: &str, repeat| {
        let omega = 7.0;
        LoggedCommand { row, text: text.into(), command: Some(Command::Speed { omega }), repeat, gait: None }
    };
    for name in ["run.csv", "run.mcap"] {
        let (path, again) = (directory.path().join(name), directory.path().join(format!("again-{name}")));
        let run = Run {
            recording: Recording { path: path.clone(), ..awkward(100, true) },
            // Not in the order of their names.
            extra: vec![column("lamp_lux", Some(0.5)), column("estimate_angle_rad", None)],
            log: RunLog {
                numbers: vec![column("time_us", Some(0.0)), column("battery_adc", Some(2000.0))],
                stated: (0..100).map(stated).collect(),
                commands: vec![command(0, "freq 7", false), command(50, "freq 7", true)],
            },
            metadata: Metadata { robot: Some("scram-26".into()), seed: Some(3), ..Metadata::default() },
            ..Run::default()
        };
        run.write(&path).unwrap();
        let mut read = Run::load(&path, &ReadOptions::default()).unwrap();
        read.write(&again).unwrap();
        assert!(std::fs::read(&path).unwrap() == std::fs::read(&again).unwrap(), "{name}");
        if name.ends_with("csv") {
            // Of a command the file has the text only.
            for (read, written) in read.log.commands.iter_mut().zip(&run.log.commands) {
                assert_eq!(read.command.take(), None);
                read.command = written.command;
            }
        }
        assert_eq!(read, run, "{name}");
    }
}

#[test]
fn a_long_recording_is_thinned_by_whole_blocks() {
    let directory = tempfile::tempdir().unwrap();
    let written = awkward(50_500, true);
    for name in ["run.csv", "run.mcap"] {
        let path = directory.path().join(name);
        if name.ends_with("csv") { write_csv(&path, &written) } else { write_mcap(&path, &written) }.unwrap();
        let loaded = load_with(&path, &ReadOptions { limit: 10_000, ..ReadOptions::default() }).unwrap();
        assert!(loaded.recording.len() <= 10_000);
        // 51 blocks at a stride of 8: blocks 0, 8, …, 48, all of them whole.
        assert_eq!((loaded.kept.rows, loaded.kept.stride, loaded.kept.kept), (50_500, 8, 7_000));
        for (index, t) in loaded.recording.t_s.iter().enumerate() {
            assert_eq!(*t, written.t_s[index / 1000 * 8000 + index % 1000]);
        }
        assert_says(&loaded.notes.join(" "), &["7000 of 50500 rows", "every 8th block"]);
    }
}

#[test]
fn files_without_samples() {
    assert_says(&refusal(""), &["run.csv", "the file is empty", "header line"]);
    assert_says(&refusal("\n"), &["the file is empty"]);
    assert_says(&refusal("t_s,duty,angle_rad\n"), &["a header and no sample"]);
    let directory = tempfile::tempdir().unwrap();
    let one = load(&write(directory.path(), "one.csv", "t_s,duty,angle_rad\n0,0,0\n")).unwrap();
    let short = one.require_samples(2).unwrap_err().to_string();
    assert_says(&short, &["one.csv", "1 sample", "at least 2"]);
}

#[test]
fn columns_that_are_missing_or_too_many() {
    let message = refusal("time,position,velocity,torque\n0,0,0,0\n");
    assert_says(&message, &["`t_s`", "`duty` (or `voltage_v`)", "`angle_rad` (or `adc`)", "`position`", "spelled"]);
    assert_says(&refusal("t_s,duty,angle_deg\n0,0,0\n"), &["no column `angle_rad` (or `adc`)", "`angle_deg`"]);
    assert_says(&refusal("t_s,duty,voltage_v,angle_rad\n0,0,0,0\n"), &["both `duty` and `voltage_v`"]);
    assert_says(&refusal("t_s,duty,adc,angle_rad\n0,0,0,0\n"), &["both `angle_rad` and `adc`"]);
    assert_says(&refusal("t_s,duty,duty,angle_rad\n0,0,0,0\n"), &["`duty` occurs twice"]);
    assert_says(&refusal("t_s;duty;angle_rad\n0;0;0\n"), &["not separated by commas"]);
}

#[test]
fn cells_that_cannot_be() {
    let with = |rows: &str| refusal(format!("t_s,enable,duty,angle_rad\n0,1,0,0\n{rows}\n0.002,1,0,0\n"));
    assert_says(&with("0,1,0,0"), &["line 3", "`t_s`", "0 after 0", "sort the rows"]);
    assert_says(&with("-1,1,0,0"), &["line 3", "`t_s`", "-1 after 0"]);
    assert_says(&with("NaN,1,0,0"), &["line 3", "`t_s`", "NaN"]);
    assert_says(&with("0.001,1,nan,0"), &["line 3", "`duty`", "NaN"]);
    assert_says(&with("0.001,1,0,inf"), &["line 3", "`angle_rad`", "inf", "leave the cell empty"]);
    assert_says(&with("0.001,1,,0"), &["line 3", "`duty`", "empty"]);
    assert_says(&with("0.001,2,0,0"), &["line 3", "`enable`", "neither 0 nor 1"]);
    assert_says(&with("0.001,yes,0,0"), &["line 3", "`enable`", "`yes` is not a number"]);
    assert_says(&with("0.001,1,70,0"), &["line 3", "`duty`", "70 is outside -1 … 1", "percent"]);
    assert_says(&with("0.001,1,0;5,0"), &["line 3", "`duty`", "`0;5` is not a number"]);
    assert_says(&with("0.001,1,0"), &["line 3", "3 cells, the header has 4"]);
    assert_says(&refusal("t_s,duty,adc\n0,0,17.5\n"), &["line 2", "`adc`", "17.5"]);
    assert_says(&refusal("t_s,duty,adc,supply_v\n0,0,17,5000\n"), &["`supply_v`", "millivolts"]);
}

#[test]
fn truth_values_are_numbers_as_data_frames_write_them() {
    let directory = tempfile::tempdir().unwrap();
    let text = "t_s,enable,duty,angle_rad,warm,state,fault,tracking\n\
                0,True,0,0,False,Idle,,False\n0.001,false,0,0,true,Speed,,True\n0.002,TRUE,0,0,TRUE,Fault,Stall,true\n";
    let run = Run::load(&write(directory.path(), "run.csv", text), &ReadOptions::default()).unwrap();
    assert_eq!(run.recording.enable, [true, false, true]);
    assert_eq!(run.extra, [ExtraColumn { name: "warm".into(), values: vec![Some(0.0), Some(1.0), Some(1.0)] }]);
    let tracking: Vec<bool> = run.log.stated.iter().map(|stated| stated.tracking).collect();
    assert_eq!((tracking, run.log.stated[2].fault), (vec![false, true, true], Some(control::Fault::Stall)));
}

#[test]
fn columns_in_memory_are_a_run_as_a_file_of_them_is() {
    let directory = tempfile::tempdir().unwrap();
    let text = "t_s,enable,duty,angle_rad,lamp_lux,time_us,state,fault,tracking,order,colour\n\
                0,1,0,0,,0,Idle,,0,freq 7,red\n0.001,0,0.5,,3,1000,Fault,Stall,1,,red\n";
    let file = Run::load(&write(directory.path(), "run.csv", text), &ReadOptions::default()).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let cells = |column: usize| {
        let numbers = rows.iter().map(|row| if row[column].is_empty() { Ok(f64::NAN) } else { row[column].parse() });
        let words = || Cells::Words(rows.iter().map(|row| row[column].to_owned()).collect());
        numbers.collect::<Result<_, _>>().map_or_else(|_| words(), Cells::Numbers)
    };
    let columns = |names: &[&str]| names.iter().enumerate().map(|(i, name)| ((*name).to_owned(), cells(i))).collect();
    let made = Run::of_columns(&file.recording.path, columns(&names), Metadata::default()).unwrap();
    assert_eq!(made, file);
    assert_eq!((made.notes.len(), made.log.commands.len(), made.log.stated.len()), (1, 1, 2));
    let wordy = ["t_s", "enable", "duty", "angle_rad", "lamp_lux", "time_us", "supply_v"];
    let refused = Run::of_columns(Path::new("bench"), columns(&wordy), Metadata::default()).unwrap_err().to_string();
    assert_says(&refused, &["bench", "column `supply_v`", "words"]);
}

#[test]
fn files_that_are_cut_off_or_not_text() {
    assert_says(&refusal("t_s,duty,angle_rad\n0,0,0\n0.001,0"), &["line 3", "cut off", "delete the last line"]);
    assert_says(&refusal(b"t_s,duty,angle_rad\n0,0,\xff\xfe\n"), &["line 2", "`angle_rad`", "UTF-8"]);
    let utf16: Vec<u8> = "t_s,duty,angle_rad\n0,0,0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    refusal([b"\xff\xfe".as_slice(), &utf16].concat());
    refusal(b"\x7fELF\x02\x01\x01\0\0\0\0\n\n");
}

/// 1.5 s at a frequency, in units.
fn motion(hz: f64, wrapped: bool, per_rad: f64, t_scale: f64) -> String {
    let mut text = String::from("t_s,duty,angle_rad\n");
    for i in 0..1500 {
        let t = f64::from(i) * 1e-3;
        let angle = -hz * std::f64::consts::TAU * t;
        let angle = if wrapped { common::wrap(angle) } else { angle };
        writeln!(text, "{},0.8,{}", t * t_scale, angle * per_rad).unwrap();
    }
    text
}

#[test]
fn degrees_and_milliseconds_give_themselves_away() {
    let deg = 180.0 / std::f64::consts::PI;
    for (hz, wrapped) in [(7.0, true), (7.0, false), (1.2, true), (2.0, false)] {
        assert_says(&refusal(motion(hz, wrapped, deg, 1.0)), &["`angle_rad`", "degrees", "π/180"]);
        let directory = tempfile::tempdir().unwrap();
        load(&write(directory.path(), "run.csv", motion(hz, wrapped, 1.0, 1.0))).unwrap();
    }
    // The fastest shaft there is, in radians, is no mistake.
    let directory = tempfile::tempdir().unwrap();
    load(&write(directory.path(), "run.csv", motion(41.7, true, 1.0, 1.0))).unwrap();
    assert_says(&refusal(motion(7.0, true, 1.0, 1000.0)), &["`t_s`", "milliseconds"]);
    assert_says(&refusal("t_s,duty,angle_rad\n0,0,0\n10,0,0\n"), &["`t_s`", "milliseconds"]);
}

#[test]
fn damaged_mcap_files() {
    let directory = tempfile::tempdir().unwrap();
    let whole = directory.path().join("run.mcap");
    write_mcap(&whole, &awkward(20_000, true)).unwrap();
    let bytes = std::fs::read(&whole).unwrap();
    let message = |name: &str, bytes: &[u8]| load(&write(directory.path(), name, bytes)).unwrap_err().to_string();
    assert_says(&message("empty.mcap", b""), &["the file is empty"]);
    assert_says(&message("text.mcap", b"t_s,duty,angle_rad\n0,0,0\n"), &["not an MCAP file"]);
    for cut in [3, 9, 100] {
        assert_says(&message("cut.mcap", &bytes[..cut]), &["cut.mcap", "cut off before its first sample"]);
    }
    for cut in [5_000, bytes.len() / 2, bytes.len() - 20] {
        let path = write(directory.path(), "cut.mcap", &bytes[..cut]);
        let loaded = load_with(&path, &ReadOptions::default()).unwrap();
        assert_says(&loaded.notes.join(" "), &["the file has no end"]);
        assert!(!loaded.recording.is_empty() && loaded.recording.len() as u64 == loaded.kept.rows);
    }
    let mut flipped = bytes.clone();
    // A digit of a current, so that only the checksum tells.
    let digits = b"0.0333333";
    let place = (200_000..).find(|&at| &bytes[at..at + digits.len()] == digits).unwrap();
    flipped[place + 5] ^= 1;
    assert_says(&message("flipped.mcap", &flipped), &["after message"]);
    assert!(matches!(load(Path::new("run.bag")), Err(RecordingError::UnknownKind { .. })));
}

#[test]
fn uneven_columns_are_not_written() {
    let directory = tempfile::tempdir().unwrap();
    let mut uneven = awkward(10, true);
    uneven.enable.pop();
    for name in ["run.csv", "run.mcap"] {
        let path = directory.path().join(name);
        let written = if name.ends_with("csv") { write_csv(&path, &uneven) } else { write_mcap(&path, &uneven) };
        assert!(written.is_err());
    }
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0, "nothing is left behind");
}
