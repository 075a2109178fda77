//! Recordings of a shaft that are fitted on, and those that are held out.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnose::{FEWEST_SAMPLES, MOST_SAMPLES};
use miette::{Report, miette};
use recording::import::Mapping;
use recording::{Loaded, ReadOptions, Recording, require_same_rig};
use robot_file::Robot;
use scram::progress::bar;

use super::import::{self, MappingArgs, WindowArgs};
use super::{Common, Failure, say};

/// Which recordings, and how they are read.
#[derive(Args)]
pub struct Runs {
    /// Recordings to fit on, CSV or MCAP; with a mapping files of another rig, as `scram import` reads them
    runs: Vec<PathBuf>,
    /// A recording to judge on and never to fit on, listed among the runs or not; repeatable
    #[arg(long, value_name = "RUN")]
    pub holdout: Vec<PathBuf>,
    #[command(flatten)]
    pub mapping: MappingArgs,
    #[command(flatten)]
    window: WindowArgs,
}

impl Runs {
    /// Whether none is named.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// The recordings to fit on and those to judge by.
    ///
    /// # Errors
    /// One cannot be read, is of another rig or too short, is there twice, or there are fewer than two.
    pub fn load(&self, common: &Common, robot: &Robot) -> Result<(Vec<Recording>, Vec<Recording>), Failure> {
        let fitted = self.runs.iter().filter(|path| !self.holdout.iter().any(|held| same_file(held, path)));
        refuse_twice(&fitted.chain(&self.holdout).collect::<Vec<_>>())?;
        // Further samples of a run cost time and tell little: a minute at 1 kHz is plenty.
        let window = self.window.read()?;
        let options = ReadOptions { limit: MOST_SAMPLES, progress: Some(bar), window, ..ReadOptions::default() };
        let mapping = self.mapping.read()?;
        let read = |path: &Path| self.recording(path, common, robot, (mapping.as_ref(), &options));
        let mut held_out = Vec::new();
        for path in &self.holdout {
            held_out.push(read(path)?);
        }
        let mut runs = Vec::new();
        for path in self.runs.iter().filter(|path| !self.holdout.iter().any(|held| same_file(held, path))) {
            runs.push(read(path)?);
        }
        if held_out.is_empty() {
            (runs, held_out) = hold_out_last(runs);
        }
        for loaded in runs.iter().chain(&held_out) {
            loaded.recording.require_samples(FEWEST_SAMPLES).map_err(Report::from)?;
        }
        if runs.is_empty() || held_out.is_empty() {
            return Err(Failure::Usage(miette!(
                help = "give at least two recordings: the numbers are fitted on some and judged on others",
                "{} run(s) to fit on, {} to judge by",
                runs.len(),
                held_out.len()
            )));
        }
        let names = |loaded: &[Loaded]| {
            let names = loaded.iter().map(|l| l.recording.path.display().to_string());
            names.collect::<Vec<_>>().join(", ")
        };
        say(&format!("fitting on {}; judging on {}", names(&runs), names(&held_out)));
        let recordings = |loaded: Vec<Loaded>| loaded.into_iter().map(|l| l.recording).collect();
        Ok((recordings(runs), recordings(held_out)))
    }

    /// Reads a recording, or what a mapping makes one. A log of BAM says itself what its columns are.
    fn recording(
        &self,
        path: &Path,
        common: &Common,
        robot: &Robot,
        (mapping, options): (Option<&Mapping>, &ReadOptions),
    ) -> Result<Loaded, Report> {
        let ends_with = |end: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(end));
        let own = Mapping::default();
        match mapping.or(ends_with("json").then_some(&own)) {
            Some(mapping) if !ends_with("mcap") => {
                let loaded = import::read(path, mapping, options)?.loaded;
                require_same_rig(&loaded, robot)?;
                Ok(loaded)
            }
            _ => common.recording(path, robot, options),
        }
    }
}

/// Refuses a run that is there twice, whether as one file or as a copy: it would be fitted on and judged by.
fn refuse_twice(paths: &[&PathBuf]) -> Result<(), Failure> {
    for (index, path) in paths.iter().enumerate() {
        if let Some(twin) = paths[..index].iter().find(|other| same_file(other, path) || same_content(other, path)) {
            let what = if same_file(twin, path) { "is listed twice" } else { "has the same content as" };
            let other = if same_file(twin, path) { String::new() } else { format!(" {}", twin.display()) };
            return Err(Failure::Usage(miette!(
                help = "a model is judged on runs that it was not fitted to: list every run once",
                "{} {what}{other}",
                path.display()
            )));
        }
    }
    Ok(())
}

/// Whether two files hold the same bytes. One that cannot be read says so where it is loaded.
fn same_content(a: &Path, b: &Path) -> bool {
    let length = |path: &Path| std::fs::metadata(path).map(|metadata| metadata.len()).ok();
    if length(a).is_none() || length(a) != length(b) {
        return false;
    }
    matches!((std::fs::read(a), std::fs::read(b)), (Ok(a), Ok(b)) if a == b)
}

/// Whether two paths lead to one file.
fn same_file(a: &Path, b: &Path) -> bool {
    match (std::fs::canonicalize(a), std::fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

/// What drove a run: from its metadata, or its file name without the last part that has a number in it.
fn kind(loaded: &Loaded) -> String {
    if let Some(excitation) = &loaded.metadata.excitation {
        return excitation.clone();
    }
    let stem = loaded.recording.path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let has_digit = |text: &str| text.chars().any(|c| c.is_ascii_digit());
    match stem.rsplit_once(['_', '-']) {
        Some((front, last)) if has_digit(last) => front.to_owned(),
        _ => stem.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned(),
    }
}

/// Holds out the last run of each kind that has more than one; where every kind has one only, the last run of all.
fn hold_out_last(runs: Vec<Loaded>) -> (Vec<Loaded>, Vec<Loaded>) {
    let kinds: Vec<String> = runs.iter().map(kind).collect();
    let is_last = |index: usize| !kinds[index + 1..].contains(&kinds[index]);
    let is_repeated = |index: usize| kinds.iter().filter(|kind| **kind == kinds[index]).count() > 1;
    let mut held: Vec<bool> = (0..runs.len()).map(|index| is_last(index) && is_repeated(index)).collect();
    if !held.contains(&true)
        && runs.len() > 1
        && let Some(last) = held.last_mut()
    {
        *last = true;
    }
    let (out, fit): (Vec<_>, Vec<_>) = runs.into_iter().zip(held).partition(|(_, held)| *held);
    let strip = |pairs: Vec<(Loaded, bool)>| pairs.into_iter().map(|(loaded, _)| loaded).collect();
    (strip(fit), strip(out))
}

#[cfg(test)]
mod tests {
    use recording::{Kept, Metadata};

    use super::*;

    fn run(path: &str, excitation: Option<&str>) -> Loaded {
        Loaded {
            recording: Recording { path: path.into(), ..Recording::default() },
            metadata: Metadata { excitation: excitation.map(String::from), ..Metadata::default() },
            kept: Kept { rows: 0, kept: 0, stride: 1, outside: 0 },
            notes: Vec::new(),
        }
    }

    fn held(runs: Vec<Loaded>) -> Vec<String> {
        let (fit, held) = hold_out_last(runs);
        assert!(fit.iter().all(|f| held.iter().all(|h| h.recording.path != f.recording.path)));
        held.iter().map(|l| l.recording.path.display().to_string()).collect()
    }

    #[test]
    fn the_last_run_of_each_kind_is_held_out() {
        let files = ["sin_sin_kp100.csv", "sin_sin_kp400.csv", "lift_and_drop_kp100.csv", "lift_and_drop_kp800.csv"];
        assert_eq!(
            held(files.iter().map(|f| run(f, None)).collect()),
            ["sin_sin_kp400.csv", "lift_and_drop_kp800.csv"]
        );
        assert_eq!(held(vec![run("run1.csv", None), run("run2.csv", None), run("run3.csv", None)]), ["run3.csv"]);
        assert_eq!(held(vec![run("a1", Some("x")), run("b1", Some("x")), run("c", Some("y"))]), ["b1"]);
        assert_eq!(held(vec![run("chirp.csv", None), run("steps.csv", None)]), ["steps.csv"]);
        assert!(held(vec![run("one.csv", None)]).is_empty());
    }
}
