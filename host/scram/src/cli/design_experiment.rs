//! `scram design-experiment`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use diagnose::{DiagnoseError, Experiment, Options, design_experiment, misfit};
use hal_sim::Settings;
use miette::{Report, miette};
use recording::Recording;
use robot_file::Robot;
use serde_json::{Value, json};
use simulation::{Drive, Plan, recording, run};

use super::diagnose::progress;
use super::run_directory::DESIGNED;
use super::{Common, Done, Failure, load_robot, print, print_json, say, table, write};

/// The drive.
const SCRIPT: &str = "experiment.txt";

/// When the first piece of a drive begins, s: after what clears the fault of a robot that was just switched on.
const BEGINS_S: f64 = 0.05;

/// Design the recording that tells models apart
///
/// Each robot file is a model that is still standing: `scram diagnose` writes one for every model that its recordings leave.
/// Each in turn is taken for the truth and the others are fitted to what it predicts; the drive is searched that tells the
/// most of the pairs apart. A drive that the robot's supervisor would end is none: the firmware's decisions
/// are run on every model before a drive is proposed.
///
/// Writes experiment.txt, one order a line, for `scram sim --drive script:FILE` and `scram console --script FILE`.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(DESIGNED.numbered)), mut_arg("robot", |arg| arg.hide(true)))]
#[command(after_help = "Examples:\n  \
    scram design-experiment out/latest-diagnose/robot.toml out/latest-diagnose/robot-2.toml\n  \
    scram design-experiment a.toml b.toml c.toml --seconds 12 --out experiment")]
pub struct DesignExperiment {
    /// Robot files of the models, two or more
    #[arg(required = true, num_args = 2.., value_name = "MODEL")]
    models: Vec<PathBuf>,
    /// Length of the recording, s
    #[arg(long, default_value_t = 8.0, value_name = "S")]
    seconds: f64,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
}

/// A drive that the firmware runs to its end on every model, and how far the models are apart on recordings of it.
pub struct Proposal {
    experiment: Experiment,
    script: String,
    /// Error of each pair's second model on simulated recordings of the first, over the noise.
    simulated: Vec<f64>,
}

impl DesignExperiment {
    pub fn run(&self) -> Done {
        if !(1.0..=120.0).contains(&self.seconds) {
            return Err(Failure::Usage(miette!("--seconds {}: from 1 to 120", self.seconds)));
        }
        let robots: Vec<Robot> = self.models.iter().map(|path| load_robot(path)).collect::<Result<_, _>>()?;
        DESIGNED.refuse(&self.common.out, self.overwrite)?;
        let proposal = propose(&robots, self.seconds, self.common.seed)?;
        let script = DESIGNED.fill(&self.common.out, self.overwrite, |out| proposal.save(&self.models, out))?;
        self.tell(&proposal, &script)
    }

    fn tell(&self, proposal: &Proposal, script: &Path) -> Done {
        let file = script.display();
        if self.common.json {
            say(&format!("written: {file}"));
            return print_json(&self.as_json(proposal, script)).map_err(Failure::from);
        }
        let rows = proposal.experiment.expected.iter().zip(&proposal.simulated).map(|(one, simulated)| {
            vec![
                self.models[one.truth].display().to_string(),
                self.models[one.model].display().to_string(),
                format!("{:.2}", one.ratio),
                format!("{simulated:.2}"),
            ]
        });
        print(&table::columns(&["if this is true", "this one misses by", "expected", "simulated"], rows));
        print("in units of the reading's noise, after its numbers are fitted: 1 is no difference");
        print(&format!("written: {file}"));
        print(&format!("try it: scram sim --bench --robot {} --drive script:{file}", self.models[0].display()));
        print(&format!(
            "on the robot: scram console --script {file}; then diagnose the old recordings and the new one"
        ));
        Ok(())
    }

    fn as_json(&self, proposal: &Proposal, script: &Path) -> Value {
        let pairs: Vec<Value> = proposal
            .experiment
            .expected
            .iter()
            .zip(&proposal.simulated)
            .map(|(one, simulated)| {
                json!({ "truth": self.models[one.truth], "model": self.models[one.model], "expected": one.ratio, "simulated": simulated })
            })
            .collect();
        json!({ "script": script, "pieces": proposal.experiment.pieces, "pairs": pairs })
    }
}

/// The best drive of a length (s) that the firmware runs to its end on every model.
pub fn propose(robots: &[Robot], seconds: f64, seed: u64) -> Result<Proposal, Report> {
    let options = Options { seed, progress: Some(progress()), ..Options::default() };
    let designed = design_experiment(robots, seconds, &options)?;
    if designed.is_empty() {
        return Err(miette!(
            help = "is the supply high enough, and the friction of every model low enough?",
            "no drive of {seconds} s turns the shaft of every model without a fault"
        ));
    }
    let mut ended = String::new();
    for experiment in designed {
        let script = lines(&experiment);
        match record_all(robots, &script, BEGINS_S + seconds, seed) {
            Ok(recorded) => {
                let simulated = simulated(robots, &experiment, &recorded)?;
                return Ok(Proposal { experiment, script, simulated });
            }
            Err(why) => ended = why,
        }
    }
    Err(miette!(
        help = "give it another --seed, or other --seconds",
        "the firmware ends every drive that was found: {ended}"
    ))
}

impl Proposal {
    /// Writes the drive, for these models, into a directory.
    pub fn save(&self, models: &[PathBuf], out: &Path) -> Result<PathBuf, Report> {
        let path = out.join(SCRIPT);
        let models: Vec<String> = models.iter().map(|model| model.display().to_string()).collect();
        write(&path, &format!("# tells apart: {}\n{}", models.join(", "), self.script))?;
        Ok(path)
    }
}

/// A drive as a script, one order a line. It begins as a robot must that was just switched on, and ends with the bridge open.
fn lines(experiment: &Experiment) -> String {
    let mut text = "0 clear\n".to_owned();
    let mut at_s = BEGINS_S;
    for piece in &experiment.pieces {
        let _ = match piece.duty {
            Some(duty) => writeln!(text, "{at_s:.3} duty {duty:.3}"),
            None => writeln!(text, "{at_s:.3} coast"),
        };
        at_s += piece.seconds;
    }
    let _ = writeln!(text, "{at_s:.3} coast");
    text
}

/// Two recordings of a script by every model, the firmware's decisions on its simulated robot; or how the firmware ended one.
fn record_all(robots: &[Robot], script: &str, seconds: f64, seed: u64) -> Result<Vec<[Recording; 2]>, String> {
    robots
        .iter()
        .map(|robot| Ok([record(robot, script, seconds, seed)?, record(robot, script, seconds, seed + 1)?]))
        .collect()
}

fn record(robot: &Robot, script: &str, seconds: f64, seed: u64) -> Result<Recording, String> {
    let drive = Drive::parse_script(script, Path::new(SCRIPT)).map_err(|error| error.to_string())?;
    let plan = Plan { drive, seconds, faults: Vec::new() };
    let trace = run(robot, seed, &Settings::default(), &plan).map_err(|error| error.to_string())?;
    if let Some(refusal) = trace.commands.iter().find_map(|given| given.refusal.clone()) {
        return Err(refusal);
    }
    match trace.ticks.iter().find_map(|tick| Some((tick.time_s, tick.telemetry.fault?))) {
        Some((time_s, fault)) => Err(format!("{} after {time_s:.2} s", recording::fault(fault).0)),
        None => Ok(recording(&trace, robot)),
    }
}

/// The error of each pair's second model on recordings of the first, over the noise.
fn simulated(
    robots: &[Robot],
    experiment: &Experiment,
    recorded: &[[Recording; 2]],
) -> Result<Vec<f64>, DiagnoseError> {
    let ratio = |truth: usize, model: usize| {
        let [fit, held_out] = &recorded[truth];
        match misfit(&robots[model], std::slice::from_ref(fit), std::slice::from_ref(held_out), &Options::default()) {
            Ok(found) => Ok(found.before / found.noise_floor),
            // So far apart that it is taken for another rig.
            Err(DiagnoseError::WrongRig { ratio, .. }) => Ok(ratio),
            Err(other) => Err(other),
        }
    };
    experiment.expected.iter().map(|one| ratio(one.truth, one.model)).collect()
}
