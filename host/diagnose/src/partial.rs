//! Names for a part of a misfit that no model explains.

use effects::Id;

use super::search::Candidate;
use super::selection::{Decision, PAYS, Selection, removed};
use super::verdict::Verdict;

/// A cause that does not reach the floor is still named if it removes this share of the held-out error: half of its
/// mean square.
const SUBSTANTIAL: f64 = 0.29;
/// Over all rollouts, the few that are worst included, it must still remove this share.
const LEAST_OVERALL: f64 = 0.15;
/// A part of a misfit that so many effects could explain is named after none of them.
const MOST_FOR_A_PART: usize = 3;
/// Share of the rollouts that a trimmed comparison leaves out.
const TRIMMED: f64 = 0.05;
/// A pair that does not reach the floor is still named if it removes this share of the nominal model's excess over it (mean square).
pub(super) const NEARLY_ALL: f64 = 0.9;

impl Selection<'_> {
    /// Causes for a part of the misfit, one or two, where they clearly lead.
    pub(super) fn partial(&self) -> Option<Decision> {
        self.part_by_pair().or_else(|| self.part_by_one())
    }

    /// One effect that removes a substantial share, with the rivals that remove half as much and are not clearly behind it.
    fn part_by_one(&self) -> Option<Decision> {
        let (single, best) = self.leading(1)?;
        let all = self.improvement(self.baseline, &self.candidates[best], 0.025)[0];
        let [value, low, _] = self.trimmed(self.baseline, &self.candidates[best]);
        if all < LEAST_OVERALL || value < SUBSTANTIAL || low < 0.5 * SUBSTANTIAL {
            return None;
        }
        let part = self.among(&self.rivals_of(best, &single), Verdict::Unexplained);
        (part.class.len() <= MOST_FOR_A_PART).then_some(part)
    }

    /// A pair that removes nearly all and needs both its effects, with those that are not clearly behind it; of too many, the effect that
    /// they have in common.
    fn part_by_pair(&self) -> Option<Decision> {
        let (pairs, best) = self.leading(2)?;
        let pair = &self.candidates[best];
        if removed(self.noise, self.baseline, pair) < NEARLY_ALL || !self.needs_both(pair) {
            return None;
        }
        let part = self.among(&self.rivals_of(best, &pairs), Verdict::Unexplained);
        if part.class.len() <= MOST_FOR_A_PART {
            return Some(part);
        }
        let in_all = |effect: &&Id| part.class.iter().all(|&i| self.candidates[i].effects.contains(effect));
        let common = pair.effects.iter().find(in_all)?;
        let alone = |one: &Candidate| one.effects == [*common] && self.is_sized(one) && !self.is_out(one);
        let place = self.candidates.iter().position(alone)?;
        Some(Decision { class: vec![place], ..part })
    }

    /// The models of so many effects, and the best of them if it is one to name.
    fn leading(&self, effects: usize) -> Option<(Vec<usize>, usize)> {
        let models: Vec<usize> =
            (0..self.candidates.len()).filter(|&i| self.candidates[i].effects.len() == effects).collect();
        let best = self.best_of(&models)?;
        let model = &self.candidates[best];
        let astray = model.fit.at_bounds() > 0 || model.fit.strayed();
        (!astray && !self.is_out(model) && self.is_sized(model)).then_some((models, best))
    }

    /// Of some models the best, and those that remove half as much and are not clearly behind it.
    fn rivals_of(&self, best: usize, models: &[usize]) -> Vec<usize> {
        let value = self.trimmed(self.baseline, &self.candidates[best])[0];
        let is_rival = |rival: &Candidate| {
            let [behind, low, _] = self.trimmed(rival, &self.candidates[best]);
            self.trimmed(self.baseline, rival)[0] > 0.5 * value && !(behind > PAYS && low > 0.0)
        };
        let stands = |i: &usize| {
            let model = &self.candidates[*i];
            *i == best || (!self.is_out(model) && is_rival(model))
        };
        models.iter().copied().filter(stands).collect()
    }

    /// [`Self::improvement`] without the rollouts that are worst in either model: where a model is wrong in something
    /// else too, a single one of them can outweigh all others.
    fn trimmed(&self, from: &Candidate, to: &Candidate) -> [f64; 3] {
        let worst = |i: usize| {
            let per = |candidate: &Candidate| candidate.evaluation.errors[i].0 / candidate.evaluation.errors[i].1;
            per(from).max(per(to))
        };
        let mut order: Vec<usize> = (0..from.evaluation.errors.len()).collect();
        order.sort_by(|&a, &b| worst(b).total_cmp(&worst(a)));
        order.truncate((order.len() as f64 * TRIMMED).ceil() as usize);
        let without = |candidate: &Candidate| {
            let mut candidate = candidate.clone();
            for &i in &order {
                candidate.evaluation.errors[i] = (0.0, 0.0);
            }
            candidate
        };
        self.improvement(&without(from), &without(to), 0.025)
    }
}
