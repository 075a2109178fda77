//! Whether a diagnosis of a walk is right, and how many are.

use diagnose::Verdict;
use diagnose::walk::WalkDiagnosis;
use identify::robot::Parameter;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::tables::REPEATS;
use super::truth::{Hidden, Truth};
use super::visible::shows;
use crate::row::FigureRow;

/// What came of a robot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// Its number.
    pub number: u64,
    /// What was hidden: `nothing`, an effect, or `outside: …`.
    pub hidden: String,
    /// Of an effect, how much of it the file's numbers cannot stand for: see [`shows`].
    pub shows: Option<f64>,
    /// What was said.
    pub verdict: Verdict,
    /// How many effects are named together.
    pub named: usize,
    /// The named effects and those that may take their place.
    pub class: Vec<String>,
    /// What the shown model leaves of the fitted means, in units of what they are known to.
    pub misfit: f64,
    /// Of the held-out conditions after over how far repeats scatter: root mean square of the three speeds.
    pub after_over_scatter: f64,
    /// The same over what repeats make of a mean.
    pub after_over_mean: f64,
    /// Root mean square at ±6 Hz over that at ±8 Hz of what the model leaves, before and after.
    pub slow_over_fast: [f64; 2],
    /// Of the file's numbers, which were drawn: how many lie in their 90 % intervals, and how many there are.
    pub within: [usize; 2],
    /// The same of those that the speeds tell.
    pub told_within: [usize; 2],
    /// Sets of numbers simulated.
    pub simulated: usize,
    /// How long it took, s.
    pub seconds: f64,
}

/// The median of fewer robots is shown and not judged.
const FEW: usize = 10;
/// Names that a class may have to be an answer.
const MOST_NAMES: usize = 3;
/// An effect that shows less ([`Outcome::shows`]) may be passed over: it is no farther off than five deviations of one mean.
const SHOWS: f64 = 25.0;

impl Outcome {
    /// Of a diagnosis.
    #[must_use]
    pub fn new(truth: &Truth, found: &WalkDiagnosis, seconds: f64) -> Self {
        let hidden = match &truth.hidden {
            Hidden::Nothing => "nothing".to_owned(),
            Hidden::Effect(name) => (*name).to_owned(),
            Hidden::Outside(name) => format!("outside: {name}"),
        };
        let class = found.causes.iter().flat_map(|cause| std::iter::once(&cause.effect).chain(&cause.also));
        let shares: Vec<f64> = found
            .after
            .iter()
            .zip(&found.scatter)
            .filter_map(|(after, scatter)| Some((*after)? / (*scatter)?))
            .collect();
        let after_over_mean = root_mean_square(&shares);
        let drawn = truth.numbers();
        Self {
            number: truth.number,
            hidden,
            shows: matches!(truth.hidden, Hidden::Effect(_)).then(|| shows(truth)).flatten(),
            verdict: found.verdict,
            named: found.causes.len(),
            class: class.cloned().collect(),
            misfit: shown_misfit(found),
            after_over_scatter: after_over_mean / (REPEATS as f64).sqrt(),
            after_over_mean,
            slow_over_fast: slow_over_fast(found),
            within: within(&found.parameters, &drawn, |_| true),
            told_within: within(&found.parameters, &drawn, |one| one.told),
            simulated: found.simulated,
            seconds,
        }
    }

    /// Whether it is what should have been said.
    #[must_use]
    pub fn right(&self) -> bool {
        match self.hidden.as_str() {
            "nothing" => self.verdict == Verdict::Nothing,
            outside if outside.starts_with("outside") => self.verdict == Verdict::Unexplained,
            // A second effect beside the hidden one is a false name.
            effect => self.named == 1 && self.class.len() <= MOST_NAMES && self.class.iter().any(|name| name == effect),
        }
    }

    /// What was named, for people: effects of a pair, or those of which one is meant.
    fn names(&self) -> String {
        self.class.join(if self.named > 1 { " with " } else { " or " })
    }

    /// How much of an effect shows, for people.
    fn shown(&self) -> String {
        self.shows.map(|shows| format!("shows {shows:.0}, ")).unwrap_or_default()
    }

    /// For people.
    #[must_use]
    pub fn line(&self) -> String {
        format!(
            "{} {} {}: {} {} ({}misfit {:.2}, held out {:.2} of the repeats' scatter, {:.2} of their mean's, ±6 Hz over ±8 Hz {:.2} before, {:.2} after; {} sets, {:.0} s)",
            if self.right() { "ok  " } else { "MISS" },
            self.number,
            self.hidden,
            self.verdict.word(),
            self.names(),
            self.shown(),
            self.misfit,
            self.after_over_scatter,
            self.after_over_mean,
            self.slow_over_fast[0],
            self.slow_over_fast[1],
            self.simulated,
            self.seconds
        )
    }
}

/// Of the named model, or of the file's.
fn shown_misfit(found: &WalkDiagnosis) -> f64 {
    let named: Vec<&String> = found.causes.iter().map(|cause| &cause.effect).collect();
    let shown = found.models.iter().find(|model| model.effects.iter().collect::<Vec<_>>() == named);
    shown.and_then(|model| model.misfit).unwrap_or(f64::NAN)
}

/// How many of some numbers that were drawn lie in the intervals that were found, and how many these numbers are.
fn within(found: &[Parameter], drawn: &[(String, f64)], some: impl Fn(&Parameter) -> bool) -> [usize; 2] {
    let value = |one: &Parameter| drawn.iter().find(|(path, _)| *path == one.path).map(|(_, value)| *value);
    let judged: Vec<bool> = found
        .iter()
        .filter(|one| some(one))
        .filter_map(|one| value(one).map(|value| (one.low..=one.high).contains(&value)))
        .collect();
    [judged.iter().filter(|within| **within).count(), judged.len()]
}

/// How far the model is off at the lowest frequency against the highest, before and after.
fn slow_over_fast(found: &WalkDiagnosis) -> [f64; 2] {
    let largest = [0, 1, 2].map(|part| {
        found.conditions.iter().filter_map(|one| one.measured[part]).fold(0.0, |top: f64, x| top.max(x.abs()))
    });
    [false, true].map(|after| {
        let off = |hz: f64| {
            let there = found.conditions.iter().filter(|one| one.f_hz.abs() == hz);
            let all: Vec<f64> = there
                .flat_map(|one| {
                    let simulated = if after { one.after } else { one.before };
                    (0..3).filter_map(move |part| Some((simulated[part] - one.measured[part]?) / largest[part]))
                })
                .collect();
            root_mean_square(&all)
        };
        off(6.0) / off(8.0)
    })
}

fn root_mean_square(all: &[f64]) -> f64 {
    (all.iter().map(|x| x * x).sum::<f64>() / all.len().max(1) as f64).sqrt()
}

/// The rows of a campaign: 26 of 30 effects, 1 alarm of 15, 7 of 8 unexplained, as shares of what was run.
#[must_use]
pub fn rows(outcomes: &[Outcome]) -> Vec<FigureRow> {
    let of = |kind: &str| -> Vec<&Outcome> {
        let is = |one: &&Outcome| match kind {
            "nothing" => one.hidden == "nothing",
            "outside" => one.hidden.starts_with("outside"),
            _ => one.hidden != "nothing" && !one.hidden.starts_with("outside"),
        };
        outcomes.iter().filter(is).collect()
    };
    let counted = |what: &str, kind: &str, allowed: &dyn Fn(usize) -> usize| {
        let some = of(kind);
        let right = some.iter().filter(|one| one.right()).count();
        let alone = some.iter().filter(|one| one.right() && one.class.len() == 1).count();
        let least = some.len() - allowed(some.len());
        let missed: Vec<String> = some
            .iter()
            .filter(|one| !one.right())
            .map(|one| {
                let Outcome { number, hidden, .. } = one;
                let said = format!("{} {}", one.verdict.word(), one.names());
                format!("{number} {hidden}: {}{}", one.shown(), said.trim_end())
            })
            .collect();
        let told = if missed.is_empty() { String::new() } else { format!("; missed: {}", missed.join("; ")) };
        let alone = if kind == "effect" { format!(", {alone} of them alone") } else { String::new() };
        (!some.is_empty()).then(|| {
            FigureRow::new(
                what,
                &format!("{least} of {}", some.len()),
                format!("{right} of {}{alone}{told}", some.len()),
                right >= least,
                json!({ "right": right, "of": some.len() }),
            )
        })
    };
    let mut rows: Vec<FigureRow> = [
        counted("walks with an effect of the catalogue: named, or in a class of three at most", "effect", &|n| {
            n * 4 / 30
        }),
        counted("walks of robots that lack nothing: nothing is said", "nothing", &|n| n / 15),
        counted("walks with something that the catalogue has not: unexplained", "outside", &|n| n / 8),
    ]
    .into_iter()
    .flatten()
    .collect();
    rows.extend(of_those_that_show(&of("effect")));
    let median_of = |of_one: fn(&Outcome) -> f64| {
        let mut named: Vec<f64> = of("effect").iter().filter(|one| one.right()).map(|one| of_one(one)).collect();
        Some((common::median(&mut named)?, named))
    };
    let scatter = median_of(|one| one.after_over_scatter);
    if let Some(((median, named), (of_mean, _))) = scatter.zip(median_of(|one| one.after_over_mean)) {
        let what = "of those named right: held-out error after over the repeats' scatter, median";
        let told = format!("{median:.2} of {}; over what they make of a mean {of_mean:.2}", named.len());
        rows.push(if named.len() < FEW {
            FigureRow::beside(what, told, json!(median))
        } else {
            FigureRow::new(what, "1.25", told, median <= 1.25, json!(median))
        });
    }
    rows.extend(covered(outcomes));
    let mut seconds: Vec<f64> = outcomes.iter().map(|one| one.seconds).collect();
    if let Some(median) = common::median(&mut seconds) {
        let most = seconds.iter().copied().fold(0.0, f64::max);
        rows.push(FigureRow::beside(
            "time a robot",
            format!("median {median:.0} s, longest {most:.0} s"),
            json!({ "median_s": median, "longest_s": most }),
        ));
    }
    rows
}

/// How many of those effects are named that the file's numbers cannot stand for.
fn of_those_that_show(effects: &[&Outcome]) -> Option<FigureRow> {
    // An outcome of a journal from before has none.
    let known = effects.iter().filter_map(|one| Some((one.shows?, one.right())));
    let (showing, others): (Vec<_>, Vec<_>) = known.partition(|(shows, _)| *shows >= SHOWS);
    let named = |some: &[(f64, bool)]| some.iter().filter(|(_, right)| *right).count();
    let (right, of) = (named(&showing), showing.len());
    let what = format!(
        "of the effects those that show: without one the sum of squares stays {SHOWS} higher or more, whatever the file's numbers"
    );
    let measured = format!("{right} of {of} named, of the others {} of {}", named(&others), others.len());
    (of > 0).then(|| FigureRow::beside(&what, measured, json!({ "right": right, "of": of })))
}

/// How often intervals hold the file's numbers, where the model is the right one.
fn covered(outcomes: &[Outcome]) -> Option<FigureRow> {
    let right: Vec<&Outcome> =
        outcomes.iter().filter(|one| one.right() && !one.hidden.starts_with("outside")).collect();
    let sum = |of: fn(&Outcome) -> [usize; 2]| {
        right.iter().map(|one| of(one)).fold([0, 0], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
    };
    let ([within, all], [told_within, told]) = (sum(|one| one.within), sum(|one| one.told_within));
    let what = "of those named right or lacking nothing: the file's numbers in their 90 % intervals";
    let measured = format!("{within} of {all}; of those that the speeds tell {told_within} of {told}");
    let numbers = json!({ "within": within, "of": all, "told_within": told_within, "told": told });
    let share = within as f64 / all.max(1) as f64;
    match right.len() {
        0 => None,
        few if few < FEW => Some(FigureRow::beside(what, measured, numbers)),
        _ => Some(FigureRow::new(what, "85 to 95 %", measured, (0.85..=0.95).contains(&share), numbers)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walks::truths;

    #[test]
    fn drawn_numbers_are_counted_in_the_intervals_that_were_found() {
        let drawn = truths(1, 0, 1, 0)[0].numbers();
        assert!(drawn.len() == 13 && drawn.iter().all(|(path, _)| !path.contains("servo")), "{drawn:?}");
        let found = |share: f64, told: bool| -> Vec<Parameter> {
            let interval = |path: &String, value: f64| Parameter {
                path: path.clone(),
                value,
                low: 0.99 * value,
                high: 1.01 * value,
                file: value,
                left: 0.5,
                told,
            };
            drawn.iter().map(|(path, value)| interval(path, share * value)).collect()
        };
        let found = [found(1.0, true).split_off(1), found(1.1, false).split_off(11)].concat();
        assert_eq!(within(&found, &drawn, |_| true), [12, 14]);
        assert_eq!(within(&found, &drawn, |one| one.told), [12, 12]);
        // What was not drawn has no truth.
        let servo = Parameter { path: "eccentric.servo_nm_per_rad".into(), ..found[0].clone() };
        assert_eq!(within(&[servo], &drawn, |_| true), [0, 0]);
    }
}
