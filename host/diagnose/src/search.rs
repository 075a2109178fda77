//! Tries the library: every effect on its own, then the most promising pairs, each fitted jointly with the file's own
//! numbers and judged on the held-out runs.

use effects::{Acts, Id};
use rayon::prelude::*;
use robot_file::robot::Robot;

use super::DiagnoseError;
use super::fit::Fit;
use super::screen::Proposal;
use super::selection::reaches;
use super::session::{Evaluation, Session};

/// A model that was tried.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Effects added to the file's model.
    pub effects: Vec<Id>,
    /// Its fit.
    pub fit: Fit,
    /// How it does on the held-out runs.
    pub evaluation: Evaluation,
    /// Each of its effects has a size whose interval does not touch zero.
    pub sized: bool,
}

impl Candidate {
    /// Held-out mean square error, rad².
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        self.evaluation.mean_square()
    }

    /// A fit, judged.
    fn of(session: &Session, fit: Fit) -> Self {
        let sized = fit.effects.iter().all(|effect| fit.has_size(&session.model, *effect));
        Self { effects: fit.effects.clone(), evaluation: session.evaluate(&fit), fit, sized }
    }

    /// Takes over another fit of the same effects where it does better; one whose numbers the file rules out must do much better
    /// than one whose numbers it allows.
    fn improve(&mut self, other: Self) {
        let allowed = match (self.fit.strayed(), other.fit.strayed()) {
            (true, false) => MUCH,
            (false, true) => 1.0 / MUCH,
            _ => 1.0,
        };
        if other.mean_square() < allowed * self.mean_square() {
            *self = other;
        }
    }
}

/// How far the cost must still fall in a round for the fit to go on.
const TOLERANCE: f64 = 2e-5;
/// Rounds of a fit at most.
const ROUNDS: usize = 15;
/// Rounds of a first look.
const LOOK: usize = 7;
/// A model is fitted in full if its excess over the noise after the first look is within this factor of the best's.
const PROMISING: f64 = 2.0;
/// Effects are fitted from each other's outcome where the better one comes this near to the floor (mean square).
const NEAR: f64 = 1.6;
/// Most single effects that are fitted in full.
const MOST_SINGLE: usize = 5;
/// Most pairs that are fitted in full, and most single effects from the file's own numbers.
const MOST_FURTHER: usize = 3;
/// Pairs are formed among this many of the best single effects.
const PAIRED: usize = 3;
/// So many effects that promise this share of the best one's are tried before the others, with what those of the first few are
/// easily mistaken for.
const FIRST: (usize, f64, usize) = (6, 0.1, 2);

/// Of each of the best single effects, pairs are formed with so many that a screen about it proposes.
const PROPOSED: usize = 4;

/// Much better, or worse, is this factor of the mean square error.
const MUCH: f64 = 1.25;

/// A model to be tried.
struct Wanted<'a> {
    effects: Vec<Id>,
    /// The fit whose numbers it takes over.
    from: &'a Fit,
    /// Starting points of what that fit does not have.
    starts: Vec<usize>,
}

/// Every effect that a diagnosis tries and some that are asked for, as far as the file lacks them and these runs can show them.
///
/// # Errors
/// Where that leaves nothing of an effect that is asked for.
pub fn candidates(session: &Session, robot: &Robot, asked: &[Id]) -> Result<Vec<Id>, DiagnoseError> {
    let tracks = || session.fit.iter().chain(&session.held_out);
    let in_file = |id: Id| robot.effects.listed().any(|listed| listed == id || listed.contains(id));
    let shows = |id: &Id| match id.spec().acts {
        Acts::Command | Acts::Bridge => tracks().any(|track| !track.terminals_measured),
        Acts::Supply => tracks().any(|track| !track.terminals_measured && track.supply_v.is_empty()),
        Acts::Shaft | Acts::Sensor => true,
        Acts::Foot | Acts::Ground => false,
    };
    for id in asked {
        let why = if in_file(*id) {
            "the robot file has it already, or one that contains it"
        } else if id.spec().acts.on_the_ground() {
            "no recording of a shaft shows it"
        } else if !shows(id) {
            "it lies before what these runs measured of the drive"
        } else {
            continue;
        };
        return Err(DiagnoseError::CannotTry { effect: id.name().to_owned(), why: why.to_owned() });
    }
    let tried = |id: &Id| id.spec().candidate || asked.contains(id);
    Ok(Id::all().filter(tried).filter(|&id| !in_file(id)).filter(shows).collect())
}

/// Fits and judges single effects: the promising ones, and the others only where `enough` is not said of the outcome; the best
/// few of those that were tried before from where they ended too. `done` is told after each.
#[must_use]
pub fn singles(
    session: &Session,
    baseline: &Candidate,
    proposals: &[Proposal],
    before: &[Candidate],
    enough: &(dyn Fn(&[Candidate]) -> bool + Sync),
    done: &(dyn Fn() + Sync),
) -> Vec<Candidate> {
    let (first, others) = promising(proposals);
    let mut candidates = alone(session, baseline, &first, done);
    from_before(session, &mut candidates, before);
    if !enough(&candidates) {
        candidates.extend(alone(session, baseline, &others, done));
        from_before(session, &mut candidates, before);
        level(session, &mut candidates);
    }
    let best = candidates.iter().min_by(|a, b| a.mean_square().total_cmp(&b.mean_square()));
    if baseline.fit.strayed() || best.is_some_and(|best| best.fit.strayed()) {
        if !enough(&candidates) {
            from_file(session, &mut candidates);
            level(session, &mut candidates);
        }
        level_mistaken(session, &mut candidates);
    }
    candidates
}

/// The proposals that are tried first, and the others.
fn promising(proposals: &[Proposal]) -> (Vec<&Proposal>, Vec<&Proposal>) {
    let (most, share, leading) = FIRST;
    let best = proposals.first().map_or(0.0, |one| one.promised);
    let related = |effect: Id| {
        let mut leaders = proposals.iter().take(leading).map(|one| one.effect);
        leaders.any(|leader| leader.mistaken(effect) || leader.contains(effect) || effect.contains(leader))
    };
    let (first, others): (Vec<_>, Vec<_>) = proposals
        .iter()
        .enumerate()
        .partition(|(place, one)| (*place < most && one.promised >= share * best) || related(one.effect));
    (first.into_iter().map(|(_, one)| one).collect(), others.into_iter().map(|(_, one)| one).collect())
}

fn alone(session: &Session, baseline: &Candidate, proposals: &[&Proposal], done: &(dyn Fn() + Sync)) -> Vec<Candidate> {
    let wanted: Vec<Wanted> = proposals
        .iter()
        .map(|one| Wanted { effects: vec![one.effect], from: &baseline.fit, starts: one.starts.clone() })
        .collect();
    if wanted.is_empty() { Vec::new() } else { try_all(session, &wanted, MOST_SINGLE, done) }
}

/// Fits the best few of those that were tried before from where they ended: on runs that have since been read anew.
fn from_before(session: &Session, candidates: &mut [Candidate], before: &[Candidate]) {
    let mut best: Vec<&Candidate> = before.iter().collect();
    best.sort_by(|a, b| a.mean_square().total_cmp(&b.mean_square()));
    best.truncate(MOST_FURTHER);
    let place = |once: &Candidate| candidates.iter().position(|one| one.effects == once.effects);
    let begun = best.into_iter().filter_map(|once| Some((place(once)?, session.begun_anew(&once.fit)))).collect();
    finish_all(session, candidates, begun);
}

/// Looks at every effect from the file's own numbers, and fits the best few in full from there: without the effect those
/// numbers may have been refitted to where no step leads back from.
fn from_file(session: &Session, candidates: &mut [Candidate]) {
    let look = |(place, candidate): (usize, &Candidate)| (place, session.look_from_file(&candidate.effects, LOOK));
    let mut looks: Vec<(usize, Fit)> = candidates.par_iter().enumerate().map(look).collect();
    looks.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    looks.truncate(MOST_FURTHER);
    finish_all(session, candidates, looks);
}

/// Fits in full what has begun, each for the candidate at a place.
fn finish_all(session: &Session, candidates: &mut [Candidate], begun: Vec<(usize, Fit)>) {
    let finish = |(place, begun)| (place, Candidate::of(session, session.finish(begun, ROUNDS, TOLERANCE)));
    let finished: Vec<(usize, Candidate)> = begun.into_par_iter().map(finish).collect();
    for (place, candidate) in finished {
        candidates[place].improve(candidate);
    }
}

/// Looks at every model briefly from each of its starting points, fits the promising ones (`most` of them) in full,
/// judges all.
fn try_all(session: &Session, wanted: &[Wanted], most: usize, done: &(dyn Fn() + Sync)) -> Vec<Candidate> {
    let look = |one: &Wanted| session.look(&one.effects, one.from, &one.starts, LOOK);
    let looks: Vec<Fit> = wanted.par_iter().map(look).collect();
    let readings = session.coarse_readings();
    let excess: Vec<f64> = looks.iter().map(|look| (look.cost / readings - 1.0).max(0.0)).collect();
    let mut sorted = excess.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |place: usize| sorted.get(place.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0.0);
    let bar = (PROMISING * at(0) + 0.05).clamp(at(1), at(most - 1).max(at(1)));
    // Where an effect is promising, what it contains must not lose for want of a full fit.
    let contained: Vec<Vec<Id>> = wanted
        .iter()
        .zip(&excess)
        .filter(|(_, excess)| **excess <= bar)
        .filter_map(|(one, _)| simpler(&one.effects))
        .collect();
    let mut candidates: Vec<Candidate> = looks
        .into_par_iter()
        .zip(wanted)
        .zip(excess)
        .map(|((look, one), excess)| {
            let promising = excess <= bar || contained.contains(&one.effects);
            let fit = if promising { session.finish(look, ROUNDS, TOLERANCE) } else { look };
            let candidate = Candidate::of(session, fit);
            done();
            candidate
        })
        .collect();
    level(session, &mut candidates);
    candidates
}

/// Of two effects of which one contains the other, as Stribeck friction does Coulomb friction, each is fitted once more from
/// where the other ended, where that promises more, so that neither wins by the luck of its starting point.
fn level(session: &Session, candidates: &mut [Candidate]) {
    for rich in 0..candidates.len() {
        let Some(simple) = simpler(&candidates[rich].effects) else { continue };
        let Some(simple) = candidates.iter().position(|one| one.effects == simple) else { continue };
        fit_from(session, candidates, rich, simple);
        fit_from(session, candidates, simple, rich);
    }
}

/// The same for the best single effect and those that it is easily mistaken for: where the refit of the file's numbers went
/// astray, one of them may have found back and the other not.
fn level_mistaken(session: &Session, candidates: &mut [Candidate]) {
    let by_error = |a: &usize, b: &usize| candidates[*a].mean_square().total_cmp(&candidates[*b].mean_square());
    let Some(best) = (0..candidates.len()).min_by(by_error) else { return };
    for other in 0..candidates.len() {
        if candidates[best].effects[0].mistaken(candidates[other].effects[0]) {
            fit_from(session, candidates, best, other);
        }
    }
}

/// Fits one candidate once more from where another ended, and keeps the better outcome. Within a per mille they agree
/// already; far from the floor, it is no matter of starting points.
fn fit_from(session: &Session, candidates: &mut [Candidate], from: usize, to: usize) {
    let ratio = candidates[to].mean_square() / candidates[from].mean_square();
    if ratio > 1.002 && candidates[from].mean_square() < NEAR * session.noise {
        let fit = session.again(&candidates[to].effects, &candidates[from].fit, ROUNDS, TOLERANCE);
        candidates[to].improve(Candidate::of(session, fit));
    }
}

/// The same effects with one of them in its contained form (Coulomb friction for Stribeck friction); `None` where none
/// contains another.
fn simpler(effects: &[Id]) -> Option<Vec<Id>> {
    let (place, inner) = effects
        .iter()
        .enumerate()
        .find_map(|(place, outer)| Some((place, Id::all().find(|inner| outer.contains(*inner))?)))?;
    let mut simpler = effects.to_vec();
    simpler[place] = inner;
    simpler.sort();
    Some(simpler)
}

/// Fits and judges pairs: of single effects each with what a screen about it proposes, and the best few among themselves.
#[must_use]
pub fn pairs(session: &Session, singles: &[Candidate], proposed: &[(&Candidate, Vec<Proposal>)]) -> Vec<Candidate> {
    let mut wanted: Vec<Wanted> = Vec::new();
    let mut want = |first: &Candidate, second: Id, starts: &[usize], from| {
        let mut effects = vec![first.effects[0], second];
        effects.sort();
        if !first.effects[0].overlaps(second) && !wanted.iter().any(|one| one.effects == effects) {
            wanted.push(Wanted { effects, from, starts: starts.to_vec() });
        }
    };
    for (first, proposals) in proposed {
        for second in proposals.iter().take(PROPOSED) {
            want(first, second.effect, &second.starts, &first.fit);
        }
    }
    let mut order: Vec<&Candidate> = singles.iter().collect();
    order.sort_by(|a, b| a.mean_square().total_cmp(&b.mean_square()));
    for (i, first) in order.iter().take(PAIRED).enumerate() {
        for second in &order[i + 1..PAIRED.min(order.len())] {
            want(first, second.effects[0], &session.all_starts(&second.effects), &first.fit);
        }
    }
    let contained: Vec<Wanted> = wanted
        .iter()
        .filter_map(|one| simpler(&one.effects))
        .filter(|pair| pair[0] != pair[1] && !wanted.iter().any(|one| one.effects == *pair))
        .filter_map(|effects| {
            let alone = order.iter().find(|candidates| effects.contains(&candidates.effects[0]))?;
            let starts = session.all_starts(&effects);
            Some(Wanted { effects, from: &alone.fit, starts })
        })
        .collect();
    wanted.extend(contained);
    if wanted.is_empty() { Vec::new() } else { try_all(session, &wanted, MOST_FURTHER, &|| ()) }
}

/// Fits and judges the first few of several effects beside the one of a single-effect model.
#[must_use]
pub fn beside(session: &Session, single: &Candidate, proposals: &[Proposal]) -> Vec<Candidate> {
    let with = |second: &Proposal| {
        let mut effects = vec![single.effects[0], second.effect];
        effects.sort();
        Wanted { effects, from: &single.fit, starts: second.starts.clone() }
    };
    let wanted: Vec<Wanted> = proposals
        .iter()
        .filter(|second| !single.effects[0].overlaps(second.effect))
        .take(MOST_FURTHER)
        .map(with)
        .collect();
    if wanted.is_empty() { Vec::new() } else { try_all(session, &wanted, MOST_FURTHER, &|| ()) }
}

/// Where a pair reaches the floor, fits each effect of the best pair on its own from where the pair ended, and what it contains
/// from there: alone, it may have gone astray on its way there.
pub fn apart(session: &Session, baseline: &Candidate, candidates: &mut [Candidate]) {
    let pairs = candidates.iter().filter(|one| one.effects.len() == 2 && reaches(session.noise, baseline, one));
    let Some(pair) = pairs.min_by(|a, b| a.mean_square().total_cmp(&b.mean_square())) else { return };
    let (effects, fit) = (pair.effects.clone(), pair.fit.clone());
    for effect in effects {
        if let Some(single) = candidates.iter_mut().find(|one| one.effects == [effect]) {
            let fit = session.again(&[effect], &fit, ROUNDS, TOLERANCE);
            single.improve(Candidate::of(session, fit));
        }
    }
    level(session, candidates);
}
