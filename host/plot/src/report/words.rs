//! Names, units and sentences for people.

use diagnose::{Diagnosis, LeftOver, TermKind, Verdict};
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

/// A text with the effects' names as people write them, and the minus of numbers as in the tables.
#[must_use]
pub(super) fn readable(text: &str) -> String {
    let text = typographic(text);
    // The longest first: `foot_load_friction` has `load_friction` in it.
    let mut names: Vec<&str> = Id::all().map(Id::name).collect();
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    names.into_iter().fold(text, |text, name| text.replace(name, &effect(name).0))
}

/// A minus before a number in place of its hyphen; none before a zero.
fn typographic(text: &str) -> String {
    let signed = |word: &str| {
        let (open, number) = word.strip_prefix('(').map_or(("", word), |rest| ("(", rest));
        let digits = number.strip_prefix('-').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))?;
        let zero = digits.chars().all(|c| matches!(c, '0' | '.'));
        Some(format!("{open}{}{digits}", if zero { "" } else { "−" }))
    };
    let words: Vec<String> = text.split(' ').map(|word| signed(word).unwrap_or_else(|| word.to_owned())).collect();
    words.join(" ")
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
    let value = rad.to_degrees();
    if value == 0.0 || !value.is_finite() {
        return format!("{}°", number(value));
    }
    // Zeros at the end, too: 0.140° beside 0.139°.
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.decimals$}°").replace('-', "−")
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

/// Odds, of which the logarithm is known: `40 to 1`, `1 to 40`, from a thousand on as a power of ten.
#[must_use]
pub fn odds(log10: f64) -> String {
    if !log10.is_finite() {
        return "–".into();
    }
    let size = log10.abs();
    let number = if size < 3.0 { three(10f64.powf(size)) } else { format!("10{}", superscript(size.round() as u64)) };
    if log10 < 0.0 { format!("1 to {number}") } else { format!("{number} to 1") }
}

fn superscript(number: u64) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    number.to_string().bytes().map(|digit| DIGITS[usize::from(digit - b'0')]).collect()
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
        "time_since_reversal_s" => ("time since it stood or turned round", "s", 1.0),
        "run" => ("run, those that were fitted on first", "", 1.0),
        "frequency_hz" => ("frequency of the error", "Hz", 1.0),
        "time_in_rollout_s" => ("time since the rollout began", "ms", 1e3),
        _ => ("", "", 1.0),
    }
}

/// The same; a coordinate without a label is called what it is called in files.
#[must_use]
pub(super) fn axis(name: &str) -> (&str, &'static str, f64) {
    let (label, unit, factor) = coordinate(name);
    (if label.is_empty() { name } else { label }, unit, factor)
}

/// What a missing term is, its unit, and how many of them the exchange format's unit is.
pub(super) fn term_kind(kind: TermKind) -> (&'static str, &'static str, f64) {
    match kind {
        TermKind::TorqueNm => ("torque", "mN·m", 1e3),
        TermKind::TorqueAlongMotionNm => ("torque along the motion", "mN·m", 1e3),
        TermKind::TorqueAlongVoltageNm => ("torque at full voltage", "mN·m", 1e3),
        TermKind::SlipRadPerS => ("slip of the sensor", "rad/s", 1.0),
        TermKind::ReadingRad => ("error of the reading", "°", 180.0 / std::f64::consts::PI),
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
    let (label, unit, factor) = axis(&left.coordinate);
    if !left.runs.is_empty() {
        let share = percent(100.0 * left.share);
        return format!("{share} % of what is left above the noise lies in {}.", left.runs.join(", "));
    }
    format!(
        "{} % of what is left above the noise lies at a {label} of {} to {} {unit}.",
        percent(100.0 * left.share),
        three(left.from * factor),
        three(left.to * factor)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_texts_have_a_minus_and_a_zero_has_none() {
        let text = "removes -0.0 % (-8.5 to 11.0) of the held-out error, -3 and co-author - 2";
        assert_eq!(readable(text), "removes 0.0 % (−8.5 to 11.0) of the held-out error, −3 and co-author - 2");
    }

    #[test]
    fn odds_are_written_as_people_say_them() {
        let found = [0.0, 2.0, -1.6, 23.4, -23.1, 310.0].map(odds);
        assert_eq!(found, ["1 to 1", "100 to 1", "1 to 39.8", "10²³ to 1", "1 to 10²³", "10³¹⁰ to 1"]);
    }

    #[test]
    fn angles_have_three_significant_digits() {
        let found = [0.1396_f64, 0.14, 12.345, 123.4, -0.00123, 0.0].map(|deg| degrees(deg.to_radians()));
        assert_eq!(found, ["0.140°", "0.140°", "12.3°", "123°", "−0.00123°", "0°"]);
    }
}
