//! Effects that recordings at steady duties cannot tell apart: the diagnosis must not choose one, and the experiment that it
//! designs must tell apart what it says that it tells apart.

use std::path::Path;
use std::time::Instant;

use diagnose::{Diagnosis, Experiment, Options, Verdict, design_experiment, diagnose, extend};
use hal_sim::Settings;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use recording::Recording;
use robot_file::edit::Document;
use robot_file::robot::{Quantity, Robot};
use simulation::{Drive, DriveCommand, Plan, Step, recording, run};

/// What is hidden, its number and the ends between which it is drawn. At a steady duty each looks like the others.
const EFFECTS: [(&str, &str, f64, f64); 5] = [
    ("driver_drop", "drop_v", 0.4, 1.0),
    ("driver_deadband", "width_duty", 0.06, 0.18),
    ("driver_drop_by_command", "drop_v", 0.4, 1.0),
    ("driver_dead_time", "lost_duty", 0.06, 0.18),
    ("coulomb_friction", "torque_nm", 3e-4, 9e-4),
];
/// What else a table needs.
const BESIDE: [(&str, &str, f64); 5] = [
    ("coulomb_friction", "presliding_deg", 0.5),
    ("driver_drop", "knee_a", 0.0),
    ("driver_drop", "slope_ohm", 0.0),
    ("driver_dead_time", "shortest_duty", 0.03),
    ("driver_dead_time", "knee_a", 0.0),
];
const ENCODER: &str = "kind = \"encoder\"\n\
    counts_per_turn = { value = 4096, low = 4096, high = 4096, source = \"test\" }\n\
    noise_deg = { value = 0.2, low = 0.2, high = 0.2, source = \"test\" }\n";
/// Steady runs, the last one held out, and their length, s.
const RUNS: (usize, f64) = (6, 3.0);
/// Times that the duty of a run is drawn: a robot that turns too fast ends its run.
const DRAWS: usize = 20;
/// Length of the experiment, s.
const EXPERIMENT_S: f64 = 6.0;
/// A model that is expected to miss the truth by less, in units of the reading's noise, may stay.
const TOLD_APART: f64 = 1.1;

/// What became of a set.
pub struct PairOutcome {
    /// Its seed.
    pub seed: u64,
    /// What is hidden.
    pub truth: &'static str,
    /// The models after the steady runs.
    pub before: Vec<Vec<String>>,
    /// One name was given although nothing told it from the others.
    pub single: bool,
    /// An experiment was designed, and the firmware ran it on the robot without a fault.
    pub proposed: bool,
    /// After it the truth stands, and nothing that it was expected to tell from the truth.
    pub separated: bool,
    /// The models after the experiment, or why there is none.
    pub after: Result<Vec<Vec<String>>, String>,
    /// Wall-clock time, s.
    pub seconds: f64,
}

impl PairOutcome {
    /// One line.
    #[must_use]
    pub fn line(&self) -> String {
        let names =
            |models: &[Vec<String>]| models.iter().map(|model| model.join(" + ")).collect::<Vec<_>>().join(", ");
        let after = self.after.as_deref().map_or_else(Clone::clone, names);
        let mark = if self.separated { "ok  " } else { "MISS" };
        format!("{mark} seed {} {}: {} → {after} ({:.1} s)", self.seed, self.truth, names(&self.before), self.seconds)
    }
}

/// The robot as its file has it, and as it is.
fn robots(truth: &str, random: &mut Pcg64) -> (Document, Robot) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/bench-linear.toml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let text = text.replace("kind = \"ideal\"\n", ENCODER);
    let document = || Document::parse(&text, &path.display().to_string()).unwrap_or_else(|error| panic!("{error}"));
    let number = |value: f64| Quantity { value, low: value, high: value, source: "drawn".to_owned() };
    let drawn = EFFECTS.iter().filter(|one| one.0 == truth);
    let mut keys: Vec<(&str, Quantity)> =
        drawn.map(|(_, key, low, high)| (*key, number(random.random_range(*low..*high)))).collect();
    keys.extend(BESIDE.iter().filter(|one| one.0 == truth).map(|(_, key, value)| (*key, number(*value))));
    let mut with = document();
    with.set_effect(truth, &keys).unwrap_or_else(|error| panic!("{error}"));
    (document(), with.robot().unwrap_or_else(|error| panic!("{error}")))
}

/// A recording of a drive by the firmware on the robot; or the fault that ended it.
fn record(robot: &Robot, drive: Drive, seconds: f64, seed: u64) -> Result<Recording, String> {
    let plan = Plan { drive, seconds, faults: Vec::new() };
    let trace = run(robot, seed, &Settings::default(), &plan).map_err(|error| error.to_string())?;
    match trace.ticks.iter().find_map(|tick| tick.telemetry.fault) {
        Some(fault) => Err(format!("{fault:?}")),
        None => Ok(recording(&trace, robot)),
    }
}

fn drive_of(experiment: &Experiment) -> Drive {
    let mut at_s = 0.0;
    let mut steps = Vec::new();
    for piece in &experiment.pieces {
        let command = piece.duty.map_or(DriveCommand::Coast, |duty| DriveCommand::Duty { duty });
        steps.push(Step { at_s, command });
        at_s += piece.seconds;
    }
    Drive { steps, end_s: Some(at_s) }
}

/// The robots of every model that a diagnosis leaves.
fn standing(file: &Document, said: &Diagnosis) -> Result<Vec<Robot>, String> {
    std::iter::once(&said.detail.extended)
        .chain(&said.detail.rivals)
        .map(|fitted| {
            let mut document = file.clone();
            extend(&mut document, fitted, "fitted").map_err(|error| error.to_string())?;
            document.robot().map_err(|error| error.to_string())
        })
        .collect()
}

/// Hides what a seed draws, diagnoses steady runs, designs the experiment, runs it and diagnoses again.
#[must_use]
pub fn examine_pair(seed: u64) -> PairOutcome {
    let clock = Instant::now();
    let mut random = Pcg64::seed_from_u64(seed);
    let truth = EFFECTS[random.random_range(0..EFFECTS.len())].0;
    let mut outcome = PairOutcome {
        seed,
        truth,
        before: Vec::new(),
        single: false,
        proposed: false,
        separated: false,
        after: Ok(Vec::new()),
        seconds: 0.0,
    };
    outcome.after = follow(&mut outcome, &mut random);
    outcome.seconds = clock.elapsed().as_secs_f64();
    outcome
}

fn follow(outcome: &mut PairOutcome, random: &mut Pcg64) -> Result<Vec<Vec<String>>, String> {
    let (file, robot) = robots(outcome.truth, random);
    let model = file.robot().map_err(|error| error.to_string())?;
    let mut runs = (0..RUNS.0)
        .map(|i| {
            let mut steady = || {
                let duty = random.random_range(0.25..0.5) * if i % 2 == 0 { 1.0 } else { -1.0 };
                record(&robot, Drive::constant(DriveCommand::Duty { duty }), RUNS.1, outcome.seed + i as u64)
            };
            (0..DRAWS).find_map(|_| steady().ok()).ok_or("no steady duty turns the shaft without a fault")
        })
        .collect::<Result<Vec<_>, _>>()?;
    let mut held_out = runs.split_off(RUNS.0 - 1);
    let options = Options::default();
    let said = diagnose(&model, &runs, &held_out, &options).map_err(|error| error.to_string())?;
    outcome.before.clone_from(&said.models);
    outcome.single = said.verdict == Verdict::Explained && said.models.len() == 1;
    if said.verdict != Verdict::Ambiguous {
        return Err(format!("{}, no experiment", said.verdict.word()));
    }
    let rivals = standing(&file, &said)?;
    let designed = design_experiment(&rivals, EXPERIMENT_S, &options).map_err(|error| error.to_string())?;
    let run_it = |experiment: Experiment| {
        let new = [1000, 1001].map(|more| record(&robot, drive_of(&experiment), EXPERIMENT_S, outcome.seed + more));
        let [Ok(fit), Ok(judge)] = new else { return None };
        Some((experiment, fit, judge))
    };
    let (experiment, fit, judge) =
        designed.into_iter().find_map(run_it).ok_or("the firmware ends every drive that was designed")?;
    outcome.proposed = true;
    runs.push(fit);
    held_out.push(judge);
    let then = diagnose(&model, &runs, &held_out, &options).map_err(|error| error.to_string())?;
    let is_truth = |names: &Vec<String>| matches!(names.as_slice(), [one] if one == outcome.truth);
    // What the experiment was expected to leave: the truth, and what it misses by next to nothing.
    let stays = |names: &Vec<String>| {
        let place = |one: &Vec<String>| said.models.iter().position(|known| known == one);
        let (Some(truth), Some(model)) = (said.models.iter().position(is_truth), place(names)) else { return false };
        let expected = experiment.expected.iter().find(|one| one.truth == truth && one.model == model);
        expected.is_some_and(|one| one.ratio < TOLD_APART)
    };
    outcome.separated =
        then.models.iter().any(is_truth) && then.models.iter().all(|names| is_truth(names) || stays(names));
    Ok(then.models)
}
