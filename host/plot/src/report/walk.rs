//! The report of a walk's diagnosis.

use diagnose::Verdict;
use diagnose::walk::{ALARM, FootPlace, Place, WalkDiagnosis, WalkLimit, WalkModel};
use identify::robot::Parameter;

use super::PAGE_STYLE;
use super::svg::{COLOURS, STYLE, escape};
use super::words::{self, sentence, three};
use crate::figures::{FigureError, speeds_svg};

/// What a walk's report says beside the diagnosis itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WalkAbout {
    /// The robot file that was diagnosed.
    pub robot: String,
    /// The tables of speeds.
    pub measured: Vec<String>,
    /// The robot file that was written, if any.
    pub extended_file: Option<String>,
}

/// The diagnosis of a walk as an HTML page.
///
/// # Errors
/// The drawing library refuses.
pub fn walk_html(found: &WalkDiagnosis, about: &WalkAbout) -> Result<String, FigureError> {
    let (badge, tone) = words::badge(found.verdict);
    let (headline, rest) = found.summary.split_first().map_or(("", &[][..]), |(first, rest)| (first.as_str(), rest));
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\"><head><meta charset=\"utf-8\"/>\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"/><title>{robot}: {badge}</title>\
         <style>{COLOURS}{STYLE}{PAGE_STYLE}</style></head><body><main>\
         <header><span class=\"badge {tone}\">{badge}</span> <span class=\"soft\">Diagnosis of the walk of {robot}</span>\
         <h1>{}</h1><p>{}</p></header>",
        escape(headline),
        escape(&(reason(found).unwrap_or_default() + &rest.join(" "))),
        robot = escape(&about.robot),
    );
    page.push_str(&cards(found));
    page.push_str(&format!(
        "<section><h2>Simulated speeds over measured ones</h2><p class=\"soft\">{}, under conditions that were fitted and under those \
         that were held out.</p><div class=\"scroll\">{}</div></section>",
        if found.causes.is_empty() {
            "The file’s model, its numbers refitted"
        } else {
            "Grey: the file’s numbers, refitted. Coloured: the model that is written"
        },
        speeds_svg(&found.conditions)?
    ));
    page.push_str(&evidence(found));
    page.push_str(&places(&found.places));
    page.push_str(&feet(&found.feet));
    page.push_str(&parameters(&found.parameters));
    page.push_str(&limits(&found.limits));
    page.push_str(&how_to_run(found, about));
    page.push_str("</main></body></html>\n");
    Ok(page)
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "–".into(), |share| format!("{:.1}\u{a0}%", 100.0 * share))
}

/// Root mean square of the three speeds.
fn together(shares: [Option<f64>; 3]) -> Option<f64> {
    let all: Vec<f64> = shares.into_iter().flatten().collect();
    (!all.is_empty()).then(|| (all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64).sqrt())
}

fn cards(found: &WalkDiagnosis) -> String {
    let card = |class: &str, name: &str, value: &str, note: &str| {
        format!("<div class=\"{class}\"><small>{name}</small><b>{value}</b><small>{}</small></div>", escape(note))
    };
    let parts = |shares: [Option<f64>; 3]| {
        format!("vx {}, vy {}, yaw {}", percent(shares[0]), percent(shares[1]), percent(shares[2]))
    };
    let after = if found.causes.is_empty() { "nothing was added to the model".into() } else { parts(found.after) };
    let (odds, tone) = (found.log10_evidence_against_nothing, words::badge(found.verdict).1);
    format!(
        "<section class=\"cards\" aria-label=\"the four numbers\">{}{}{}{}</section>",
        card(
            "",
            "repeats scatter",
            &percent(together(found.scatter)),
            "a mean over the repeats, share of the largest speed"
        ),
        card("b", "error before", &percent(together(found.before)), &parts(found.before)),
        card("a", "error after", &percent(together(found.after)), &after),
        card(tone, "odds of a missing effect", &words::odds(odds), odds_words(odds, found.verdict)),
    )
}

/// Why a walk is unexplained: of the two legs of the verdict the odds alone would say that all is well.
fn reason(found: &WalkDiagnosis) -> Option<String> {
    let own = found.models.iter().find(|one| one.effects.is_empty())?;
    (found.verdict == Verdict::Unexplained && own.adequate == Some(false)).then(|| unexplained(own.misfit))
}

fn unexplained(misfit: Option<f64>) -> String {
    let of = |misfit| format!(": misfit {} on the fitted speeds, where scatter alone makes 1", three(misfit));
    format!("With its numbers refitted it leaves more than repeats scatter by{}. ", misfit.map_or_else(String::new, of))
}

/// What the odds of a missing effect mean for the verdict.
fn odds_words(log10_odds: f64, verdict: Verdict) -> &'static str {
    match (log10_odds >= ALARM, verdict) {
        (true, Verdict::Unexplained) => "an alarm, which needs 100 to 1; but no effect leaves only scatter",
        (true, _) => "an alarm, which needs 100 to 1",
        (false, Verdict::Unexplained) => "no alarm, which needs 100 to 1: no effect of the catalogue explains it",
        (false, _) => "no alarm, which needs 100 to 1",
    }
}

fn evidence(found: &WalkDiagnosis) -> String {
    let named: Vec<&String> = found.causes.iter().map(|cause| &cause.effect).collect();
    let row = |one: &WalkModel| {
        let names: Vec<String> = one.effects.iter().map(|name| words::effect(name).0).collect();
        let (name, what) = match one.effects.as_slice() {
            [] => ("The file’s model, numbers refitted".to_owned(), ""),
            [only] => (sentence(&names[0]), words::effect(only).1),
            _ => (sentence(&words::join(&names, "and")), ""),
        };
        let class = if !one.effects.is_empty() && one.effects.iter().collect::<Vec<_>>() == named {
            " class=\"named\""
        } else if one.effects.is_empty() {
            " class=\"nominal\""
        } else {
            ""
        };
        let adequate = one.adequate.map_or("not looked at", |adequate| if adequate { "yes" } else { "no" });
        format!(
            "<tr{class}><td><b>{}</b><small>{}</small></td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td>{adequate}</td></tr>",
            escape(&name),
            escape(what),
            format!("{:.1}", one.log10_bayes_factor).replace('-', "\u{2212}"),
            if one.effects.is_empty() { "–".into() } else { percent(Some(one.probability)) },
            one.misfit.map_or_else(|| "–".into(), three),
        )
    };
    let rows: String = found.models.iter().map(row).collect();
    format!(
        "<section><h2>The evidence for each cause</h2><p class=\"soft\">Every model was fitted with the file’s own numbers. Evidence: log₁₀ \
         of the factor by which the speeds become more probable than under the file’s model, numbers and sizes averaged over what is \
         believed of them. Misfit: what is left over what repeats make.</p>\
         <div class=\"scroll\"><table><thead><tr><th>model</th><th class=\"n\">evidence</th>\
         <th class=\"n\">probability</th><th class=\"n\">misfit</th><th>leaves only scatter</th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}

fn places(places: &[Place]) -> String {
    let name = |place: &Place| match place.by.as_str() {
        "frequency_hz" => format!("{} Hz, both directions", place.at),
        "direction" => format!("eccentric {}", place.at),
        "alpha_deg" => format!("α = {}°", place.at),
        _ => place.at.clone(),
    };
    let row = |place: &Place| {
        format!(
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(&name(place)),
            three(place.misfit),
            three(place.elsewhere)
        )
    };
    let rows: String = places.iter().map(row).collect();
    format!(
        "<section><h2>Where the file’s model is wrong</h2><p class=\"soft\">Deviations of the refitted file’s speeds in units of what the \
         means are known to, root mean square. Those that stand out most come first.</p><div class=\"scroll\"><table><thead><tr>\
         <th>speeds</th><th class=\"n\">off by</th><th class=\"n\">all others</th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}

fn feet(feet: &[FootPlace]) -> String {
    if feet.is_empty() {
        return String::new();
    }
    let row = |one: &FootPlace| {
        let (side, module) = one.side_and_module();
        format!(
            "<tr><td>module {}, {}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(module),
            escape(side),
            three(one.share),
            format!("{:.1}", one.deviations).replace('-', "\u{2212}")
        )
    };
    let rows: String = feet.iter().map(row).collect();
    format!(
        "<section><h2>Foot by foot</h2><p class=\"soft\">Share of the ground’s friction with which each foot alone would bring the refitted \
         file’s speeds nearest, by one linear step, and how many standard deviations that is from 1. Several feet that stand out, or one \
         beside a cause that is named, may only stand in for it.</p><div class=\"scroll\"><table><thead><tr><th>foot</th>\
         <th class=\"n\">share</th><th class=\"n\">deviations</th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}

fn parameters(parameters: &[Parameter]) -> String {
    let row = |one: &Parameter| {
        format!(
            "<tr><td><code>{}</code></td><td class=\"n\">{}</td><td class=\"n\"><b>{}</b></td><td class=\"n\">{} … {}</td>\
             <td class=\"n\">{}</td></tr>",
            escape(&one.path).replace('.', ".<wbr/>"),
            three(one.file),
            three(one.value),
            three(one.low),
            three(one.high),
            percent(Some(one.left))
        )
    };
    let rows: String = parameters.iter().map(row).collect();
    format!(
        "<section><h2>The numbers</h2><div class=\"scroll\"><table><thead><tr><th>key in the robot file</th><th class=\"n\">file</th>\
         <th class=\"n\">fitted</th><th class=\"n\">90 % interval</th><th class=\"n\">left of the spread</th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}

fn limits(limits: &[WalkLimit]) -> String {
    if limits.is_empty() {
        return String::new();
    }
    let row = |limit: &WalkLimit| {
        let keys: Vec<String> = limit
            .largest
            .iter()
            .map(|(path, size)| format!("{} {}", path.rsplit('.').next().unwrap_or(path), three(*size)))
            .collect();
        format!(
            "<tr><td>{}</td><td>{}</td></tr>",
            escape(&sentence(&words::effect(&limit.effect).0)),
            escape(&keys.join(", "))
        )
    };
    let rows: String = limits.iter().map(row).collect();
    format!(
        "<section><h2>How large the others may be</h2><p class=\"soft\">From its absence, beside the file’s model, by one linear step: \
         95 % of what these speeds leave open. A key that reaches what was believed of it before is one that they do not tell.</p>\
         <div class=\"scroll\"><table><thead><tr><th>effect</th><th>at most</th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}

fn how_to_run(found: &WalkDiagnosis, about: &WalkAbout) -> String {
    let simulated = format!("{} sets of numbers were simulated. How it works: docs/diagnose-walk.md.", found.simulated);
    let Some(file) = &about.extended_file else {
        return format!(
            "<section><h2>The model</h2><p class=\"soft\">No robot file was written. {simulated}</p></section>"
        );
    };
    let tables = about.measured.join(" ");
    let written = if found.verdict == Verdict::Unexplained {
        "the refitted numbers, which leave something unexplained"
    } else {
        "the model"
    };
    format!(
        "<section><h2>Run it</h2><p>{written} as a robot file, beside these speeds:</p><pre>scram sweep --robot {} --measured {}</pre>\
         <p class=\"soft\">{simulated}</p></section>",
        escape(file),
        escape(&tables),
        written = sentence(written),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_the_odds_agrees_with_the_verdict() {
        assert_eq!(odds_words(23.0, Verdict::Explained), "an alarm, which needs 100 to 1");
        assert!(odds_words(23.0, Verdict::Unexplained).contains("but no effect leaves only scatter"));
        assert_eq!(odds_words(-23.1, Verdict::Nothing), "no alarm, which needs 100 to 1");
        // No alarm and an unexplained walk: it must be said what is wrong all the same.
        assert!(odds_words(-23.1, Verdict::Unexplained).contains("no effect of the catalogue"));
        assert!(unexplained(Some(3.26)).contains("more than repeats scatter by: misfit 3.26"));
    }
}
