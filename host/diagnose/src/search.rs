//! Tries the library: every effect on its own, then the most promising pairs, each fitted jointly with the file's own
//! numbers and judged on the held-out runs.

use effects::{Acts, Id};
use rayon::prelude::*;
use robot_file::robot::Robot;

use super::DiagnoseError;
use super::fit::Fit;
use super::pairs::add_pairs;
use super::screen::{Proposal, propose};
use super::selection::reaches;
use super::session::{Evaluation, Session};

/// See [`Candidate::is_richer_than`].
const RICHER: usize = 2;

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
    /// The same where the numbers of its shape are known.
    pub sized_in_its_shape: bool,
    /// What it leaves speaks against it.
    pub refuted: bool,
    /// Fitted to all rollouts, not only to those of a first look.
    pub in_full: bool,
}

impl Candidate {
    /// Held-out mean square error, rad².
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        self.evaluation.mean_square()
    }

    /// Whether its fit moved so many more numbers than another one's that it must do better to stay beside it.
    pub(super) fn is_richer_than(&self, other: &Self) -> bool {
        self.fit.numbers_moved() >= other.fit.numbers_moved() + RICHER
    }

    /// Median of the held-out rollouts' mean square errors, rad².
    #[must_use]
    pub fn usual_square(&self) -> f64 {
        let mut squares: Vec<f64> = self.evaluation.errors.iter().map(|(sum, freedom)| sum / freedom).collect();
        common::median(&mut squares).unwrap_or(0.0)
    }

    /// A fit, judged.
    pub(super) fn of(session: &Session, fit: Fit, in_full: bool) -> Self {
        let sized = fit.effects.iter().all(|effect| fit.has_size(&session.model, *effect));
        let sized_in_its_shape = fit.effects.iter().all(|effect| fit.has_size_in_its_shape(&session.model, *effect));
        let evaluation = session.evaluate(&fit);
        let effects = fit.effects.clone();
        Self { effects, evaluation, fit, sized, sized_in_its_shape, refuted: false, in_full }
    }

    /// Takes over another fit of the same effects where it does better; one whose numbers the file rules out must do much better
    /// than one whose numbers it allows.
    pub(super) fn improve(&mut self, other: Self) {
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
pub(super) const TOLERANCE: f64 = 2e-5;
/// Rounds of a fit at most.
pub(super) const ROUNDS: usize = 15;
/// Rounds of a first look.
pub(super) const LOOK: usize = 7;
/// Models that are looked at side by side.
const WAVE: usize = 6;
/// A model is fitted in full if its excess over the noise after the first look is within this factor of the best's.
const PROMISING: f64 = 2.0;
/// Effects are fitted from each other's outcome where the better one comes this near to the floor (mean square).
const NEAR: f64 = 1.6;
/// Most single effects that are fitted in full.
const MOST_SINGLE: usize = 5;
/// Most pairs that are fitted in full, and most single effects from the file's own numbers.
pub(super) const MOST_FURTHER: usize = 3;
/// So many effects that promise this share of the best one's are tried before the others, with what those of the first few are
/// easily mistaken for.
const FIRST: (usize, f64, usize) = (6, 0.1, 2);

/// A model does about as well as the best up to this factor of its mean square error.
pub(super) const LEADS: f64 = 1.1;
/// What contains another effect leaves less than this share of its mean square error where it has something of its own.
const GAINS: f64 = 0.999;
/// Much better, or worse, is this factor of the mean square error.
const MUCH: f64 = 1.25;

/// A model to be tried.
pub(super) struct Wanted {
    /// What the model has beside the file's.
    pub effects: Vec<Id>,
    /// The fit whose numbers it takes over.
    pub from: Fit,
    /// Starting points of what that fit does not have.
    pub starts: Vec<usize>,
    /// The numbers of that fit stay until the others suit them.
    pub suited: bool,
}

impl Wanted {
    /// All numbers are moved at once.
    pub fn new(effects: Vec<Id>, from: Fit, starts: Vec<usize>) -> Self {
        Self { effects, from, starts, suited: false }
    }
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
        Acts::Shaft | Acts::Sensor => !session.is_of_the_body(*id),
        Acts::Foot | Acts::Ground => false,
    };
    for id in asked {
        let why = if in_file(*id) {
            "the robot file has it already, or one that contains it"
        } else if id.spec().acts.on_the_ground() {
            "no recording of a shaft shows it"
        } else if session.is_of_the_body(*id) {
            "on the ground gravity pulls through the body, which the file has"
        } else if !shows(id) {
            "it lies before what these runs measured of the drive"
        } else {
            continue;
        };
        return Err(DiagnoseError::CannotTry { effect: id.name().to_owned(), why: why.to_owned() });
    }
    let tried = |id: &Id| !id.spec().acts.on_the_ground() && id.spec().candidate || asked.contains(id);
    Ok(Id::all().filter(tried).filter(|&id| !in_file(id)).filter(shows).collect())
}

/// What [`models`] asks of the course of a diagnosis.
pub struct Asks<'a> {
    /// Everything that is looked for.
    pub effects: &'a [Id],
    /// Whether what has been tried is enough.
    pub enough: &'a (dyn Fn(&[Candidate]) -> bool + Sync),
    /// What a screen about a model proposes.
    pub proposals: &'a (dyn Fn(&Candidate) -> Vec<Proposal> + Sync),
    /// To be told after each effect.
    pub done: &'a (dyn Fn() + Sync),
}

/// Tries models until they are enough: promising single effects, pairs of the best of them, the other effects, and the best from
/// the file's own numbers. The best few of those that were tried before are fitted from where they ended too.
#[must_use]
pub fn models(
    session: &Session,
    baseline: &Candidate,
    proposals: &[Proposal],
    before: &[Candidate],
    asks: &Asks,
) -> Vec<Candidate> {
    let (first, mut others) = promising(proposals, &leaders(before));
    let mut candidates = alone(session, baseline, &first, f64::INFINITY, asks.done);
    add_related(&mut candidates, &mut others, |related| alone(session, baseline, related, f64::INFINITY, asks.done));
    from_before(session, &mut candidates, before);
    if !(asks.enough)(&candidates) {
        add_pairs(session, baseline, &mut candidates, asks);
        let reached = best(&candidates).filter(|best| reaches(floor(session, &candidates), baseline, best));
        let least = reached.map_or(f64::INFINITY, |best| session.coarse_cost(&best.fit));
        // A pair's effects may have been tried alone since.
        others.retain(|one| candidates.iter().all(|tried| tried.effects != [one.effect]));
        candidates.extend(alone(session, baseline, &others, least, asks.done));
        from_before(session, &mut candidates, before);
        level(session, &mut candidates);
    }
    let strayed = baseline.fit.strayed() || best(&candidates).is_some_and(|best| best.fit.strayed());
    if strayed && !(asks.enough)(&candidates) {
        from_file(session, &mut candidates);
        level(session, &mut candidates);
    }
    level_mistaken(session, &mut candidates);
    if !(asks.enough)(&candidates) {
        add_pairs(session, baseline, &mut candidates, asks);
    }
    candidates
}

/// The mean square of the noise (rad²) where a model that is better than the settled one leaves fewer kinks in what it is measured
/// on: the floor is the least that any model shows, and no more than the best one leaves.
#[must_use]
pub fn floor(session: &Session, candidates: &[Candidate]) -> f64 {
    let floor_of = |best: &Candidate| session.scatter_about(&best.evaluation).min(best.mean_square());
    best(candidates).map_or(session.noise, |best| session.noise.min(floor_of(best)))
}

/// The model with the least held-out error.
#[must_use]
pub fn best(candidates: &[Candidate]) -> Option<&Candidate> {
    best_of(candidates.iter())
}

/// The same of some of them.
pub fn best_of<'a>(candidates: impl Iterator<Item = &'a Candidate>) -> Option<&'a Candidate> {
    candidates.min_by(|a, b| a.mean_square().total_cmp(&b.mean_square()))
}

/// Places of the single effects, the best one first.
pub(super) fn singles(candidates: &[Candidate]) -> Vec<usize> {
    let mut singles: Vec<usize> = (0..candidates.len()).filter(|&i| candidates[i].effects.len() == 1).collect();
    singles.sort_by(|&a, &b| candidates[a].mean_square().total_cmp(&candidates[b].mean_square()));
    singles
}

/// The proposals that are tried first, and the others. Those that led before runs were read anew are of the first, and what they are easily
/// mistaken for: about the numbers that those runs are refitted with, a screen may see nothing of them.
fn promising<'a>(proposals: &'a [Proposal], led: &[Id]) -> (Vec<&'a Proposal>, Vec<&'a Proposal>) {
    let (most, share, leading) = FIRST;
    let best = proposals.first().map_or(0.0, |one| one.promised);
    let related = |effect: Id| {
        let mut leaders = proposals.iter().take(leading).map(|one| one.effect);
        leaders.any(|leader| leader.mistaken(effect) || leader.contains(effect) || effect.contains(leader))
            || led.iter().any(|&leader| leader == effect || leader.mistaken(effect))
    };
    let (first, others): (Vec<_>, Vec<_>) = proposals
        .iter()
        .enumerate()
        .partition(|(place, one)| (*place < most && one.promised >= share * best) || related(one.effect));
    (first.into_iter().map(|(_, one)| one).collect(), others.into_iter().map(|(_, one)| one).collect())
}

/// The effects of the best model and of those that do about as well.
fn leaders(candidates: &[Candidate]) -> Vec<Id> {
    let least = best(candidates).map_or(0.0, Candidate::mean_square);
    let leads = |one: &&Candidate| one.mean_square() <= LEADS * least;
    candidates.iter().filter(leads).flat_map(|one| &one.effects).copied().collect()
}

/// Tries those of the other proposals that the best single effect, or one that does about as well, is easily mistaken for: a screen
/// does not always have it in front. As one of these may be the best in turn, until there is none left.
fn add_related<'a>(
    candidates: &mut Vec<Candidate>,
    others: &mut Vec<&'a Proposal>,
    attempt: impl Fn(&[&Proposal]) -> Vec<Candidate>,
) {
    loop {
        let leaders = leaders(candidates);
        let is_related = |one: &&'a Proposal| leaders.iter().any(|leader| leader.mistaken(one.effect));
        let (related, rest): (Vec<_>, Vec<_>) = others.iter().partition(|one| is_related(one));
        if related.is_empty() {
            return;
        }
        *others = rest;
        candidates.extend(attempt(&related));
    }
}

fn alone(
    session: &Session,
    baseline: &Candidate,
    proposals: &[&Proposal],
    least: f64,
    done: &(dyn Fn() + Sync),
) -> Vec<Candidate> {
    let wanted: Vec<Wanted> =
        proposals.iter().map(|one| Wanted::new(vec![one.effect], baseline.fit.clone(), one.starts.clone())).collect();
    try_all(session, &wanted, (MOST_SINGLE, least), done)
}

/// Fits the best few of those that were tried before from where they ended, and what they contain: on runs that have since been
/// read anew.
fn from_before(session: &Session, candidates: &mut [Candidate], before: &[Candidate]) {
    let mut best: Vec<&Candidate> = before.iter().collect();
    best.sort_by(|a, b| a.mean_square().total_cmp(&b.mean_square()));
    best.truncate(MOST_FURTHER);
    let contained = |once: &&Candidate| {
        let is_part = |one: &Candidate| one.effects.iter().all(|effect| once.effects.contains(effect));
        let begun = |(place, one): (usize, &Candidate)| (place, session.begun_from(&one.effects, &once.fit));
        candidates.iter().enumerate().filter(|(_, one)| is_part(one)).map(begun).collect::<Vec<_>>()
    };
    let begun = best.iter().flat_map(contained).collect();
    finish_all(session, candidates, begun);
}

/// Takes over a fit of effects that were tried, where it does better.
pub fn take(session: &Session, candidates: &mut [Candidate], fit: &Fit) {
    if let Some(candidate) = candidates.iter_mut().find(|one| one.effects == fit.effects) {
        candidate.improve(Candidate::of(session, session.begun_anew(fit), true));
    }
}

/// Looks at the most promising effects of a screen about the file's own numbers from there, and fits the best few in full:
/// without the effect those numbers may have been refitted to where no step leads back from. The best effect so far is fitted in
/// full from each of its starting points: it is the one to be named, unless its numbers have gone astray.
fn from_file(session: &Session, candidates: &mut [Candidate]) {
    let singles = singles(candidates);
    let effects: Vec<Id> = singles.iter().map(|&i| candidates[i].effects[0]).collect();
    let place = |effect: Id| effects.iter().position(|one| *one == effect).map(|i| singles[i]);
    let look = |(effect, starts): (Id, Vec<usize>)| {
        Some((place(effect)?, session.look_suited(&[effect], &session.unfitted, &starts, (LOOK, f64::INFINITY))))
    };
    let leader = effects.first().copied();
    let promising: Vec<(Id, Vec<usize>)> = propose(&session.model, &session.data(), &session.unfitted, &effects)
        .into_iter()
        .take(FIRST.0)
        .filter(|one| Some(one.effect) != leader)
        .map(|one| (one.effect, session.all_starts(&[one.effect])))
        .collect();
    let mut looks: Vec<(usize, Fit)> = promising.into_par_iter().filter_map(look).collect();
    looks.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    looks.truncate(MOST_FURTHER);
    let each = leader
        .into_iter()
        .flat_map(|leader| session.all_starts(&[leader]).into_iter().map(move |start| (leader, vec![start])));
    looks.par_extend(each.collect::<Vec<_>>().into_par_iter().filter_map(look));
    finish_all(session, candidates, looks);
}

/// Fits in full what has begun, each for the candidate at a place.
fn finish_all(session: &Session, candidates: &mut [Candidate], begun: Vec<(usize, Fit)>) {
    let finish =
        |(place, begun)| (place, Candidate::of(session, session.finish(begun, ROUNDS, TOLERANCE, f64::INFINITY), true));
    let finished: Vec<(usize, Candidate)> = begun.into_par_iter().map(finish).collect();
    for (place, candidate) in finished {
        candidates[place].improve(candidate);
    }
}

/// Looks at every model briefly from each of its starting points, fits the promising ones (`most` of them) in full,
/// judges all. A look is not taken to the end where it is beaten by the `least` cost that others have reached on the same
/// rollouts.
pub(super) fn try_all(
    session: &Session,
    wanted: &[Wanted],
    (most, least): (usize, f64),
    done: &(dyn Fn() + Sync),
) -> Vec<Candidate> {
    if wanted.is_empty() {
        return Vec::new();
    }
    let looks = look_at_all(session, wanted, least);
    let readings = session.coarse_readings();
    let excess: Vec<f64> = looks.iter().map(|look| (look.cost / readings - 1.0).max(0.0)).collect();
    let mut sorted = excess.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |place: usize| sorted.get(place.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0.0);
    let near = |excess: f64| PROMISING * excess + 0.05;
    let bar = near(at(0)).clamp(at(1), at(most - 1).max(at(1))).min(near(least / readings - 1.0));
    // Where an effect is promising, what it contains must not lose for want of a full fit.
    let contained: Vec<Vec<Id>> = wanted
        .iter()
        .zip(&excess)
        .filter(|(_, excess)| **excess <= bar)
        .filter_map(|(one, _)| simpler(&one.effects))
        .collect();
    let promising = |place: usize| excess[place] <= bar || contained.contains(&wanted[place].effects);
    let mut fits = looks;
    // What the best of the looks comes to tells which of the others need not be fitted to the end.
    let leader = (0..fits.len()).min_by(|&a, &b| excess[a].total_cmp(&excess[b])).unwrap_or(0);
    fits[leader] = session.finish(fits[leader].clone(), ROUNDS, TOLERANCE, f64::INFINITY);
    let least = fits[leader].cost;
    let finish = |(place, fit): (usize, Fit)| {
        let is_promising = promising(place);
        let fit = if is_promising && place != leader { session.finish(fit, ROUNDS, TOLERANCE, least) } else { fit };
        let candidate = Candidate::of(session, fit, is_promising || place == leader);
        done();
        candidate
    };
    let mut candidates: Vec<Candidate> = fits.into_par_iter().enumerate().map(finish).collect();
    level(session, &mut candidates);
    candidates
}

/// Looks at models in waves: each wave knows the least cost of those before.
fn look_at_all(session: &Session, wanted: &[Wanted], mut least: f64) -> Vec<Fit> {
    let mut looks: Vec<Fit> = Vec::new();
    for wave in wanted.chunks(WAVE) {
        let look = |one: &Wanted| {
            let look = if one.suited { Session::look_suited } else { Session::look };
            look(session, &one.effects, &one.from, &one.starts, (LOOK, least))
        };
        looks.par_extend(wave.par_iter().map(look));
        least = looks.iter().map(|look| look.cost).fold(least, f64::min);
    }
    looks
}

/// Of two effects of which one contains the other, as Stribeck friction does Coulomb friction, each is fitted once more from
/// where the other ended, where that promises more, so that neither wins by the luck of its starting point.
pub(super) fn level(session: &Session, candidates: &mut [Candidate]) {
    for rich in 0..candidates.len() {
        let Some(simple) = simpler(&candidates[rich].effects) else { continue };
        let Some(simple) = candidates.iter().position(|one| one.effects == simple) else { continue };
        fit_from(session, candidates, rich, simple);
        let near = candidates[simple].mean_square() < NEAR * session.noise;
        // One that has nothing of its own may have collapsed to the simple one, or never have left it.
        if near && candidates[rich].mean_square() > GAINS * candidates[simple].mean_square() {
            refit(session, candidates, simple, rich);
        }
    }
}

/// The same for the best single effect and those that it is easily mistaken for: one of them may have found back to the file's
/// numbers from where their refit without it ended, and the other not.
fn level_mistaken(session: &Session, candidates: &mut [Candidate]) {
    let singles = singles(candidates);
    let Some(&best) = singles.first() else { return };
    for other in singles {
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
        refit(session, candidates, from, to);
    }
}

/// Fits one candidate once more from where another ended, and keeps the better outcome.
fn refit(session: &Session, candidates: &mut [Candidate], from: usize, to: usize) {
    let least = if candidates[from].in_full { candidates[from].fit.cost } else { f64::INFINITY };
    let fit = session.again(&candidates[to].effects, &candidates[from].fit, ROUNDS, TOLERANCE, least);
    candidates[to].improve(Candidate::of(session, fit, true));
}

/// The same effects with one of them in its contained form (Coulomb friction for Stribeck friction); `None` where none
/// contains another.
pub(super) fn simpler(effects: &[Id]) -> Option<Vec<Id>> {
    let (place, inner) = effects
        .iter()
        .enumerate()
        .find_map(|(place, outer)| Some((place, Id::all().find(|inner| outer.contains(*inner))?)))?;
    let mut simpler = effects.to_vec();
    simpler[place] = inner;
    simpler.sort();
    Some(simpler)
}

#[cfg(test)]
mod tests {
    use super::super::selection::tests::model;
    use super::*;

    fn proposals(promised: &[(&str, f64)]) -> Vec<Proposal> {
        let proposal =
            |&(name, promised): &(&str, f64)| Proposal { effect: Id::of(name).unwrap(), starts: Vec::new(), promised };
        promised.iter().map(proposal).collect()
    }

    #[test]
    fn what_the_best_is_mistaken_for_is_tried_though_it_came_late_itself() {
        let [sag, dead_time] = ["battery_sag", "driver_dead_time"].map(|name| Id::of(name).unwrap());
        assert!(!sag.mistaken(dead_time), "only through the bridge's drop");
        let proposed = proposals(&[("driver_dead_time", 0.3), ("driver_drop", 0.2), ("clock_drift", 0.1)]);
        let mut others: Vec<&Proposal> = proposed.iter().collect();
        let mut candidates = vec![model(&["battery_sag"], 4.0)];
        add_related(&mut candidates, &mut others, |related| {
            related.iter().map(|one| model(&[one.effect.name()], 1.0)).collect()
        });
        let tried: Vec<&str> = candidates.iter().map(|one| one.effects[0].name()).collect();
        assert_eq!(tried, ["battery_sag", "driver_drop", "driver_dead_time"]);
        assert_eq!(others, [&proposed[2]], "nothing is tried twice, nor without a reason");
    }

    #[test]
    fn what_led_before_and_its_like_are_of_the_first_though_a_screen_sees_nothing_of_them() {
        let seen =
            ["torque_ripple", "sensor_nonlinearity", "shaft_compliance", "gravity_tilt", "friction_patch", "backlash"];
        let seen = seen.map(|name| (name, 0.5));
        let proposed =
            proposals(&[&seen[..], &[("clock_drift", 0.0), ("driver_drop", 0.0), ("driver_dead_time", 0.0)]].concat());
        let before = [model(&["driver_drop"], 1.0), model(&["load_friction"], 1.2), model(&["clock_drift"], 2.0)];
        let first = |before: &[Candidate]| promising(&proposed, &leaders(before)).0.len();
        assert_eq!(first(&[]), seen.len());
        assert_eq!(first(&before), seen.len() + 2, "the drop, and dead time; not what was twice as far off");
    }
}
