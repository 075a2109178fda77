//! Pages for people: the diagnosis report, and the small charts in it.
//!
//! A report is one self-contained HTML file (well-formed XML): style sheet and SVG inside, no scripts, nothing loaded.

mod charts;
pub mod svg;
mod walk;
mod words;

use std::fmt::Write as _;

use common::quantile;
use diagnose::{
    CandidateEvidence, Diagnosis, FittedParameter, Limit, MissingTerm, RigDoubt, RolloutTrace, RunUse, Verdict,
};
use simulation::{ComparedFigure, Comparison};
use svg::{COLOURS, STYLE, escape, number};
pub use walk::{WalkAbout, walk_html};
pub use words::odds;
use words::{degrees, percent, sentence, three, times};

const PAGE_STYLE: &str = include_str!("style.css");
/// Pairs of effects in the table of evidence; there may be dozens.
const MOST_PAIRS: usize = 4;

/// What a report says beside the diagnosis itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// Name from the robot file.
    pub robot: String,
    /// The robot file that was diagnosed.
    pub robot_file: String,
    /// The extended robot file that was written, if any.
    pub extended_file: Option<String>,
    /// What its robot tracks under the controller of the diagnosed file, and under its own.
    pub tracking: Vec<Comparison>,
}

/// The diagnosis as an HTML page.
#[must_use]
pub fn html(diagnosis: &Diagnosis, about: &About) -> String {
    let (badge, tone) = words::badge(diagnosis.verdict);
    let headline = words::headline(diagnosis);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\"><head><meta charset=\"utf-8\"/>\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"/><title>{robot}: {badge}</title>\
         <style>{COLOURS}{STYLE}{PAGE_STYLE}</style></head><body><main>\
         <header><span class=\"badge {tone}\">{badge}</span> <span class=\"soft\">Diagnosis of {robot}</span>\
         <h1>{}</h1><p>{}</p></header>",
        // A number and its sign stay on one line.
        escape(&headline.replace(" %", "\u{a0}%")),
        escape(&words::lead(diagnosis)),
        robot = escape(&about.robot),
    );
    page.push_str(&cards(diagnosis));
    page.push_str(&rollouts(diagnosis));
    page.push_str(&where_it_lives(diagnosis));
    page.push_str(&missing_terms(diagnosis));
    page.push_str(&evidence(diagnosis));
    page.push_str(&scale_free(diagnosis));
    page.push_str(&parameters(diagnosis));
    page.push_str(&what_is_left(diagnosis));
    page.push_str(&limits(diagnosis));
    page.push_str(&data_used(diagnosis));
    page.push_str(&gained(about));
    page.push_str(&how_to_run(diagnosis, about));
    page.push_str(&method(diagnosis));
    page.push_str("</main></body></html>\n");
    page
}

/// The four numbers.
fn cards(diagnosis: &Diagnosis) -> String {
    let floor = diagnosis.noise_floor.max(f64::MIN_POSITIVE);
    let card = |class: &str, name: &str, value: &str, note: &str| {
        format!("<div class=\"{class}\"><small>{name}</small><b>{value}</b><small>{}</small></div>", escape(note))
    };
    let over = |error: f64| format!("{} the noise floor", times(error / floor));
    let nothing_added = nothing_added(diagnosis);
    let after_note = if nothing_added { "nothing was added to the model".to_owned() } else { over(diagnosis.after) };
    let gain = &diagnosis.gain;
    let (gain_value, gain_note) = if nothing_added {
        ("–".to_owned(), "no cause was named".to_owned())
    } else {
        let interval = format!("of the excess; 95 %: {} to {} %", percent(gain.low), percent(gain.high));
        (format!("{} %", percent(gain.percent_of_excess_removed)), interval)
    };
    format!(
        "<section class=\"cards\" aria-label=\"the four numbers\">{}{}{}{}</section>",
        card("", "noise floor", &degrees(diagnosis.noise_floor), "scatter of the angle reading itself"),
        card("b", "error before", &degrees(diagnosis.before), &over(diagnosis.before)),
        card("a", "error after", &degrees(diagnosis.after), &after_note),
        card("g", "removed", &gain_value, &gain_note),
    )
}

/// What the curves are. Where nothing was added the two models are one, and so are their curves.
fn key(diagnosis: &Diagnosis, with_measured: bool, shaded: &str) -> String {
    let measured = if with_measured { "<span class=\"m\">measured</span>" } else { "" };
    let models = if nothing_added(diagnosis) {
        "<span class=\"b\">the refitted model</span>"
    } else {
        "<span class=\"b\">model, numbers refitted (before)</span><span class=\"a\">extended model (after)</span>"
    };
    let floor = if with_measured { "" } else { "<span class=\"f\">noise floor</span>" };
    let shaded = if shaded.is_empty() { String::new() } else { format!("<span class=\"n\">{}</span>", escape(shaded)) };
    format!("<div class=\"key\">{measured}{models}{floor}{shaded}</div>")
}

/// Whether the model after the diagnosis is the refitted one before it.
fn nothing_added(diagnosis: &Diagnosis) -> bool {
    diagnosis.causes.is_empty()
}

fn rollouts(diagnosis: &Diagnosis) -> String {
    let detail = &diagnosis.detail;
    let mut out = format!(
        "<section><h2>Measured against simulated, on runs that no fit has seen</h2>\
         <p class=\"soft\">Each rollout starts from the measured state and runs freely for {} s on the recorded drive: {} \
         rollouts in {}.</p>{}<div class=\"charts two\">",
        three(detail.horizon_s),
        detail.held_out_rollouts,
        escape(&counted(detail.held_out_runs.len(), "held-out run")),
        key(diagnosis, true, "noise of the reading, ±2σ"),
    );
    for (index, (why, trace)) in different_traces(diagnosis).iter().enumerate() {
        out.push_str(&charts::trace(index, why, trace, diagnosis));
    }
    if !detail.rollout_errors.is_empty() {
        let _ = write!(out, "<figure>{}{}</figure>", charts::distribution(diagnosis), distribution_words(diagnosis));
    }
    out.push_str("</div></section>");
    out
}

/// Every stretch once, with all that it is shown for.
fn different_traces(diagnosis: &Diagnosis) -> Vec<(String, &RolloutTrace)> {
    let traces = &diagnosis.detail.traces;
    let is_same = |a: &RolloutTrace, b: &RolloutTrace| a.run == b.run && a.samples == b.samples;
    let why = |trace: &RolloutTrace| {
        let all = traces.iter().filter(|other| is_same(other, trace)).map(|other| match nothing_added(diagnosis) {
            true => other.why.trim_end_matches(" before").trim_end_matches(" after").to_owned(),
            false => other.why.clone(),
        });
        let mut all: Vec<String> = all.collect();
        all.dedup();
        words::join(&all, "and")
    };
    let is_new = |index: usize| !traces[..index].iter().any(|earlier| is_same(earlier, &traces[index]));
    (0..traces.len()).filter(|index| is_new(*index)).map(|index| (why(&traces[index]), &traces[index])).collect()
}

/// Median and 95th percentile of the rollouts' errors, in words.
fn distribution_words(diagnosis: &Diagnosis) -> String {
    let floor = diagnosis.noise_floor.max(f64::MIN_POSITIVE);
    let at = |value: fn(&diagnose::RolloutError) -> f64| {
        let mut ratios: Vec<f64> = diagnosis.detail.rollout_errors.iter().map(|one| value(one) / floor).collect();
        let mut pick = |share: f64| quantile(&mut ratios, share).unwrap_or(f64::NAN);
        format!("median {}, 95 % below {}", times(pick(0.5)), times(pick(0.95)))
    };
    if nothing_added(diagnosis) {
        return format!("<figcaption>The refitted model: {}.</figcaption>", at(|one| one.before));
    }
    format!("<figcaption>Before: {}.<br/>After: {}.</figcaption>", at(|one| one.before), at(|one| one.after))
}

fn where_it_lives(diagnosis: &Diagnosis) -> String {
    let curves: String = diagnosis
        .detail
        .misfit_map
        .iter()
        .enumerate()
        .map(|(index, curve)| charts::misfit(index, curve, diagnosis))
        .filter(|chart| !chart.is_empty())
        .map(|chart| format!("<figure>{chart}</figure>"))
        .collect();
    if curves.is_empty() {
        return String::new();
    }
    let shaded = if diagnosis.left_over.is_some() { "where most of the rest lives" } else { "" };
    format!(
        "<section><h2>Where the misfit lives</h2>{}<div class=\"charts\">{curves}</div>{}</section>",
        key(diagnosis, false, shaded),
        constant_coordinates(diagnosis)
    )
}

/// What hardly changed in the held-out runs: one value makes no curve.
fn constant_coordinates(diagnosis: &Diagnosis) -> String {
    let curves = diagnosis.detail.misfit_map.iter().filter(|curve| curve.bins.len() == 1);
    // What an axis says beside its quantity is of no use here.
    let name = |label: &str| escape(label.split(',').next().unwrap_or(label));
    let names: Vec<String> = curves.map(|curve| name(words::axis(&curve.coordinate).0)).collect();
    if names.is_empty() {
        return String::new();
    }
    format!(
        "<p class=\"soft\">Of one value in the held-out runs, so without a curve: {}.</p>",
        words::join(&names, "and")
    )
}

/// What is missing as curves that nobody has chosen a law for.
fn missing_terms(diagnosis: &Diagnosis) -> String {
    let figure = |(index, term): (usize, &MissingTerm)| {
        let chart = charts::missing_term(index, term);
        let share = percent(100.0 * term.promised.min(1.0));
        format!(
            "<figure>{chart}<figcaption>Alone it could take away {share} % of the squared error.</figcaption></figure>"
        )
    };
    if diagnosis.missing_terms.is_empty() {
        return String::new();
    }
    let curves: String = diagnosis.missing_terms.iter().enumerate().map(figure).collect();
    format!(
        "<section><h2>What the file’s model lacks, without a law</h2><p class=\"soft\">Each curve is the torque (or error of the \
         reading) that the fit runs ask for over one coordinate, by one linear step from the refitted model: the shape is more to \
         be trusted than the size. What its numbers could do as well is not in it. Shaded: 95 % of each point. An effect over one \
         coordinate may show over others, too; the curve that takes away most comes first.{}</p>\
         <div class=\"charts\">{curves}</div></section>",
        volts_per_torque(diagnosis)
    )
}

/// How many volts a torque takes, where the resistance and the torque constant were fitted.
fn volts_per_torque(diagnosis: &Diagnosis) -> String {
    let fitted = |path: &str| diagnosis.detail.nominal.iter().find(|one| one.path == path).map(|one| one.value);
    match (fitted("motor.resistance_ohm"), fitted("motor.torque_constant_nm_per_a")) {
        (Some(resistance), Some(constant)) => {
            format!(" 1 mN·m takes {} V at the motor.", three(1e-3 * resistance / constant))
        }
        _ => String::new(),
    }
}

fn evidence(diagnosis: &Diagnosis) -> String {
    let all = &diagnosis.detail.candidates;
    if all.is_empty() {
        return String::new();
    }
    let worst = all.iter().map(|one| one.ratio_to_floor).filter(|r| r.is_finite()).fold(1.0, f64::max);
    let (mut pairs, mut hidden, mut rows) = (0, 0, String::new());
    for one in all {
        if one.effects.len() > 1 && !one.named {
            pairs += 1;
            if pairs > MOST_PAIRS {
                hidden += 1;
                continue;
            }
        }
        rows.push_str(&evidence_row(one, worst));
    }
    let hidden = if hidden > 0 {
        format!("<p class=\"soft\">{} did no better and are left out.</p>", counted(hidden, "further pair"))
    } else {
        String::new()
    };
    format!(
        "<section><h2>The evidence for and against each cause</h2><p class=\"soft\">Every candidate was fitted together with \
         the model's own numbers. Bars: held-out error over the noise floor; the dashed mark is the floor itself, a \
         candidate that reaches it leaves nothing to explain.</p>\
         <table class=\"evidence\"><thead><tr><th>candidate</th><th>held-out error</th><th class=\"n\">× floor</th>\
         <th class=\"n\">removes</th><th>what speaks for it and against it</th></tr></thead><tbody>{rows}</tbody></table>\
         {hidden}</section>"
    )
}

fn evidence_row(one: &CandidateEvidence, worst: f64) -> String {
    let nominal = one.effects.is_empty();
    let names: Vec<String> = one.effects.iter().map(|name| words::effect(name).0).collect();
    let name =
        if nominal { "The file's model, numbers refitted".to_owned() } else { sentence(&words::join(&names, "and")) };
    let what = match one.effects.as_slice() {
        [only] => words::effect(only).1,
        _ => "",
    };
    let share = |ratio: f64| (100.0 * ratio / worst).clamp(0.0, 100.0);
    let removes = if nominal {
        "–".to_owned()
    } else {
        let [value, low, high] = one.improvement_percent;
        format!("{} %<small>{} to {} %</small>", percent(value), percent(low), percent(high))
    };
    let points = |texts: &[String], class: &str| -> String {
        texts.iter().map(|text| format!("<li class=\"{class}\">{}</li>", escape(&words::readable(text)))).collect()
    };
    let class = match (one.named, nominal) {
        (true, _) => " class=\"named\"",
        (_, true) => " class=\"nominal\"",
        _ => "",
    };
    format!(
        "<tr{class}><td><b>{}</b><small>{}</small></td>\
         <td><div class=\"bar\"><i style=\"width:{:.1}%\"></i><u style=\"left:{:.1}%\"></u></div></td>\
         <td class=\"n\" data-label=\"error over floor\">{}</td><td class=\"n\" data-label=\"removes\">{removes}</td>\
         <td><ul class=\"plain\">{}{}</ul></td></tr>",
        escape(&name),
        escape(what),
        share(one.ratio_to_floor),
        share(1.0),
        times(one.ratio_to_floor),
        points(&one.speaks_for, "yes"),
        points(&one.speaks_against, "no"),
    )
}

fn parameters(diagnosis: &Diagnosis) -> String {
    let detail = &diagnosis.detail;
    let (numbers, what) = if diagnosis.causes.is_empty() {
        (&detail.nominal, "The model's numbers, refitted")
    } else {
        (&detail.extended, "The numbers of the extended model")
    };
    if numbers.is_empty() {
        return String::new();
    }
    let rows: String = numbers.iter().map(parameter_row).collect();
    format!(
        "<section><h2>{what}</h2><div class=\"scroll\"><table><thead><tr><th>key in the robot file</th>\
         <th class=\"n\">file</th><th class=\"n\">fitted</th><th class=\"n\">95 % interval</th></tr></thead>\
         <tbody>{rows}</tbody></table></div></section>"
    )
}

/// What the data know whatever the scale of torques is.
fn scale_free(diagnosis: &Diagnosis) -> String {
    if diagnosis.scale_free.is_empty() {
        return String::new();
    }
    let row = |(key, [value, low, high]): (&String, &[f64; 3])| {
        format!(
            "<tr><td><code>{}</code></td><td class=\"n\"><b>{}</b></td><td class=\"n\">{} … {}</td></tr>",
            escape(key),
            three(*value),
            three(*low),
            three(*high)
        )
    };
    let rows: String = diagnosis.scale_free.iter().map(row).collect();
    format!(
        "<section><h2>Numbers in volts</h2><p class=\"soft\">Angle and drive alone show the motor’s equation in volts: J·R/K, \
         K + b·R/K and every torque times R/K. These hold as well as the data are good; the scale of the numbers below them hangs \
         on what the file says of R, K and J, unless a current was measured.</p><div class=\"scroll\"><table><thead><tr><th>key</th>\
         <th class=\"n\">fitted</th><th class=\"n\">95 % interval</th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}

fn parameter_row(one: &FittedParameter) -> String {
    let file = one.file_value.map_or_else(|| "new".to_owned(), three);
    let class = if one.file_value.is_none() { " class=\"named\"" } else { "" };
    // No fit moves it: these recordings could not tell it from another number.
    let is_assumed = one.low == one.high;
    let interval =
        if is_assumed { "assumed".to_owned() } else { format!("{} … {}", three(one.low), three(one.high)) };
    format!(
        "<tr{class}><td><code>{}</code></td><td class=\"n\">{file}</td><td class=\"n\"><b>{}</b></td>\
         <td class=\"n\">{interval}</td></tr>",
        escape(&one.path).replace('.', ".<wbr/>"),
        three(one.value)
    )
}

fn what_is_left(diagnosis: &Diagnosis) -> String {
    let floor = diagnosis.noise_floor.max(f64::MIN_POSITIVE);
    let rest = times(diagnosis.after / floor);
    let state = match diagnosis.verdict {
        Verdict::Nothing if diagnosis.remembers() => format!(
            "The error is {rest} the noise floor, alike in every rollout whatever the shaft does: noise that remembers."
        ),
        Verdict::Nothing if diagnosis.leaves_numbers_open() => format!(
            "The error is {rest} the noise floor, no more than the runs that were fitted leave the numbers open."
        ),
        Verdict::Nothing | Verdict::Explained => {
            format!("The error is {rest} the noise floor: nothing to speak of is left.")
        }
        Verdict::Ambiguous => {
            format!(
                "The error is {rest} the noise floor with any of the candidates: what is open is which of them it is."
            )
        }
        Verdict::Unexplained => format!("The error is still {rest} the noise floor."),
    };
    let place = diagnosis.left_over.as_ref().map_or_else(String::new, |left| format!(" {}", words::left_over(left)));
    let next = diagnosis.next_experiment.as_ref().map_or_else(String::new, |next| {
        format!("<p class=\"next\"><b>Next experiment:</b> {}.</p>", escape(next.trim_end_matches('.')))
    });
    let doubts: String = diagnosis.rig_doubts.iter().map(doubt).collect();
    format!("<section><h2>What is left</h2><p>{}{}</p>{next}{doubts}</section>", escape(&state), escape(&place))
}

/// What does not go together between recordings and file, and what to change.
fn doubt(doubt: &RigDoubt) -> String {
    let mend = doubt.mend.lines().map(|line| format!("<br>{}", escape(&words::readable(line)))).collect::<String>();
    let reason = escape(&words::readable(&doubt.reason));
    format!("<p class=\"next\"><b>Is this the file's rig?</b> {reason}.{mend}</p>")
}

/// How large each effect may still be that was not named.
fn limits(diagnosis: &Diagnosis) -> String {
    if diagnosis.limits.is_empty() {
        return String::new();
    }
    let row = |limit: &Limit| {
        let sizes: Vec<String> = limit
            .at_most
            .iter()
            .map(|(key, at_most)| {
                let size = at_most.map_or_else(|| "anything".to_owned(), three);
                format!("<code>{}</code> {size}", escape(key))
            })
            .collect();
        let chance = if limit.chance < 0.001 { "&lt; 0.1".to_owned() } else { three(100.0 * limit.chance) };
        format!(
            "<tr><td>{}</td><td>{}</td><td class=\"n\">{chance} %</td><td>{}</td></tr>",
            escape(&sentence(&words::effect(&limit.effect).0)),
            sizes.join(", "),
            if limit.would_show { "yes" } else { "no" }
        )
    };
    let rows: String = diagnosis.limits.iter().map(row).collect();
    let which = if diagnosis.causes.is_empty() { "the file's model" } else { "the extended model" };
    format!(
        "<section><h2>How large the other effects may be</h2><p class=\"soft\">Upper limits, 95 % each, beside {which}; how \
         often chance alone makes something in the library look as likely; and whether these runs would show an effect of the \
         usual size.</p><div class=\"scroll\"><table><thead><tr><th>effect</th><th>at most</th><th class=\"n\">by chance</th>\
         <th>would show</th></tr></thead><tbody>{rows}</tbody></table></div></section>"
    )
}

fn data_used(diagnosis: &Diagnosis) -> String {
    // Of a shaft on a bench nothing is to be said here.
    let is_unknown = diagnosis.detail.runs.iter().any(|run| run.pull_unknown > 0);
    let where_unknown = |cell: String| if is_unknown { cell } else { String::new() };
    let row = |run: &RunUse| {
        format!(
            "<tr><td>{}</td><td>{}</td><td class=\"n\">{} s</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{}</td>{}<td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            escape(&run.name),
            if run.held_out { "held out" } else { "fitted" },
            three(run.seconds),
            run.samples,
            run.used,
            run.missing,
            run.blind,
            where_unknown(format!("<td class=\"n\">{}</td>", run.pull_unknown)),
            run.spikes,
            run.rollouts
        )
    };
    let rows: String = diagnosis.detail.runs.iter().map(row).collect();
    if rows.is_empty() {
        let list = |names: &[String]| escape(&names.join(", "));
        return format!(
            "<section><h2>Data used</h2><p>Fitted: {}. Held out: {}.</p></section>",
            list(&diagnosis.detail.fit_runs),
            list(&diagnosis.detail.held_out_runs)
        );
    }
    format!(
        "<section><h2>Data used</h2><div class=\"scroll\"><table><thead><tr><th>run</th><th></th><th class=\"n\">length</th>\
         <th class=\"n\">samples</th><th class=\"n\">used</th><th class=\"n\">no reading</th>\
         <th class=\"n\">of these in the blind arc</th>{}<th class=\"n\">spikes left out</th><th class=\"n\">rollouts</th></tr></thead><tbody>{rows}</tbody></table></div></section>",
        where_unknown("<th class=\"n\">left out: the body's pull is unknown</th>".to_owned())
    )
}

/// What the robot gains when its controller is designed from the extended model.
fn gained(about: &About) -> String {
    if about.tracking.is_empty() {
        return String::new();
    }
    let value = |value: Option<f64>, unit: &str| {
        let unit = if unit == "deg" { "°".to_owned() } else { format!(" {unit}") };
        value.map_or_else(|| "–".to_owned(), |value| three(value) + &unit)
    };
    let figure = |drive: &str, row: &ComparedFigure| {
        format!(
            "<tr><td><code>{}</code></td><td>{}</td><td class=\"n\">{}</td><td class=\"n\"><b>{}</b></td></tr>",
            escape(drive),
            escape(row.what),
            value(row.before, row.unit),
            value(row.after, row.unit)
        )
    };
    let drive = |one: &Comparison| {
        let mut rows: String = one.rows.iter().map(|row| figure(&one.drive, row)).collect();
        if one.stopped.iter().any(Option::is_some) {
            let [before, after] = one.stopped.each_ref().map(|why| escape(why.as_deref().unwrap_or("–")));
            let _ = write!(
                rows,
                "<tr><td><code>{}</code></td><td>stopped by</td><td class=\"n\">{before}</td><td class=\"n\">{after}</td></tr>",
                escape(&one.drive)
            );
        }
        rows
    };
    let rows: String = about.tracking.iter().map(drive).collect();
    format!(
        "<section><h2>What the robot gains</h2><p class=\"soft\">The extended model’s robot, simulated on a bench, means of three \
         runs: under the controller that is designed from <code>{}</code>, and under its own. The design takes back friction, \
         what the bridge loses and how late the reading is; of other effects the controller knows nothing.</p>\
         <div class=\"scroll\"><table><thead><tr><th>drive</th><th>tracking</th><th class=\"n\">before</th>\
         <th class=\"n\">after</th></tr></thead><tbody>{rows}</tbody></table></div></section>",
        escape(&about.robot_file)
    )
}

fn how_to_run(diagnosis: &Diagnosis, about: &About) -> String {
    let Some(file) = &about.extended_file else {
        return format!(
            "<section><h2>The model</h2><p class=\"soft\">No extended model was written; the diagnosed file is \
             <code>{}</code>.</p></section>",
            escape(&about.robot_file)
        );
    };
    let what = if diagnosis.causes.is_empty() {
        "It has the refitted numbers and no new effect."
    } else {
        "It has the refitted numbers and the new effects with their intervals."
    };
    format!(
        "<section><h2>Run the extended model</h2><p>{what} <code>{}</code> is as it was.</p>\
         <pre>scram sim --robot {file}\nscram diagnose --robot {file} NEW_RUN…</pre></section>",
        escape(&about.robot_file),
        file = escape(file)
    )
}

fn method(diagnosis: &Diagnosis) -> String {
    format!(
        "<section><h2>Method</h2><ol>\
         <li>The model's own numbers are refitted first, so that a wrong number is not called a wrong model.</li>\
         <li>A score test screens every effect of the library that the file lacks, with signs of whole blocks changed at random, \
         so that noise that remembers, has heavy tails or grows with speed raises no alarm.</li>\
         <li>After an alarm each effect is fitted jointly with those numbers (multiple shooting, start angle and speed of every \
         rollout free).</li>\
         <li>All are judged by free rollouts of {} s on held-out runs, against the noise of the reading.</li>\
         <li>A cause is named when it reaches the floor and no simpler or rival one does as well; intervals are 95 %, from \
         resampled rollouts.</li>\
         <li>If nothing reaches the floor, the answer is “unexplained”, with the place where the rest lives.</li></ol></section>",
        number(diagnosis.detail.horizon_s)
    )
}

fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests;
