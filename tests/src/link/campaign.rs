//! The fault campaign: every fault in every mode, many times.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde_json::json;
use testbed::event_log::Detail;

use super::Options;
use super::assessment::{LinkAssessment, assess, bound_of_case};
use super::fault::{CASES, Case, Host, Must, NOTHING};
use super::mode::{MODES, Mode};
use super::rig::Template;
use super::run::{Task, Trace, run};
use crate::figures::run::{DesignedRobot, worst};
use crate::row::FigureRow;

/// Runs of a fault per seed of the campaign.
const MODE_COUNT: u64 = MODES.len() as u64;

/// A run of the campaign.
struct Done {
    mode: Mode,
    seed: u64,
    verdict: LinkAssessment,
}

/// The rows: one a fault, and one without any.
#[must_use]
pub fn rows(bench: &DesignedRobot, options: &Options) -> Vec<FigureRow> {
    let wanted: Vec<&Case> =
        CASES.iter().filter(|case| options.fault.as_deref().is_none_or(|part| case.name.contains(part))).collect();
    let bridge = Template::new(&bench.robot, 1, Detail::Bridge);
    let everything = Template::new(&bench.robot, 1, Detail::Everything);
    let a_seed = wanted.len() as u64 * MODES.len() as u64;
    let seeds: Vec<u64> = match options.seed {
        Some(seed) => vec![seed],
        None => (0..options.runs.div_ceil(a_seed.max(1))).collect(),
    };
    let tasks: Vec<Task> = seeds
        .iter()
        .flat_map(|seed| MODES.map(|mode| Task { mode, seed: 1 + seed * MODE_COUNT + mode as u64 }))
        .collect();
    let done: Vec<(usize, Done)> = tasks
        .par_iter()
        .flat_map(|task| {
            let healthy = run(&bridge, *task, None);
            let verdict = assess(&bench.parameters, &NOTHING, task.mode, &healthy, &healthy);
            let unbroken = (wanted.len(), Done { mode: task.mode, seed: (task.seed - 1) / MODE_COUNT, verdict });
            let broken = wanted
                .par_iter()
                .enumerate()
                .map(|(index, case)| {
                    // Whoever replays must have recorded.
                    let template = if case.host == Host::IsReplayed { &everything } else { &bridge };
                    let trace: Trace = run(template, *task, Some(case));
                    let verdict = assess(&bench.parameters, case, task.mode, &trace, &healthy);
                    (index, Done { mode: task.mode, seed: (task.seed - 1) / MODE_COUNT, verdict })
                })
                .collect::<Vec<_>>();
            broken.into_par_iter().chain([unbroken])
        })
        .collect();
    let mut by_case: BTreeMap<usize, Vec<Done>> = BTreeMap::new();
    done.into_iter().for_each(|(index, done)| by_case.entry(index).or_default().push(done));
    by_case.iter().map(|(index, done)| row(bench, wanted.get(*index).copied().unwrap_or(&NOTHING), done)).collect()
}

fn row(bench: &DesignedRobot, case: &Case, done: &[Done]) -> FigureRow {
    let count = |is: &dyn Fn(&Done) -> bool| done.iter().filter(|done| is(done)).count();
    let unsafe_ = count(&|done| !done.verdict.unsafe_.is_empty());
    for bad in done.iter().filter(|done| !done.verdict.unsafe_.is_empty()).take(5) {
        eprintln!("{}, {:?}, --seed {}: {}", case.name, bad.mode, bad.seed, bad.verdict.unsafe_.join("; "));
    }
    let can_show = count(&|done| case.shows(done.mode));
    // A run without a fault is what the others are compared with.
    let can_show = if case.name == NOTHING.name { 0 } else { can_show };
    let silent = count(&|done| can_show > 0 && case.shows(done.mode) && !done.verdict.changed.any());
    for bad in done.iter().filter(|done| can_show > 0 && case.shows(done.mode) && !done.verdict.changed.any()).take(5) {
        eprintln!("{}, {:?}, --seed {}: changed nothing", case.name, bad.mode, bad.seed);
    }
    let off_s = worst(done.iter().filter_map(|done| done.verdict.off_s));
    let gone_s = worst(done.iter().filter_map(|done| done.verdict.gone_s));
    let share = |is: &dyn Fn(&Done) -> bool| 100.0 * count(is) as f64 / done.len().max(1) as f64;
    let changed = format!(
        "bridge {:.0} %, readings {:.0} %, counters {:.0} %, air {:.0} %, session {:.0} %",
        share(&|done| done.verdict.changed.bridge),
        share(&|done| done.verdict.changed.readings),
        share(&|done| done.verdict.changed.counters),
        share(&|done| done.verdict.changed.air),
        share(&|done| done.verdict.changed.session)
    );
    let apart = if can_show == done.len() { String::new() } else { format!(" ({} cannot)", done.len() - can_show) };
    let mut names: BTreeMap<String, usize> = BTreeMap::new();
    for name in done.iter().filter_map(|done| done.verdict.stopped) {
        *names.entry(name.map_or("no fault".into(), |cause| format!("{cause:?}"))).or_default() += 1;
    }
    let called: Vec<String> = names.iter().map(|(name, count)| format!("{name} {count}")).collect();
    let on = count(&|done| done.verdict.gone_s.is_some());
    let idle = count(&|done| done.mode == Mode::Idle);
    let bound_s = bound_of_case(&bench.parameters, case);
    let outcome = match case.must {
        Must::Found(_) | Must::LinkLost | Must::HeldBack | Must::AtOnce | Must::Bitten | Must::Bounded(_) => "off",
        Must::GoOn => "goes on",
        Must::Either => "either, but safe",
    };
    let required = match bound_s {
        Some(bound_s) => format!("{outcome} within {bound_s:.3} s; nothing unsafe; shown"),
        None => format!("{outcome}; nothing unsafe; shown"),
    };
    let stopped = if called.is_empty() {
        String::new()
    } else {
        format!("off by itself, worst {off_s:.3} s ({}); ", called.join(", "))
    };
    let went_on = if on == 0 {
        String::new()
    } else {
        format!("{on} went on, off {gone_s:.3} s after the console's last frame; ")
    };
    FigureRow::new(
        case.name,
        &required,
        format!(
            "{} runs, {idle} of them idle; {stopped}{went_on}changed: {changed}, nothing in {silent}{apart}; unsafe {unsafe_}",
            done.len()
        ),
        !done.is_empty() && unsafe_ == 0 && silent == 0,
        json!({
            "runs": done.len(), "outcome": outcome, "bound_s": bound_s, "worst_off_s": off_s, "went_on": on,
            "worst_off_after_console_s": gone_s, "called": names, "changed": changed, "changed_nothing": silent,
            "cannot_show": done.len() - can_show, "unsafe": unsafe_,
        }),
    )
}
