//! From what was tried to a verdict.

use std::ops::Range;

use effects::Id;

use super::bootstrap::{Bootstrap, interval};
use super::confidence_set;
use super::search::Candidate;
use super::verdict::Verdict;

/// A model whose held-out error is within this factor of the noise floor has reached it.
pub(super) const REACHES: f64 = 1.12;
/// The same for a pair of effects.
const PAIR_REACHES: f64 = 1.06;
/// What explains a misfit removes at least this share of its excess over the floor (mean square), however near the floor is.
const EXPLAINS: f64 = 0.5;
/// A law of the library that is nearly the right one leaves at most this share of the misfit.
const TRACE: f64 = 0.025;
/// Up to this factor, a model that leaves no more of the excess than its laws' traces has reached the floor too.
const REACHES_WITH_TRACE: f64 = 1.22;
/// The refitted nominal model has nothing to explain up to this factor.
const NOTHING: f64 = 1.08;
/// Up to this factor a model stands at the floor: that itself is known no better.
const AT_FLOOR: f64 = 1.02;
/// Of more models than this only those stay that the runs do not rule out, and as many of those that are behind by too little to matter
/// as there is room for.
const MOST_BY_SIZE: usize = 3;
/// A richer model must be better by this share of the error to be preferred to a simpler one, however sure the
/// difference is.
pub(super) const PAYS: f64 = 0.01;
/// Or, of a small misfit, by this share of the nominal model's excess (mean square) over the floor.
const PAYS_OF_EXCESS: f64 = 0.03;
/// A second effect takes away at least this share of the nominal model's excess: a law of the library that is only nearly the
/// right one leaves less.
const SECOND_PAYS: f64 = 0.045;
/// And never by less than this share of the floor (mean square): the floor of one set of runs is not known better.
const PAYS_OF_NOISE: f64 = 0.006;
/// And never by less than this many times the noise of one reading (sum of squares, for white noise twice the logarithm of the ratio of
/// likelihoods): of 25 effects, fitted to short runs, some one does as much on others by chance.
const PAYS_OF_READINGS: f64 = 10.0;
/// A richer model that is better than a simpler one by this share of the nominal model's excess stays beside it.
const SUGGESTS: f64 = 0.01;
/// Error of a comparison on each side; candidates are many, so it is small. It is read from
/// [`Bootstrap::deciding_mean_squares`], of which 10 lie beyond it: the least of the 600 resamples that serve the reported
/// intervals would stand for any tail below 1/600.
pub(super) const TAIL: f64 = 0.001;
/// Of a pair that needs both its effects each takes away at least this share of the nominal model's excess beyond what any single one
/// does.
const NEEDED: f64 = 0.2;
/// Two models are the same up to this factor of their errors (mean square).
const SAME: f64 = 1.001;

/// The decision.
#[derive(Clone, Debug)]
pub struct Decision {
    /// The answer in one word.
    pub verdict: Verdict,
    /// Indices of the models that these runs cannot tell apart, the one that the answer names first; empty for the nominal
    /// one.
    pub class: Vec<usize>,
}

impl Decision {
    /// Index of the model that the answer names; `None` for the nominal one.
    #[must_use]
    pub fn named(&self) -> Option<usize> {
        self.class.first().copied()
    }

    /// For each effect of the named model, those that do as well in its place, everything else as it is.
    #[must_use]
    pub fn also(&self, candidates: &[Candidate]) -> Vec<Vec<Id>> {
        let Some(named) = self.named() else { return Vec::new() };
        let named = &candidates[named].effects;
        let rivals = || self.class[1..].iter().map(|&rival| &candidates[rival].effects);
        let instead_of = |effect: &Id| {
            let rest: Vec<Id> = named.iter().copied().filter(|one| one != effect).collect();
            let in_its_place =
                rivals().filter(|rival| rival.len() == named.len() && rest.iter().all(|one| rival.contains(one)));
            let mut others: Vec<Id> = in_its_place.flatten().copied().filter(|other| !named.contains(other)).collect();
            others.sort();
            others.dedup();
            others
        };
        named.iter().map(instead_of).collect()
    }
}

/// Whether a model reaches the floor (mean square noise, rad²) and takes most of the misfit away on its way there. Of a large
/// misfit, the law in the library may leave a trace because the real one is richer: then it must have removed nearly all of
/// it. A pair has more freedom, so more is asked of it.
#[must_use]
pub fn reaches(noise: f64, baseline: &Candidate, model: &Candidate) -> bool {
    let ratio = (model.mean_square() / noise).sqrt();
    let removed = removed(noise, baseline, model);
    let near = if model.effects.len() > 1 { PAIR_REACHES } else { REACHES };
    (ratio <= near && removed >= EXPLAINS) || (ratio <= REACHES_WITH_TRACE && removed >= 1.0 - trace(model))
}

/// The share of a misfit that a model's laws may leave where they are nearly right: the traces of two add up.
pub(super) fn trace(model: &Candidate) -> f64 {
    TRACE * model.effects.len() as f64
}

/// Whether the refitted model leaves more over the floor (mean square noise, rad²) than is passed over.
#[must_use]
pub fn leaves_much(noise: f64, baseline: &Candidate) -> bool {
    baseline.mean_square() > NOTHING * NOTHING * noise
}

/// Share of the nominal model's excess over the floor (mean square) that a model removes, 1 at most.
pub(super) fn removed(noise: f64, baseline: &Candidate, model: &Candidate) -> f64 {
    let gained = baseline.mean_square() - model.mean_square();
    gained / (baseline.mean_square() - noise).max(gained).max(f64::MIN_POSITIVE)
}

/// Everything a comparison needs.
pub struct Selection<'a> {
    /// Mean square noise, rad².
    pub noise: f64,
    /// The refitted nominal model.
    pub baseline: &'a Candidate,
    /// Models with one or two effects.
    pub candidates: &'a [Candidate],
    /// Resamples of the held-out rollouts.
    pub bootstrap: &'a Bootstrap,
}

/// Share of an RMSE that is gone, from mean squares.
fn share(before: f64, after: f64) -> f64 {
    1.0 - (after / before).sqrt()
}

impl Selection<'_> {
    /// Held-out RMSE over the noise floor.
    #[must_use]
    pub fn ratio(&self, model: &Candidate) -> f64 {
        (model.mean_square() / self.noise).sqrt()
    }

    /// Whether a model stands at the floor, which itself is known no better.
    #[must_use]
    pub fn is_at_floor(&self, model: &Candidate) -> bool {
        model.mean_square() <= AT_FLOOR * AT_FLOOR * self.noise
    }

    /// [`reaches`] for a model that was tried.
    #[must_use]
    pub fn reaches(&self, model: &Candidate) -> bool {
        reaches(self.noise, self.baseline, model)
    }

    /// Whether a model's effects are there at all. Effects that stand for much of the misfit each, as a single one does, are asked in
    /// their fitted shape; of one that may take away little, the shape must not be made for its size.
    pub(super) fn is_sized(&self, model: &Candidate) -> bool {
        model.sized || (model.sized_in_its_shape && (model.effects.len() == 1 || self.needs_both(model)))
    }

    /// Whether every single effect that was tried leaves much of what a pair takes away.
    pub(super) fn needs_both(&self, pair: &Candidate) -> bool {
        let removed = |one: &Candidate| removed(self.noise, self.baseline, one);
        let singles = self.candidates.iter().filter(|one| one.effects.len() == 1).map(removed);
        singles.fold(0.0, f64::max) < removed(pair) - NEEDED
    }

    /// Whether a model was taken back for what it leaves, or does no better than one that was.
    pub(super) fn is_out(&self, model: &Candidate) -> bool {
        let mut refuted = self.candidates.iter().filter(|one| one.refuted);
        refuted.any(|one| one.mean_square() <= model.mean_square())
    }

    /// Share of one model's RMSE that another removes: value and interval.
    #[must_use]
    pub fn improvement(&self, from: &Candidate, to: &Candidate, tail: f64) -> [f64; 3] {
        let before = self.bootstrap.mean_squares(&from.evaluation.errors);
        let after = self.bootstrap.mean_squares(&to.evaluation.errors);
        let (low, high) = interval(before.iter().zip(&after).map(|(b, a)| share(*b, *a)).collect(), tail);
        [share(from.mean_square(), to.mean_square()), low, high]
    }

    /// Whether `to` is better than `from` beyond doubt and by enough to matter.
    #[must_use]
    pub fn beats(&self, to: &Candidate, from: &Candidate) -> bool {
        if !self.pays(to, from) {
            return false;
        }
        let before = self.bootstrap.deciding_mean_squares(&from.evaluation.errors);
        let after = self.bootstrap.deciding_mean_squares(&to.evaluation.errors);
        let (low, _) = interval(before.iter().zip(&after).map(|(b, a)| share(*b, *a)).collect(), TAIL);
        low > 0.0
    }

    /// Whether `to` is better than `from` by enough to matter.
    fn pays(&self, to: &Candidate, from: &Candidate) -> bool {
        let gained = from.mean_square() - to.mean_square();
        let excess = self.baseline.mean_square() - self.noise;
        gained > PAYS_OF_READINGS / from.evaluation.readings() * self.noise
            && (share(from.mean_square(), to.mean_square()) > PAYS
                || gained > (PAYS_OF_EXCESS * excess).max(PAYS_OF_NOISE * self.noise))
    }

    /// Whether a pair takes so much more away than a single effect that its second one is more than the single one's law in another form:
    /// much of the misfit, or all that is left where that alone would be a misfit.
    fn second_pays(&self, pair: &Candidate, single: &Candidate) -> bool {
        let excess = self.baseline.mean_square() - self.noise;
        let takes_the_rest = self.ratio(single) > REACHES && self.is_at_floor(pair);
        takes_the_rest || single.mean_square() - pair.mean_square() > SECOND_PAYS * excess
    }

    /// Of some models, those that hold the best one as often as [`confidence_set`] says.
    fn confidence_set(&self, models: &[usize]) -> Vec<usize> {
        let errors = |&i: &usize| &self.candidates[i].evaluation.errors;
        let means: Vec<f64> = models.iter().map(|&i| self.candidates[i].mean_square()).collect();
        let resampled: Vec<Vec<f64>> = models.iter().map(|i| self.bootstrap.deciding_mean_squares(errors(i))).collect();
        confidence_set::of(&means, &resampled).into_iter().map(|place| models[place]).collect()
    }

    /// Whether a richer model is so much better than one that it contains that nobody would swear on the simpler one.
    fn suggests(&self, rich: &Candidate, simple: &Candidate) -> bool {
        let excess = self.baseline.mean_square() - self.noise;
        simple.mean_square() - rich.mean_square() > SUGGESTS * excess.max(self.noise * 1e-3)
    }

    /// Share of the nominal model's excess over the floor (mean square) that a model removes.
    #[must_use]
    pub fn gain(&self, model: &Candidate) -> [f64; 3] {
        let excess = |before: f64, after: f64| 100.0 * (1.0 - (after - self.noise).max(0.0) / (before - self.noise));
        let before = self.bootstrap.mean_squares(&self.baseline.evaluation.errors);
        let after = self.bootstrap.mean_squares(&model.evaluation.errors);
        let values = before.iter().zip(&after).filter(|(b, _)| **b > self.noise).map(|(b, a)| excess(*b, *a)).collect();
        let (low, high) = interval(values, 0.025);
        [excess(self.baseline.mean_square(), model.mean_square()), low, high]
    }

    /// Whether some model takes most of the misfit away beyond doubt: then it is no noise, whatever a screen has seen from where
    /// the refitted model stands.
    #[must_use]
    pub fn any_explains(&self) -> bool {
        let explains = |model: &Candidate| {
            removed(self.noise, self.baseline, model) >= EXPLAINS && self.beats(model, self.baseline)
        };
        self.candidates.iter().any(explains)
    }

    /// The verdict, where a screen has raised an alarm or not.
    #[must_use]
    pub fn decide(&self, alarm: bool) -> Decision {
        let nothing = Decision { verdict: Verdict::Nothing, class: Vec::new() };
        if !alarm {
            return nothing;
        }
        let singles = self.standing(1, |model| self.reaches(model));
        if !singles.is_empty() {
            return self.among(&singles, Verdict::Explained);
        }
        let pairs = self.standing(2, |model| self.reaches(model));
        if let Some(best) = self.best_of(&pairs) {
            // What is near enough to the floor for a pair is so for an effect beside which no second one pays.
            let alone = self.standing(1, |model| !self.second_pays(&self.candidates[best], model));
            return self.among(if alone.is_empty() { &pairs } else { &alone }, Verdict::Explained);
        }
        if !leaves_much(self.noise, self.baseline) {
            return nothing;
        }
        self.partial().unwrap_or(Decision { verdict: Verdict::Unexplained, class: Vec::new() })
    }

    /// Models of so many effects that are there, were not taken back, are enough and clearly beat the nominal one.
    fn standing(&self, effects: usize, is_enough: impl Fn(&Candidate) -> bool) -> Vec<usize> {
        let stands = |model: &Candidate| {
            let is_there = model.effects.len() == effects && self.is_sized(model) && !self.is_out(model);
            is_there && is_enough(model) && self.beats(model, self.baseline)
        };
        (0..self.candidates.len()).filter(|&i| stands(&self.candidates[i])).collect()
    }

    /// The decision for a pair of the named effect, or of one that does as well, and another, where the second one pays.
    #[must_use]
    pub fn with_second(&self, decision: &Decision) -> Option<Decision> {
        let single = &self.candidates[decision.named()?];
        let pays = |pair: &Candidate| pair.sized && self.second_pays(pair, single);
        let as_good: Vec<&Id> = decision.class.iter().flat_map(|&i| &self.candidates[i].effects).collect();
        let is_of_them =
            |pair: &Candidate| pair.effects.len() == 2 && pair.effects.iter().any(|one| as_good.contains(&one));
        let pairs: Vec<usize> = (0..self.candidates.len())
            .filter(|&i| is_of_them(&self.candidates[i]))
            .filter(|&i| pays(&self.candidates[i]) && self.beats(&self.candidates[i], single))
            .collect();
        (!pairs.is_empty()).then(|| self.among(&pairs, Verdict::Explained))
    }

    /// Mean square error (rad²) on held-out runs that did not choose the model: each part of the rollouts is judged with the one, of
    /// as many effects as the named model, that does best on the other parts (cross-validation by run: M. Stone, J. Royal
    /// Statistical Society B 36, 1974). Beside the named model's own error it says how much choosing among many flatters.
    #[must_use]
    pub fn cross_judged(&self, named: &Candidate, parts: &[Range<usize>]) -> f64 {
        let alike = |one: &&Candidate| one.effects.len() == named.effects.len() && one.in_full && !self.is_out(one);
        let choices: Vec<&Candidate> = self.candidates.iter().filter(alike).collect();
        let sum = |one: &Candidate, within: &dyn Fn(usize) -> bool| {
            let errors = one.evaluation.errors.iter().enumerate().filter(|(place, _)| within(*place));
            errors.fold((0.0, 0.0), |total, (_, error)| (total.0 + error.0, total.1 + error.1))
        };
        let judged = parts.iter().map(|part| {
            let elsewhere = |one: &Candidate| {
                let (square, freedom) = sum(one, &|place| !part.contains(&place));
                square / freedom.max(1.0)
            };
            let chosen = choices.iter().min_by(|a, b| elsewhere(a).total_cmp(&elsewhere(b))).copied().unwrap_or(named);
            sum(chosen, &|place| part.contains(&place))
        });
        let (square, freedom) = judged.fold((0.0, 0.0), |total, one| (total.0 + one.0, total.1 + one.1));
        square / freedom.max(1.0)
    }

    /// Of some models the one with the least held-out error.
    pub(super) fn best_of(&self, models: &[usize]) -> Option<usize> {
        let error = |&i: &usize| self.candidates[i].mean_square();
        models.iter().copied().min_by(|a, b| error(a).total_cmp(&error(b)))
    }

    /// Names one of several models of equal size, with those that it cannot be told from.
    pub(super) fn among(&self, models: &[usize], verdict: Verdict) -> Decision {
        let best = self.best_of(models).unwrap_or(0);
        let near = models.iter().copied().filter(|&i| verdict == Verdict::Explained && self.as_near(best, i));
        let surely: Vec<usize> = self.confidence_set(models).into_iter().chain(near).collect();
        let mut class: Vec<usize> = models
            .iter()
            .copied()
            .filter(|&i| i == best || !self.pays(&self.candidates[best], &self.candidates[i]))
            .chain(surely.iter().copied())
            .collect();
        class.sort_unstable();
        class.dedup();
        // What contains a simpler one of the class is no rival, and not named even where it is the best by a trace.
        class.sort_by_key(|&i| (self.candidates[i].fit.free.len(), (1e6 * self.ratio(&self.candidates[i])) as u64));
        let contains_simpler = |i: usize| {
            let outer = &self.candidates[i].effects;
            class.iter().any(|&j| {
                let inner = &self.candidates[j].effects;
                let covered = |one: &Id| inner.contains(one) || inner.iter().any(|other| one.contains(*other));
                j != i
                    && outer != inner
                    && outer.iter().all(covered)
                    && !self.suggests(&self.candidates[i], &self.candidates[j])
            })
        };
        let numbers = |i: usize| self.candidates[i].fit.free.len();
        // What is richer than one that the runs do not rule out, and no better.
        let imitates = |i: usize| {
            let simpler = |j: &&usize| surely.contains(j) && self.candidates[i].is_richer_than(&self.candidates[**j]);
            class.iter().filter(simpler).any(|&j| !self.suggests(&self.candidates[i], &self.candidates[j]))
        };
        let mut class: Vec<usize> = class.iter().copied().filter(|&i| !contains_simpler(i) && !imitates(i)).collect();
        self.shorten(&mut class, best, &surely);
        // Of those that do the same to a per mille, as one law under two names, the one that the catalogue has first.
        let same = |i: usize| {
            let [one, least] = [i, best].map(|i| &self.candidates[i]);
            i == best || (one.mean_square() < SAME * least.mean_square() && numbers(i) <= numbers(best))
        };
        let first = class.iter().copied().filter(|&i| same(i)).min_by_key(|&i| &self.candidates[i].effects);
        if let Some(place) = class.iter().position(|&i| Some(i) == first) {
            class[..=place].rotate_right(1);
        }
        let verdict = if class.len() > 1 && verdict == Verdict::Explained { Verdict::Ambiguous } else { verdict };
        Decision { verdict, class }
    }

    /// Of many in the place of an effect of the best model that are behind by little, leaves what the runs do not rule out, and of the
    /// others those that are nearest to the best, as long as there are few. Of a pair with both effects replaced, what is left of each.
    fn shorten(&self, class: &mut Vec<usize>, best: usize, surely: &[usize]) {
        let is_sure = |i: usize| i == best || surely.contains(&i);
        let mut nearest = class.clone();
        nearest.sort_by(|&a, &b| self.candidates[a].mean_square().total_cmp(&self.candidates[b].mean_square()));
        nearest.sort_by_key(|&i| !is_sure(i));
        let effects = &self.candidates[best].effects;
        let mut left_out: Vec<Id> = Vec::new();
        for effect in effects {
            let rest: Vec<&Id> = effects.iter().filter(|one| *one != effect).collect();
            let in_its_place = |i: &usize| {
                let other = &self.candidates[*i].effects;
                other.len() == effects.len() && rest.iter().all(|one| other.contains(one))
            };
            let alike = nearest.iter().copied().filter(in_its_place);
            let beyond = alike.skip(MOST_BY_SIZE).filter(|&i| !is_sure(i)).flat_map(|i| &self.candidates[i].effects);
            left_out.extend(beyond.filter(|one| !rest.contains(one)));
        }
        class.retain(|&i| is_sure(i) || self.candidates[i].effects.iter().all(|one| !left_out.contains(one)));
    }

    /// Whether another model is behind the best by no more than that one itself leaves over the floor: a law that misses by as much
    /// is not so right that the other must be wrong, however sure the difference is. Of one that stands at the floor nothing is
    /// left that the floor's own error could not be.
    fn as_near(&self, best: usize, other: usize) -> bool {
        let [best, other] = [best, other].map(|i| &self.candidates[i]);
        !self.is_at_floor(best) && other.mean_square() - best.mean_square() <= best.mean_square() - self.noise
    }
}

#[cfg(test)]
pub(super) mod tests {
    use effects::FitNumber;
    use nalgebra::DMatrix;

    use super::super::fit::Fit;
    use super::super::numbers::Free;
    use super::super::session::Evaluation;
    use super::*;

    /// Of a rollout, after its start.
    const READINGS: f64 = 200.0;

    /// A model whose rollouts all have one mean square, rad².
    pub(in super::super) fn model(effects: &[&str], mean_square: f64) -> Candidate {
        let effects: Vec<Id> = effects.iter().map(|name| Id::of(name).unwrap()).collect();
        let fit = Fit {
            effects: effects.clone(),
            curve: None,
            free: Vec::new(),
            of_file: 0,
            coordinates: Vec::new(),
            starts: Vec::new(),
            cost: 0.0,
            covariance: DMatrix::zeros(0, 0),
        };
        let errors = vec![(READINGS * mean_square, READINGS); 100];
        let evaluation = Evaluation { rolled: Vec::new(), errors, starts: Vec::new() };
        Candidate { effects, fit, evaluation, sized: true, sized_in_its_shape: true, refuted: false, in_full: true }
    }

    fn decide(baseline: f64, candidates: &[Candidate]) -> Decision {
        let bootstrap = Bootstrap::new(100, 1);
        let baseline = model(&[], baseline);
        Selection { noise: 1.0, baseline: &baseline, candidates, bootstrap: &bootstrap }.decide(true)
    }

    #[test]
    fn a_model_that_one_run_chooses_is_judged_by_the_other() {
        let on = |first: f64, second: f64| {
            let errors = (0..100).map(|i| (if i < 50 { first } else { second }, 1.0)).collect();
            let model = model(&["gravity_tilt"], 0.0);
            Candidate { evaluation: Evaluation { errors, ..model.evaluation.clone() }, ..model }
        };
        let baseline = model(&[], 9.0);
        // Each is lucky on one of the runs; the best on both is neither's choice.
        let candidates = [on(1.0, 2.0), on(2.0, 1.0), on(1.4, 1.4)];
        let bootstrap = Bootstrap::new(100, 1);
        let selection = Selection { noise: 1.0, baseline: &baseline, candidates: &candidates, bootstrap: &bootstrap };
        assert_eq!(selection.cross_judged(&candidates[2], &[0..50, 50..100]), 2.0);
        // A choice of one is no choice.
        let alone = Selection { candidates: &candidates[2..], ..selection };
        assert!((alone.cross_judged(&candidates[2], &[0..50, 50..100]) - 1.4).abs() < 1e-12);
    }

    #[test]
    fn a_rival_pair_stands_for_the_effect_that_it_replaces() {
        let candidates = [
            model(&["gravity_tilt"], 4.0),
            model(&["driver_drop", "gravity_tilt"], 1.0),
            model(&["driver_deadband", "gravity_tilt"], 1.001),
            model(&["driver_drop", "sensor_nonlinearity"], 1.002),
            model(&["battery_sag", "sensor_delay"], 1.003),
        ];
        let decision = decide(9.0, &candidates);
        assert_eq!((decision.verdict, decision.named()), (Verdict::Ambiguous, Some(1)));
        let also: Vec<Vec<&str>> =
            decision.also(&candidates).iter().map(|ids| ids.iter().map(|id| id.name()).collect()).collect();
        assert_eq!(also, [["driver_deadband"], ["sensor_nonlinearity"]]);
        // Nor is the pair that shares no effect forgotten.
        assert_eq!(decision.class.len(), 4);
    }

    #[test]
    fn the_best_is_named_but_not_for_what_it_contains() {
        let candidates =
            [model(&["stribeck_friction"], 1.0), model(&["coulomb_friction"], 1.001), model(&["sensor_delay"], 1.002)];
        let decision = decide(9.0, &candidates);
        let class: Vec<&str> = decision.class.iter().map(|&i| candidates[i].effects[0].name()).collect();
        assert_eq!(class, ["coulomb_friction", "sensor_delay"]);
    }

    #[test]
    fn a_rival_with_more_numbers_stays_where_the_runs_need_them_or_say_nothing_of_them() {
        let number = FitNumber::linear("one", "one", 1.0, 0.5, [0.0, 10.0]);
        let class = |moved_by: f64, left: f64| {
            let with = |mut one: Candidate, count: usize| {
                let free = |i: usize| {
                    let prior = if i == 0 { f64::INFINITY } else { 2.0 };
                    Free::of_effect(&FitNumber { prior, ..number.clone() }, 0)
                };
                one.fit.free = (0..count).map(free).collect();
                one.fit.coordinates = (0..count).map(|_| 0.5 + moved_by).collect();
                one
            };
            let candidates = [with(model(&["driver_drop"], 1.0), 1), with(model(&["driver_dead_time"], left), 3)];
            decide(9.0, &candidates).class
        };
        assert_eq!(class(1e-3, 1.0), [0, 1]);
        assert_eq!(class(0.1, 1.0), [0]);
        // Better by little, and beyond doubt.
        assert_eq!(class(0.1, 0.995), [1, 0]);
    }

    #[test]
    fn of_a_long_list_the_nearest_stay() {
        let class = |rivals: &[(&str, f64)]| {
            let candidates: Vec<Candidate> = rivals.iter().map(|(name, left)| model(&[name], *left)).collect();
            let class = decide(9.0, &candidates).class;
            class.iter().map(|&i| candidates[i].effects[0].name()).collect::<Vec<_>>()
        };
        // Beyond doubt behind, by too little to matter.
        let near = [("sensor_lag", 1.0), ("held_samples", 1.008), ("command_latency", 1.004), ("sensor_delay", 1.006)];
        assert_eq!(class(&near), ["sensor_lag", "command_latency", "sensor_delay"]);
        assert_eq!(class(&near[..2]), ["sensor_lag", "held_samples"]);
    }

    #[test]
    fn of_a_pair_the_nearest_stay_in_the_place_of_each_effect() {
        let pair = |late: &str, drag: &str, left: f64| model(&[late, drag], left);
        let candidates = [
            pair("sensor_lag", "cubic_drag", 1.0),
            pair("held_samples", "cubic_drag", 1.008),
            pair("command_latency", "cubic_drag", 1.004),
            pair("sensor_delay", "cubic_drag", 1.006),
            pair("sensor_lag", "quadratic_drag", 1.007),
            pair("command_latency", "quadratic_drag", 1.009),
            pair("held_samples", "quadratic_drag", 1.009),
        ];
        // Beyond doubt behind, by too little to matter; held samples are the fourth, and so nowhere.
        assert_eq!(decide(9.0, &candidates).class, [0, 2, 3, 4, 5]);
    }

    #[test]
    fn a_pair_that_does_no_better_than_one_of_its_effects_is_not_named_for_it() {
        // A trace that is too large for a single effect, and not for a pair.
        let named = |pair: f64| {
            let candidates = [model(&["load_friction"], 1.29), model(&["driver_deadband", "load_friction"], pair)];
            decide(11.0, &candidates).named()
        };
        assert_eq!(named(1.28), Some(0));
        assert_eq!(named(0.8), Some(1));
    }

    #[test]
    fn a_second_effect_leaves_open_what_the_first_left_open() {
        let candidates = [
            model(&["sensor_delay"], 1.2),
            model(&["sensor_lag"], 1.201),
            model(&["driver_drop", "sensor_delay"], 1.0),
            model(&["driver_drop", "sensor_lag"], 1.001),
            model(&["driver_drop", "gravity_tilt"], 1.001),
        ];
        let (bootstrap, baseline) = (Bootstrap::new(100, 1), model(&[], 3.0));
        let selection = Selection { noise: 1.0, baseline: &baseline, candidates: &candidates, bootstrap: &bootstrap };
        let single = selection.decide(true);
        assert_eq!(single.class, [0, 1]);
        assert_eq!(selection.with_second(&single).unwrap().class, [2, 3]);
    }

    #[test]
    fn all_that_is_left_of_a_large_misfit_is_a_second_effects_though_its_share_is_small() {
        let named = |single: f64, pair: f64| {
            let candidates = [model(&["driver_drop"], single), model(&["driver_drop", "stribeck_friction"], pair)];
            let (bootstrap, baseline) = (Bootstrap::new(100, 1), model(&[], 15.0));
            let selection =
                Selection { noise: 1.0, baseline: &baseline, candidates: &candidates, bootstrap: &bootstrap };
            selection.with_second(&selection.decide(true)).and_then(|decision| decision.named())
        };
        assert_eq!(named(1.27, 1.0), Some(1));
        // What a law that is richer than the library's leaves, another one does not take to the floor.
        assert_eq!(named(1.27, 1.06), None);
        // And so little needs no second effect.
        assert_eq!(named(1.2, 1.0), None);
    }

    #[test]
    fn what_short_runs_gain_by_chance_is_nothing() {
        let verdict = |readings: f64| {
            let of = |mut one: Candidate| {
                one.evaluation.errors.iter_mut().for_each(|error| *error = (error.0 / READINGS * readings, readings));
                one
            };
            let (baseline, candidates) = (of(model(&[], 1.01)), [of(model(&["backlash"], 1.0))]);
            let bootstrap = Bootstrap::new(100, 1);
            Selection { noise: 1.0, baseline: &baseline, candidates: &candidates, bootstrap: &bootstrap }
                .decide(true)
                .verdict
        };
        assert_eq!(verdict(9.0), Verdict::Nothing);
        assert_eq!(verdict(11.0), Verdict::Explained);
    }

    #[test]
    fn a_law_that_leaves_a_trace_does_not_rule_out_what_leaves_two() {
        let class = |second: f64| decide(9.0, &[model(&["backlash"], 1.1), model(&["shaft_compliance"], second)]).class;
        assert_eq!(class(1.19).len(), 2);
        assert_eq!(class(1.22).len(), 1);
    }

    #[test]
    fn a_pair_may_leave_a_trace_of_what_it_removes() {
        let verdict = |left: f64| decide(9.0, &[model(&["driver_drop", "gravity_tilt"], left)]).verdict;
        assert_eq!(verdict(1.3), Verdict::Explained);
        assert_eq!(verdict(1.42), Verdict::Unexplained);
    }

    #[test]
    fn a_pair_that_leaves_a_little_is_named_for_its_part_where_it_needs_both() {
        let pair = |left: f64| model(&["driver_dead_time", "battery_sag"], left);
        let named = |candidates: &[Candidate]| {
            let decision = decide(15.0, candidates);
            assert_eq!(decision.verdict, Verdict::Unexplained);
            decision.class.iter().map(|&i| candidates[i].effects.clone()).collect::<Vec<_>>()
        };
        let single = model(&["driver_drop"], 5.6);
        assert_eq!(named(&[single.clone(), pair(2.0)]), [pair(2.0).effects]);
        // Of one that leaves more, the best single effect.
        assert_eq!(named(&[single.clone(), pair(2.6)]), std::slice::from_ref(&single.effects));
        // Nor of one whose second effect takes away little beyond the first.
        let near = model(&["driver_drop"], 3.0);
        assert_eq!(named(&[near.clone(), pair(2.0)]), [near.effects]);
        // Of many what they have in common.
        let others = ["sensor_delay", "sensor_lag", "command_latency", "shaft_compliance"];
        let mut many: Vec<Candidate> = others.iter().map(|other| model(&["winding_heating", other], 2.0)).collect();
        many.push(model(&["winding_heating"], 6.0));
        assert_eq!(named(&many), [many[4].effects.clone()]);
        // Nor what was taken back for what it leaves.
        many[4].refuted = true;
        assert!(named(&many).is_empty());
    }

    #[test]
    fn a_second_effect_that_takes_away_much_is_there_whatever_its_size() {
        let named = |single: f64| {
            let pair = model(&["torque_ripple", "grease_warming"], 1.0);
            let pair = Candidate { sized: false, ..pair };
            decide(3.2, &[model(&["torque_ripple"], single), pair]).named()
        };
        assert_eq!(named(1.8), Some(1));
        assert_ne!(named(1.4), Some(1));
    }

    #[test]
    fn what_leaves_most_of_a_small_misfit_explains_nothing() {
        assert_eq!(decide(1.147, &[model(&["sensor_delay"], 1.134)]).verdict, Verdict::Nothing);
        assert_eq!(decide(1.147, &[model(&["sensor_delay"], 1.03)]).verdict, Verdict::Explained);
        // Far enough above the floor that it must be said, and not explained either.
        assert_eq!(decide(1.24, &[model(&["sensor_delay"], 1.21)]).verdict, Verdict::Unexplained);
    }

    #[test]
    fn evidence_and_verdict_agree_on_what_reaches_the_floor() {
        // A pair must come nearer than a single effect.
        let far = 1.1f64.powi(2);
        let candidates = [model(&["driver_drop", "gravity_tilt"], far)];
        assert_eq!(decide(1.5, &candidates).verdict, Verdict::Unexplained);
        let candidates = [model(&["driver_drop"], far)];
        assert_eq!(decide(1.5, &candidates).verdict, Verdict::Explained);
    }
}
