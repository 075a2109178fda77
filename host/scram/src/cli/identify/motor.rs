//! `scram identify motor`

use std::path::{Path, PathBuf};

use clap::Args;
use diagnose::{Known, MotorFit, MotorNumber, Options, extend, identify_motor};
use miette::Report;
use robot_file::edit::Document;
use serde::Serialize;

use super::super::diagnose::progress;
use super::super::run_directory::IDENTIFIED;
use super::super::runs::Runs;
use super::super::{Common, Done, print, print_json, say, table};
use super::{ROBOT, short};

/// Find the motor's numbers and its friction from bench runs
///
/// Angle and drive tell the motor's equation in volts: K, J·R/K and friction times R/K. R, J, damping and friction themselves take a
/// measured current (a column of the recordings), or R or J known from elsewhere. Writes a copy of the robot file with the numbers and
/// their intervals into a directory of its own, out/identify-0001 and so on.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(IDENTIFIED.numbered)))]
#[command(mut_arg("runs", |arg| arg.required(true)))]
#[command(after_help = "Examples:\n  \
    scram identify motor runs/*.csv --robot robots/bench-linear.toml\n  \
    scram identify motor runs/*.csv --robot rig.toml --resistance 14.8\n  \
    scram identify motor rig/*.csv --mapping rig.toml --robot rig-robot.toml --inertia 1.5e-6\n\n\
    Runs that coast for a while (enable off) tell damping from back-EMF; steps of several sizes and both directions tell friction. \
    Without --holdout the last run of each kind of excitation is held out, as `scram diagnose` does.")]
pub struct Motor {
    #[command(flatten)]
    runs: Runs,
    /// Resistance of the winding, measured with an ohmmeter, Ω: taken as known to 2 %
    #[arg(long, value_name = "OHM", value_parser = positive)]
    resistance: Option<f64>,
    /// Inertia of rotor and load, known to 2 %, kg·m²
    #[arg(long, value_name = "KG_M2", value_parser = positive)]
    inertia: Option<f64>,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
}

fn positive(words: &str) -> Result<f64, String> {
    let value = words.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "a positive number is expected".into())
}

#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    fit: &'a MotorFit,
    files: [&'a Path; 1],
}

impl Motor {
    pub fn run(&self) -> Done {
        let common = &self.common;
        let robot = common.robot()?;
        common.keeps_robot_file(&common.out.join(ROBOT))?;
        IDENTIFIED.refuse(&common.out, self.overwrite)?;
        let (fit, held_out) = self.runs.load(common, &robot)?;
        let known = Known { resistance_ohm: self.resistance, inertia_kg_m2: self.inertia };
        let options = Options { seed: common.seed, progress: Some(progress()), ..Options::default() };
        let found = identify_motor(&robot, &fit, &held_out, known, &options).map_err(Report::from)?;
        let file = IDENTIFIED.fill(&common.out, self.overwrite, |out| self.save(&found, out))?;
        if common.json {
            print_json(&Output { fit: &found, files: [&file] })?;
            return Ok(());
        }
        print(&volts(&found));
        print(&numbers(&found.numbers));
        print(&facts(&found));
        self.advise(&found);
        print(&format!("written: {}", file.display()));
        print(&format!("use it: scram sim --robot {}", file.display()));
        Ok(())
    }

    /// What would tell more.
    fn advise(&self, found: &MotorFit) {
        if !found.current && self.resistance.is_none() && self.inertia.is_none() {
            say(
                "without a measured current, R, J, damping and friction hang on what the file says of R and J: only the numbers in volts \
                 are told by these runs. Measure R (--resistance), know J (--inertia), or record current_a",
            );
        }
        if found.lacks_more() {
            say("the model misses the held-out runs by more than their noise: scram diagnose names what is missing");
        }
    }

    fn save(&self, found: &MotorFit, out: &Path) -> Result<PathBuf, Report> {
        let mut document = Document::load(&self.common.robot)?;
        extend(&mut document, &found.fitted, "scram identify motor; 95 % interval")?;
        let file = out.join(ROBOT);
        self.common.save(&document, &file)?;
        Ok(file)
    }
}

fn interval(low: f64, high: f64) -> String {
    format!("{} … {}", short(low), short(high))
}

fn volts(found: &MotorFit) -> String {
    let header = ["told whatever the scale of torques", "found", "95 % interval"];
    let rows =
        found.volts.iter().map(|(key, [value, low, high])| vec![key.clone(), short(*value), interval(*low, *high)]);
    table::columns(&header, rows)
}

fn numbers(numbers: &[MotorNumber]) -> String {
    let header = ["number", "found", "95 % interval", "file", "told"];
    let row = |one: &MotorNumber| {
        vec![
            one.path.clone(),
            short(one.value),
            interval(one.low, one.high),
            one.file.map_or_else(|| "–".to_owned(), short),
            if one.told { "yes" } else { "no" }.to_owned(),
        ]
    };
    table::columns(&header, numbers.iter().map(row))
}

fn facts(found: &MotorFit) -> String {
    let deg = |rad: f64| format!("{:.3}°", rad.to_degrees());
    let friction =
        if found.friction.is_empty() { "these runs show none".to_owned() } else { found.friction.join(", ") };
    let error = format!("{} with the file's numbers, {} with these", deg(found.before_rad), deg(found.after_rad));
    table::facts([
        ("friction", friction),
        ("scale of torques", scale(found).to_owned()),
        ("noise of the angle", deg(found.noise_rad)),
        ("held out", error),
    ])
}

fn scale(found: &MotorFit) -> &'static str {
    if found.current { "by the measured current" } else { "by what the file or the options say of R and J" }
}
