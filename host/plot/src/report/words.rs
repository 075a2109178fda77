//! Names, units and sentences for people.

use diagnose::{Diagnosis, LeftOver, Verdict};
use effects::Id;

use super::svg::number;

/// An effect's name for people and what it does, in one clause.
#[must_use]
pub(super) fn effect(name: &str) -> (String, &'static str) {
    match Id::of(name) {
        Some(id) => (id.spec().title.to_owned(), id.spec().clause),
        None => (name.replace('_', " "), ""),
    }
}

/// A text with the effects' names as people write them.
#[must_use]
pub(super) fn readable(text: &str) -> String {
    // The longest first: `foot_load_friction` has `load_friction` in it.
    let mut names: Vec<&str> = Id::all().map(Id::name).collect();
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    names.into_iter().fold(text.to_owned(), |text, name| text.replace(name, &effect(name).0))
}

/// What was compared and what came out, in one paragraph.
#[must_use]
pub(super) fn lead(diagnosis: &Diagnosis) -> String {
    let floor = diagnosis.noise_floor.max(f64::MIN_POSITIVE);
    let mut text = format!(
        "Simulated freely for {} s at a time on runs that no fit has seen, the model with refitted numbers is off by {}: \
         {} times the scatter of the angle reading ({}).",
        three(diagnosis.detail.horizon_s),
        degrees(diagnosis.before),
        three(diagnosis.before / floor),
        degrees(diagnosis.noise_floor)
    );
    if !diagnosis.causes.is_empty() {
        let after = format!(
            " With the cause in the model it is off by {}, {} times.",
            degrees(diagnosis.after),
            three(diagnosis.after / floor)
        );
        text.push_str(&after);
    }
    text
}

/// Names of effects in a sentence: "a", "a and b", "a, b and c".
#[must_use]
pub(super) fn join(names: &[String], word: &str) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [front @ .., last] => format!("{} {word} {last}", front.join(", ")),
    }
}

/// First letter in capitals.
#[must_use]
pub(super) fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Whole percent, but never a rounded-up 100.
#[must_use]
pub(super) fn percent(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let rounded = if (99.0..100.0).contains(&value) { (value * 10.0).floor() / 10.0 } else { value.round() };
    number(rounded)
}

/// An angle in rad as degrees, with three significant digits.
#[must_use]
pub(super) fn degrees(rad: f64) -> String {
    format!("{}°", three(rad.to_degrees()))
}

/// Three significant digits.
#[must_use]
pub(super) fn three(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return number(value);
    }
    let scale = 10f64.powi(2 - value.abs().log10().floor() as i32);
    number((value * scale).round() / scale)
}

/// How often the floor fits in, e.g. `4.4×`.
#[must_use]
pub(super) fn times(value: f64) -> String {
    if value.is_finite() { format!("{value:.2}×") } else { "–".into() }
}

/// A coordinate of the misfit: axis label and factor from SI.
#[must_use]
pub(super) fn coordinate(name: &str) -> (&'static str, &'static str, f64) {
    match name {
        "angle_rad" => ("shaft angle", "°", 180.0 / std::f64::consts::PI),
        "speed_rad_per_s" => ("shaft speed", "turns/s", 1.0 / std::f64::consts::TAU),
        "voltage_v" => ("commanded voltage", "V", 1.0),
        "current_a" => ("motor current", "A", 1.0),
        "time_s" => ("time in the run", "s", 1.0),
        "time_in_rollout_s" => ("time since the rollout began", "ms", 1e3),
        _ => ("", "", 1.0),
    }
}

/// The verdict as a headline.
#[must_use]
pub(super) fn headline(diagnosis: &Diagnosis) -> String {
    let share = percent(diagnosis.gain.percent_of_excess_removed);
    let named: Vec<String> = diagnosis
        .causes
        .iter()
        .map(|cause| {
            let class: Vec<String> =
                std::iter::once(&cause.effect).chain(&cause.also).map(|name| effect(name).0).collect();
            join(&class, "or")
        })
        .collect();
    let names = sentence(&join(&named, "and"));
    let verb = if diagnosis.causes.len() > 1 { "explain" } else { "explains" };
    match diagnosis.verdict {
        Verdict::Nothing => {
            "Nothing to explain: with its numbers refitted, the simulation is as good as the sensor.".into()
        }
        Verdict::Explained => format!("{names} {verb} {share} % of what the simulation gets wrong."),
        Verdict::Ambiguous => {
            let model =
                |effects: &Vec<String>| join(&effects.iter().map(|name| effect(name).0).collect::<Vec<_>>(), "and");
            let models = sentence(&join(&diagnosis.models.iter().map(model).collect::<Vec<_>>(), "or"));
            format!("{models} {verb} {share} % of what the simulation gets wrong; these runs cannot tell which.")
        }
        Verdict::Unexplained if names.is_empty() => {
            "The simulation misses something that no known effect explains.".into()
        }
        Verdict::Unexplained => {
            format!("{names} {verb} {share} % of what the simulation gets wrong; something else is missing too.")
        }
    }
}

/// Word on the badge.
#[must_use]
pub(super) fn badge(verdict: Verdict) -> (&'static str, &'static str) {
    match verdict {
        Verdict::Nothing => ("nothing to explain", "good"),
        Verdict::Explained => ("explained", "good"),
        Verdict::Ambiguous => ("ambiguous", "warn"),
        Verdict::Unexplained => ("unexplained", "bad"),
    }
}

/// Where the rest lives, as a sentence.
#[must_use]
pub(super) fn left_over(left: &LeftOver) -> String {
    let (label, unit, factor) = coordinate(&left.coordinate);
    let label = if label.is_empty() { left.coordinate.as_str() } else { label };
    format!(
        "{} % of what is left above the noise lies at a {label} of {} to {} {unit}.",
        percent(100.0 * left.share),
        three(left.from * factor),
        three(left.to * factor)
    )
}
