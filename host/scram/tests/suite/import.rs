//! `scram import` and `scram diagnose --mapping`, as a person runs them on another rig's files.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use crate::common::command::{fails, json, refuses, scram, succeeds, succeeds_saying, temporary};
use crate::common::root;
use recording::{AngleReading, Drive, ReadOptions, Recording, load, load_with};
use testbed::peers::skip_anywhere;

const WORDS: &str = "--map time=Time:ms --map angle=Pos:deg --map duty=PWM:255 --map supply=Vbat:mV";

/// Angle, rad, and PWM of 255 of a motor that swings, at a time.
fn swing(t_s: f64) -> (f64, i32) {
    (1.5 - 1.5 * (TAU * t_s).cos(), (200.0 * (TAU * t_s).sin()).round() as i32)
}

/// A rig's table: milliseconds, degrees, counts of 255, millivolts, semicolons, decimal commas, a byte order mark.
fn rig() -> String {
    let mut text = String::from("\u{feff}Time;Pos;PWM;Vbat;Mode\r\n");
    for row in 0..400 {
        let (angle, pwm) = swing(f64::from(row) * 0.004);
        let line = format!("{};{:.4};{pwm};{};auto\r\n", row * 4, angle.to_degrees(), 7400 + row % 3);
        text += &line.replace('.', ",");
    }
    text
}

fn write(directory: &Path, name: &str, text: impl AsRef<[u8]>) {
    std::fs::write(directory.join(name), text).unwrap();
}

fn duty(recording: &Recording) -> &[f64] {
    match &recording.drive {
        Drive::Duty(duty) => duty,
        Drive::Voltage(_) => panic!("a voltage in place of a duty"),
    }
}

fn angles(recording: &Recording) -> Vec<Option<f64>> {
    match &recording.angle {
        AngleReading::Angle(angle) => angle.clone(),
        AngleReading::Adc(_) => panic!("codes in place of angles"),
    }
}

#[test]
fn a_rigs_table_becomes_a_recording_in_si() {
    let directory = temporary();
    let at = directory.path();
    write(at, "rig.csv", rig());
    let (said, message) = succeeds_saying(at, &format!("import rig.csv {WORDS}"));
    assert!(said.contains("400 of 400 rows, 0.000 … 1.596 s, written: out/import-0001/rig.mcap"), "{said}");
    assert!(message.contains("columns that are not mapped: Mode") && !message.contains("warning"), "{message}");

    let loaded = load_with(&at.join("out/latest-import/rig.mcap"), &ReadOptions::default()).unwrap();
    let run = &loaded.recording;
    assert_eq!((run.len(), run.t_s[1], run.supply_v[2]), (400, 0.004, 7.402));
    for row in 0..400 {
        let (angle, pwm) = swing(f64::from(row as u16) * 0.004);
        assert!((angles(run)[row].unwrap() - angle).abs() < 1e-6, "row {row}");
        assert!((duty(run)[row] - f64::from(pwm) / 255.0).abs() < 1e-12, "row {row}");
    }
    let import = loaded.metadata.import.expect("what was imported");
    assert_eq!((import.source.as_str(), import.rows, import.samples), ("rig.csv", 400, 400));
    assert_eq!(import.mapping, ["time=Time:ms", "angle=Pos:deg", "duty=PWM:255", "supply=Vbat:mV"]);
    assert_eq!(import.not_mapped, ["Mode"]);
}

#[test]
fn a_mapping_file_says_the_same_and_words_go_before_it() {
    let directory = temporary();
    let at = directory.path();
    write(at, "rig.csv", rig());
    let mapping = "[columns]\ntime = { column = \"Time\", unit = \"ms\" }\nangle = { column = \"Pos\", unit = \"deg\" }\n\
                   duty = { column = \"PWM\", full_scale = 255 }\nsupply = { column = \"Vbat\", unit = \"mV\" }\n";
    write(at, "rig.toml", mapping);
    succeeds(at, &format!("import rig.csv {WORDS} --format csv --out words"));
    succeeds(at, "import rig.csv --mapping rig.toml --format csv --out file");
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    assert_eq!(read("words/rig.csv"), read("file/rig.csv"));
    assert_eq!(read("words/rig.toml"), read("file/rig.toml"));
    let message = succeeds_saying(at, "import rig.csv --mapping rig.toml --map angle=-Pos:deg+90 --out turned").1;
    assert!(message.contains("turns against its drive"), "{message}");
    let angle = angles(&load(&at.join("turned/rig.mcap")).unwrap())[100].unwrap();
    assert!((angle - (90f64.to_radians() - swing(0.4).0)).abs() < 1e-6, "{angle}");
}

#[test]
fn the_window_and_the_rows_left_out_are_counted() {
    let directory = temporary();
    let at = directory.path();
    write(at, "rig.csv", "Time,Pos,PWM\n0,0,0\n10,1,20\n20,,40\n30,3,nan\n,4,60\n50,5,80\n60,6,100\n");
    let words = "import rig.csv --map time=Time:ms --map angle=Pos:deg --map duty=PWM:100 --from 0.01 --to 0.05 --json";
    let (said, message) = succeeds_saying(at, words);
    let run = load(&at.join("out/import-0001/rig.mcap")).unwrap();
    assert_eq!((run.t_s.as_slice(), duty(&run)), (&[0.01, 0.02, 0.05][..], &[0.2, 0.4, 0.8][..]));
    assert_eq!(angles(&run)[1], None, "its drive is known, its angle is not");
    let imported = &json(&said)["recordings"][0]["import"];
    assert_eq!((&imported["rows"], &imported["samples"]), (&7.into(), &3.into()));
    let left_out = [
        "1 row before 0.01 s",
        "1 row after 0.05 s",
        "1 row left out: no time",
        "1 row left out: no drive",
        "1 row without an angle",
    ];
    for part in left_out {
        assert!(message.contains(part), "`{message}` does not say `{part}`");
        assert!(imported["left_out"].to_string().contains(part), "{imported} does not say `{part}`");
    }
    assert!(message.contains("sampled unevenly"), "{message}");
}

#[test]
fn a_voltage_over_its_supply_is_the_duty() {
    let directory = temporary();
    let at = directory.path();
    write(at, "rig.csv", "t,a,u,i\n0,0,6,500\n0.01,0.1,-3,-250\n0.02,0.2,12.3,0\n");
    let words = "import rig.csv --map time=t:s --map angle=a:turns --map current=i:mA";
    let message = succeeds_saying(at, &format!("{words} --map voltage=u:V --supply 12 --out duty")).1;
    assert!(message.contains("rows whose voltage is above the supply: 1;"), "{message}");
    let run = load(&at.join("duty/rig.mcap")).unwrap();
    assert_eq!((duty(&run), run.supply_v.as_slice()), (&[0.5, -0.25, 1.0][..], &[12.0; 3][..]));
    assert_eq!(run.current_a, [Some(0.5), Some(-0.25), Some(0.0)]);
    for (words, out) in [
        (format!("{words} --map voltage=u:V"), "alone"),
        (format!("{words} --map terminal_voltage=u:V --supply 12"), "end"),
    ] {
        succeeds(at, &format!("{words} --out {out}"));
        let run = load(&at.join(out).join("rig.mcap")).unwrap();
        assert_eq!(run.drive, Drive::Voltage(vec![6.0, -3.0, 12.3]), "{words}");
    }
    refuses(
        at,
        &format!("{words} --map voltage=u:V --supply 5"),
        1,
        &["line 2, column `u`", "6 V is more than the supply of 5 V"],
    );
}

#[test]
fn a_speed_is_integrated_and_a_rate_stands_for_the_time() {
    let directory = temporary();
    let at = directory.path();
    let mut text = String::from("rpm,PWM\n");
    for row in 0..101 {
        let speed = if row == 50 { String::new() } else { format!("{}", 0.6 * f64::from(row)) };
        let _ = writeln!(text, "{speed},{}", row % 7);
    }
    write(at, "rig.csv", text);
    let message = succeeds_saying(at, "import rig.csv --rate 100 --map speed=rpm:rpm --map duty=PWM:255 --out out").1;
    assert!(message.contains("the integral of \"rpm\""), "{message}");
    let run = load(&at.join("out/rig.mcap")).unwrap();
    // From 0 to 60 rpm within 1 s: half a turn. The rule is exact for a ramp, across the row without a speed, too.
    let end = angles(&run)[100].unwrap();
    assert!((run.t_s[100] - 1.0).abs() < 1e-12 && (end - TAU / 2.0).abs() < 1e-9, "{end}");
    assert_eq!(angles(&run)[50], None);
}

#[test]
fn a_servos_goal_gives_its_duty() {
    let directory = temporary();
    let at = directory.path();
    write(at, "servo.csv", "t,enc,goal\n0,2048,10\n0.01,2048,-90\n0.02,1024,-90\n");
    let words = "import servo.csv --map time=t:s --map angle=enc:counts/4096-2048 --map goal=goal:deg";
    succeeds(at, &format!("{words} --p-gain 32 --p-full-scale 8 --p-max-duty 0.9 --out out"));
    let run = load(&at.join("out/servo.mcap")).unwrap();
    let expected = 32.0 / 8.0 * 10f64.to_radians();
    assert!((duty(&run)[0] - expected).abs() < 1e-12, "{:?}", run.drive);
    assert_eq!((duty(&run)[1], duty(&run)[2]), (-0.9, 0.0));
    refuses(at, words, 1, &["a goal position alone does not say how the motor was driven", "--p-gain"]);
}

#[test]
fn a_log_of_bam_needs_no_mapping() {
    let directory = temporary();
    let at = directory.path();
    let entries = (0..200).map(|row| {
        let t = f64::from(row) * 0.005;
        let (angle, _) = swing(t);
        format!(
            r#"{{"position": {angle}, "speed": 0.0, "load": 3, "input_volts": 7.3, "temp": 28, "timestamp": {t},
                "goal_position": {}, "torque_enable": {}}}"#,
            angle + 0.5,
            row < 150
        )
    });
    let entries = entries.collect::<Vec<_>>().join(",\n");
    let log = |motor: &str| {
        format!(
            r#"{{"mass": 0.49, "arm-mass": 0.01, "length": 0.1, "kp": 100, "vin": 7.4, "motor": "{motor}", "trajectory": "sin_sin",
                "entries": [{entries}]}}"#
        )
    };
    write(at, "log.json", log("xl330"));
    write(at, "own.json", log("own"));
    let (_, message) = succeeds_saying(at, "import log.json --out out");
    assert!(
        message.contains("computed from goal and angle") && message.contains("not mapped: load, speed"),
        "{message}"
    );
    let loaded = load_with(&at.join("out/log.mcap"), &ReadOptions::default()).unwrap();
    let full_scale = 256.0 * 885.0 * TAU / 4096.0;
    assert!((duty(&loaded.recording)[10] - 100.0 * 0.5 / full_scale).abs() < 1e-9, "{:?}", loaded.recording.drive);
    assert_eq!((loaded.recording.enable[149], loaded.recording.enable[150]), (true, false));
    assert_eq!(loaded.metadata.excitation.as_deref(), Some("sin_sin"));
    assert!(loaded.metadata.notes.unwrap().contains("mass 0.49 kg, arm_mass 0.01 kg, length 0.1 m"));

    refuses(at, "import own.json --out own", 1, &["own.json: motor `own`", "--p-full-scale"]);
    succeeds(at, "import own.json --map duty=load:885 --out own");
    assert!((duty(&load(&at.join("own/own.mcap")).unwrap())[0] - 3.0 / 885.0).abs() < 1e-15);
}

/// Written by scipy: `host/recording/tests/fixtures/make_mat.py`.
#[test]
fn a_mat_file_becomes_a_recording() {
    let directory = temporary();
    let at = directory.path();
    let fixtures = "@/host/recording/tests/fixtures";
    let words = "--map time=t:s --map angle=pos:deg --map duty=pwm:30 --map supply=log.inner.volts:V";
    for name in ["scipy", "scipy-compressed"] {
        let message = succeeds_saying(at, &format!("import {fixtures}/{name}.mat {words} --out out")).1;
        assert!(message.contains("not mapped: single, log.t, two(:,1), two(:,2)"), "{message}");
        let run = load(&at.join("out").join(format!("{name}.mcap"))).unwrap();
        assert_eq!(run.len(), 50);
        for row in 0..50 {
            let t = f64::from(row as u16) * 0.01;
            let angle = 1.0 - (TAU * t).cos();
            assert!(
                (run.t_s[row] - t).abs() < 1e-12 && (angles(&run)[row].unwrap() - angle).abs() < 1e-12,
                "row {row}"
            );
            assert!((duty(&run)[row] - (f64::from(row as u16) - 20.0) / 30.0).abs() < 1e-12, "row {row}");
        }
    }
    refuses(
        at,
        &format!("import {fixtures}/scipy.mat --map time=Time:s"),
        1,
        &["\"Time\" is not there; the file has: t, pos"],
    );
    write(at, "new.mat", "MATLAB 7.3 MAT-file, Platform: GLNXA64");
    refuses(at, "import new.mat --map time=t:s", 1, &["new.mat: a file of version 7.3 (HDF5)", "-v7"]);
    let whole = std::fs::read(root().join("host/recording/tests/fixtures/scipy.mat")).unwrap();
    write(at, "cut.mat", &whole[..700]);
    refuses(at, "import cut.mat --map time=t:s", 1, &["cut.mat: the file is damaged or cut off at byte"]);
}

#[test]
fn what_cannot_be_meant_is_refused_with_its_place() {
    let directory = temporary();
    let at = directory.path();
    let words = "import rig.csv --map time=t:s --map angle=a:deg --map duty=u:255";
    let bad = |text: &str, says: &[&str]| {
        write(at, "rig.csv", text);
        fails(at, words, 1, says);
    };
    bad("t,Position,u\n0,1,2\n", &["rig.csv: column \"a\" is not there; the file has: t, Position, u"]);
    bad("t,a,u,u\n0,1,2,2\n", &["rig.csv: column `u` occurs twice"]);
    bad("t,a,u\n0,1,2\n0.1,1,2\n0.05,1,2\n", &["rig.csv, line 4, column `t`: time goes backwards: 0.05 s after 0.1 s"]);
    bad("t,a,u\n0,1,2\n0.1,1,2\n0.1,1,2\n", &["rig.csv, line 4, column `t`", "is repeated: 0.1 s", "--rate HZ"]);
    bad("t,a,u\n0,1,2\n0.1,x,2\n", &["rig.csv, line 3, column `a`: `x` is not a number"]);
    bad("t,a,u\n0,1,256\n", &["rig.csv, line 2, column `u`: as duty of full scale 255: 1.00", "is the unit right?"]);
    bad("t,a,u\n0,1,2\n10,1,2\n20,1,2\n", &["column `t`: as time in `s`: time advances by 10"]);
    bad("t,a,u\n0,,nan\n", &["no row is left of 1: 1 row left out: no drive"]);
    bad("", &["the file is empty"]);

    write(at, "rig.csv", "t,a,u\n0,1,2\n0.1,2,3\n");
    fails(
        at,
        "import rig.csv --map time=t:s --map duty=u:255",
        1,
        &["no column is mapped to the angle", "the file has: t, a, u"],
    );
    fails(at, "import rig.csv --map angle=a:deg --map duty=u:255", 1, &["no column is mapped to the time", "--rate"]);
    fails(at, "import rig.csv --map time=t:s --map angle=a:deg", 1, &["no column is mapped to the drive"]);
    fails(at, &format!("{words} --map voltage=a:V"), 1, &["both `duty` and `voltage` are mapped"]);
    fails(at, &format!("{words} --rate 10"), 1, &["the time is in column \"t\" and in the rate"]);
    fails(at, &format!("{words} --from 5"), 1, &["no row is left of 2: 2 rows before 5 s"]);
    fails(at, &format!("{words} --from 2 --to 1"), 2, &["nothing is between --from 2 and --to 1"]);
    fails(at, &format!("{words} --map supply_current=a:A"), 2, &["no column for the supply's current"]);
    fails(at, "import rig.csv --map angle=a", 2, &["`angle=a` has no unit", "rad, deg, turns"]);
    fails(at, "import rig.csv --map angle=a:ms", 2, &["`angle` is not in `ms`"]);
    fails(at, "import rig.csv --rate 0", 2, &["the rate is 0 Hz"]);
    write(
        at,
        "rig.toml",
        "[columns]\ntime = { column = \"t\", unit = \"s\" }\nangle = { column = \"a\", unit = \"V\" }\n",
    );
    fails(at, "import rig.csv --mapping rig.toml", 1, &["rig.toml: line 3: `angle` is not in `V`"]);
    write(at, "rig.xlsx", "PK");
    fails(at, "import rig.xlsx", 1, &["rig.xlsx: files that are imported end with .csv"]);
}

#[test]
fn nothing_is_written_over_unasked() {
    let directory = temporary();
    let at = directory.path();
    write(at, "rig.csv", rig());
    std::fs::create_dir(at.join("b")).unwrap();
    write(at, "b/rig.csv", rig());
    let words = format!("import rig.csv {WORDS} --out runs");
    succeeds(at, &words);
    refuses(at, &words, 1, &["rig.mcap is there already; it is not written over"]);
    succeeds(at, &format!("{words} --overwrite"));
    refuses(
        at,
        &format!("import rig.csv b/rig.csv {WORDS} --out both"),
        2,
        &["another of the files would be rig.mcap, too"],
    );
    refuses(at, &format!("import rig.csv {WORDS} --format csv --out . --overwrite"), 1, &["is a file that was read"]);
    assert_eq!(std::fs::read_to_string(at.join("rig.csv")).unwrap(), rig());
}

#[test]
fn what_looks_wrong_is_warned_of() {
    let directory = temporary();
    let at = directory.path();
    let table = |line: &dyn Fn(f64) -> String| {
        (0..400).fold(String::from("t,a,w,u\n"), |text, row| text + &line(f64::from(row)))
    };
    let warns = |text: String, words: &str, says: &str| {
        write(at, "rig.csv", text);
        let message = succeeds_saying(at, &format!("import rig.csv {words} --out out --overwrite")).1;
        assert!(message.contains("warning: rig.csv: ") && message.contains(says), "`{message}` does not say `{says}`");
    };
    let all = "--map time=t:s --map angle=a:rad --map speed=w:rad/s --map duty=u:1";
    let line = |row: f64, angle: f64, speed: f64, duty: f64| format!("{},{angle},{speed},{duty}\n", row * 0.004);
    let sine = |row: f64| (TAU * row * 0.004).sin();
    let turn = |row: f64| 1.0 - (TAU * row * 0.004).cos();
    warns(table(&|row| line(row, turn(row), TAU * sine(row), 0.3)), all, "the drive is 0.3 in every row");
    warns(
        table(&|row| line(row, turn(row), 57.3 * TAU * sine(row), sine(row))),
        all,
        "0.017 times as fast as \"w\" says",
    );
    warns(table(&|row| line(row, turn(row), -TAU * sine(row), sine(row))), all, "turn in opposite ways");
    warns(table(&|row| line(row, turn(row), TAU * sine(row), -sine(row))), all, "turns against its drive");
    let slow = "--map time=t:s --map angle=a:rad --map duty=u:1";
    warns(table(&|row| format!("{},{},0,{}\n", row * 0.25, turn(row), sine(row))), slow, "4.00 rows a second");
    warns(table(&|row| format!("{},{},0,{}\n", row * 2e-6, 1e-4 * row, sine(row))), slow, "500000 rows a second");
    let wrapped = |row: f64| (row * 4.0 + 180.0) % 360.0 - 180.0;
    warns(
        table(&|row| format!("{},{},0,{}\n", row * 0.05, wrapped(row), sine(row))),
        slow,
        "jumps by 360: it looks like degrees",
    );
    let wrapped = |row: f64| ((row * 0.02 + 3.0) % TAU) - 3.0;
    let degrees = "--map time=t:s --map angle=a:deg --map duty=u:1";
    warns(
        table(&|row| format!("{},{},0,{}\n", row * 0.004, wrapped(row), sine(row))),
        degrees,
        "jumps by 2π: it looks like radians",
    );
}

#[test]
fn the_examples_files_are_the_runs_that_they_are_said_to_be() {
    let directory = temporary();
    let at = directory.path();
    let files = "@/examples/another-rig/run-1.csv @/examples/another-rig/run-2.csv";
    succeeds(at, &format!("import {files} --mapping @/examples/another-rig/rig.toml --out out"));
    for (name, original) in [("run-1", "run-1"), ("run-2", "run-5")] {
        let run = load(&at.join("out").join(format!("{name}.mcap"))).unwrap();
        let original = load(&root().join(format!("examples/hidden-effect/{original}.csv"))).unwrap();
        assert!(run.len() > 1500, "{name} has {} samples", run.len());
        for row in 0..run.len() {
            assert!((run.t_s[row] - original.t_s[row]).abs() < 6e-6, "{name}, row {row}");
            assert_eq!(run.enable[row], original.enable[row], "{name}, row {row}");
            assert!((duty(&run)[row] - duty(&original)[row]).abs() < 0.51 / 255.0, "{name}, row {row}");
            match (angles(&run)[row], angles(&original)[row]) {
                (Some(one), Some(other)) => assert!((one - other).abs() < 1e-4, "{name}, row {row}: {one}, {other}"),
                (one, other) => assert_eq!(one, other, "{name}, row {row}"),
            }
        }
    }
}

#[test]
fn a_diagnosis_of_foreign_files_is_that_of_the_imported_ones() {
    let directory = temporary();
    let at = directory.path();
    let files = "@/examples/another-rig/run-1.csv @/examples/another-rig/run-2.csv";
    let mapping = "--mapping @/examples/another-rig/rig.toml --from 0.2 --to 1.5";
    let robot = "--robot @/examples/hidden-effect/robot.toml --json";
    succeeds(at, &format!("import {files} {mapping} --out runs"));
    let imported = succeeds(at, &format!("diagnose runs/run-1.mcap runs/run-2.mcap {robot} --out imported"));
    let foreign = succeeds(at, &format!("diagnose {files} {mapping} {robot} --out foreign"));
    let number = |text: &str, key: &str| json(text)[key].as_f64().unwrap();
    for key in ["before", "after", "noise_floor"] {
        assert_eq!(number(&foreign, key), number(&imported, key), "{key}");
    }
    assert_eq!(json(&foreign)["causes"][0]["effect"], "gravity_tilt");
    // What was cut on import and what is cut on reading is the same part of the run.
    succeeds(at, &format!("import {files} --mapping @/examples/another-rig/rig.toml --out whole"));
    let (cut, message) = succeeds_saying(
        at,
        &format!("diagnose whole/run-1.mcap whole/run-2.mcap {robot} --from 0.2 --to 1.5 --out cut"),
    );
    assert!(message.contains("rows are outside --from and --to"), "{message}");
    assert_eq!(number(&cut, "before"), number(&imported, "before"));
    refuses(at, &format!("diagnose whole/run-1.mcap whole/run-2.mcap {robot} --from 9"), 1, &["goes from 0 s to 1."]);
}

/// The XL330's logs in the exchange format are no part of the project: see CONTRIBUTING.
#[test]
fn the_measured_servo_is_read_by_a_mapping_of_its_own_columns() {
    let file = root().join("../shared/data/xl330_csv/sin_sin_kp400.csv");
    if !file.exists() {
        skip_anywhere(&format!("{} is missing", file.display()));
        return;
    }
    let directory = temporary();
    let at = directory.path();
    let words = "--map time=t_s:s --map angle=angle_rad:rad --map duty=duty:1 --map supply=supply_v:V --map enable=enable \
                 --map temperature=temperature_c:C --out out";
    let output = scram(at, &format!("import {} {words}", file.display()));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (own, imported) = (load(&file).unwrap(), load(&at.join("out/sin_sin_kp400.mcap")).unwrap());
    assert_eq!(Recording { path: own.path.clone(), ..imported }, own);
}
