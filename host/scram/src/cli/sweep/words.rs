//! What `scram sweep` says: progress, warnings, tables.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sweep::claims::{ClaimResult, Number};
use sweep::{Component, Conditions, Factor, Found, Measured, Robustness, Stat, Swept};

use super::super::say;
use super::Summary;
use crate::cli::table;

/// A bar on a terminal, nothing elsewhere.
pub struct Bar {
    bar: ProgressBar,
    what: &'static str,
}

impl Bar {
    pub fn new(what: &'static str) -> Self {
        Self { bar: ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()), what }
    }

    pub fn show(&mut self, done: usize, total: usize) {
        if self.bar.length().is_none() {
            self.bar.set_length(total as u64);
            let template = format!("{{bar:40}} {{pos}}/{{len}} {}, {{eta}} left", self.what);
            self.bar.set_style(ProgressStyle::with_template(&template).unwrap_or(ProgressStyle::default_bar()));
            // What was there already says nothing about the time that is left.
            self.bar.set_position(done as u64);
            self.bar.reset_eta();
        }
        self.bar.set_position(done as u64);
    }

    pub fn end(&self) {
        self.bar.finish_and_clear();
    }
}

pub fn warn_unmatched(measured: &Measured, conditions: &Conditions) {
    let place = |what: Factor| conditions.axes.iter().position(|axis| *axis == what);
    let (Some(f), Some(alpha)) = (place(Factor::Frequency), place(Factor::Alpha)) else {
        say("warning: measured speeds are of f and alpha; this sweep does not vary both, no error map is drawn");
        return;
    };
    let here = |at: &(f64, f64)| conditions.conditions.iter().any(|c| (c.point[f], c.point[alpha]) == *at);
    let missing: Vec<String> =
        measured.conditions().iter().filter(|at| !here(at)).map(|(f, alpha)| format!("{f} Hz at {alpha}°")).collect();
    if !missing.is_empty() {
        say(&format!("warning: measured, but not in the sweep: {}", missing.join(", ")));
    }
}

pub fn warn_notes(swept: &Swept, summary: &Summary) {
    if summary.blown_up > 0 {
        let first = swept.runs.iter().find(|run| run.measures.vx.is_none()).map_or("", |run| run.note.as_str());
        say(&format!("warning: {} of {} runs have no speeds: {first}", summary.blown_up, summary.runs));
    }
    let others = summary.notes - summary.blown_up;
    if others > 0 {
        let noted = swept.runs.iter().find(|run| run.measures.vx.is_some() && !run.note.is_empty());
        let first = noted.map_or("", |run| run.note.as_str());
        say(&format!("warning: {others} of {} runs have a note: {first}", summary.runs));
    }
}

pub fn speeds_table(conditions: &Conditions) -> String {
    let cell = |stat: Stat| match (stat.mean, stat.spread) {
        (Some(mean), Some(spread)) => {
            format!("{} ± {}", table::with_unit(mean, 2, ""), table::with_unit(spread, 2, ""))
        }
        (mean, _) => table::or_dash(mean, 2, ""),
    };
    let mut header: Vec<String> = conditions.axes.iter().map(Factor::label).collect();
    header.extend(["vx / mm/s", "vy / mm/s", "yaw / °/s", "J/m"].map(String::from));
    let rows = conditions.conditions.iter().map(|condition| {
        let mut row: Vec<String> = condition.point.iter().map(f64::to_string).collect();
        row.extend(Component::ALL.map(|component| cell(condition.speed(component))));
        row.push(table::or_dash(condition.stat(|measures| measures.energy_j_per_m).mean, 1, ""));
        row
    });
    table::columns(&header.iter().map(String::as_str).collect::<Vec<_>>(), rows)
}

/// σ (5.2) and φ (5.3) of every condition at nominal friction.
pub fn robustness_table(nominal: &Conditions, robustness: &[(Component, Robustness)]) -> String {
    let mut header: Vec<String> = nominal.axes.iter().map(Factor::label).collect();
    for (name, (component, _)) in ["vx", "vy", "yaw"].into_iter().zip(robustness) {
        header.extend([format!("σ {name} / %"), format!("φ {name} / {}", component.unit())]);
    }
    let rows = nominal.conditions.iter().enumerate().map(|(index, condition)| {
        let mut row: Vec<String> = condition.point.iter().map(f64::to_string).collect();
        for (_, found) in robustness {
            row.push(table::or_dash(found.sensitivity[index].map(|sigma| 100.0 * sigma), 1, ""));
            row.push(table::or_dash(found.effectiveness[index], 2, ""));
        }
        row
    });
    table::columns(&header.iter().map(String::as_str).collect::<Vec<_>>(), rows)
}

pub fn claim_text(verdict: &ClaimResult) -> String {
    let holds = match verdict.holds {
        Some(true) => "holds",
        Some(false) => "does not hold",
        None => "cannot be judged: a run is missing",
    };
    let number = |number: &Number| format!("{} {}", number.name, table::or_dash(number.value, 3, ""));
    let numbers: Vec<String> = verdict.numbers.iter().map(number).collect();
    format!(
        "{}: {holds}{}\n  thesis: {}\n  if:     {}\n  found:  {}\n",
        verdict.claim,
        verdict.margin.map_or(String::new(), |margin| format!(", margin {margin:+.2}")),
        verdict.thesis,
        verdict.holds_if,
        numbers.join("; ")
    )
}

pub fn search_text(found: &Found) -> String {
    let rows = found.claims.iter().map(|(name, count)| {
        let best = if found.best_holds.contains(name) { "holds" } else { "–" };
        vec![name.clone(), format!("{count} of {}", found.admissible), best.to_owned()]
    });
    let claims = table::columns(&["claim", "holds in", "best set"], rows);
    let values = found.values.iter().map(|(path, value)| (path.as_str(), value.to_string()));
    let best = format!("best: set {} of {}, {} claims hold", found.best, found.sets, found.best_holds.len());
    format!("{claims}\n{best}\n{}", table::facts(values))
}
