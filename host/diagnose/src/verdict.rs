//! What a diagnosis says: the verdict in the exchange format, and behind it the evidence that a report draws.
//!
//! [`Diagnosis`] serialises to the JSON object of `scram diagnose --json`; [`Detail`] is for reports and tests and is
//! not part of that object. Angles are in radians here, in degrees only where a key's name says so.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The answer in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The model with refitted numbers reaches the noise floor on unseen data.
    Nothing,
    /// One effect (or a pair) brings the model to the noise floor, and no rival does as well.
    Explained,
    /// Several effects do equally well on these data.
    Ambiguous,
    /// No effect of the library reaches the noise floor; a cause may still be named for the part that it removes.
    Unexplained,
}

impl Verdict {
    /// The word used in JSON.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Explained => "explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
        }
    }
}

/// An effect that the model lacks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// Name as in robot.toml's `[effects.NAME]`.
    pub effect: String,
    /// Other effects that these data cannot tell apart from it.
    pub also: Vec<String>,
    /// Its parameters by robot.toml key: `[value, low, high]` in the unit that the key's name ends with, 95 %.
    pub parameters: BTreeMap<String, [f64; 3]>,
}

/// How much better the extended model is on the held-out runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// Share of the held-out error above the noise floor (mean square) that the causes remove, %.
    pub percent_of_excess_removed: f64,
    /// Lower end of its 95 % interval, %.
    pub low: f64,
    /// Upper end, %.
    pub high: f64,
}

/// Where the error that remains lives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOver {
    /// `angle_rad`, `speed_rad_per_s`, `voltage_v`, `current_a`, `time_s`, `time_since_reversal_s`, `frequency_hz` or `run`: the run's
    /// place among all, those that were fitted on first.
    pub coordinate: String,
    /// Lower end of the range.
    pub from: f64,
    /// Upper end of the range.
    pub to: f64,
    /// Share of what is left above the floor that lies in this range, 0 … 1.
    pub share: f64,
    /// Where the coordinate is the run, the names of those in the range.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub runs: Vec<String>,
}

impl LeftOver {
    /// The range, as the end of a sentence: `at angle_rad from 0.400 to 1.200`, `in the run a.csv`.
    #[must_use]
    pub fn place(&self) -> String {
        match self.runs.as_slice() {
            [] => format!("at {} from {:.3} to {:.3}", self.coordinate, self.from, self.to),
            [run] => format!("in the run {run}"),
            runs => format!("in the runs {}", runs.join(", ")),
        }
    }
}

/// What a [`MissingTerm`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TermKind {
    /// A torque on the shaft, N·m, positive with the angle.
    TorqueNm,
    /// A torque on a shaft that turns forwards, N·m, which turns over with the direction of motion.
    TorqueAlongMotionNm,
    /// A torque at the highest voltage of the runs, N·m, in proportion to the voltage.
    TorqueAlongVoltageNm,
    /// An error of the angle reading, rad.
    ReadingRad,
    /// How fast the sensor gains on the shaft, rad/s; over the current, at the highest speed of the runs.
    SlipRadPerS,
}

/// What the file's model lacks, as a curve over one coordinate that nobody has chosen a law for: of the refitted model linearised
/// about the fit runs. What its refitted numbers could do as well is not in it: of a friction the part that grows with speed, for
/// instance. Each coordinate is looked at alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissingTerm {
    /// `angle_rad`, `speed_rad_per_s`, `voltage_v`, `current_a`, `time_s`, `time_since_reversal_s` or `run`.
    pub coordinate: String,
    /// What it is, and in what unit.
    pub kind: TermKind,
    /// Share of the sum of squared errors on the fit runs that the curve promises to take away, 0 … 1.
    pub promised: f64,
    /// Chance that noise promises as much on any coordinate.
    pub chance: f64,
    /// The curve over the range that the held-out runs cover.
    pub points: Vec<TermPoint>,
}

/// A point of a [`MissingTerm`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TermPoint {
    /// Place on the coordinate.
    pub at: f64,
    /// The term.
    pub value: f64,
    /// Lower end of its 95 % interval, of this point alone.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// How large an effect may be that was not found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Name as in robot.toml's `[effects.NAME]`.
    pub effect: String,
    /// Upper one-sided 95 % limits of what makes it large, by robot.toml key, in the unit that the key's name ends with; `null`
    /// where these runs say nothing of it.
    pub at_most: BTreeMap<String, Option<f64>>,
    /// Chance that an effect which is not there looks as likely somewhere in the library.
    pub chance: f64,
    /// These runs would show an effect of the size that the catalogue calls usual.
    pub would_show: bool,
}

/// Something by which the recordings do not look like those of the file's rig, although a model of it follows them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigDoubt {
    /// What does not go together, with its evidence.
    pub reason: String,
    /// What to change, a line an explanation.
    pub mend: String,
}

/// A diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// The answer in one word.
    pub verdict: Verdict,
    /// What the model lacks; empty when nothing does or nothing is known.
    pub causes: Vec<Cause>,
    /// Every model that these runs cannot tell from the one that `causes` names, by its effects; that one first. Empty
    /// without a cause.
    pub models: Vec<Vec<String>>,
    /// Noise of the angle reading, estimated without any motor model, rad RMS.
    pub noise_floor: f64,
    /// Held-out free-rollout RMSE of the file's model with refitted numbers, rad.
    pub before: f64,
    /// The same of the extended model (equal to `before` when there is no cause), rad.
    pub after: f64,
    /// The same where each held-out run is judged with the model, of as many effects, that the other held-out runs choose, rad: about
    /// `after` where the choice is clear, more where choosing among many models flatters it.
    pub after_cross_judged: f64,
    /// How much of the excess the causes remove.
    pub gain: Gain,
    /// Where the rest lives; `None` when nothing is left.
    pub left_over: Option<LeftOver>,
    /// What the file's model lacks as a curve over each coordinate, where that is more than an accident; the one that promises
    /// most first. Empty for the verdict `nothing`.
    pub missing_terms: Vec<MissingTerm>,
    /// Numbers of the extended model that do not hang on the scale of torques, which angle and drive alone do not show, by key:
    /// `[value, low, high]` in the unit that the key ends with, 95 %. `motor.back_emf_v_s_per_rad` is `K + b·R/K`,
    /// `motor.inertia_v_s2_per_rad` is `J·R/K`, `motor.time_constant_s` their ratio; an effect's torque is times `R/K`.
    pub scale_free: BTreeMap<String, [f64; 3]>,
    /// How large each effect that is not named may still be.
    pub limits: Vec<Limit>,
    /// What [`crate::check_rig`] finds wrong between the recordings and the file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rig_doubts: Vec<RigDoubt>,
    /// The experiment that would decide, when these data cannot.
    pub next_experiment: Option<String>,
    /// Everything that a report draws; not in the JSON.
    #[serde(skip)]
    pub detail: Detail,
}

/// Beyond this many floors an error without a cause is noise that remembers.
const REMEMBERS: f64 = 1.1;

impl Diagnosis {
    /// Whether nothing is missing though the held-out runs are missed by more than noise: they go where the fit runs leave the
    /// model's numbers open.
    #[must_use]
    pub fn leaves_numbers_open(&self) -> bool {
        self.leaves_more_than_noise() && self.detail.is_of_open_numbers
    }

    fn leaves_more_than_noise(&self) -> bool {
        self.verdict == Verdict::Nothing && self.before > REMEMBERS * self.noise_floor
    }

    /// Whether nothing is missing though the error is larger than the fast scatter of the reading: its noise remembers.
    #[must_use]
    pub fn remembers(&self) -> bool {
        self.leaves_more_than_noise() && !self.detail.is_of_open_numbers
    }
}

/// The evidence behind a [`Diagnosis`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Detail {
    /// Length of the free rollouts that everything is judged by, s.
    pub horizon_s: f64,
    /// How many rollouts the held-out runs gave.
    pub held_out_rollouts: usize,
    /// Names of the runs that were fitted on.
    pub fit_runs: Vec<String>,
    /// Names of the runs that were held out.
    pub held_out_runs: Vec<String>,
    /// Every number of the file's own model, refitted without any cause.
    pub nominal: Vec<FittedParameter>,
    /// What the extended robot file says: refitted numbers and the tables of the causes.
    pub extended: Vec<FittedParameter>,
    /// The same for each other model that these runs cannot tell from the named one, in the order of [`Diagnosis::models`].
    pub rivals: Vec<Vec<FittedParameter>>,
    /// Every candidate that was tried, best first. The first entry with no effect is the refitted nominal model.
    pub candidates: Vec<CandidateEvidence>,
    /// The misfit against each coordinate.
    pub misfit_map: Vec<MisfitCurve>,
    /// Held-out rollouts to look at, the worst before, the median, and so on.
    pub traces: Vec<RolloutTrace>,
    /// RMS error of every held-out rollout.
    pub rollout_errors: Vec<RolloutError>,
    /// What of each run was used.
    pub runs: Vec<RunUse>,
    /// What the refitted model leaves of the held-out runs is no more than the fit runs leave its numbers open.
    pub is_of_open_numbers: bool,
    /// The verdict in a few plain sentences.
    pub summary: Vec<String>,
}

/// RMS error of one held-out rollout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RolloutError {
    /// Of the refitted nominal model, rad.
    pub before: f64,
    /// Of the extended model, rad.
    pub after: f64,
}

/// What of a run was used.
#[derive(Clone, Debug, PartialEq)]
pub struct RunUse {
    /// The run's name.
    pub name: String,
    /// Held out, not fitted on.
    pub held_out: bool,
    /// Its length, s.
    pub seconds: f64,
    /// Samples in it.
    pub samples: usize,
    /// Samples with a reading that counts and within a rollout.
    pub used: usize,
    /// Samples without a reading (blind arc, empty cells).
    pub missing: usize,
    /// Of these, readings that were dropped because they are from the potentiometer's blind arc.
    pub blind: usize,
    /// Readings that hardly say how the walking body pulls at the shaft.
    pub pull_unknown: usize,
    /// Readings left out as spikes.
    pub spikes: usize,
    /// Rollouts cut from it.
    pub rollouts: usize,
}

/// A fitted number of the robot file.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedParameter {
    /// Dotted path in robot.toml, e.g. `motor.resistance_ohm` or `effects.coulomb_friction.torque_nm`.
    pub path: String,
    /// Fitted value in the unit that the key's name ends with.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// What the file says; `None` for a number that it does not have.
    pub file_value: Option<f64>,
}

/// How one candidate did.
#[derive(Clone, Debug, PartialEq)]
pub struct CandidateEvidence {
    /// The effects added to the file's model: none (the refitted nominal), one, or a pair.
    pub effects: Vec<String>,
    /// Held-out free-rollout RMSE, rad.
    pub held_out_rmse: f64,
    /// The same over the noise floor.
    pub ratio_to_floor: f64,
    /// Share of the refitted nominal's held-out RMSE that it removes, %: value, low, high (95 %, bootstrap).
    pub improvement_percent: [f64; 3],
    /// Its own parameters (not the nominal ones).
    pub parameters: Vec<FittedParameter>,
    /// What speaks for it, in words.
    pub speaks_for: Vec<String>,
    /// What speaks against it, in words.
    pub speaks_against: Vec<String>,
    /// Whether the verdict names it.
    pub named: bool,
}

/// Root mean square of the held-out rollout error against one coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct MisfitCurve {
    /// `angle_rad`, `speed_rad_per_s`, `voltage_v`, `current_a`, `time_s`, `time_since_reversal_s`, `run`, `time_in_rollout_s` or
    /// `frequency_hz`: of the error's spectrum, whose level is the floor where the error is white noise.
    pub coordinate: String,
    /// Bins, ascending; bins with too few samples are left out.
    pub bins: Vec<MisfitBin>,
}

/// One bin of a [`MisfitCurve`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MisfitBin {
    /// Lower edge.
    pub from: f64,
    /// Upper edge.
    pub to: f64,
    /// Samples in it.
    pub samples: usize,
    /// RMS of the refitted nominal model's error, rad.
    pub before: f64,
    /// RMS of the extended model's error, rad.
    pub after: f64,
    /// Mean (signed) error before, measured minus simulated, rad.
    pub bias_before: f64,
    /// Mean (signed) error after, rad.
    pub bias_after: f64,
}

/// A stretch of a held-out run, measured and simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct RolloutTrace {
    /// The run's name.
    pub run: String,
    /// Why it is shown, e.g. `worst before`.
    pub why: String,
    /// One entry a sample.
    pub samples: Vec<TraceSample>,
}

/// One sample of a [`RolloutTrace`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceSample {
    /// Time in the run, s.
    pub t_s: f64,
    /// A rollout begins here.
    pub starts: bool,
    /// Unwrapped measured angle, rad; `None` where there is no reading.
    pub measured: Option<f64>,
    /// Simulated reading of the refitted nominal model, rad, same turn.
    pub before: f64,
    /// Simulated reading of the extended model, rad.
    pub after: f64,
}

/// The floor and the refitted nominal model's error, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Noise of the angle reading, rad RMS.
    pub noise_floor: f64,
    /// Held-out free-rollout RMSE of the refitted nominal model, rad.
    pub before: f64,
}
