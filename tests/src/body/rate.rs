//! Steps per second on one thread, beside MuJoCo's fastest setting on the same robot: the fastest of those that are timed in
//! the same run.

use hal_sim::body::{Precision, Settings};
use mjcf::Options;
use serde::Deserialize;
use serde_json::json;

use super::PeerSetup;
use super::peer::{Peer, PeerError, not_compared};
use super::processor::processor;
use super::reference::{Condition, conditions, ensemble, plan};
use super::stopwatch::Stopwatch;
use crate::row::FigureRow;

/// Of a run, s of the robot.
const LENGTH_S: f64 = 2.0;
/// Runs of ours before MuJoCo's, and again after.
const REPEATS: usize = 5;
/// The robot that is timed alone.
const ALONE: Condition = Condition { alpha_deg: 60.0, frequency_hz: 7.0 };
/// What is timed, with the ratio that is required.
const CASES: [(&str, bool, Precision, f64); 3] = [
    ("one robot, f64", false, Precision::Double, 60.0),
    ("per thread in a batch of 24 conditions, f64", true, Precision::Double, 120.0),
    ("per thread in a batch of 24 conditions, f32", true, Precision::Single, 240.0),
];

/// What the script prints.
#[derive(Deserialize)]
struct Printed {
    single: Vec<Timed>,
}

#[derive(Deserialize)]
struct Timed {
    setting: String,
    steps_per_s: f64,
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let mut ours = CASES.map(|case| times(bench, case));
    let theirs = match bench.peer.as_ref().map(|peer| simulated(peer, bench)) {
        Ok(theirs) => theirs,
        Err(PeerError::Missing(path)) => Err(PeerError::Missing(path.clone())),
        Err(why) => Err(PeerError::Script { script: "timing.py", message: why.to_string() }),
    };
    for (ours, case) in ours.iter_mut().zip(CASES) {
        ours.extend(times(bench, case));
    }
    let rates = ours.map(|mut rates| {
        rates.sort_by(f64::total_cmp);
        rates[rates.len() / 2]
    });
    let mut rows: Vec<FigureRow> = CASES.iter().zip(rates).map(|(case, rate)| row(case, rate, &theirs)).collect();
    if let Ok(theirs) = theirs {
        let text: Vec<_> = theirs.iter().map(|timed| format!("{}: {:.0}", timed.setting, timed.steps_per_s)).collect();
        let numbers: Vec<_> = theirs.iter().map(|timed| json!([timed.setting, timed.steps_per_s])).collect();
        rows.push(FigureRow::beside("beside it: the processor", processor(), json!(processor())));
        rows.push(FigureRow::beside("beside it: MuJoCo's settings, steps per second", text.join("; "), json!(numbers)));
    }
    rows
}

fn row(case: &(&str, bool, Precision, f64), rate: f64, theirs: &Result<Vec<Timed>, PeerError>) -> FigureRow {
    let (name, _, _, ratio) = case;
    let what =
        format!("steps per second at 1e-4 s, 97 degrees of freedom on the ground: {name}, against MuJoCo's fastest");
    let required = format!("{ratio} times");
    let fastest = match theirs {
        Ok(theirs) => theirs.iter().max_by(|a, b| a.steps_per_s.total_cmp(&b.steps_per_s)),
        Err(why) => return not_compared(&what, &required, why),
    };
    let Some(Timed { setting, steps_per_s: theirs }) = fastest else {
        return FigureRow::new(&what, &required, "MuJoCo was not timed".into(), false, json!(null));
    };
    let reached = rate / theirs;
    FigureRow::new(
        &what,
        &required,
        format!("{reached:.1} times: {rate:.0} to {theirs:.0} of {setting} (processor time, medians)"),
        reached >= *ratio,
        json!({ "ratio": reached, "steps_per_s": rate, "steps_per_s_mujoco": theirs }),
    )
}

fn simulated(peer: &Peer, bench: &PeerSetup) -> Result<Vec<Timed>, PeerError> {
    let model = peer.export("timed", &plan(&bench.robot, ALONE.alpha_deg), &Options::default());
    let words = ["single".into(), format!("--frequency={}", ALONE.frequency_hz), "--repeats=5".into()];
    peer.run("timing.py", &words, &[model]).map(|printed: Printed| printed.single)
}

/// Steps of a body per second of processor time, of each repeat.
fn times(bench: &PeerSetup, (_, batch, precision, _): (&str, bool, Precision, f64)) -> Vec<f64> {
    let settings = Settings { precision, ..Settings::default() };
    let which = if batch { conditions() } else { vec![ALONE] };
    let steps = (LENGTH_S / settings.step_s).round() as usize;
    let once = |_| {
        let (mut bodies, drives) = ensemble(&bench.robot, &which, settings);
        let watch = Stopwatch::start();
        bodies.advance(steps, &drives);
        let busy_s = watch.busy_s();
        // A robot that has blown up is quick, too.
        let whole = (0..bodies.len()).all(|i| bodies.snapshot(i).centroid().iter().all(|x| x.is_finite()));
        if whole { (steps * bodies.len()) as f64 / busy_s } else { 0.0 }
    };
    (0..REPEATS).map(once).collect()
}
