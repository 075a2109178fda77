//! A walking body and the shaft that moves it, found in turns: neither needs the other to be good.

use effects::{DirectionalFriction, DriverDrop, Effect, Id, SensorNonlinearity};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use robot_file::robot::Robot;

use super::super::fit::{self, Fit};
use super::super::model::Plant;
use super::super::search;
use super::super::session::{BEATEN, Session};
use super::super::track::Track;
use super::super::{DiagnoseError, Options};
use super::particles::PARTICLES;
use super::update_pull;

/// Turns of the file's model at most: after five some sets of walks left more than noise, after eight none that had it in them.
const TURNS: u64 = 8;
/// Turns in a row that leave no more than noise, with which they end.
const IN_A_ROW: usize = 3;
/// A doubt in one of so many last turns leaves a rollout out: a handful of bodies may all go one of two ways.
const DOUBTS: usize = 3;
/// Turns of a model with effects: one that is right is found in one or two, and one that is wrong leaves something else each time.
const FEWER_TURNS: u64 = 4;
/// After so many turns a model that leaves more than [`LOST`] times the noise (mean square) is not the right one: a right one left 1.6 times
/// at most after the first.
const FIRST_TURNS: u64 = 3;
const LOST: f64 = 4.0;
/// What leaves less than this many times the noise is found: fits differ by that from turn to turn.
const FOUND: f64 = 1.01;
/// Share of a walk that is much of it.
const MUCH: f64 = 0.5;
/// A turn is judged on much less of a walk than another one, if on less than this share of what that is judged on.
const MUCH_LESS: f64 = 0.5;
/// Share of a diagnosis that this is taken for, as people are told.
const SHARE: f64 = 0.15;
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
pub fn find_body(session: &mut Session, robot: &Robot, options: &Options) -> Result<Fit, DiagnoseError> {
    let file = Fit::begin(&session.model, &[], 0, Vec::new());
    let (mut fit, mut noise, mut found) = (file.clone(), session.noise, 0);
    let mut doubts: Vec<Vec<Vec<bool>>> = Vec::new();
    for round in 0..TURNS {
        options.tell("finding how the body pulls", SHARE * round as f64 / TURNS as f64);
        pull(session, robot, &fit, round)?;
        fit = settle(session, &file, &fit, options)?;
        doubts.push(tracks(session).map(|track| track.pull_unknown.clone()).collect());
        noise = noise.min(session.noise);
        let left = session.evaluate(&fit).capped_square(FARTHEST * noise) / noise;
        if round + 1 == FIRST_TURNS && left > LOST {
            let candidates = search::candidates(session, robot, &[])?;
            let generous: Vec<Id> = candidates.into_iter().filter(|id| GENEROUS.contains(&id.name())).collect();
            let generous = Fit::begin(&session.model, &generous, 0, Vec::new());
            let _ = find_again(session, robot, &generous, FARTHEST * noise, options)?;
            return Ok(session.settle(&file));
        }
        found = if left < FOUND { found + 1 } else { 0 };
        if found == IN_A_ROW {
            break;
        }
    }
    for turn in doubts.iter().rev().take(DOUBTS) {
        for (track, doubted) in tracks(session).zip(turn) {
            track.pull_unknown.iter_mut().zip(doubted).for_each(|(unknown, doubted)| *unknown |= doubted);
        }
    }
    session.take_pull(options)?;
    settle_where_known(session, &file, &fit, options)
}

/// Finds a body's pull anew by a model with effects that explains more. Whether that explains more again; if not, the session stays as it
/// was.
pub fn follow_anew(session: &mut Session, robot: &Robot, fit: &Fit, options: &Options) -> bool {
    let kept = session.clone();
    session.noise = session.measure(fit, false).min(session.noise);
    session.lower_fit_noise(fit);
    let farthest = FARTHEST * session.noise;
    let before = Turn::of(session, fit, farthest);
    let found = find_again(session, robot, fit, farthest, options);
    let is_better = found.is_ok_and(|turn| turn.is_some_and(|turn| turn.is_better(&before)));
    if !is_better {
        *session = kept;
    }
    is_better
}

/// How good one turn is.
#[derive(Clone, Copy)]
struct Turn {
    /// Mean square of what is left of the held-out runs, rad².
    left: f64,
    /// Share of the samples at which the readings say how the body pulls.
    known: f64,
}

impl Turn {
    /// A turn that has ended with a fit, of which no rollout is to leave more than a mean square `farthest` (rad²).
    fn of(session: &Session, fit: &Fit, farthest: f64) -> Self {
        let samples = || session.fit.iter().chain(&session.held_out).flat_map(|track| &track.pull_unknown);
        let known = samples().filter(|unknown| !**unknown).count() as f64 / samples().count().max(1) as f64;
        Self { left: session.evaluate(fit).capped_square(farthest), known }
    }

    /// Whether it leaves less than another one, if neither knows much less of the walk; else whether it is the one that knows more.
    fn is_better(&self, other: &Self) -> bool {
        let much_less = |one: &Self, other: &Self| one.known < MUCH_LESS * other.known;
        !much_less(self, other) && (self.left < other.left || much_less(other, self))
    }

    /// Whether no more than noise (mean square, rad²) is left of much of the walk.
    fn is_found(&self, noise: f64) -> bool {
        self.left < FOUND * noise && self.known > MUCH
    }
}

/// Finds a body's pull with a model of whose effects little is known yet, from where they are; the turn that is best is kept. Of `farthest`
/// see [`Turn::of`].
fn find_again(
    session: &mut Session,
    robot: &Robot,
    from: &Fit,
    farthest: f64,
    options: &Options,
) -> Result<Option<Turn>, DiagnoseError> {
    let (file, mut fit, mut noise) = (from.at_file_numbers(), from.clone(), session.noise);
    let mut best: Option<(Turn, Session)> = None;
    for round in 0..FEWER_TURNS {
        pull(session, robot, &fit, round)?;
        fit = settle(session, &file, &fit, options)?;
        noise = noise.min(session.noise);
        let turn = Turn::of(session, &fit, farthest);
        if best.as_ref().is_none_or(|(best, _)| turn.is_better(best)) {
            best = Some((turn, session.clone()));
        }
        if turn.is_found(noise) {
            break;
        }
    }
    let found = best.map(|(turn, kept)| {
        *session = kept;
        turn
    });
    session.take_pull(options)?;
    Ok(found)
}

fn tracks(session: &mut Session) -> impl Iterator<Item = &mut Track> {
    session.fit.iter_mut().chain(&mut session.held_out)
}

/// Works out how the body pulls at the shaft where a fit has that, and where the readings do not say.
fn pull(session: &mut Session, robot: &Robot, fit: &Fit, round: u64) -> Result<(), DiagnoseError> {
    // Other numbers than those that readings are drawn with, whose seeds count from 0.
    let mut random = Pcg64Mcg::seed_from_u64(!round);
    // By how much a model is wrong, no draw of its numbers tells.
    let cost = fit.cost / fit::residuals(&session.data());
    let share = if cost.is_finite() { cost.max(1.0).sqrt().recip() } else { 1.0 };
    let others = fit.drawn_plants(&session.model, share, &mut random).take(PARTICLES - 1);
    let plants: Vec<Plant> = std::iter::once(fit.plant(&session.model)).chain(others).collect();
    let runs = session.fit.iter_mut().map(|track| (track, session.fit_noise));
    let runs = runs.chain(session.held_out.iter_mut().map(|track| (track, session.noise)));
    update_pull(robot, &plants, runs, session.horizon_s, round)
}

/// Fits anew where a body's pull has been found; everywhere, if that is hardly anywhere: a later turn, with a better model, may know more.
fn settle(session: &mut Session, file: &Fit, fit: &Fit, options: &Options) -> Result<Fit, DiagnoseError> {
    let unknown: Vec<Vec<bool>> = tracks(session).map(|track| track.pull_unknown.clone()).collect();
    if session.take_pull(options).is_err() {
        tracks(session).for_each(|track| track.pull_unknown.clear());
        session.take_pull(options)?;
    }
    let fit = settle_where_known(session, file, fit, options)?;
    // That it is fitted to there does not make it known.
    tracks(session).zip(unknown).for_each(|(track, unknown)| track.pull_unknown = unknown);
    Ok(fit)
}

/// Fits anew. What the sensor showed in its blind arc is known the better, the better the pull is known.
///
/// Each fit begins where the file's numbers do: one that goes on from a fit without a body, or with a wrong one, has numbers under which the
/// next body suits the readings as well and is wrong again. Only where these leave much does it begin elsewhere, at what has been found or
/// at the effects' own starting points, if that leaves much less.
fn settle_where_known(session: &mut Session, file: &Fit, fit: &Fit, options: &Options) -> Result<Fit, DiagnoseError> {
    let _ = session.drop_blind(fit, options)?;
    let mut best = session.settle(file);
    if best.cost < BEATEN * fit::residuals(&session.data()) {
        return Ok(best);
    }
    let starts = 0..session.model.starts(&file.effects);
    let anew: Vec<Fit> = starts.map(|start| Fit::begin(&session.model, &file.effects, start, Vec::new())).collect();
    let mut tried = vec![file.coordinates.clone()];
    let mut kept = session.clone();
    for other in std::iter::once(fit).chain(&anew) {
        if tried.contains(&other.coordinates) {
            continue;
        }
        tried.push(other.coordinates.clone());
        let settled = session.settle(other);
        if BEATEN * settled.cost * session.fit_noise < best.cost * kept.fit_noise {
            (best, kept) = (settled, session.clone());
        }
    }
    *session = kept;
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::Turn;

    #[test]
    fn a_turn_is_better_by_what_it_leaves_of_much_of_the_walk() {
        let turn = |left, known| Turn { left, known };
        let usual = turn(2.0, 0.8);
        assert!(turn(1.0, 0.7).is_better(&usual) && !turn(3.0, 0.9).is_better(&usual));
        // Of a little that is easy, little is left.
        assert!(!turn(1.0, 0.1).is_better(&usual) && usual.is_better(&turn(1.0, 0.1)));
        assert!(turn(1.0, 0.8).is_found(1.0) && !turn(1.0, 0.1).is_found(1.0) && !turn(1.1, 0.8).is_found(1.0));
    }
}
