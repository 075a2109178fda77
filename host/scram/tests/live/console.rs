//! `scram console` on a pseudo-terminal: the real program, the real serial code, robots behind it in real time.
#![cfg(unix)]

use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use crate::common::policy::steering_policy;
use crate::common::tty::{OnTty, SEED};
use crate::common::{self, robot_file};
use control::protocol::radio::Reset;
use control::{Fault, State};
use recording::{ReadOptions, SessionEvent, events, load_with};
use robot_file::gait::GaitFile;
use serde_json::Value;
use testbed::injected_event::InjectedEvent;
#[cfg(target_os = "linux")]
use testbed::peers::{skip, skip_anywhere};
use testbed::setup::{DONGLE, pairing};

impl OnTty {
    fn spawn(&self, arguments: &[&str]) -> Child {
        self.command("console", arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("scram runs")
    }

    fn run(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        said(self.spawn(arguments).wait_with_output().expect("it ends"))
    }
}

fn said(output: Output) -> (Option<i32>, String, String) {
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn lines(stdout: &str) -> Vec<Value> {
    stdout.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"))).collect()
}

#[test]
fn commands_are_done_one_after_the_other_and_recorded() {
    let tty = OnTty::new(1);
    let commands = "clear; freq 7; wait 1s; status; set frequency_hz 9; get frequency_hz; note here; stop; status";
    let (code, stdout, stderr) = tty.run(&["--json", "--command", commands]);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    let told = lines(&stdout);
    let kinds: Vec<&str> = told.iter().map(|line| line["kind"].as_str().expect("a kind")).collect();
    assert_eq!(kinds, ["answer", "answer", "robot", "answer", "answer", "robot"], "{stdout}");
    assert_eq!(told[2]["state"], "speed");
    let frequency = told[2]["frequency_hz"].as_f64().expect("a number");
    assert!((frequency - 7.0).abs() < 0.4, "{frequency} Hz");
    let parameter = &told[4]["parameter"];
    assert_eq!(
        (&parameter["value"], &parameter["factory"], &parameter["unit"]),
        (&9.0.into(), &12.0.into(), &"Hz".into())
    );
    assert_eq!((&told[5]["state"], &told[5]["fault"]), (&"idle".into(), &Value::Null));
    assert_eq!(tty.states(), [(State::Idle, None)]);

    let path = tty.recording();
    let loaded = load_with(&path, &ReadOptions::default()).expect("a recording");
    assert!(loaded.recording.len() > 900, "{}", loaded.recording.len());
    assert!(loaded.recording.enable.iter().filter(|on| **on).count() > 900);
    let events = events(&path).expect("events");
    let typed: Vec<&str> = events
        .iter()
        .filter_map(
            |event| if let SessionEvent::Command { text, .. } = &event.event { Some(text.as_str()) } else { None },
        )
        .collect();
    assert_eq!(typed, ["clear", "freq 7", "set frequency_hz 9", "get frequency_hz"]);
    assert!(events.iter().any(|event| event.event == SessionEvent::Stop));
    assert!(events.iter().any(|event| matches!(&event.event, SessionEvent::Note { text } if text == "here")));
}

#[test]
fn a_gait_is_sent_once_kept_over_a_restart_and_played() {
    let tty = OnTty::new(1);
    let file = tty.directory.path().join("turn.toml");
    let turn = GaitFile::new("turn", 0.4, true, &[7.0, -7.0]).expect("good");
    turn.save(&file).expect("written");
    let gait = format!("gait {}", file.display());
    let (code, stdout, stderr) =
        tty.run(&["--command", &format!("clear; {gait}; wait 1s; status; stop; {gait}; stop; status")]);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    let lines: Vec<&str> = stdout.lines().collect();
    let (sent, done) = ("keep gait turn: done", "gait turn: done");
    let kept = lines.iter().filter(|line| **line == sent).count();
    let played = lines.iter().filter(|line| **line == done).count();
    assert_eq!((kept, played), (1, 2), "{stdout}");
    assert!(stdout.contains("gait, ") && stdout.contains("idle, "), "{stdout}");
    // What was sent is in the recording.
    let events = events(&tty.recording()).expect("events");
    let recorded = events.iter().find_map(|event| match &event.event {
        SessionEvent::Command { gait: Some(gait), .. } => Some(**gait),
        _ => None,
    });
    assert_eq!(recorded, Some(*turn.gait()));
    // It is there after the battery was out, and another one of the same name is not taken for it.
    tty.simulation.apply(InjectedEvent::PowerCut(0));
    tty.simulation.apply(InjectedEvent::Boot(0, Reset::PowerOn));
    let (code, stdout, stderr) = tty.run(&["--command", &format!("clear; {gait}; stop")]);
    assert_eq!((code, stdout.contains("keep gait")), (Some(0), false), "{stdout}{stderr}");
    GaitFile::new("turn", 0.4, true, &[6.0, -7.0]).and_then(|other| other.save(&file)).expect("written");
    let (code, stdout, stderr) = tty.run(&["--command", &format!("{gait}; stop")]);
    assert_eq!((code, stdout.contains("keep gait turn: done")), (Some(0), true), "{stdout}{stderr}");
    // Refused with its reason, and the one before stays; a file that is none is wrong usage of nothing.
    GaitFile::new("fast", 0.4, true, &[14.0]).and_then(|fast| fast.save(&file)).expect("written");
    let (code, stdout, stderr) = tty.run(&["--command", &gait]);
    let said = format!("{stdout}{stderr}");
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("the gait's frequencies must be from 1.0000 to 12.0000 Hz, not 14.0000"), "{said}");
    std::fs::write(&file, "name = \"x\"\n").expect("written");
    let (code, stdout, stderr) = tty.run(&["--command", &gait]);
    let said = format!("{stdout}{stderr}");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("turn.toml") && said.contains("steps_hz"), "{said}");
}

#[test]
fn an_extended_file_is_pushed_and_kept() {
    let tty = OnTty::new(1);
    let extended = tty.directory.path().join("extended.toml");
    let late = "\n[effects.sensor_delay]\ndelay_s = { value = 3e-3, low = 3e-3, high = 3e-3, source = \"test\" }\n";
    std::fs::write(&extended, std::fs::read_to_string(robot_file()).expect("the robot file") + late).expect("writes");
    let file = extended.display().to_string();
    let (code, stdout, stderr) = tty.run(&["--push", &file]);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert_eq!(stdout, "effects.sensor_delay.delay_s = 0.003 s (built in: 0)\nsave: done\n", "{stderr}");
    // It is there after the battery was out.
    tty.simulation.apply(InjectedEvent::PowerCut(0));
    tty.simulation.apply(InjectedEvent::Boot(0, Reset::PowerOn));
    let (code, stdout, stderr) = tty.run(&["--push", &file]);
    assert_eq!((code, stdout.as_str()), (Some(0), ""), "{stderr}");
    assert!(stderr.contains("every parameter that can be sent already"), "{stderr}");
    // What would weaken a failsafe is left alone, and said.
    let text = std::fs::read_to_string(&extended)
        .expect("the file")
        .replace("drop_v = { value = 2.07", "drop_v = { value = 2.2");
    std::fs::write(&extended, text).expect("writes");
    let (code, stdout, stderr) = tty.run(&["--push", &file]);
    assert_eq!(code, Some(3), "{stdout}{stderr}");
    assert!(stderr.contains("not sent: effects.driver_drop.drop_v stays 2.07 V"), "{stderr}");
}

#[test]
fn exit_codes_say_what_went_wrong() {
    let tty = OnTty::new(1);
    for (commands, expected, words) in [
        ("frek 7", 2, "did you mean `freq`?"),
        ("freq 7", 3, "refused"),
        ("clear; freq 50", 3, "refused"),
        ("clear; freq 7; wait 20s", 5, "stopped itself"),
    ] {
        if expected == 5 {
            tty.simulation.apply(InjectedEvent::Fault(0, hal_sim::Fault::Stalled));
        }
        let (code, stdout, stderr) = tty.run(&["--command", commands]);
        assert_eq!(code, Some(expected), "{commands}: {stdout}{stderr}");
        assert!(format!("{stdout}{stderr}").contains(words), "{commands}: {stdout}{stderr}");
        assert!(!tty.states()[0].0.is_driving(), "{commands}");
    }
    tty.simulation.apply(InjectedEvent::PowerCut(0));
    let (code, _, stderr) = tty.run(&["--command", "status"]);
    assert_eq!(code, Some(1), "{stderr}");
    assert!(stderr.contains("does not answer"), "{stderr}");
    let (code, stdout, _) = tty.run(&["--command", "list"]);
    assert_eq!(code, Some(0));
    assert!(stdout.contains("not heard"), "{stdout}");
}

#[test]
fn a_robot_that_goes_while_it_drives_is_exit_code_4() {
    let tty = OnTty::new(1);
    let child = tty.spawn(&["--command", "clear; freq 7; wait 20s"]);
    tty.wait_until("drives", |tty| tty.states()[0].0 == State::Speed);
    tty.simulation.apply(InjectedEvent::Place(0, 1e4));
    let (code, stdout, stderr) = said(child.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(4), "{stdout}{stderr}");
    assert_eq!(tty.states(), [(State::Fault, Some(Fault::CommandTooOld))]);
}

#[test]
fn however_it_ends_the_robot_is_told_to_stop_and_what_is_not_done_is_said() {
    let tty = OnTty::new(1);
    for (commands, expected, words) in [
        ("clear; freq 7", 0, "freq 7: done"),
        ("freq 7; quit; freq -7", 0, "freq 7: done"),
        ("robot nobody; freq 7", 1, "there is no robot `nobody`"),
        ("wait 100ms; undo", 1, "there is no `set` to take back"),
        ("note a; script missing.txt", 2, "`script` stands alone"),
    ] {
        let (code, stdout, stderr) = tty.run(&["--command", commands]);
        assert_eq!(code, Some(expected), "{commands}: {stdout}{stderr}");
        assert!(format!("{stdout}{stderr}").contains(words), "{commands}: {stdout}{stderr}");
        assert!(!stdout.contains("freq -7"), "{stdout}");
        assert_eq!(tty.states(), [(State::Idle, None)], "{commands}");
    }
}

#[test]
fn a_script_drives_several_robots_and_a_wrong_line_is_named() {
    let tty = OnTty::new(2);
    let script = tty.directory.path().join("gait.txt");
    std::fs::write(&script, "clear\nfreq 7 # the first\nrobot 2\nclear; freq -7\nwait 0.5\nstop all\n")
        .expect("writes");
    let path = script.display().to_string();
    let child = tty.spawn(&["--script", &path]);
    tty.wait_until("both drive", |tty| tty.states().iter().all(|(state, _)| *state == State::Speed));
    let (code, stdout, stderr) = said(child.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    assert!(tty.states().iter().all(|(state, _)| *state == State::Idle));
    let names = ["robot-0", "robot-1"];
    for name in names {
        let options = ReadOptions { robot: Some(name.to_owned()), ..ReadOptions::default() };
        let loaded = load_with(&tty.recording(), &options).expect("its part");
        assert!(loaded.recording.enable.iter().any(|on| *on), "{name}");
    }
    std::fs::write(&script, "clear\nfrek 7\n").expect("writes");
    let (code, _, stderr) = tty.run(&["--script", &path]);
    assert_eq!(code, Some(2));
    assert!(stderr.contains("gait.txt, line 2: there is no command `frek`"), "{stderr}");
}

#[test]
fn a_console_that_is_killed_stops_the_robot_and_loses_nothing_recorded() {
    let tty = OnTty::new(1);
    let mut child = tty.spawn(&["--command", "clear; freq 7; wait 20s"]);
    tty.wait_until("drives", |tty| tty.states()[0].0 == State::Speed);
    std::thread::sleep(Duration::from_secs(1));
    child.kill().expect("SIGKILL");
    child.wait().expect("it ends");
    let took = tty.wait_until("stops by itself", |tty| !tty.simulation.robots()[0].actuation.enable);
    // Half a second by the robot's clock; the rest is this busy machine's.
    assert!(took < Duration::from_millis(1500), "{took:?}");
    assert_eq!(tty.states(), [(State::Fault, Some(Fault::CommandTooOld))]);
    let loaded = load_with(&tty.recording(), &ReadOptions::default()).expect("a recording without an end");
    assert!(loaded.recording.len() > 700, "{}", loaded.recording.len());
    assert!(loaded.notes.iter().any(|note| note.contains("cut off")), "{:?}", loaded.notes);

    // A person clears it from a new console.
    let (code, stdout, stderr) = tty.run(&["--command", "freq 7"]);
    assert_eq!(code, Some(3), "{stdout}{stderr}");
    let (code, stdout, stderr) = tty.run(&["--command", "clear; freq 7; wait 100ms; stop"]);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
}

#[test]
fn a_dongle_that_is_pulled_out_is_said_and_the_recording_is_whole() {
    let mut tty = OnTty::new(1);
    let child = tty.spawn(&["--command", "clear; freq 7; wait 20s"]);
    tty.wait_until("drives", |tty| tty.states()[0].0 == State::Speed);
    tty.simulation.unplug();
    let (code, stdout, stderr) = said(child.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(1), "{stdout}{stderr}");
    // A real port breaks; a pseudo-terminal may only fall silent.
    let said = ["the line to the dongle broke", "the dongle has been silent"];
    assert!(said.iter().any(|said| stderr.contains(said)), "{stderr}");
    let loaded = load_with(&tty.recording(), &ReadOptions::default()).expect("a recording");
    assert!(!loaded.notes.iter().any(|note| note.contains("cut off")), "{:?}", loaded.notes);
}

/// Whether the robot drives on and is told to stop with nothing recorded any more, and how a person hears of it.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_the_robot_drives_on_and_the_exit_code_is_1() {
    let tty = OnTty::new(1);
    let at = |name: &str| tty.directory.path().join(name);
    std::fs::create_dir(at("tiny")).expect("a directory");
    let script = "\"$@\"; code=$?; cp \"$TINY\"/console-0001.mcap \"$TINY\"/../kept.mcap; exit $code";
    let Some(mut command) = common::command::on_a_disk_of(&at("tiny"), "256k", script) else {
        skip_anywhere("this user may not mount a file system of his own");
        return;
    };
    let commands = "clear; freq 7; wait 4s; status; stop";
    command.args(tty.words("console")).arg("--out").arg(at("tiny")).args(["--json", "--command", commands]);
    let (code, stdout, stderr) = said(command.output().expect("it runs"));
    assert_eq!(code, Some(1), "{stdout}{stderr}");
    for part in [
        "not everything was recorded: ",
        "tiny/console-0001.mcap: the disk is full: what was recorded until then is kept and can be read",
        "choose another directory with --out",
    ] {
        assert!(stderr.contains(part), "`{stderr}` does not say `{part}`");
    }
    let told = lines(&stdout);
    let status = told.iter().find(|line| line["kind"] == "robot").expect("a status");
    assert_eq!((&status["state"], &status["fault"]), (&"speed".into(), &Value::Null), "{stdout}");
    assert_eq!(tty.states(), [(State::Idle, None)]);
    // It was full long before the end.
    let loaded = load_with(&at("kept.mcap"), &ReadOptions::default()).expect("what was recorded until then");
    let rows = loaded.recording.len();
    assert!((300..3500).contains(&rows), "{rows} rows");
}

/// A terminal window with the console in it, which is closed while the robot drives: the exit code of the console.
#[cfg(target_os = "linux")]
fn closed_window(tty: &OnTty, arguments: &[&str], keys: &[u8], rows: u16) -> Option<i32> {
    let code = tty.directory.path().join("code");
    let quoted = |word: OsString| format!("'{}'", word.to_str().expect("UTF-8"));
    let mut words: Vec<String> = tty.words("console").into_iter().map(quoted).collect();
    words.extend(["--out".to_owned(), quoted(tty.directory.path().into())]);
    words.extend(arguments.iter().map(|word| quoted(word.into())));
    // As a person's shell does, this one hands the end of its window on; it outlives it, to tell. That signal may interrupt
    // the wait (more than 128), or come when the console has ended: then a second wait would know nothing of it.
    let shell = format!(
        "stty rows {rows} cols 120; exec 3<&0; {} <&3 & child=$!; trap 'kill -HUP $child' HUP; \
         wait $child; code=$?; if [ $code -gt 128 ]; then wait $child; code=$?; fi; echo $code > '{}'",
        words.join(" "),
        code.display()
    );
    if Command::new("script").arg("--version").stdout(Stdio::null()).status().is_err() {
        skip("there is no `script`");
        return None;
    }
    // Below `nohup` a closed window is ignored, and these tests may run below it.
    let mut window = Command::new("env")
        .args(["--default-signal=HUP", "script", "--quiet", "--command", &shell, "/dev/null"])
        .env("SHELL", "/bin/sh")
        .env("TERM", "xterm")
        .env("XDG_STATE_HOME", tty.directory.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("env");
    let mut keyboard = window.stdin.take().expect("a pipe");
    tty.wait_until("the console is open", |tty| {
        let listed = std::fs::read_dir(tty.directory.path()).expect("a directory");
        listed.flatten().any(|entry| entry.path().extension().is_some_and(|extension| extension == "mcap"))
    });
    std::thread::sleep(Duration::from_secs(1));
    keyboard.write_all(keys).expect("it takes keys");
    tty.wait_until("drives", |tty| tty.states()[0].0 == State::Speed);
    std::thread::sleep(Duration::from_millis(300));
    window.kill().expect("SIGKILL");
    window.wait().expect("it ends");
    tty.wait_until("the console has ended", |_| code.exists());
    std::thread::sleep(Duration::from_millis(100));
    std::fs::read_to_string(&code).expect("its code").trim().parse().ok()
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminal_window_that_is_closed_ends_the_console_in_order() {
    // Without a screen; with one; and in a window that is too small for a prompt, which hides the cursor.
    let cases: [(&[&str], &[u8], u16); 3] = [
        (&["--command", "clear; freq 7; wait 20s"], b"", 40),
        (&[], b"clear; freq 7\r", 40),
        (&[], b"clear; freq 7\r", 3),
    ];
    for (arguments, keys, rows) in cases {
        let tty = OnTty::new(1);
        let Some(code) = closed_window(&tty, arguments, keys, rows) else { return };
        assert_eq!(code, 1, "{arguments:?}, {rows} rows");
        assert_eq!(tty.states(), [(State::Idle, None)], "{arguments:?}: it was told to stop");
        let loaded = load_with(&tty.recording(), &ReadOptions::default()).expect("a recording");
        assert!(!loaded.notes.iter().any(|note| note.contains("cut off")), "{arguments:?}: {:?}", loaded.notes);
        let events = events(&tty.recording()).expect("events");
        assert!(events.iter().any(|event| event.event == SessionEvent::Stop), "{arguments:?}");
    }
}

#[test]
fn no_key_is_in_what_is_written() {
    let tty = OnTty::new(1);
    let (code, stdout, stderr) =
        tty.run(&["--json", "--command", "clear; status; get frequency_hz; params limits; help"]);
    assert_eq!(code, Some(0), "{stdout}{stderr}");
    let secret = pairing(DONGLE, SEED, 0);
    let recorded = std::fs::read(tty.recording()).expect("a file");
    for key in [&secret.key.0[..], &secret.local, &secret.primary] {
        let hex: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
        for written in [&recorded[..], stdout.as_bytes(), stderr.as_bytes()] {
            assert!(!written.windows(8).any(|some| some == &key[..8]), "raw");
            assert!(!written.windows(16).any(|some| some == &hex.as_bytes()[..16]), "in hexadecimal");
        }
    }
}

#[test]
fn the_simulation_needs_no_keys_and_without_a_port_the_ports_are_listed() {
    let out = tempfile::tempdir().expect("a directory");
    let scram = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_scram"));
        command.arg("console").args(["--robot"]).arg(robot_file()).args(["--out"]).arg(out.path()).args(arguments);
        said(command.output().expect("scram runs"))
    };
    let (code, stdout, stderr) = scram(&["--sim", "--robots", "2", "--command", "list"]);
    assert_eq!(code, Some(0), "{stderr}");
    assert_eq!(stdout.lines().count(), 2, "{stdout}");
    assert!(stdout.lines().all(|line| line.contains("FAULT (it has restarted)")), "{stdout}");
    let (code, _, stderr) = scram(&[]);
    assert_eq!(code, Some(2));
    assert!(stderr.contains("which dongle?") && stderr.contains("--sim"), "{stderr}");
    let (code, _, stderr) = scram(&["--sim", "--pick", "nobody", "--command", "status"]);
    assert_eq!(code, Some(2), "{stderr}");
    let (code, _, stderr) = scram(&["--sim"]);
    assert_eq!(code, Some(1), "no terminal");
    assert!(stderr.contains("no terminal"), "{stderr}");
}

/// Pose to policy to radio to the robot's tasks to its motor to its body, and back by UDP: a policy of one layer that turns the robot back
/// to where it looked keeps its heading, which a frequency alone turns by 5.6 °/s.
#[test]
fn a_simulated_robot_walks_by_its_poses() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = steering_policy(directory.path(), 0.2, [-8.0, 8.0]);
    let turned = |command: &str, name: &str| {
        let out = directory.path().join(name);
        let commands = format!("clear; {command}; wait 8s; stop");
        let output = Command::new(env!("CARGO_BIN_EXE_scram"))
            .args(["console", "--sim", "--poses", "127.0.0.1:0", "--alpha", "90", "--command", &commands, "--robot"])
            .args([robot_file(), PathBuf::from("--out"), out.clone()])
            .output()
            .expect("scram runs");
        let (code, stdout, stderr) = said(output);
        assert_eq!(code, Some(0), "{stdout}{stderr}");
        let loaded = load_with(&out.join("console-0001.mcap"), &ReadOptions::default()).expect("a recording");
        let poses: Vec<[f64; 3]> = loaded.recording.pose.iter().copied().flatten().collect();
        assert!(poses.len() > 600, "{} poses", poses.len());
        let (first, last) = (poses[0], poses[poses.len() - 1]);
        (last[2] - first[2]).to_degrees()
    };
    let (by_poses, without) = (turned(&format!("policy {}", file.display()), "by-poses"), turned("freq 8", "without"));
    assert!(without.abs() > 30.0 && by_poses.abs() < 10.0, "{by_poses}° by its poses, {without}° without");
}
