//! `scram diagnose`

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use diagnose::{
    Detail, Diagnosis, FittedParameter, MOST_SAMPLES, Options, Progress, RunUse, Verdict, diagnose, extend,
};
use effects::Id;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use miette::{Report, miette};
use plot::report::{About, html};
use recording::{ReadOptions, Recording};
use robot_file::Robot;
use robot_file::edit::Document;
use serde::Serialize;
use simulation::{Comparison, tracking_gain};

use super::design_experiment::propose;
use super::diagnose_walk::WalkRun;
use super::identify::capture::{CaptureArgs, CaptureShape, column};
use super::measured::{MeasuredArgs, condition};
use super::pair::KeysFile;
use super::run_directory::DIAGNOSED;
use super::runs::Runs;
use super::sim::tracked;
use super::then_run::Place;
use super::{Common, Done, Failure, load_robot, print, print_json, say, table, write};

/// The extended model; the others that are still standing are numbered from 2.
pub const ROBOT: &str = "robot.toml";

/// Find what the simulation gets wrong about a recorded robot, and name its cause
///
/// Fits on some runs, judges on others. Writes the extended robot file, report.html and diagnosis.json into a
/// directory of their own, out/diagnose-0001 and so on; out/latest-diagnose leads to the last.
///
/// With --measured it is the walk that is diagnosed, from a table of speeds over conditions or of motion captures
/// (docs/diagnose-walk.md); --holdout is a condition then, as 7,60, and --map a column, as t_s=Time.
///
/// Of a potentiometer without [sensor.correction] the converter's error is fitted, too. It is in the report's figures and
/// not in the extended robot file: calibrate first (scram calibrate, scram identify potentiometer).
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(DIAGNOSED.numbered)))]
#[command(mut_arg("runs", |arg| arg.required_unless_present("measured")))]
#[command(after_help = "Examples:\n  \
    scram diagnose runs/*.csv --robot robots/bench-xl330.toml\n  \
    scram diagnose a.mcap b.mcap c.mcap --holdout c.mcap --out diagnosis\n  \
    scram diagnose rig/*.csv --mapping rig.toml --from 2 --to 8 --robot rig-robot.toml\n  \
    scram diagnose --measured speeds.csv --robot robot.toml\n\n\
    Without --holdout the last run of each kind of excitation is held out. The kind is `excitation` in the \
    recording's metadata, or the file name without its number: sweep_1.csv and sweep_2.csv are of one kind.")]
pub struct Diagnose {
    #[command(flatten)]
    runs: Runs,
    #[command(flatten)]
    walks: MeasuredArgs,
    #[command(flatten)]
    shape: CaptureShape,
    /// Try this effect too, which a diagnosis does not try by itself; repeatable
    #[arg(long = "try", value_name = "EFFECT", value_parser = effect)]
    also_try: Vec<Id>,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
    /// Where several models are still standing: design the recording that tells them apart, run it twice through the console on
    /// the robot behind a dongle's serial port, or on a simulated robot (sim:FILE, its robot file), and diagnose again
    #[arg(long, value_name = "PORT|sim:FILE", value_parser = Place::parse)]
    then_run: Option<Place>,
    #[command(flatten)]
    keys: KeysFile,
}

/// Length of the recording that tells models apart, s.
const EXPERIMENT_S: f64 = 8.0;

/// What a diagnosis wrote.
struct Files {
    page: PathBuf,
    /// Missing where the robot file cannot hold what was fitted.
    robot: Option<PathBuf>,
    /// The other models that the runs cannot tell from it.
    rivals: Vec<PathBuf>,
    json: PathBuf,
}

/// A diagnosis, and what the robot gains by it.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    /// What the robot of the extended file tracks under the controller of the file and under its own. Empty where nothing was
    /// found, or the file has no controller.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tracking: Vec<Comparison>,
}

/// What the robot gains by its extended model, where one was found and the robot has a controller.
fn gained(robot: &Robot, diagnosis: &Diagnosis, models: &[Document]) -> Result<Vec<Comparison>, Report> {
    let stands = matches!(diagnosis.verdict, Verdict::Explained | Verdict::Ambiguous);
    let Some(extended) = models.first().filter(|_| stands && robot.controller.is_some()) else { return Ok(Vec::new()) };
    match tracking_gain(robot, &extended.robot()?) {
        Ok(compared) => Ok(compared),
        // A fitted number may be beyond what a controller takes: the diagnosis holds all the same.
        Err(why) => {
            say(&format!("what the robot gains is not shown: {why}"));
            Ok(Vec::new())
        }
    }
}

impl Diagnose {
    pub fn run(&self) -> Done {
        if !self.walks.measured.is_empty() {
            return self.walk();
        }
        let common = &self.common;
        let robot = common.robot()?;
        // Whatever can be refused is refused before the minutes that it takes.
        common.keeps_robot_file(&common.out.join(ROBOT))?;
        DIAGNOSED.refuse(&common.out, self.overwrite)?;
        let (fit, held_out) = self.runs.load(common, &robot)?;
        let files = self.diagnose(&robot, &fit, &held_out, &common.out)?;
        match &self.then_run {
            None => Ok(()),
            Some(_) if files.rivals.is_empty() => {
                say("no two models are left to tell apart: nothing is run");
                Ok(())
            }
            Some(place) => self.then_run(place, &robot, fit, held_out, &files),
        }
    }

    /// Diagnoses how a robot walks.
    fn walk(&self) -> Done {
        let refused = [
            (!self.runs.is_empty(), "recordings of a shaft"),
            (!self.also_try.is_empty(), "--try"),
            (self.then_run.is_some(), "--then-run"),
        ];
        if let Some((_, what)) = refused.iter().find(|(given, _)| *given) {
            return Err(Failure::Usage(miette!("--measured says how a robot walks: {what} cannot stand beside it")));
        }
        let (columns, rate) = self.runs.mapping.words();
        let columns = columns.iter().map(|words| column(words)).collect::<Result<_, _>>().map_err(usage)?;
        let holdout = self.runs.holdout.iter().map(|words| condition(&words.to_string_lossy()));
        WalkRun {
            common: &self.common,
            walks: &self.walks,
            capture: CaptureArgs { shape: self.shape.clone(), rate, columns },
            holdout: holdout.collect::<Result<_, _>>().map_err(usage)?,
            overwrite: self.overwrite,
        }
        .run()
    }

    /// Diagnoses, writes it down and tells it.
    fn diagnose(&self, robot: &Robot, fit: &[Recording], held_out: &[Recording], out: &Path) -> Result<Files, Failure> {
        let also_try = self.also_try.clone();
        let options = Options { seed: self.common.seed, also_try, progress: Some(progress()), ..Options::default() };
        let diagnosis = diagnose(robot, fit, held_out, &options).map_err(Report::from)?;

        // A number that the robot file refuses must not cost the report.
        let detail = &diagnosis.detail;
        let models: Result<Vec<Document>, Report> =
            std::iter::once(&detail.extended).chain(&detail.rivals).map(|fitted| self.with(fitted, detail)).collect();
        let written = models.as_deref().unwrap_or(&[]);
        let told = Told { diagnosis: &diagnosis, tracking: gained(robot, &diagnosis, written)? };
        let files = DIAGNOSED.fill(out, self.overwrite, |out| self.save(robot, &told, written, out))?;
        self.tell(robot, &told, &files)?;
        models?;
        Ok(files)
    }

    /// Runs the experiment that tells the models apart, once to fit on and once to judge by, and diagnoses again.
    fn then_run(
        &self,
        place: &Place,
        robot: &Robot,
        mut fit: Vec<Recording>,
        mut held_out: Vec<Recording>,
        files: &Files,
    ) -> Done {
        let models: Vec<PathBuf> = files.robot.iter().chain(&files.rivals).cloned().collect();
        let robots: Vec<Robot> = models.iter().map(|path| load_robot(path)).collect::<Result<_, _>>()?;
        let beside = files.page.parent().unwrap_or(Path::new("."));
        let script = propose(&robots, EXPERIMENT_S, self.common.seed)?.save(&models, beside)?;
        for (number, recordings) in [&mut fit, &mut held_out].into_iter().enumerate() {
            let seed = self.common.seed + number as u64;
            let out = beside.join(format!("experiment-{}", number + 1));
            let path = place.record(&script, self.keys.given(), seed, &out)?;
            let options = ReadOptions { limit: MOST_SAMPLES, ..ReadOptions::default() };
            recordings.push(self.common.recording(&path, robot, &options)?.recording);
        }
        // A named directory has the first diagnosis in it.
        let numbered = self.common.out == Path::new(DIAGNOSED.numbered);
        let out = if numbered { self.common.out.clone() } else { self.common.out.join("then") };
        self.diagnose(robot, &fit, &held_out, &out).map(|_| ())
    }

    /// Prints the diagnosis and where it was written.
    fn tell(&self, robot: &Robot, told: &Told<'_>, files: &Files) -> Done {
        let diagnosis = told.diagnosis;
        let own = [Some(&files.page), files.robot.as_ref(), Some(&files.json)];
        let shown = |path: &PathBuf| path.display().to_string();
        let paths: Vec<String> = own.into_iter().flatten().chain(&files.rivals).map(shown).collect();
        let written = format!("written: {}", paths.join(", "));
        if self.common.json {
            say(&written);
            print_json(told)?;
            return Ok(());
        }
        for line in &diagnosis.detail.summary {
            print(line);
        }
        print(&table::facts(facts(diagnosis)));
        if !told.tracking.is_empty() {
            let is = "of the extended file";
            print(&tracked(&told.tracking, &format!("controller of {}", self.common.robot.display()), is));
        }
        print(&written);
        if let (Some(file), true) = (&files.robot, robot.controller.is_some()) {
            print(&format!("try it: scram sim --robot {}", file.display()));
        }
        if !files.rivals.is_empty() {
            let models: Vec<String> = files.robot.iter().chain(&files.rivals).map(shown).collect();
            print(&format!("tell them apart: scram design-experiment {}", models.join(" ")));
        }
        Ok(())
    }

    fn save(&self, robot: &Robot, told: &Told<'_>, models: &[Document], out: &Path) -> Result<Files, Report> {
        let paths: Vec<PathBuf> = (1..=models.len()).map(|number| out.join(model_file(number))).collect();
        let files = Files {
            page: out.join("report.html"),
            robot: paths.first().cloned(),
            rivals: paths.iter().skip(1).cloned().collect(),
            json: out.join("diagnosis.json"),
        };
        let about = About {
            robot: robot.name.clone(),
            robot_file: self.common.robot.display().to_string(),
            extended_file: files.robot.as_ref().map(|file| file.display().to_string()),
            tracking: told.tracking.clone(),
        };
        // First what can be refused, so that no report speaks of a model that was not written.
        for (model, file) in models.iter().zip(&paths) {
            self.common.save(model, file)?;
        }
        remove_others(out, models.len() + 1)?;
        write(&files.page, &html(told.diagnosis, &about))?;
        let json = serde_json::to_string_pretty(told).map_err(|e| miette!("diagnosis.json: {e}"))?;
        write(&files.json, &(json + "\n"))?;
        Ok(files)
    }

    /// The robot file with the fitted numbers of a model and its effects.
    fn with(&self, fitted: &[FittedParameter], detail: &Detail) -> Result<Document, Report> {
        let mut document = Document::load(&self.common.robot)?;
        let source = format!("scram diagnose, fitted on {}", detail.fit_runs.join(", "));
        extend(&mut document, fitted, &source)?;
        Ok(document)
    }
}

fn usage(problem: String) -> Failure {
    Failure::Usage(miette!("{problem}"))
}

/// An effect of the shaft by name.
fn effect(name: &str) -> Result<Id, String> {
    let known = |id: &Id| !id.spec().acts.on_the_ground();
    Id::of(name).filter(known).ok_or_else(|| {
        let names: Vec<&str> = Id::all().filter(known).map(Id::name).collect();
        format!("the effects of a shaft are {}", names.join(", "))
    })
}

/// The robot file of a model, from 1.
fn model_file(number: usize) -> String {
    if number == 1 { ROBOT.to_owned() } else { format!("robot-{number}.toml") }
}

/// Removes the models that an earlier diagnosis has left in a directory, from a number on.
fn remove_others(out: &Path, from: usize) -> Result<(), Report> {
    for file in (from..).map(|number| out.join(model_file(number))).take_while(|file| file.exists()) {
        std::fs::remove_file(&file).map_err(|error| miette!("{}: {error}", file.display()))?;
    }
    Ok(())
}

/// A bar on stderr, drawn only where stderr is a terminal.
pub fn progress() -> Progress {
    let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {elapsed}") {
        bar.set_style(style);
    }
    Arc::new(move |what: &str, share: f64| {
        bar.set_message(what.to_owned());
        bar.set_position((1000.0 * share.clamp(0.0, 1.0)) as u64);
        if share >= 1.0 {
            bar.finish_and_clear();
        }
    })
}

/// Readings of walks about which it is unknown how the body pulls at the shaft; `None` where that is next to nothing, as on a bench.
fn left_out_percent(d: &Diagnosis) -> Option<f64> {
    let sum = |count: fn(&RunUse) -> usize| d.detail.runs.iter().map(count).sum::<usize>() as f64;
    let (unknown, readings) = (sum(|run| run.pull_unknown), sum(|run| run.samples - run.missing));
    let percent = 100.0 * unknown / readings;
    (percent >= 0.5).then_some(percent)
}

fn facts(d: &Diagnosis) -> Vec<(&'static str, String)> {
    let floor = |error: f64| format!("{:.4}° ({:.2} × noise floor)", error.to_degrees(), error / d.noise_floor);
    let mut rows = vec![("verdict", d.verdict.word().to_owned())];
    for cause in &d.causes {
        let mut text = cause.effect.clone();
        if !cause.also.is_empty() && d.verdict != Verdict::Ambiguous {
            text += &format!(" (or {})", cause.also.join(", "));
        }
        rows.push(("cause", text));
    }
    if d.verdict == Verdict::Ambiguous {
        rows.extend(d.models[1..].iter().map(|model| ("or", model.join(" and "))));
    }
    if let Some(percent) = left_out_percent(d) {
        rows.push((
            "left out",
            format!("{percent:.0} % of the readings: nothing says how the walking body pulls there"),
        ));
    }
    rows.push(("held-out rollout error, before", floor(d.before)));
    rows.push(("held-out rollout error, after", floor(d.after)));
    if !d.causes.is_empty() {
        rows.push(("the same, each run judged by a choice without it", floor(d.after_cross_judged)));
        let gain = &d.gain;
        let text = format!("{:.0} % ({:.0} … {:.0})", gain.percent_of_excess_removed, gain.low, gain.high);
        rows.push(("excess error removed", text));
    }
    if let Some(left) = &d.left_over {
        rows.push(("left over", format!("{:.0} % of it {}", 100.0 * left.share, left.place())));
    }
    rows.extend(d.rig_doubts.iter().map(|doubt| ("not of this rig?", doubt.reason.clone())));
    if let Some(next) = &d.next_experiment {
        rows.push(("next experiment", next.clone()));
    }
    rows
}
