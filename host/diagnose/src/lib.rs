//! Diagnosis: what the simulation gets wrong about a measured robot, and the name of the cause.
//!
//! Order of work: the numbers of the file's model are refitted first, so that a wrong number is not called a wrong
//! model; each effect of the catalogue that the file lacks is then fitted jointly with them; all are judged by free
//! rollouts of a fixed length on runs that no fit has seen.
//!
//! ```
//! use std::path::Path;
//!
//! use robot_file::Robot;
//! use robot_file::edit::Document;
//! use diagnose::{Options, diagnose};
//! use simulation::{Drive, DriveCommand, Plan, Step, recording, run};
//!
//! let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/bench-linear.toml"));
//! let robot = Robot::load(file)?;
//! // The measured rig is another one: it has friction that the file does not know.
//! let friction = "[effects.coulomb_friction]\n\
//!     torque_nm = { value = 2e-4, low = 1e-4, high = 4e-4, source = \"example\" }\n\
//!     presliding_deg = { value = 0.2, low = 0.05, high = 1.0, source = \"example\" }\n";
//! let text = std::fs::read_to_string(file)? + friction;
//! let rig = Document::parse(&text, &file.display().to_string())?.robot()?;
//! let measured: Vec<_> = (1..=4)
//!     .map(|seed| {
//!         let duty = |k: u64| (((k * 7 + seed * 3) % 11) as f64 - 5.0) / 5.0;
//!         let steps = (0..8).map(|k| Step { at_s: 0.25 * k as f64, command: DriveCommand::Duty { duty: duty(k) } }).collect();
//!         let plan = Plan { drive: Drive { steps, end_s: None }, seconds: 2.0, faults: Vec::new() };
//!         Ok(recording(&run(&rig, seed, &hal_sim::Settings::default(), &plan)?, &rig))
//!     })
//!     .collect::<Result<_, simulation::SimError>>()?;
//! // The last two runs are held out: no fit sees them.
//! let diagnosis = diagnose(&robot, &measured[..2], &measured[2..], &Options::default())?;
//! assert_eq!(diagnosis.causes[0].effect, "coulomb_friction");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It draws nothing and knows no terminal: reports and pictures are the crate `plot`'s.
//! * It reads no files: the crate `recording` does. [`extend`] changes a robot file in memory only.
//! * It runs no experiment: [`design_experiment`] says which drive tells models apart, the crate `simulation` or a robot runs it.

mod blind_arc;
mod bootstrap;
mod confidence_set;
mod converter;
mod covariance;
mod current;
mod curves;
mod experiment;
mod extend;
mod fit;
mod floor;
mod ground;
mod held;
mod inquiry;
mod map;
mod memory;
mod missing_term;
mod model;
mod motion;
mod motor;
mod nominal;
mod normal_equations;
mod numbers;
mod odd_runs;
mod one_step;
mod open_numbers;
mod pairs;
mod partial;
mod place;
mod probe;
mod repeats;
mod rig_check;
mod rollout;
mod scale_free;
mod screen;
mod search;
mod selection;
mod session;
mod spectrum;
mod track;
mod values;
mod verdict;
pub mod walk;
mod words;

#[cfg(test)]
mod measured;
#[cfg(test)]
mod tests;

use effects::Id;
use robot_file::robot::Robot;

use fit::Fit;
use inquiry::{Found, Inquiry};
use recording::Recording;
use search::Candidate;
use selection::Selection;
use session::Session;

pub use common::Progress;
pub use experiment::{Experiment, Piece, Separation, design_experiment};
pub use extend::extend;
pub use motor::{Known, MotorFit, MotorNumber, identify_motor};
pub use rig_check::{Cause as RigMistake, Finding, Mend, RigCheck, check_rig};
pub use verdict::{
    CandidateEvidence, Cause, Detail, Diagnosis, FittedParameter, Gain, LeftOver, Limit, Misfit, MisfitBin,
    MisfitCurve, MissingTerm, RigDoubt, RolloutError, RolloutTrace, RunUse, TermKind, TermPoint, TraceSample, Verdict,
};

/// Samples that make a few rollouts; a run below this cannot be judged.
pub const FEWEST_SAMPLES: usize = 20;
/// Samples of a run that are worth their time: a minute at 1 kHz. Longer runs are read thinned by whole blocks.
pub const MOST_SAMPLES: usize = 60_000;

/// How to diagnose.
#[derive(Clone)]
pub struct Options {
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Threads; 0 for as many as the machine has cores.
    pub threads: usize,
    /// Length of the free rollouts, s; `None` for 0.1 s, longer for a rig that is slow (twice its mechanical time
    /// constant, where that is beyond 0.2 s; 1 s at most) or slowly sampled (25 samples).
    pub horizon_s: Option<f64>,
    /// Effects that are tried beside those of every diagnosis ([`effects::Spec::candidate`]).
    pub also_try: Vec<Id>,
    /// Told what is being done (a word or two) and the share done, 0 … 1.
    pub progress: Option<Progress>,
}

impl Options {
    fn tell(&self, what: &str, share: f64) {
        if let Some(progress) = &self.progress {
            progress(what, share);
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1, threads: 0, horizon_s: None, also_try: Vec::new(), progress: None }
    }
}

/// Why there is no diagnosis.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum DiagnoseError {
    /// Nothing to fit on.
    #[error("no recording to fit on")]
    #[diagnostic(help("give at least two runs: one to fit on, one to hold out"))]
    NothingToFit,
    /// Nothing to judge by.
    #[error("no recording is held out")]
    #[diagnostic(help("give at least two runs, and hold one of them out"))]
    NothingHeldOut,
    /// A recording that cannot be used.
    #[error("{run}: {problem}")]
    #[diagnostic(help("{help}"))]
    Recording {
        /// The run.
        run: String,
        /// What is wrong with it.
        problem: String,
        /// What to do.
        help: String,
    },
    /// The robot file cannot describe these recordings.
    #[error(
        "the model of {robot} misses these recordings by {ratio:.0} times their noise, even with its numbers refitted: {detail}"
    )]
    #[diagnostic(help("{mend}"))]
    WrongRig {
        /// Name in the robot file.
        robot: String,
        /// Error over noise.
        ratio: f64,
        /// What gave it away, and the reason where [`check_rig`] finds one.
        detail: String,
        /// What to change.
        mend: String,
    },
    /// An effect of [`Options::also_try`] that there is nothing to try of.
    #[error("{effect} cannot be tried: {why}")]
    #[diagnostic(help("leave it out"))]
    CannotTry {
        /// Its name.
        effect: String,
        /// What stands in the way.
        why: String,
    },
    /// An experiment is asked for to tell one model apart.
    #[error("an experiment tells models apart, and this is one")]
    #[diagnostic(help(
        "give at least two robot files: scram diagnose writes one for every model that is still standing"
    ))]
    NothingToTellApart,
    /// A field of the robot file stands in the way.
    #[error("{field}: {problem}")]
    Robot {
        /// Dotted path.
        field: String,
        /// What is wrong.
        problem: String,
    },
}

/// Beyond this many times the noise, and this far in rad, the refitted model is of another rig.
const HOPELESS: (f64, f64) = (100.0, 0.35);
/// The same where the fit drives two of R, K and J to five times or a fifth of what the file says, and no effect explains it.
const IMPLAUSIBLE: f64 = 20.0;

/// Compares a robot file with recordings and says what the model lacks.
///
/// # Errors
/// When there is nothing to fit on or to judge by, when a recording is unusable, when it is of another rig, or when an effect of
/// [`Options::also_try`] is in the file already or does not show in these runs.
pub fn diagnose(
    robot: &Robot,
    fit: &[Recording],
    held_out: &[Recording],
    options: &Options,
) -> Result<Diagnosis, DiagnoseError> {
    in_pool(options, || {
        options.tell("refitting the model's numbers", 0.0);
        let (session, baseline) = open(robot, fit, held_out, options)?;
        let found = Inquiry::new(robot, options).run(session, baseline)?;
        options.tell("writing down", 0.97);
        let mut diagnosis = write_down(robot, &found, options.seed);
        held::add(&mut diagnosis, robot, &found.session);
        diagnosis.rig_doubts = findings(robot, fit, held_out).iter().map(RigDoubt::from).collect();
        diagnosis.detail.summary = words::summary(&diagnosis);
        options.tell("done", 1.0);
        Ok(diagnosis)
    })
    .map_err(|error| with_reason(error, robot, fit, held_out))
}

/// The noise floor and the refitted nominal model's held-out error, without looking for a cause.
///
/// # Errors
/// As [`diagnose`].
pub fn misfit(
    robot: &Robot,
    fit: &[Recording],
    held_out: &[Recording],
    options: &Options,
) -> Result<Misfit, DiagnoseError> {
    in_pool(options, || {
        let (session, baseline) = open(robot, fit, held_out, options)?;
        if is_implausible(&session, &baseline) {
            return Err(wrong_rig(robot, &session, &baseline));
        }
        Ok(Misfit { noise_floor: session.noise.sqrt(), before: baseline.mean_square().sqrt() })
    })
    .map_err(|error| with_reason(error, robot, fit, held_out))
}

fn in_pool<T: Send>(options: &Options, work: impl FnOnce() -> T + Send) -> T {
    identify::robot::in_pool(options.threads, work)
}

/// Refits the nominal model and judges it; refuses what it does not follow at all.
fn open(
    robot: &Robot,
    fit: &[Recording],
    held_out: &[Recording],
    options: &Options,
) -> Result<(Session, Candidate), DiagnoseError> {
    let (mut session, mut fit) = Session::open(robot, fit, held_out, options)?;
    if session.on_ground() {
        fit = ground::find_body(&mut session, robot, options)?;
    }
    let baseline = judged(&mut session, fit);
    let error = baseline.mean_square().sqrt();
    if !error.is_finite() || (error / session.noise.sqrt() > HOPELESS.0 && error > HOPELESS.1) {
        return Err(wrong_rig(robot, &session, &baseline));
    }
    Ok((session, baseline))
}

/// Whether the refit of a model that misses by far has driven its numbers to where no motor of this kind has them.
fn is_implausible(session: &Session, baseline: &Candidate) -> bool {
    baseline.mean_square() > IMPLAUSIBLE * IMPLAUSIBLE * session.noise && baseline.fit.at_bounds() >= 2
}

fn wrong_rig(robot: &Robot, session: &Session, baseline: &Candidate) -> DiagnoseError {
    let error = baseline.mean_square().sqrt();
    let detail = format!("{:.1}° after {:.2} s", error.to_degrees(), session.horizon_s);
    let mend = "is this the right robot file? Check also that angles are in radians and that duty and angle have the same sign";
    let ratio = error / session.noise.sqrt();
    DiagnoseError::WrongRig { robot: robot.name.clone(), ratio, detail, mend: mend.to_owned() }
}

/// What does not go together between all recordings and the file.
fn findings(robot: &Robot, fit: &[Recording], held_out: &[Recording]) -> Vec<Finding> {
    let runs: Vec<Recording> = fit.iter().chain(held_out).cloned().collect();
    check_rig(robot, &runs).findings
}

/// A refusal with its reason and what to change, where a check of the recordings against the file finds any.
fn with_reason(error: DiagnoseError, robot: &Robot, fit: &[Recording], held_out: &[Recording]) -> DiagnoseError {
    let found = || {
        let findings = findings(robot, fit, held_out);
        let reasons: Vec<String> = findings.iter().map(Finding::reason).collect();
        let mends: Vec<String> = findings.iter().map(Finding::mend).collect();
        (!findings.is_empty()).then(|| (reasons.join("; "), mends.join("\n")))
    };
    match error {
        DiagnoseError::WrongRig { robot, ratio, detail, mend } => {
            let (reason, mend) = found().map_or((String::new(), mend), |(reason, mend)| (format!("; {reason}"), mend));
            DiagnoseError::WrongRig { robot, ratio, detail: detail + &reason, mend }
        }
        DiagnoseError::Recording { run, problem, help } => {
            let help = found().map_or(help.clone(), |(reason, mend)| format!("{help}\n{reason}\n{mend}"));
            DiagnoseError::Recording { run, problem, help }
        }
        other => other,
    }
}

/// The refitted nominal model, judged; its starts are a first guess for every later one.
fn judged(session: &mut Session, fit: Fit) -> Candidate {
    let evaluation = session.evaluate(&fit);
    session.remember(&evaluation);
    let (effects, refuted, in_full) = (Vec::new(), false, true);
    Candidate { effects, fit, evaluation, sized: true, sized_in_its_shape: true, refuted, in_full }
}

fn write_down(robot: &Robot, found: &Found, seed: u64) -> Diagnosis {
    let Found { session, decision, rest, .. } = found;
    let selection = &found.selection();
    let named = decision.named().map(|index| &selection.candidates[index]);
    let also = decision.also(selection.candidates);
    let rivals: Vec<&Candidate> = decision.class.iter().skip(1).map(|&index| &selection.candidates[index]).collect();
    let after = named.unwrap_or(selection.baseline);
    let extended = values::fitted(robot, &session.model, &after.fit);
    let causes: Vec<Cause> = after
        .effects
        .iter()
        .zip(&also)
        .map(|(effect, also)| Cause {
            effect: effect.name().to_owned(),
            also: also.iter().map(|effect| effect.name().to_owned()).collect(),
            parameters: values::of_effect(&extended, *effect),
        })
        .collect();
    let (misfit_map, left_over) = map::misfit_map(session, selection.baseline, after, found.place);
    let left_over = found.odd_runs.clone().or(left_over).filter(|_| decision.verdict == Verdict::Unexplained);
    let missing_terms = match decision.verdict {
        Verdict::Nothing => Vec::new(),
        _ => missing_term::of(session, selection.baseline, &misfit_map, seed),
    };
    let mut class: Vec<Id> = also.iter().flatten().copied().collect();
    class.extend(if class.is_empty() { &[] } else { after.effects.as_slice() });
    let gain = named.map_or_else(Gain::default, |model| {
        let [percent_of_excess_removed, low, high] = selection.gain(model);
        Gain { percent_of_excess_removed, low, high }
    });
    Diagnosis {
        verdict: decision.verdict,
        causes,
        models: decision.class.iter().map(|&index| names(&selection.candidates[index])).collect(),
        noise_floor: session.noise.sqrt(),
        before: selection.baseline.mean_square().sqrt(),
        after: after.mean_square().sqrt(),
        after_cross_judged: named
            .map_or(after.mean_square(), |model| selection.cross_judged(model, &session.parts()))
            .sqrt(),
        gain,
        next_experiment: words::next_experiment(&class, left_over.as_ref().map(|left| left.coordinate.as_str())),
        left_over,
        missing_terms,
        scale_free: scale_free::of(&session.model, &after.fit),
        limits: values::limits(&session.model, rest, &after.effects),
        detail: Detail {
            horizon_s: session.horizon_s,
            held_out_rollouts: selection.baseline.evaluation.errors.len(),
            fit_runs: session.fit.iter().map(|track| track.name.clone()).collect(),
            held_out_runs: session.held_out.iter().map(|track| track.name.clone()).collect(),
            nominal: values::fitted(robot, &session.model, &selection.baseline.fit),
            extended,
            rivals: rivals.iter().map(|rival| values::fitted(robot, &session.model, &rival.fit)).collect(),
            candidates: candidates(robot, session, selection, named),
            misfit_map,
            traces: map::traces(session, selection.baseline, after),
            rollout_errors: map::rollout_errors(selection.baseline, after),
            runs: map::runs(session),
            is_of_open_numbers: found.is_of_open_numbers,
            summary: Vec::new(),
        },
        rig_doubts: Vec::new(),
    }
}

/// The effects of a model by name.
fn names(model: &Candidate) -> Vec<String> {
    model.effects.iter().map(|effect| effect.name().to_owned()).collect()
}

/// The evidence for every model that was tried, best first, the nominal one in front.
fn candidates(
    robot: &Robot,
    session: &Session,
    selection: &Selection,
    named: Option<&Candidate>,
) -> Vec<CandidateEvidence> {
    let mut order: Vec<&Candidate> = selection.candidates.iter().collect();
    order.sort_by(|a, b| a.mean_square().total_cmp(&b.mean_square()));
    let is_named = |model: &Candidate| named.is_some_and(|named| named.effects == model.effects);
    let mut out = vec![CandidateEvidence {
        effects: Vec::new(),
        held_out_rmse: selection.baseline.mean_square().sqrt(),
        ratio_to_floor: selection.ratio(selection.baseline),
        improvement_percent: [0.0; 3],
        parameters: Vec::new(),
        speaks_for: Vec::new(),
        speaks_against: Vec::new(),
        named: false,
    }];
    out.extend(order.into_iter().map(|model| {
        let (speaks_for, speaks_against) = words::evidence(selection, model, named);
        let own = names(model);
        CandidateEvidence {
            effects: names(model),
            held_out_rmse: model.mean_square().sqrt(),
            ratio_to_floor: selection.ratio(model),
            improvement_percent: selection.improvement(selection.baseline, model, 0.025).map(|share| 100.0 * share),
            parameters: values::fitted(robot, &session.model, &model.fit)
                .into_iter()
                .filter(|one| one.path.split('.').nth(1).is_some_and(|table| own.iter().any(|name| name == table)))
                .collect(),
            speaks_for,
            speaks_against,
            named: is_named(model),
        }
    }));
    out
}
