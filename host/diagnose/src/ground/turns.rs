//! A walking body and the shaft that moves it, found in turns: neither needs the other to be good.

use effects::{DirectionalFriction, DriverDrop, Effect, Id, SensorNonlinearity};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use robot_file::robot::Robot;

use super::super::fit::Fit;
use super::super::model::Plant;
use super::super::search;
use super::super::session::{BEATEN, Session};
use super::super::track::Track;
use super::super::{DiagnoseError, Options};
use super::particles::PARTICLES;
use super::update_pull;

/// Turns of the file's model: four to seven were enough for one set of walks.
const TURNS: u64 = 8;
/// Last ones of which a doubt in one leaves a rollout out: a handful of bodies may all go one of two ways.
const DOUBTS: u64 = 3;
/// Turns of a model of which less is known.
const FEWER_TURNS: u64 = 4;
/// After so many turns a model that leaves more than [`LOST`] times the noise (mean square) is not the right one.
const FIRST_TURNS: u64 = 3;
const LOST: f64 = 4.0;
/// What leaves less than this many times the noise, of this share of the walk, is found.
const FOUND: f64 = 1.01;
const MUCH: f64 = 0.5;
/// No rollout counts for more than this many times the noise: one with a reading from the blind arc is thousands off.
const FARTHEST: f64 = 10.0;
/// Effects with which a body is looked for where the file's model does not do: friction of any even kind, the driver's drop and the
/// sensor's curve are much of what moves a shaft.
const GENEROUS: [&str; 3] = [DirectionalFriction::SPEC.name, DriverDrop::SPEC.name, SensorNonlinearity::SPEC.name];

/// Finds how a walking body pulls at the shaft and what the file's numbers are; where these are not enough, the pull of a body that a more
/// generous model follows.
///
/// # Errors
/// The file has no body, or too little of the runs is left where the pull is known.
pub fn find_body(session: &mut Session, robot: &Robot, file: &Fit, options: &Options) -> Result<Fit, DiagnoseError> {
    let mut fit = file.clone();
    for round in 0..TURNS {
        let doubted: Vec<Vec<bool>> = tracks(session).map(|track| track.pull_unknown.clone()).collect();
        pull(session, robot, &fit, round)?;
        if round + DOUBTS > TURNS {
            for (track, doubted) in tracks(session).zip(&doubted) {
                track.pull_unknown.iter_mut().zip(doubted).for_each(|(unknown, doubted)| *unknown |= doubted);
            }
        }
        fit = settle(session, file, &fit, round + 1 == TURNS, options)?;
        if round + 1 == FIRST_TURNS && misfit(session, &fit, session.noise) > LOST {
            let candidates = search::candidates(session, robot, &[])?;
            let generous: Vec<Id> = candidates.into_iter().filter(|id| GENEROUS.contains(&id.name())).collect();
            let _ = find_again(session, robot, &Fit::begin(&session.model, &generous, 0, Vec::new()), options)?;
            return Ok(session.settle(file));
        }
    }
    Ok(fit)
}

/// Finds a body's pull anew by a model with effects that explains more. Whether that explains more again; if not, the session stays as it
/// was.
pub fn follow_anew(session: &mut Session, robot: &Robot, fit: &Fit, options: &Options) -> bool {
    let kept = session.clone();
    session.noise = session.measure(fit, false).min(session.noise);
    session.lower_fit_noise(fit);
    let noise = session.noise;
    let before = misfit(session, fit, noise);
    let found = find_again(session, robot, fit, options);
    let is_better = found.is_ok_and(|found| misfit(session, &found, noise) < before);
    if !is_better {
        *session = kept;
    }
    is_better
}

/// How good one turn is.
struct Turn {
    /// See [`misfit`].
    misfit: f64,
    /// Share of the samples at which the readings say how the body pulls.
    known: f64,
}

impl Turn {
    /// Whether it leaves less than another one, of not much less of the walk.
    fn is_better(&self, other: &Self) -> bool {
        let much = |one: &Self, other: &Self| one.known >= MUCH * other.known;
        much(self, other) && (self.misfit < other.misfit || !much(other, self))
    }

    /// Whether little is left of much of the walk.
    fn is_found(&self) -> bool {
        self.misfit < FOUND && self.known > MUCH
    }
}

/// Finds a body's pull with a model of whose effects little is known yet, from where they are; the turn that leaves least is kept.
fn find_again(session: &mut Session, robot: &Robot, from: &Fit, options: &Options) -> Result<Fit, DiagnoseError> {
    let (file, mut fit) = (from.at_file_numbers(), from.clone());
    let mut best: Option<(Turn, Session, Fit)> = None;
    for round in 0..FEWER_TURNS {
        pull(session, robot, &fit, round)?;
        fit = settle(session, &file, &fit, false, options)?;
        let turn = Turn { misfit: misfit(session, &fit, session.noise), known: known(session) };
        let is_found = turn.is_found();
        if best.as_ref().is_none_or(|(best, ..)| turn.is_better(best)) {
            best = Some((turn, session.clone(), fit.clone()));
        }
        if is_found {
            break;
        }
    }
    if let Some((_, kept, found)) = best {
        (*session, fit) = (kept, found);
    }
    Ok(fit)
}

fn tracks(session: &mut Session) -> impl Iterator<Item = &mut Track> {
    session.fit.iter_mut().chain(&mut session.held_out)
}

/// Works out how the body pulls at the shaft where a fit has that, and where the readings do not say.
fn pull(session: &mut Session, robot: &Robot, fit: &Fit, round: u64) -> Result<(), DiagnoseError> {
    let mut random = Pcg64Mcg::seed_from_u64(round);
    // By how much a model is wrong, no draw of its numbers tells.
    let misfit = fit.cost / readings(session);
    let share = if misfit.is_finite() { misfit.max(1.0).sqrt().recip() } else { 1.0 };
    let others = fit.drawn_plants(&session.model, share, &mut random).take(PARTICLES - 1);
    let plants: Vec<Plant> = std::iter::once(fit.plant(&session.model)).chain(others).collect();
    let runs = session.fit.iter_mut().map(|track| (track, session.fit_noise));
    let runs = runs.chain(session.held_out.iter_mut().map(|track| (track, session.noise)));
    update_pull(robot, &plants, runs, session.horizon_s, round)
}

/// Fits anew where a body's pull has been found.
fn settle(
    session: &mut Session,
    file: &Fit,
    fit: &Fit,
    is_last: bool,
    options: &Options,
) -> Result<Fit, DiagnoseError> {
    let mut taken = session.take_pull(options);
    if !is_last && taken.is_err() {
        // A later round, with a better model, may know more.
        tracks(session).for_each(|track| track.pull_unknown.clear());
        taken = session.take_pull(options);
    }
    taken?;
    // What the sensor showed in its blind arc is known the better, the better the pull is known.
    let _ = session.drop_blind(fit, options)?;
    Ok(settle_near(session, file, fit))
}

/// Each fit begins where the file's numbers do: one that goes on from a fit without a body, or with a wrong one, has numbers under which the
/// next body suits the readings as well and is wrong again. Only where these leave much does it begin elsewhere, at what has been found or
/// at the effects' own starting points, if that leaves much less.
fn settle_near(session: &mut Session, file: &Fit, fit: &Fit) -> Fit {
    let near = session.settle(file);
    if near.cost < BEATEN * readings(session) {
        return near;
    }
    let starts = 0..session.model.starts(&file.effects);
    let anew = starts.map(|start| Fit::begin(&session.model, &file.effects, start, Vec::new()));
    let others: Vec<Fit> = std::iter::once(fit.clone()).chain(anew).collect();
    let (mut from, mut least) = (file, near.cost * session.fit_noise);
    for other in &others {
        let cost = session.settle(other).cost * session.fit_noise;
        if BEATEN * cost < least {
            (from, least) = (other, cost);
        }
    }
    session.settle(from)
}

/// How much of the held-out runs a fit does not follow, in units of a noise's mean square (rad²).
fn misfit(session: &Session, fit: &Fit, noise: f64) -> f64 {
    session.evaluate(fit).capped_square(FARTHEST * noise) / noise
}

/// Share of the samples at which the readings say how the body pulls.
fn known(session: &Session) -> f64 {
    let samples = || session.fit.iter().chain(&session.held_out).flat_map(|track| &track.pull_unknown);
    samples().filter(|unknown| !**unknown).count() as f64 / samples().count().max(1) as f64
}

/// Readings that are fitted to.
fn readings(session: &Session) -> f64 {
    session.fit.iter().map(Track::readings).sum()
}
