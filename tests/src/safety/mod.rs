//! The figures on safety that the project promises: whatever is commanded, and however often, while something is broken, the bridge
//! goes off in time. Controller and simulated robot alone, so that a command may come in every tick; the same over the radio is
//! `link`'s campaign of faults. `safety` (the binary) prints the rows; a smaller version runs as an ordinary test.

pub mod assessment;
pub mod broken;
pub mod commands;
pub mod heat;
pub mod run;

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde_json::json;

use crate::figures::run::DesignedRobot;
use crate::row::FigureRow;
use assessment::SafetyAssessment;
use broken::{Broken, KINDS, Kind};
use run::Conditions;

/// Size of the campaign.
#[derive(Clone, Debug)]
pub struct Options {
    /// Runs, over all kinds of trouble.
    pub runs: u64,
    /// The first seed.
    pub seed: u64,
    /// Only kinds of trouble whose name contains this.
    pub only: Option<String>,
}

/// The rows: one a kind of trouble, and those on heat.
#[must_use]
pub fn rows(bench: &DesignedRobot, options: &Options) -> Vec<FigureRow> {
    let kinds: Vec<&Kind> =
        KINDS.iter().filter(|kind| options.only.as_deref().is_none_or(|part| kind.name.contains(part))).collect();
    let each = options.runs.div_ceil(kinds.len().max(1) as u64);
    let tasks: Vec<(usize, u64)> =
        (0..kinds.len()).flat_map(|index| (0..each).map(move |run| (index, options.seed + run))).collect();
    let done: Vec<(usize, Done)> =
        tasks.into_par_iter().map(|(index, seed)| (index, run_one(bench, kinds[index], seed))).collect();
    let mut by_kind: BTreeMap<usize, Vec<Done>> = BTreeMap::new();
    done.into_iter().for_each(|(index, done)| by_kind.entry(index).or_default().push(done));
    let mut rows: Vec<FigureRow> = by_kind.iter().map(|(index, done)| row(kinds[*index], done)).collect();
    if options.only.is_none() {
        rows.extend(heat::rows(bench, options.runs));
    }
    rows
}

/// A run, and what came of it.
struct Done {
    seed: u64,
    verdict: SafetyAssessment,
}

fn run_one(bench: &DesignedRobot, kind: &Kind, seed: u64) -> Done {
    let conditions = Conditions::drawn(bench, kind, seed);
    let verdict = assessment::assess(&conditions, &run::run(bench, &conditions));
    Done { seed, verdict }
}

fn row(kind: &Kind, done: &[Done]) -> FigureRow {
    for bad in done.iter().filter(|done| !done.verdict.unsafe_.is_empty()).take(5) {
        eprintln!("{}, --seed {}: {}", kind.name, bad.seed, bad.verdict.unsafe_.join("; "));
    }
    let unsafe_ = done.iter().filter(|done| !done.verdict.unsafe_.is_empty()).count();
    let mut names: BTreeMap<String, usize> = BTreeMap::new();
    for done in done {
        let name = done.verdict.fault.map_or("none".into(), |fault| format!("{fault:?}"));
        *names.entry(name).or_default() += 1;
    }
    let called: Vec<String> = names.iter().map(|(name, count)| format!("{name} {count}")).collect();
    let worst_s = crate::figures::run::worst(done.iter().filter_map(|done| done.verdict.driven_s));
    let heat = crate::figures::run::worst(done.iter().map(|done| done.verdict.heat));
    let required = match kind.broken {
        Broken::Found(_) => "off within the bound of what it is called; heat within its limit",
        Broken::Borne => "nothing unsafe; heat within its limit",
    };
    FigureRow::new(
        kind.name,
        required,
        format!(
            "{} runs; driven for at most {worst_s:.3} s; {}; heat at most {heat:.2}; unsafe {unsafe_}",
            done.len(),
            called.join(", ")
        ),
        !done.is_empty() && unsafe_ == 0,
        json!({
            "runs": done.len(), "worst_driven_s": worst_s, "called": names, "hottest": heat, "unsafe": unsafe_,
        }),
    )
}
