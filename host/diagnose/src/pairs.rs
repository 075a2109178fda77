//! Models with two effects: which are tried, and from where.

use effects::Id;
use rayon::prelude::*;

use super::fit::Fit;
use super::is_implausible;
use super::partial::NEARLY_ALL;
use super::screen::Proposal;
use super::search::{
    Asks, Candidate, LEADS, LOOK, MOST_FURTHER, ROUNDS, TOLERANCE, Wanted, floor, level, simpler, singles, try_all,
};
use super::selection::{reaches, removed};
use super::session::Session;

/// Pairs are formed among this many of the best single effects.
const PAIRED: usize = 3;
/// Of so many single effects pairs are formed with what a screen about each proposes.
const LEADING: usize = 2;
/// Of each of the best single effects, pairs are formed with so many that a screen about it proposes.
const PROPOSED: usize = 4;
/// A pair that leaves at most this share of the mean square error is fitted again where it does not reach the floor.
const MOST: f64 = 0.5;
/// But not where it leaves more than so many times the floor's mean square: no start leads from there to it.
const FARTHEST: f64 = 16.0;
/// What an effect is mistaken for may be mistaken for a third: play between the gears for a soft shaft, that for a late reading, and that
/// for a late command.
const RELATIONS: usize = 3;
/// So many times, as long as it becomes clearly better.
const RESTARTS: usize = 3;
/// Clearly better is less than this share of the mean square error before.
const BETTER: f64 = 0.99;

/// Adds pairs of the best single effects, and fits what they are made of from there. A rig that is not the file's gets none.
pub fn add_pairs(session: &Session, baseline: &Candidate, candidates: &mut Vec<Candidate>, asks: &Asks) {
    if is_implausible(session, baseline) {
        return;
    }
    candidates.extend(pairs(session, candidates, asks.proposals));
    add_relatives(session, baseline, candidates, asks.effects);
    let restarts = (0..RESTARTS).take_while(|_| restart(session, baseline, candidates)).count();
    if restarts > 0 {
        add_relatives(session, baseline, candidates, asks.effects);
    }
    apart(session, baseline, candidates);
}

/// The pair with the least held-out error.
fn best_pair(candidates: &[Candidate]) -> Option<usize> {
    let pairs = (0..candidates.len()).filter(|&i| candidates[i].effects.len() == 2);
    pairs.min_by(|&a, &b| candidates[a].mean_square().total_cmp(&candidates[b].mean_square()))
}

/// Adds what the best pairs are mistaken for, and what that is mistaken for, of some effects.
pub fn add_relatives(session: &Session, baseline: &Candidate, candidates: &mut Vec<Candidate>, effects: &[Id]) {
    let mut looked_at = Vec::new();
    for _ in 0..RELATIONS {
        let further = relatives(session, baseline, candidates, effects, &mut looked_at);
        if further.is_empty() {
            break;
        }
        for one in further {
            match candidates.iter_mut().find(|tried| tried.effects == one.effects) {
                Some(tried) => tried.improve(one),
                None => candidates.push(one),
            }
        }
    }
}

/// The best pair and, where it takes away nearly all, so that pairs are named, those that do about as well; but none that only imitates
/// it, with more numbers and no less of an error.
fn leading<'a>(session: &Session, baseline: &Candidate, candidates: &'a [Candidate]) -> Vec<&'a Candidate> {
    let Some(best) = best_pair(candidates).map(|place| &candidates[place]) else { return Vec::new() };
    let is_named = removed(floor(session, candidates), baseline, best) >= NEARLY_ALL;
    let within = best.mean_square() * if is_named { LEADS } else { 1.0 };
    let leads = |one: &&Candidate| one.effects.len() == 2 && one.mean_square() <= within && !one.is_richer_than(best);
    let mut leading: Vec<&Candidate> = candidates.iter().filter(leads).collect();
    leading.sort_by(|a, b| a.mean_square().total_cmp(&b.mean_square()));
    leading
}

/// Fits and judges the leading pairs with each of their effects in turn replaced by those that the catalogue knows to be mistaken for it,
/// and by those that it contains, the other one where it was found: from elsewhere the same may have gone astray. What was looked at so
/// before is not looked at again.
fn relatives(
    session: &Session,
    baseline: &Candidate,
    candidates: &[Candidate],
    known: &[Id],
    looked_at: &mut Vec<Vec<Id>>,
) -> Vec<Candidate> {
    let leading = leading(session, baseline, candidates);
    let leads = |effects: &[Id]| leading.iter().any(|one| one.effects == effects);
    let mut wanted: Vec<Wanted> = Vec::new();
    for (pair, place) in leading.iter().flat_map(|pair| [(pair, 0), (pair, 1)]) {
        let (effect, other) = (pair.effects[place], pair.effects[1 - place]);
        // What does badly in the place of an effect of one leading pair does so in another: once is enough.
        let beside: Vec<Id> = leading.iter().filter_map(|one| partner(&one.effects, effect)).collect();
        let replaces = |pair: &[Id], one: Id| partner(pair, one).is_some_and(|other| beside.contains(&other));
        let related = |one: &Id| (one.mistaken(effect) || effect.contains(*one)) && !one.overlaps(other);
        for relative in known.iter().copied().filter(related) {
            let effects = pair_of(relative, other);
            let speaks = |pair: &Vec<Id>| *pair == effects || (replaces(pair, relative) && !leads(pair));
            let is_known = leads(&effects) || looked_at.iter().any(speaks);
            if !is_known {
                let starts = session.all_starts(&effects);
                looked_at.push(effects.clone());
                let from = pair.fit.without(&session.model, effect);
                wanted.push(Wanted { suited: true, ..Wanted::new(effects, from, starts) });
            }
        }
    }
    let Some(best) = leading.first().filter(|_| !wanted.is_empty()) else { return Vec::new() };
    try_all(session, &wanted, (MOST_FURTHER, session.coarse_cost(&best.fit)), &|| ())
}

/// Two effects in the order of the catalogue.
fn pair_of(one: Id, other: Id) -> Vec<Id> {
    let mut effects = vec![one, other];
    effects.sort();
    effects
}

/// The other effect of a pair that has this one.
fn partner(effects: &[Id], effect: Id) -> Option<Id> {
    match *effects {
        [one, other] if one == effect => Some(other),
        [other, one] if one == effect => Some(other),
        _ => None,
    }
}

/// Where the best pair takes most of the misfit away and yet does not reach the floor, it is fitted again from every starting point
/// of each of its effects, the other one where it was found: found alone, an effect makes up for the other. Whether that is clearly
/// better.
fn restart(session: &Session, baseline: &Candidate, candidates: &mut [Candidate]) -> bool {
    let Some(place) = best_pair(candidates) else { return false };
    let pair = &candidates[place];
    let noise = floor(session, candidates);
    let is_far = pair.mean_square() > (MOST * baseline.mean_square()).min(FARTHEST * noise);
    if reaches(noise, baseline, pair) || is_far {
        return false;
    }
    let starts = session.all_starts(&pair.effects);
    let least = session.coarse_cost(&pair.fit);
    let look =
        |&effect: &Id| session.look(&pair.effects, &pair.fit.without(&session.model, effect), &starts, (LOOK, least));
    let begun = pair.effects.par_iter().map(look).min_by(|a, b| a.cost.total_cmp(&b.cost));
    let Some(begun) = begun.filter(|begun| begun.cost < least) else { return false };
    let fit = session.finish(begun, ROUNDS, TOLERANCE, pair.fit.cost);
    let before = pair.mean_square();
    candidates[place].improve(Candidate::of(session, fit, true));
    candidates[place].mean_square() < BETTER * before
}

/// Fits and judges pairs that were not tried yet: of the best single effects each with what a screen about it proposes, and among
/// themselves.
fn pairs(
    session: &Session,
    candidates: &[Candidate],
    proposals: &(dyn Fn(&Candidate) -> Vec<Proposal> + Sync),
) -> Vec<Candidate> {
    let singles: Vec<&Candidate> = singles(candidates).into_iter().map(|i| &candidates[i]).collect();
    let mut wanted: Vec<Wanted> = Vec::new();
    let mut want = |first: &Candidate, second: Id, starts: &[usize], from: Fit| {
        let effects = pair_of(first.effects[0], second);
        let known = candidates.iter().any(|one| one.effects == effects);
        if !known && !first.effects[0].overlaps(second) && !wanted.iter().any(|one| one.effects == effects) {
            wanted.push(Wanted::new(effects, from, starts.to_vec()));
        }
    };
    for first in singles.iter().take(LEADING) {
        for second in proposals(first).iter().take(PROPOSED) {
            want(first, second.effect, &second.starts, first.fit.clone());
        }
    }
    let best = &singles[..PAIRED.min(singles.len())];
    for (i, first) in best.iter().enumerate() {
        for second in &best[i + 1..] {
            want(first, second.effects[0], &[0], first.fit.knowing(&second.fit));
        }
    }
    let alone = |effect: Id| singles.iter().find(|one| one.effects == [effect]);
    for place in 0..wanted.len() {
        let Some(effects) = simpler(&wanted[place].effects).filter(|pair| pair[0] != pair[1]) else { continue };
        let known = candidates.iter().map(|one| &one.effects).chain(wanted.iter().map(|one| &one.effects));
        if known.into_iter().all(|one| *one != effects)
            && let (Some(first), Some(second)) = (alone(effects[0]), alone(effects[1]))
        {
            wanted.push(Wanted::new(effects, first.fit.knowing(&second.fit), vec![0]));
        }
    }
    try_all(session, &wanted, (MOST_FURTHER, f64::INFINITY), &|| ())
}

/// Fits and judges the first few of several effects beside the one of a single-effect model.
#[must_use]
pub fn beside(session: &Session, single: &Candidate, proposals: &[Proposal]) -> Vec<Candidate> {
    let with = |second: &Proposal| {
        Wanted::new(pair_of(single.effects[0], second.effect), single.fit.clone(), second.starts.clone())
    };
    let wanted: Vec<Wanted> = proposals
        .iter()
        .filter(|second| !single.effects[0].overlaps(second.effect))
        .take(MOST_FURTHER)
        .map(with)
        .collect();
    try_all(session, &wanted, (MOST_FURTHER, f64::INFINITY), &|| ())
}

/// Where a pair reaches the floor, fits each effect of the best pair on its own from where the pair ended, and what it contains
/// from there: alone, it may have gone astray on its way there, or have been met only in the pair.
pub fn apart(session: &Session, baseline: &Candidate, candidates: &mut Vec<Candidate>) {
    let pairs = candidates.iter().filter(|one| one.effects.len() == 2 && reaches(session.noise, baseline, one));
    let Some(pair) = pairs.min_by(|a, b| a.mean_square().total_cmp(&b.mean_square())) else { return };
    let (effects, fit) = (pair.effects.clone(), pair.fit.clone());
    for effect in effects {
        let fit = session.again(&[effect], &fit, ROUNDS, TOLERANCE, f64::INFINITY);
        let alone = Candidate::of(session, fit, true);
        match candidates.iter_mut().find(|one| one.effects == [effect]) {
            Some(single) => single.improve(alone),
            None => candidates.push(alone),
        }
    }
    level(session, candidates);
}

#[cfg(test)]
mod tests {
    use effects::{DriverDrop, Laws};

    use super::super::session::Session;
    use super::super::tests::{Rig, bench};
    use super::super::{Options, judged};
    use super::*;

    #[test]
    fn an_effect_that_was_met_only_in_a_pair_is_tried_alone() {
        let mut rig = Rig::off();
        rig.shaft.laws =
            Laws { driver_drop: Some(DriverDrop { drop_v: 0.4, knee_a: 0.0, slope_ohm: 0.0 }), ..Laws::NONE };
        let runs = rig.runs(3);
        let (mut session, fit) = Session::open(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
        let baseline = judged(&mut session, fit);
        let id = |name: &str| Id::all().find(|id| id.name() == name).unwrap();
        let (drag, drop) = (id("quadratic_drag"), id("driver_drop"));
        let effects = pair_of(drag, drop);
        let starts = session.all_starts(&effects);
        let wanted = [Wanted::new(effects, baseline.fit.clone(), starts)];
        let mut candidates = try_all(&session, &wanted, (MOST_FURTHER, f64::INFINITY), &|| ());
        assert!(reaches(session.noise, &baseline, &candidates[0]), "the pair stands at the floor");
        apart(&session, &baseline, &mut candidates);
        let alone = |effect: Id| candidates.iter().find(|one| one.effects == [effect]).unwrap();
        assert!(reaches(session.noise, &baseline, alone(drop)));
        assert!(!reaches(session.noise, &baseline, alone(drag)));
    }

    #[test]
    fn what_a_pair_that_does_as_well_is_mistaken_for_is_tried_too() {
        let mut rig = Rig::off();
        rig.shaft.laws =
            Laws { driver_drop: Some(DriverDrop { drop_v: 0.4, knee_a: 0.0, slope_ohm: 0.0 }), ..Laws::NONE };
        let runs = rig.runs(3);
        let (mut session, fit) = Session::open(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
        let baseline = judged(&mut session, fit.clone());
        let pair = |names: [&str; 2]| {
            let mut effects: Vec<Id> = names.iter().filter_map(|name| Id::of(name)).collect();
            effects.sort();
            effects
        };
        let wanted = [["quadratic_drag", "driver_drop"], ["cubic_drag", "driver_drop"]].map(|names| {
            let effects = pair(names);
            let starts = session.all_starts(&effects);
            Wanted::new(effects, fit.clone(), starts)
        });
        let mut candidates = try_all(&session, &wanted, (MOST_FURTHER, f64::INFINITY), &|| ());
        // Which of them were tried alone makes no difference.
        let known: Vec<Id> = Id::all().collect();
        add_relatives(&session, &baseline, &mut candidates, &known);
        let has = |names| candidates.iter().any(|one| one.effects == pair(names));
        // Which does badly in the place of the drop beside one drag, and so is not tried beside the other.
        assert!(has(["quadratic_drag", "driver_dead_time"]) != has(["cubic_drag", "driver_dead_time"]));
        // What an effect of the pair contains is tried, too.
        let rich = pair(["driver_drop", "directional_friction"]);
        let from = session.again(&rich, &fit, 3, TOLERANCE, f64::INFINITY);
        let candidates = [Candidate::of(&session, from, true)];
        let tried = relatives(&session, &baseline, &candidates, &known, &mut Vec::new());
        assert!(tried.iter().any(|one| one.effects == pair(["driver_drop", "coulomb_friction"])));
    }
}
