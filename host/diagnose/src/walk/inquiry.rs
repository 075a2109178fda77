//! The course of a walk's diagnosis.

use effects::Id;
use hal_sim::random::{Source, Stream};
use identify::robot::{ConditionFit, RobotError, RobotFit, Table};
use rayon::prelude::*;
use robot_file::edit::Document;
use sweep::Measured;

use super::adequacy::Adequacy;
use super::evidence::{ALARM, CLASS, log10_mean_factor, probabilities};
use super::feet::feet;
use super::models::{Bench, FEW_STEPS, MANY_STEPS, Model, Screened};
use super::outcome::{Judged, WalkCause, WalkDiagnosis, WalkLimit, WalkModel};
use super::place::{places, pointed};
use super::{WalkOptions, words};
use crate::Verdict;

/// A fit goes on where its evidence lies no farther behind the best one's than this, in the logarithm, ...
const CLOSE: f64 = 7.0;
/// ... of so many at most.
const FINISHED: usize = 4;
/// A diagnosis simulates about so many sets for every number of the file's model.
const SETS_A_NUMBER: f64 = 70.0;

/// Models with one more effect than another.
struct Round {
    /// The most probable, best first.
    models: Vec<Judged>,
    /// Those that lie far behind.
    behind: Vec<Model>,
    /// The screens of all effects that were tried.
    screens: Vec<Screened>,
    /// Effects that there were to try.
    tried: usize,
}

/// From the refit of the file's model to the verdict.
pub fn run(document: &Document, measured: &Measured, options: &WalkOptions) -> Result<WalkDiagnosis, RobotError> {
    let run = options.run()?;
    let table = Table::new(measured, &options.held)?;
    let told = |simulated: usize| options.tell("simulating", (simulated as f64 / (13.0 * SETS_A_NUMBER)).min(0.99));
    let bench = Bench::new((document, &table), run, options.keep_in.clone(), &told);
    let mut draws = Stream::new(options.seed, Source::Variation);
    let base = bench.baseline(options.draws, &mut draws)?;
    let mut base = judged(&bench, base, &mut draws)?;
    let unfitted = bench.unfitted()?;
    let mut singles = round(&bench, &base.model, unfitted.as_ref(), &mut draws)?;
    base = revisited(&bench, base, &singles, &mut draws)?;
    let lost = |singles: &Round| !singles.models.first().is_some_and(|best| best.adequacy.holds());
    let raised = |singles: &Round, base: &Judged| singles.raise(base.model.evidence) >= ALARM;
    if lost(&singles) && (raised(&singles, &base) || !base.adequacy.holds()) {
        singles = widened(&bench, singles, options, &mut draws)?;
        base = revisited(&bench, base, &singles, &mut draws)?;
    }
    let mut pairs = None;
    if raised(&singles, &base) && singles.models.first().is_some_and(|best| !best.adequacy.holds()) {
        let best = singles.models.remove(0);
        let found = round(&bench, &best.model, None, &mut draws)?;
        let single = match found.models.first() {
            Some(pair) => bench.restart(best.model, &pair.model)?,
            None => best.model,
        };
        singles.models.insert(0, judged(&bench, single, &mut draws)?);
        pairs = Some(found);
    }
    let raised = singles.raise(base.model.evidence);
    options.tell("done", 1.0);
    write_down(&bench, base, singles, pairs, raised)
}

/// The file's model, also from where its best extension ended: a valley that an effect has shown may be the file's as well.
fn revisited(bench: &Bench<'_>, base: Judged, singles: &Round, draws: &mut Stream) -> Result<Judged, RobotError> {
    let Some(best) = singles.models.first() else { return Ok(base) };
    judged(bench, bench.restart(base.model, &best.model)?, draws)
}

/// Models with one effect more, fitted from where a model is, and from another start where there is one.
fn round(
    bench: &Bench<'_>,
    base: &Model,
    other_start: Option<&Model>,
    draws: &mut Stream,
) -> Result<Round, RobotError> {
    let robot = bench.document.robot().map_err(|error| RobotError::CannotRun(error.to_string()))?;
    let there = |id: &Id| base.effects.contains(id) || robot.effects.listed().any(|listed| listed == *id);
    let new = |id: &Id| id.spec().acts.on_the_ground() && id.spec().candidate && !there(id);
    let new: Vec<Id> = Id::all().filter(new).collect();
    let fitted = |start: &Model, effect: Id| -> Result<Option<(Screened, Option<Model>)>, RobotError> {
        let Some(screen) = bench.screen(start, effect)? else { return Ok(None) };
        let model = bench.refit(start, &screen)?;
        Ok(Some((screen, model)))
    };
    let one = |effect: &Id| -> Result<(Option<Screened>, Option<Model>), RobotError> {
        let (screen, mut best) = fitted(base, *effect)?.unzip();
        if let Some(start) = other_start {
            let other = fitted(start, *effect)?.and_then(|(_, model)| model);
            best = best.into_iter().chain([other]).max_by(|a, b| rank(a).total_cmp(&rank(b)));
        }
        Ok((screen, best.flatten()))
    };
    let found: Vec<_> = new.par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
    let (screens, fitted): (Vec<Option<Screened>>, Vec<Option<Model>>) = found.into_iter().unzip();
    let (screens, fitted) = (screens.into_iter().flatten().collect(), fitted.into_iter().flatten().collect());
    ended(bench, fitted, draws, (screens, new.len()))
}

/// The same effects, each searched for over all that is believed of it and of the numbers: where no fit from a known point leads to the
/// speeds, one may have gone into another valley.
fn widened(bench: &Bench<'_>, found: Round, options: &WalkOptions, draws: &mut Stream) -> Result<Round, RobotError> {
    let Round { models, behind, screens, tried } = found;
    let known = models.into_iter().map(|judged| judged.model).chain(behind);
    let wider = |model: Model| -> Result<Model, RobotError> {
        let searched = bench.search(model.effects.clone(), options.draws, options.seed)?;
        Ok(searched.filter(|other| other.evidence > model.evidence).unwrap_or(model))
    };
    let fitted = known.collect::<Vec<_>>().into_par_iter().map(wider).collect::<Result<Vec<_>, _>>()?;
    ended(bench, fitted, draws, (screens, tried))
}

/// A round from its fits.
fn ended(
    bench: &Bench<'_>,
    fitted: Vec<Model>,
    draws: &mut Stream,
    (screens, tried): (Vec<Screened>, usize),
) -> Result<Round, RobotError> {
    let (close, behind) = finished(bench, fitted)?;
    let mut models = Vec::new();
    for model in close {
        models.push(judged(bench, model, draws)?);
    }
    models.sort_by(|a, b| b.model.evidence.total_cmp(&a.model.evidence));
    Ok(Round { models, behind, screens, tried })
}

/// What a fit is worth, if there is one.
fn rank(model: &Option<Model>) -> f64 {
    model.as_ref().map_or(f64::NEG_INFINITY, |model| model.evidence)
}

/// The most probable of some fits at their ends, and those that lie far behind.
fn finished(bench: &Bench<'_>, fitted: Vec<Model>) -> Result<(Vec<Model>, Vec<Model>), RobotError> {
    let (mut close, mut behind) = (fitted, Vec::new());
    for steps in [FEW_STEPS, MANY_STEPS] {
        close.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        let best = close.first().map_or(f64::NEG_INFINITY, |model| model.evidence);
        let count = close.iter().take(FINISHED).take_while(|model| model.evidence > best - CLOSE).count();
        // Those that fall back later lie closer than those that did before.
        behind.splice(0..0, close.split_off(count));
        close = close.into_par_iter().map(|model| bench.go_on(model, steps)).collect::<Result<_, _>>()?;
    }
    Ok((close, behind))
}

impl Round {
    fn evidence(&self) -> Vec<f64> {
        self.models.iter().map(|one| &one.model).chain(&self.behind).map(|model| model.evidence).collect()
    }

    /// log₁₀ of the mean factor by which they raise a model's evidence.
    fn raise(&self, base: f64) -> f64 {
        log10_mean_factor(base, &self.evidence(), self.tried)
    }

    /// How many of the most probable are needed to hold the right one, and the probabilities of all.
    fn class(&self) -> (usize, Vec<f64>) {
        let shares = probabilities(&self.evidence());
        let mut sum = 0.0;
        let within = shares.iter().take(self.models.len()).take_while(|share| {
            let before = sum;
            sum += **share;
            before < CLASS
        });
        (within.count(), shares)
    }
}

fn judged(bench: &Bench<'_>, model: Model, draws: &mut Stream) -> Result<Judged, RobotError> {
    let (adequacy, fit) = bench.with(&model.numbers, |posterior| {
        let adequacy = Adequacy::of(posterior, &model.minimum, draws)?;
        Ok((adequacy, RobotFit::new(posterior, &model.minimum, (&[], &[]))?))
    })?;
    Ok(Judged { model, adequacy, fit })
}

fn write_down(
    bench: &Bench<'_>,
    base: Judged,
    singles: Round,
    pairs: Option<Round>,
    raised: f64,
) -> Result<WalkDiagnosis, RobotError> {
    let evidence = base.model.evidence;
    let alarm = raised >= ALARM;
    // A pair is named where its second effect stands by itself as a single one must.
    let first = singles.models.first();
    let best = first.map_or(evidence, |single| single.model.evidence);
    let pair_counts = pairs.as_ref().is_some_and(|pairs| {
        pairs.raise(best) >= ALARM && pairs.models.first().is_some_and(|pair| pair.adequacy.holds())
    });
    let chosen = if pair_counts { pairs.as_ref() } else { Some(&singles) };
    let named = chosen.and_then(|round| round.models.first()).filter(|model| alarm && model.adequacy.holds());
    let class = chosen.map_or(0, |round| round.class().0);
    let verdict = match named {
        Some(_) if class == 1 => Verdict::Explained,
        Some(_) => Verdict::Ambiguous,
        None if alarm || !base.adequacy.holds() => Verdict::Unexplained,
        None => Verdict::Nothing,
    };
    let causes = match (named, chosen) {
        (Some(named), Some(round)) => causes(named, &round.models[1..class.max(1)]),
        _ => Vec::new(),
    };
    let mut models = vec![base.listed(evidence, 1.0)];
    for round in [Some(&singles), pairs.as_ref()].into_iter().flatten() {
        let (_, shares) = round.class();
        models.extend(round.models.iter().zip(&shares).map(|(model, share)| model.listed(evidence, *share)));
        let behind = round.behind.iter().zip(&shares[round.models.len()..]);
        models.extend(behind.map(|(model, share)| WalkModel::of(model, evidence, *share)));
    }
    let shown = named.unwrap_or(&base);
    let conditions = beside(&base.fit.conditions, &shown.fit.conditions);
    let speeds: Vec<f64> = base.fit.conditions.iter().flat_map(|one| one.after).collect();
    let places = places(bench.table, &speeds);
    let wrong = verdict != Verdict::Nothing;
    let named_effects = shown.names();
    let limits = singles.screens.iter().filter(|one| !named_effects.contains(&one.effect.name().to_owned()));
    let mut diagnosis = WalkDiagnosis {
        verdict,
        causes,
        log10_evidence_against_nothing: raised,
        models,
        before: base.errors(),
        after: shown.errors(),
        scatter: [0, 1, 2]
            .map(|part| bench.table.scatter_of_mean(part).map(|scatter| scatter / bench.table.largest[part])),
        place: pointed(&places).filter(|_| wrong).cloned(),
        places,
        feet: feet(&singles.screens, base.adequacy.misfit),
        limits: limits
            .map(|one| WalkLimit { effect: one.effect.name().to_owned(), largest: one.largest.clone() })
            .collect(),
        conditions,
        parameters: shown.fit.parameters.clone(),
        simulated: bench.simulated(),
        summary: Vec::new(),
        kept: bench.kept(),
        document: shown.fit.document.clone(),
    };
    diagnosis.summary = words::summary(&diagnosis);
    Ok(diagnosis)
}

/// The effects of a model; those of the others that may take their place stand beside the last of them.
fn causes(named: &Judged, others: &[Judged]) -> Vec<WalkCause> {
    let own = &named.model.effects;
    let also: Vec<String> = others
        .iter()
        .flat_map(|other| other.model.effects.iter().filter(|id| !own.contains(id)).map(|id| id.name().to_owned()))
        .collect();
    let last = own.len().saturating_sub(1);
    let one = |(place, id): (usize, &Id)| named.cause(*id, if place == last { also.clone() } else { Vec::new() });
    own.iter().enumerate().map(one).collect()
}

/// Every condition with the refitted numbers before and the shown model after.
fn beside(before: &[ConditionFit], after: &[ConditionFit]) -> Vec<ConditionFit> {
    let one = |(before, after): (&ConditionFit, &ConditionFit)| ConditionFit { before: before.after, ..after.clone() };
    before.iter().zip(after).map(one).collect()
}
