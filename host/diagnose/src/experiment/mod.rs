//! The next experiment: a drive whose recording tells models apart that the recordings so far do not.
//!
//! Each model in turn is taken for the truth, and the others are fitted to what it predicts, their numbers and the starts of
//! their rollouts free: what is left of them then, in standard deviations of the reading, is what the recording can tell. The
//! drive is chosen by T-optimality (A. C. Atkinson, V. V. Fedorov, "The design of experiments for discriminating between two
//! rival models", Biometrika 62, 1975; the sum over several models, ibid. 289–303), with each pair's misfit counted as the
//! share of it that is not noise: a pair that is far apart already gains little more, and one that no drive can tell apart
//! takes nothing from the others. It is searched for among regular and random drives, and by exchange of pieces in the best of
//! them (R. K. Meyer, C. J. Nachtsheim, "The coordinate-exchange algorithm", Technometrics 37, 1995). A drive in which a shaft
//! stands still although it is driven, or turns against a hard drive for long, is none: the robot's supervisor ends it.

mod rival;
mod script;
#[cfg(test)]
mod tests;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use robot_file::robot::Robot;
use serde::Serialize;

use rival::Rival;
use script::{Reach, Script};

pub use script::Piece;

use super::{DiagnoseError, Options, in_pool};

/// Random drives that are tried.
const RANDOM: usize = 24;
/// Drives whose pieces are exchanged, and how often.
const IMPROVED: (usize, usize) = (3, 12);
/// Rounds of a fit while drives are compared, and in the end.
const ROUNDS: (usize, usize) = (2, 15);
/// Duties at which it is tried whether the shaft turns.
const STEPS_OF_DUTY: usize = 20;

/// A drive and what it tells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Experiment {
    /// The drive.
    pub pieces: Vec<Piece>,
    /// What it tells of each model against each other one.
    pub expected: Vec<Separation>,
}

/// How far a model stays from the readings of another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Separation {
    /// Which model is the truth, from 0.
    pub truth: usize,
    /// Which one is fitted to it.
    pub model: usize,
    /// Error of that one's free rollouts over the noise of the reading.
    pub ratio: f64,
}

impl Experiment {
    /// What it tells, from 0 to 1: the share of the misfit that is not noise, in the mean over the pairs.
    #[must_use]
    pub fn told(&self) -> f64 {
        told(&self.expected)
    }
}

fn told(separations: &[Separation]) -> f64 {
    let sum: f64 = separations.iter().map(|one| 1.0 - one.ratio.powi(-2)).sum();
    sum / separations.len() as f64
}

/// Drives of a length (s) that tell models apart, given as robot files, the best one first. Empty where no drive turns every
/// model's shaft.
///
/// # Errors
/// Fewer than two models.
pub fn design_experiment(models: &[Robot], seconds: f64, options: &Options) -> Result<Vec<Experiment>, DiagnoseError> {
    if models.len() < 2 {
        return Err(DiagnoseError::NothingToTellApart);
    }
    in_pool(options, || {
        let rivals: Vec<Rival> = models.iter().map(Rival::new).collect();
        let Some(duty) = duties(&rivals) else { return Ok(Vec::new()) };
        let reach = Reach { duty, seconds };
        options.tell("trying drives", 0.1);
        let mut random = Pcg64Mcg::seed_from_u64(options.seed);
        let mut scripts = reach.regular();
        scripts.extend((0..RANDOM).map(|_| reach.random(&mut random)));
        let mut judged = best_first(&rivals, scripts);
        for round in 0..IMPROVED.1 {
            options.tell("exchanging pieces", 0.4 + 0.5 * round as f64 / IMPROVED.1 as f64);
            let of_best = judged.iter().take(IMPROVED.0).map(|(script, _)| reach.exchanged(script, &mut random));
            let exchanged = best_first(&rivals, of_best.collect());
            judged.extend(exchanged);
            judged.sort_by(|a, b| b.1.total_cmp(&a.1));
        }
        options.tell("judging the best", 0.9);
        let mut found: Vec<Experiment> =
            judged.into_iter().take(IMPROVED.0).filter_map(|(script, _)| experiment(&rivals, script)).collect();
        found.sort_by(|a, b| b.told().total_cmp(&a.told()));
        options.tell("done", 1.0);
        Ok(found)
    })
}

/// The least and the greatest duty at which every model's shaft goes on turning, both ways, and no supervisor intervenes.
fn duties(rivals: &[Rival]) -> Option<[f64; 2]> {
    let turns = |duty: &f64| {
        [*duty, -*duty].par_iter().all(|duty| {
            let script = [Piece { seconds: 1.0, duty: Some(*duty) }];
            rivals.iter().all(|rival| rival.read(&script).is_ok_and(|track| !rival.trips(&track)))
        })
    };
    let turning = (1..=STEPS_OF_DUTY).map(|step| step as f64 / STEPS_OF_DUTY as f64).filter(turns);
    turning.fold(None, |found, duty| Some([found.map_or(duty, |[least, _]| least), duty]))
}

/// Drives that no model's supervisor ends, with what they tell, the best one first.
fn best_first(rivals: &[Rival], scripts: Vec<Script>) -> Vec<(Script, f64)> {
    let mut judged: Vec<(Script, f64)> = scripts
        .into_par_iter()
        .filter_map(|script| {
            let told = told(&separations(rivals, &script, ROUNDS.0)?);
            Some((script, told))
        })
        .collect();
    judged.sort_by(|a, b| b.1.total_cmp(&a.1));
    judged
}

fn experiment(rivals: &[Rival], script: Script) -> Option<Experiment> {
    let expected = separations(rivals, &script, ROUNDS.1)?;
    Some(Experiment { pieces: script, expected })
}

/// How far each model stays from the readings of each other one; `None` where a supervisor ends it.
fn separations(rivals: &[Rival], script: &Script, rounds: usize) -> Option<Vec<Separation>> {
    let mut found = Vec::new();
    for (truth, rival) in rivals.iter().enumerate() {
        let read = rival.read(script).ok().filter(|track| !rival.trips(track))?;
        for (model, other) in rivals.iter().enumerate().filter(|(model, _)| *model != truth) {
            found.push(Separation { truth, model, ratio: other.ratio_on(&read, rounds) });
        }
    }
    Some(found)
}
