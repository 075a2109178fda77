//! `scram bring-up`: on a sound simulated board nothing fails, on a broken one the right step does and says what is wrong.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::command::{fails, json, scram, succeeds, succeeds_saying, temporary};
use crate::common::{robot, root};
use scram::bring_up::{Checked, Chip, Options, Report, StepResult, simulated, steps};
use testbed::broken::Broken;
use testbed::setup::Setup;

/// What a simulated person and a program can look at, all of it.
const LOOKED_AT: [u16; 41] = [
    1, 2, 3, 4, 6, 7, 8, 9, 10, 12, 13, 14, 16, 17, 18, 19, 21, 23, 24, 26, 27, 28, 30, 31, 38, 43, 44, 45, 46, 54, 58,
    59, 60, 62, 66, 67, 68, 69, 70, 71, 72,
];

fn walk(seed: u64, prepare: impl FnOnce(&mut Setup)) -> Report {
    let robot = robot();
    let options = Options::simulated(&robot, Chip::Esp32c3).expect("a controller");
    simulated::simulate(&robot, &options, seed, prepare, &mut |_| {}).expect("a bench")
}

fn on_broken(broken: Broken) -> Report {
    walk(1, |setup| setup.robots[0].broken.push(broken))
}

fn with(report: &Report, verdict: StepResult) -> Vec<&Checked> {
    report.steps.iter().filter(|step| step.verdict == verdict).collect()
}

fn numbers(steps: &[&Checked]) -> Vec<u16> {
    steps.iter().map(|step| step.number).collect()
}

/// Exactly these steps fail, and each says this.
#[track_caller]
fn fails_with(report: &Report, expected: &[(u16, &str)]) {
    let failed = with(report, StepResult::Failed);
    let told: Vec<String> = failed.iter().map(|step| format!("{} {:?}", step.number, step.checks)).collect();
    let wanted: Vec<u16> = expected.iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers(&failed), wanted, "{told:#?}");
    for (step, (_, says)) in failed.iter().zip(expected) {
        let wrong = step.checks.iter().filter(|check| check.verdict == StepResult::Failed);
        let text: Vec<String> = wrong.map(|check| format!("{}: {}", check.what, check.found)).collect();
        assert!(text.iter().any(|line| line.contains(says)), "{}: {text:?} does not say `{says}`", step.number);
    }
}

#[test]
fn every_line_of_the_list_has_its_step_and_every_step_its_line() {
    let list = std::fs::read_to_string(root().join("firmware/UNVERIFIED.md")).expect("the list");
    let mut lines = BTreeMap::new();
    for line in list.lines() {
        let Some((number, rest)) = line.split_once(". **") else { continue };
        let Ok(number) = number.parse::<u16>() else { continue };
        let title = rest.split("**").next().unwrap_or_default().trim_end_matches(['.', ':']);
        assert_eq!(lines.insert(number, title.to_owned()), None, "{number} twice");
    }
    assert!(lines.len() > 50, "the list is not read: {lines:?}");
    let table: BTreeMap<u16, String> = steps().map(|step| (step.number, step.title.to_owned())).collect();
    assert_eq!(table.len(), steps().count(), "a number twice");
    for (number, title) in &lines {
        assert_eq!(table.get(number), Some(title), "step {number} of firmware/UNVERIFIED.md");
    }
    let without: Vec<_> = table.keys().filter(|number| !lines.contains_key(number)).collect();
    assert!(without.is_empty(), "not in firmware/UNVERIFIED.md: {without:?}");
}

#[test]
fn on_a_sound_board_nothing_fails_and_what_can_be_looked_at_passes() {
    for seed in 1..=6 {
        let report = walk(seed, |_| {});
        fails_with(&report, &[]);
        assert_eq!(numbers(&with(&report, StepResult::Passed)), LOOKED_AT, "seed {seed}");
        assert_eq!(report.steps.len(), report.passed + report.not_checked);
    }
}

#[test]
fn a_watchdog_that_never_bites_is_found() {
    let did_not = "the watchdog did not bite";
    fails_with(&on_broken(Broken::Watchdog), &[(9, did_not), (10, did_not), (62, did_not)]);
}

#[test]
fn a_bridge_that_stays_on_after_a_crash_is_found() {
    let late = "EN's last falling edge: 50.";
    fails_with(&on_broken(Broken::PanicCut), &[(6, late), (7, late), (8, late)]);
}

#[test]
fn a_missing_pull_down_is_found() {
    let report = on_broken(Broken::PullDown);
    // It comes up again while the chip resets.
    let again = "EN's last falling edge: 50.";
    let pressed = "EN low from the button's press on";
    let (low, later) = ("EN low all the time", "EN's last falling edge; command_bound_s");
    let crashed = [(6, again), (7, again), (8, again)];
    fails_with(&report, &[&[(2, low)], &crashed[..], &[(12, pressed), (59, later), (60, later)]].concat());
}

#[test]
fn a_converter_with_one_code_is_found() {
    let report = on_broken(Broken::Converter);
    let failed = numbers(&with(&report, StepResult::Failed));
    // With it the robot does not drive at all, and says why.
    assert!(failed.contains(&14) && failed.contains(&16), "{failed:?}");
    let refused = report.steps.iter().flat_map(|step| &step.checks).filter(|check| check.verdict == StepResult::Failed);
    assert!(refused.filter(|check| check.found.contains("repeats one code at rest")).count() > 10);
    let codes = report.steps.iter().find(|step| step.number == 14).expect("it is there");
    let wrong = codes.checks.iter().find(|check| check.verdict == StepResult::Failed).expect("it fails");
    assert_eq!((wrong.what.as_str(), wrong.found.as_str()), ("code at 0.00 V", "1234"));
}

#[test]
fn a_radio_without_acknowledgement_is_found() {
    let report = on_broken(Broken::Acknowledgement);
    let mut expected = vec![(28, "frames of the robot without acknowledgement: 100.0 %")];
    // Nothing counts as sent then, so that the loss of a single message, which is drawn, is too much.
    if with(&report, StepResult::Failed).iter().any(|step| step.number == 54) {
        expected.push((54, "messages that were lost meanwhile"));
    }
    fails_with(&report, &expected);
}

#[test]
fn a_reset_that_says_nothing_of_its_cause_is_found() {
    let report = on_broken(Broken::ResetCause);
    let cause = "the reset's cause in the status after it: PowerOn";
    fails_with(&report, &[4, 6, 7, 8, 9, 10, 11, 59, 60, 62].map(|number| (number, cause)));
}

#[test]
fn a_flash_that_forgets_is_found() {
    fails_with(&on_broken(Broken::Flash), &[(43, "boots that say Stored")]);
}

#[test]
fn a_missing_failsafe_of_silence_is_found() {
    // No robot takes a failsafe so late that this would be seen: it is held to a file that asks for an earlier one.
    let mut strict = robot();
    let numbers = &mut strict.controller.as_mut().expect("a controller").numbers;
    for (key, seconds) in [("link_slow_s", 0.02), ("command_age_s", 0.05), ("command_bound_s", 0.06)] {
        numbers.get_mut(&format!("supervisor.{key}")).expect("a number").value = seconds;
    }
    let options = Options::simulated(&strict, Chip::Esp32c3).expect("a controller");
    let report = simulated::simulate(&robot(), &options, 1, |_| {}, &mut |_| {}).expect("a bench");
    let silent = report.steps.iter().find(|step| step.number == 13).expect("it is there");
    assert_eq!(silent.verdict, StepResult::Failed);
    let late = silent.checks.iter().find(|check| check.verdict == StepResult::Failed).expect("one fails");
    assert!(late.what.contains("longest time that EN was high"), "{:?}", silent.checks);
}

#[test]
fn an_ordinary_image_makes_no_fault_and_that_is_said() {
    let report = walk(1, |setup| setup.robots[0].injectable = false);
    fails_with(&report, &[]);
    assert!(!report.injectable);
    for step in report.steps.iter().filter(|step| [6, 7, 8, 9, 58, 59, 60, 62, 66, 67, 68, 69].contains(&step.number)) {
        assert_eq!(step.verdict, StepResult::NotChecked, "{}", step.number);
        assert!(step.checks.iter().any(|check| check.found.contains("--inject")), "{:?}", step.checks);
    }
}

#[test]
fn the_command_walks_a_simulated_board_and_writes_a_report() {
    let directory = temporary();
    let (stdout, stderr) = succeeds_saying(directory.path(), "bring-up --sim --steps 6-9,13,20 --robot @/robot.toml");
    for line in stdout.lines().chain(stderr.lines()) {
        assert!(line.chars().count() <= 80, "{line}");
    }
    assert!(stdout.contains("passed         5  6, 7, 8, 9, 13"), "{stdout}");
    assert!(stdout.contains("not checked    1  20") && stdout.contains("says nothing about a board"), "{stdout}");
    let read = |name: &str| std::fs::read_to_string(directory.path().join("out/bring-up").join(name)).expect("a file");
    let report = json(&read("bring-up.json").replace('\n', " "));
    assert_eq!((&report["passed"], &report["failed"], &report["not_checked"]), (&5.into(), &0.into(), &1.into()));
    let markdown = read("bring-up.md");
    assert!(markdown.contains("| 9 | Watchdog | passed |") && markdown.contains("this says nothing about a board"));
    assert!(markdown.contains("| the reset's cause in the status after it | Watchdog | Watchdog | passed |"));
    let again = succeeds(directory.path(), "bring-up --sim --steps 6-9,13,20 --json --robot @/robot.toml");
    assert_eq!(json(&again), report, "the same each time");
}

#[test]
fn a_shortened_step_says_so() {
    let report = walk(1, |_| {});
    let hour = report.steps.iter().find(|step| step.number == 19).expect("it is there");
    let said =
        hour.checks.iter().any(|check| check.what.contains("shortened") && check.found.contains("instead of 3600 s"));
    assert!(said, "{:?}", hour.checks);
}

#[test]
fn wrong_words_are_refused_before_anything_moves() {
    let directory = temporary();
    let robot = "--robot @/robot.toml";
    for (words, says) in [
        ("bring-up --sim --steps 999", "no step 999"),
        ("bring-up --sim --steps 9-6", "goes backwards"),
        ("bring-up --sim --length 3d", "no time"),
        ("bring-up --sim --port x", "cannot be used with"),
        ("bring-up", "--sim"),
    ] {
        fails(directory.path(), &format!("{words} {robot}"), 2, &[says]);
    }
    std::fs::write(directory.path().join("answers.toml"), "[six]\nen = 1").expect("writes");
    fails(directory.path(), &format!("bring-up --port none --answers answers.toml {robot}"), 1, &["[six] is no step"]);
    let list = succeeds(directory.path(), "bring-up --list");
    assert_eq!(list.lines().count(), steps().count());
}

/// The real program on a pseudo-terminal, with the real serial code.
#[cfg(unix)]
mod on_a_port {
    use super::*;
    use crate::common::command::command;
    use crate::common::tty;
    use hal_sim::radio::Trouble;
    use std::io::Write;
    use std::process::{Output, Stdio};
    use testbed::injected_event::InjectedEvent;

    /// Runs it on an ordinary image, with something typed.
    fn run(directory: &Path, injected_events: &[InjectedEvent], words: &str, typed: &str) -> Output {
        let simulation = tty::start(1, 1, injected_events, directory);
        let port = simulation.port().display();
        let words = format!("bring-up --port {port} --keys keys.toml --robot @/robot.toml {words}");
        let mut child = command(directory, &words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("scram runs");
        child.stdin.take().expect("a pipe").write_all(typed.as_bytes()).expect("it reads");
        let output = child.wait_with_output().expect("it ends");
        assert!(!simulation.robots()[0].state.expect("it runs").0.is_driving());
        output
    }

    fn report(output: &Output) -> serde_json::Value {
        assert_eq!(output.stdout.iter().filter(|byte| **byte == b'\n').count(), 1);
        json(std::str::from_utf8(&output.stdout).expect("UTF-8"))
    }

    #[test]
    fn without_a_person_what_needs_one_is_not_checked() {
        let directory = temporary();
        let output = run(directory.path(), &[], "--skip-manual --json --steps 4,6,13,45", "");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report = report(&output);
        let verdicts: Vec<_> = report["steps"].as_array().expect("steps").iter().map(|step| &step["verdict"]).collect();
        assert_eq!(verdicts, ["not_checked", "not_checked", "not_checked", "not_checked"]);
        // What the program sees itself is there.
        let lost = &report["steps"][2]["checks"][0];
        assert_eq!((&lost["found"], &lost["verdict"]), (&"Some(CommandTooOld)".into(), &"passed".into()), "{lost}");
        assert_eq!(report["simulated"], false);
    }

    #[test]
    fn a_person_answers_and_a_failed_step_is_the_exit_code() {
        let directory = temporary();
        // Step 15: begin, a number. Step 36: begin, yes. Step 37: skip. Step 41: begin, no.
        let output = run(directory.path(), &[], "--steps 15,36,37,41", "\n2.9\n\ny\ns\n\nn\n");
        let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert_eq!(output.status.code(), Some(1), "{stdout}{stderr}");
        assert!(stdout.contains("passed         2  15, 36"), "{stdout}");
        assert!(stdout.contains("failed         1  41") && stdout.contains("not checked    1  37"), "{stdout}");
        assert!(stderr.contains("Needs a key file with 18 robots.") && stderr.contains("failed: step 41"), "{stderr}");
    }

    #[test]
    fn answers_of_a_file_count_and_one_that_nobody_asked_for_is_named() {
        let directory = temporary();
        std::fs::write(directory.path().join("answers.toml"), "[15]\nsaturates-above = 2.9\nvolts = 1\n")
            .expect("writes");
        let output = run(directory.path(), &[], "--steps 15,36 --answers answers.toml", "");
        let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{stderr}");
        assert!(
            stdout.contains("passed         1  15") && stderr.contains("[15] volts was not asked"),
            "{stdout}{stderr}"
        );
    }

    #[test]
    fn a_lossy_air_fails_the_step_of_the_link() {
        let directory = temporary();
        let lossy = Trouble { loss_share: Some(0.5), ..Trouble::NONE };
        let output = run(directory.path(), &[InjectedEvent::Air(lossy)], "--skip-manual --steps 28", "");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains("28  Robot and dongle hear each other") && stderr.contains("FAILED"), "{stderr}");
    }

    #[test]
    fn without_a_dongle_nothing_is_written() {
        let directory = temporary();
        let output = run(directory.path(), &[InjectedEvent::DongleHangs], "--skip-manual", "");
        assert_eq!(output.status.code(), Some(1));
        assert!(!directory.path().join("out").exists());
    }
}

#[test]
fn without_keys_nothing_is_asked_of_the_port() {
    let directory = temporary();
    let output = scram(directory.path(), "bring-up --port /dev/none --keys none.toml --robot @/robot.toml");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("no robot is paired"), "{stderr}");
}
