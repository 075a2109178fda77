//! The verdict and its evidence in words.

use effects::{Id, Scale};

use super::search::Candidate;
use super::selection::Selection;
use super::verdict::{Diagnosis, Verdict};

/// What speaks for and against a model.
#[must_use]
pub fn evidence(selection: &Selection, model: &Candidate, named: Option<&Candidate>) -> (Vec<String>, Vec<String>) {
    let (mut speaks_for, mut against) = (Vec::new(), Vec::new());
    let ratio = selection.ratio(model);
    let [value, low, high] = selection.improvement(selection.baseline, model, 0.025).map(|share| 100.0 * share);
    if low > 0.0 && value >= 1.0 {
        speaks_for.push(format!("removes {value:.0} % ({low:.0} to {high:.0}) of the held-out error"));
    } else {
        against
            .push(format!("removes {value:.1} % ({low:.1} to {high:.1}) of the held-out error: nothing to speak of"));
    }
    if selection.reaches(model) {
        speaks_for.push(format!("reaches the noise floor ({ratio:.2} times)"));
    } else {
        against.push(format!("leaves {ratio:.2} times the noise floor"));
    }
    if let Some(named) = named {
        let [behind, low, _] = selection.improvement(model, named, 0.025).map(|share| 100.0 * share);
        if low > 0.0 && behind > 1.0 {
            against.push(format!("{} leaves {behind:.0} % less", list(&named.effects)));
        } else if named.effects != model.effects {
            speaks_for.push(format!("as good as {} on these runs", list(&named.effects)));
        }
    }
    for (i, free) in model.fit.free.iter().enumerate().skip(selection.baseline.fit.free.len()) {
        let at = model.fit.coordinates[i];
        if at <= free.coordinate(free.low) && matches!(free.scale, Scale::Linear(_)) {
            against.push(format!("its fit sets {} to the lower bound", free.words));
        } else if at >= free.coordinate(free.high) {
            against.push(format!("its fit drives {} into the upper bound", free.words));
        }
    }
    (speaks_for, against)
}

/// Names joined with "and".
#[must_use]
pub fn list(effects: &[Id]) -> String {
    effects.iter().map(|effect| effect.name()).collect::<Vec<_>>().join(" and ")
}

/// The experiment that tells the effects of a class apart, or that would show more of what is left.
#[must_use]
pub fn next_experiment(class: &[Id], left_over: Option<&str>) -> Option<String> {
    let text = if class.len() > 1 {
        telling_apart(class)
    } else {
        match left_over? {
            "angle_rad" => {
                "turn slowly at several constant speeds, both ways: what depends on the angle repeats every turn"
            }
            "speed_rad_per_s" => {
                "hold constant speeds across the range where the misfit lives, both ways, and coast through it"
            }
            "voltage_v" => "measure the voltage at the motor's terminals (column voltage_v) and repeat the runs",
            "current_a" => {
                "repeat the runs with the current measured (column current_a), and hold loads of several sizes"
            }
            "time_since_reversal_s" => "reverse again and again, after rests of 0.02 s to 5 s",
            "run" => "repeat those runs, once as they were and once in another order, and hold one of them out",
            "frequency_hz" => "hold constant speeds, and record once with the motor off: what stays is not the motor's",
            "time_s" => "repeat one run three times in a row, cold and warm, with temperature and supply recorded",
            _ => "repeat the runs with the current measured (column current_a)",
        }
    };
    Some(text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// The experiment for the first pair of a class that the catalogue knows to be mistaken for one another; else the one that
/// shows an effect of it best.
fn telling_apart(class: &[Id]) -> &'static str {
    let mut pairs = class.iter().flat_map(|id| id.spec().mistaken_for);
    let known = pairs.find(|other| class.iter().any(|id| id.name() == other.with));
    let best = || class.iter().find_map(|id| id.spec().experiment);
    known.map(|other| other.experiment).or_else(best).unwrap_or(
        "repeat the runs with other speeds and duties, and with stretches where the bridge is open (enable = 0)",
    )
}

/// Models by their effects, one after the other.
fn models(models: &[Vec<String>]) -> String {
    models.iter().map(|effects| effects.join(" and ")).collect::<Vec<_>>().join("; ")
}

/// The verdict in a few plain sentences.
#[must_use]
pub fn summary(diagnosis: &Diagnosis) -> Vec<String> {
    let degrees = |rad: f64| rad.to_degrees();
    let mut out = vec![format!(
        "Simulated freely for {:.2} s at a time, the model with refitted numbers is off by {:.3}° on runs it has not \
         seen; the angle reading itself scatters by {:.3}°.",
        diagnosis.detail.horizon_s,
        degrees(diagnosis.before),
        degrees(diagnosis.noise_floor)
    )];
    let causes: Vec<String> = diagnosis
        .causes
        .iter()
        .map(|cause| {
            if cause.also.is_empty() {
                cause.effect.clone()
            } else {
                format!("{} (or {})", cause.effect, cause.also.join(", "))
            }
        })
        .collect();
    let causes = causes.join(" and ");
    out.push(match diagnosis.verdict {
        Verdict::Nothing if diagnosis.remembers() => {
            "There is nothing to explain: what is left is alike in every rollout, whatever the shaft does. The reading's \
             noise is not white."
                .to_owned()
        }
        Verdict::Nothing if diagnosis.leaves_numbers_open() => {
            "There is nothing to explain: the held-out runs are missed by no more than the runs that were fitted leave the \
             numbers open. More of such runs to fit on would say more."
                .to_owned()
        }
        Verdict::Nothing => "There is nothing to explain: only numbers were wrong, not the model.".to_owned(),
        Verdict::Explained => {
            format!("The model lacks {causes}; with it the error is {:.3}°.", degrees(diagnosis.after))
        }
        Verdict::Ambiguous => format!(
            "The model lacks one of these, which these runs cannot tell apart: {}. With {} the error is {:.3}°.",
            models(&diagnosis.models),
            diagnosis.models.first().map_or_else(String::new, |model| model.join(" and ")),
            degrees(diagnosis.after)
        ),
        Verdict::Unexplained if causes.is_empty() => {
            "Something is missing that no effect of the library explains.".to_owned()
        }
        Verdict::Unexplained => format!(
            "{causes} {explain} a part (error {:.3}°), but something else is missing too.",
            degrees(diagnosis.after),
            explain = if diagnosis.causes.len() == 1 { "explains" } else { "explain" },
        ),
    });
    out.extend(diagnosis.rig_doubts.iter().map(|doubt| {
        let mend = doubt.mend.replace('\n', "; ");
        format!("The recordings may be of another rig than the file's: {}. What to change: {mend}.", doubt.reason)
    }));
    if let Some(left) = &diagnosis.left_over {
        out.push(format!("{:.0} % of what is left lies {}.", 100.0 * left.share, left.place()));
    }
    out
}
