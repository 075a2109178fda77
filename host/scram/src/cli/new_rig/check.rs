//! `scram new-rig --check`: what of recordings does not go with a robot file, for people.

use std::path::{Path, PathBuf};

use diagnose::{Finding, Mend, RigCheck, RigMistake, check_rig};
use miette::{Diagnostic, Report, miette};
use recording::import::Mapping;
use recording::{Loaded, ReadOptions, RecordingError, load_with, require_same_rig, supply_problem};
use robot_file::Robot;
use scram::progress::bar;
use serde::Serialize;

use super::super::import::{MappingArgs, WindowArgs};
use super::super::{Failure, load_robot, print, print_json, say};

/// Samples of a run that are looked at.
const MOST_SAMPLES: usize = 60_000;

/// What was found in all runs.
#[derive(Serialize)]
pub struct Found {
    #[serde(flatten)]
    check: RigCheck,
}

/// Reads recordings, those that cannot be of any rig being findings of their own, and checks the others.
pub fn check(
    robot_file: &Path,
    runs: &[PathBuf],
    mapping: &MappingArgs,
    window: &WindowArgs,
) -> Result<Found, Failure> {
    let robot = load_robot(robot_file)?;
    let (mapping, window) = (mapping.read()?, window.read()?);
    // What a reader refuses as in another unit is for the check to say which.
    let options =
        ReadOptions { limit: MOST_SAMPLES, progress: Some(bar), window, as_written: true, ..ReadOptions::default() };
    let (mut recordings, mut refused) = (Vec::new(), Vec::new());
    for path in runs {
        match read(path, &robot, mapping.as_ref(), &options) {
            Ok(loaded) => recordings.push(loaded.recording),
            Err(error @ (RecordingError::Cell { .. } | RecordingError::OtherRig { .. })) => {
                refused.push(refusal(&error));
            }
            Err(other) => return Err(Report::from(other).into()),
        }
    }
    let mut check = check_rig(&robot, &recordings);
    check.findings.splice(0..0, refused);
    if check.findings.is_empty() && check.unreadable.len() == runs.len() {
        let help = "record runs of some seconds in which the drive turns the shaft";
        return Err(miette!(help = help, "nothing was checked: {}", check.unreadable.join("; ")).into());
    }
    // With the file's line, where a mend is one.
    for mend in check.findings.iter_mut().flat_map(|finding| &mut finding.mends) {
        let line = mend.field.as_ref().and_then(|field| Robot::line_of(robot_file, field));
        mend.change = line.map_or(mend.change.clone(), |(file, line)| format!("{file}:{line}: {}", mend.change));
    }
    Ok(Found { check })
}

/// A recording, or what a mapping makes of another rig's file. A log of BAM says itself what its columns are.
fn read(
    path: &Path,
    robot: &Robot,
    mapping: Option<&Mapping>,
    options: &ReadOptions,
) -> Result<Loaded, RecordingError> {
    let ends_with = |end: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(end));
    let own = Mapping::default();
    let loaded = match mapping.or(ends_with("json").then_some(&own)) {
        Some(mapping) if !ends_with("mcap") => {
            let imported = recording::import::import(path, mapping, options)?;
            imported.warnings.iter().for_each(|warning| say(&format!("warning: {}: {warning}", path.display())));
            imported.loaded
        }
        _ => load_with(path, options)?,
    };
    loaded.notes.iter().for_each(|note| say(&format!("{}: {note}", path.display())));
    // Another supply is told once for all runs, with what to change.
    match require_same_rig(&loaded, robot) {
        Err(other) if supply_problem(&loaded.recording, robot).is_none() => Err(other),
        _ => Ok(loaded),
    }
}

/// What no reader takes, with its own advice.
fn refusal(error: &RecordingError) -> Finding {
    let help = error.help().map_or_else(String::new, |help| help.to_string());
    Finding {
        problem: error.to_string(),
        evidence: String::new(),
        mends: vec![Mend {
            causes: vec![RigMistake::Recording],
            words: "the recording is refused".to_owned(),
            change: help,
            field: None,
        }],
        tell_apart: None,
    }
}

impl Found {
    pub fn is_right(&self) -> bool {
        self.check.findings.is_empty()
    }

    /// Prints what was found.
    pub fn tell(&self, robot: &Path, runs: usize, json: bool) -> Result<(), Report> {
        if json {
            return print_json(self);
        }
        for finding in &self.check.findings {
            print(&format!("{}: {}", robot.display(), finding.problem));
            if !finding.evidence.is_empty() {
                print(&format!("  because  {}", finding.evidence));
            }
            for line in finding.mend().lines() {
                let is_mend = !line.starts_with("to know which: ");
                print(&format!("  {}{line}", if is_mend { "change   " } else { "" }));
            }
        }
        for unchecked in self.check.unreadable.iter().chain(&self.check.unchecked) {
            print(&format!("not checked: {unchecked}"));
        }
        if self.is_right() {
            let recordings = if runs == 1 { "1 recording".to_owned() } else { format!("{runs} recordings") };
            print(&format!("{}: nothing is wrong in {recordings}", robot.display()));
        }
        Ok(())
    }
}
