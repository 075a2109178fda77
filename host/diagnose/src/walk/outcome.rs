//! What the diagnosis of a walk says.

use std::collections::BTreeMap;
use std::path::PathBuf;

use identify::robot::{ComponentError, ConditionFit, Parameter, RobotFit};
use robot_file::edit::Document;
use serde::Serialize;

use super::adequacy::Adequacy;
use super::feet::FootPlace;
use super::models::Model;
use super::place::Place;
use crate::Verdict;

/// Deviations below which nineteen of twenty lie.
pub(super) const Z95: f64 = 1.645;

/// An effect that the model lacks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WalkCause {
    /// Name as in robot.toml's `[effects.NAME]`.
    pub effect: String,
    /// Other effects that these speeds cannot tell from it.
    pub also: Vec<String>,
    /// Its parameters by robot.toml key: `[value, low, high]` in the unit that the key's name ends with, 90 %.
    pub parameters: BTreeMap<String, [f64; 3]>,
}

/// A model that was fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WalkModel {
    /// The effects that it has beyond the file's; empty for the file's model.
    pub effects: Vec<String>,
    /// log₁₀ of the factor by which it raises the evidence of the file's model.
    pub log10_bayes_factor: f64,
    /// Among models of as many effects that were fitted, were one of them right.
    pub probability: f64,
    /// Root mean square of the fitted means' deviations, in units of what the means are known to.
    pub misfit: Option<f64>,
    /// Whether what it leaves is what repeats scatter by, on fitted and on held-out conditions; none, as with what else was not looked
    /// at, of a model that lies far behind others.
    pub adequate: Option<bool>,
    /// Of the held-out conditions: longitudinal, lateral, yaw, as a share of the largest; root mean square.
    pub held_out: [Option<f64>; 3],
}

/// How large an effect that is not named may still be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WalkLimit {
    /// The effect.
    pub effect: String,
    /// Its keys with how far from the effect's absence each may be, in the key's unit, 95 %.
    pub largest: Vec<(String, f64)>,
}

/// What the diagnosis of a walk says.
#[derive(Clone, Debug, Serialize)]
pub struct WalkDiagnosis {
    /// In one word.
    pub verdict: Verdict,
    /// What the model lacks; empty when nothing does or nothing is known.
    pub causes: Vec<WalkCause>,
    /// log₁₀ of the mean factor by which the effects raise the evidence; chance passes 2 in at most one table of a hundred.
    pub log10_evidence_against_nothing: f64,
    /// Every model that was fitted: the file's first, then the most probable.
    pub models: Vec<WalkModel>,
    /// Of the held-out conditions, the file's numbers refitted: longitudinal, lateral, yaw.
    pub before: [Option<f64>; 3],
    /// The same with the extended model; as before where nothing is named.
    pub after: [Option<f64>; 3],
    /// What repeats alone make of a mean, share of the largest, where there are repeats.
    pub scatter: [Option<f64>; 3],
    /// Where the file's model, refitted, is most clearly wrong; `None` where it is wrong nowhere, or everywhere alike.
    pub place: Option<Place>,
    /// The same for every part of the speeds.
    pub places: Vec<Place>,
    /// What the speeds say of the friction of each foot alone; empty where the file has it already.
    pub feet: Vec<FootPlace>,
    /// How large each effect that is not named may still be.
    pub limits: Vec<WalkLimit>,
    /// Every condition: measured, with the file's numbers refitted, with the extended model.
    pub conditions: Vec<ConditionFit>,
    /// The extended model's numbers, or the refitted ones where nothing is named; what the speeds tell best first.
    pub parameters: Vec<Parameter>,
    /// Sets of numbers simulated.
    pub simulated: usize,
    /// One line for people, then what to do.
    #[serde(skip)]
    pub summary: Vec<String>,
    /// The files of what was simulated, if they were kept; of no use when the diagnosis is done.
    #[serde(skip)]
    pub kept: Vec<PathBuf>,
    /// The robot file with the numbers and effects that were found.
    #[serde(skip)]
    pub document: Document,
}

/// A model with what it leaves.
pub struct Judged {
    /// The model.
    pub model: Model,
    /// Whether that is what repeats scatter by.
    pub adequacy: Adequacy,
    /// Its speeds and numbers.
    pub fit: RobotFit,
}

impl WalkModel {
    /// Beside the evidence of the file's model, with its probability.
    pub(super) fn of(model: &Model, base: f64, probability: f64) -> Self {
        Self {
            effects: model.effects.iter().map(|id| id.name().to_owned()).collect(),
            log10_bayes_factor: (model.evidence - base) / std::f64::consts::LN_10,
            probability,
            misfit: None,
            adequate: None,
            held_out: [None; 3],
        }
    }
}

impl Judged {
    /// Names of its effects.
    pub fn names(&self) -> Vec<String> {
        self.model.effects.iter().map(|id| id.name().to_owned()).collect()
    }

    /// Beside the evidence of the file's model, with its probability.
    pub fn listed(&self, base: f64, probability: f64) -> WalkModel {
        WalkModel {
            misfit: Some(self.adequacy.misfit),
            adequate: Some(self.adequacy.holds()),
            held_out: self.errors(),
            ..WalkModel::of(&self.model, base, probability)
        }
    }

    /// Of the held-out conditions, root mean square as a share of the largest.
    pub fn errors(&self) -> [Option<f64>; 3] {
        let error = |part: &Option<ComponentError>| part.map(|error| error.after);
        [0, 1, 2].map(|part| error(&self.fit.held_out[part]))
    }

    /// An effect of its own, as a cause.
    pub fn cause(&self, effect: effects::Id, also: Vec<String>) -> WalkCause {
        let table = format!("effects.{}.", effect.name());
        let key = |one: &Parameter| Some((one.path.strip_prefix(&table)?.to_owned(), [one.value, one.low, one.high]));
        let parameters = self.fit.parameters.iter().filter_map(key).collect();
        WalkCause { effect: effect.name().to_owned(), also, parameters }
    }
}
