//! 12 conditions of 2 s at equal error: each simulator at its cheapest setting whose speeds are within a bound of its own
//! converged ones, on two threads. The robot is alike on its left and right: frequencies of one sign say all.

use std::time::Instant;

use hal_sim::body::{Ensemble, Precision, Settings};
use serde::Deserialize;
use serde_json::json;

use super::PeerSetup;
use super::convergence::refined;
use super::error_measures::{percent, rms_over_largest, worst};
use super::peer::{Peer, PeerError, not_compared};
use super::processor::processor;
use super::reference::{ALPHAS_DEG, Condition, plan, speeds};
use super::walking::models;
use crate::row::FigureRow;

/// Errors to be kept, each of vx, vy and yaw: RMS over the largest.
const BOUNDS: [f64; 2] = [0.02, 0.05];
/// Counter-clockwise, Hz.
const FREQUENCIES_HZ: [f64; 3] = [6.0, 7.0, 8.0];
/// The step whose own error is a bound as well, s.
const NAMED_STEP_S: f64 = 2.5e-4;
/// How much faster.
const REQUIRED: f64 = 40.0;
/// Our steps, s.
const STEPS_S: [f64; 7] = [1e-4, 1.25e-4, 2e-4, 2.5e-4, 4e-4, 5e-4, 1e-3];
/// Every angle at every frequency, the frequencies of an angle together.
fn conditions() -> Vec<Condition> {
    let at = |alpha_deg| FREQUENCIES_HZ.map(|frequency_hz| Condition { alpha_deg, frequency_hz });
    ALPHAS_DEG.into_iter().flat_map(at).collect()
}

/// Runs of ours, the median counts.
const REPEATS: usize = 5;

/// A setting with what it costs and how wrong it is.
#[derive(Clone, Debug, Deserialize)]
struct TimedSetting {
    setting: String,
    step_s: f64,
    wall_s: f64,
    error: [f64; 3],
}

/// What the script prints.
#[derive(Deserialize)]
struct Printed {
    sweep: Vec<TimedSetting>,
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let ours = own(bench);
    let theirs = match bench.peer.as_ref().map(|peer| simulated(peer, bench)) {
        Ok(theirs) => theirs,
        Err(PeerError::Missing(path)) => Err(PeerError::Missing(path.clone())),
        Err(why) => Err(PeerError::Script { script: "timing.py", message: why.to_string() }),
    };
    let mut rows: Vec<FigureRow> = BOUNDS
        .iter()
        .map(|bound| row(*bound, &format!("{} % of the own limit, cheapest settings", 100.0 * bound), &ours, &theirs))
        .collect();
    // At the named step its cheapest precision alone, against what MuJoCo needs for the same error.
    let named: Vec<_> = ours.iter().filter(|tried| tried.step_s == NAMED_STEP_S).cloned().collect();
    if let Some(error) = named.iter().map(|tried| worst(tried.error)).reduce(f64::max) {
        let within = format!("the error of our {NAMED_STEP_S:e} s, {:.1} %", 100.0 * error);
        rows.push(row(error, &within, &named, &theirs));
    }
    rows.push(FigureRow::beside("beside it: the processor", processor(), json!(processor())));
    rows.push(beside("beside it: our settings", &ours));
    if let Ok(theirs) = theirs {
        rows.push(beside("beside it: MuJoCo's settings", &theirs));
    }
    rows
}

fn row(bound: f64, within: &str, ours: &[TimedSetting], theirs: &Result<Vec<TimedSetting>, PeerError>) -> FigureRow {
    let what = format!("12 conditions × 2 s within {within}, two threads");
    let required = format!("{REQUIRED} times faster");
    let theirs = match theirs {
        Ok(theirs) => theirs,
        Err(why) => return not_compared(&what, &required, why),
    };
    let (Some(ours), Some(theirs)) = (cheapest(ours, bound), cheapest(theirs, bound)) else {
        let measured = "no setting that was tried is that exact".into();
        return FigureRow::new(&what, &required, measured, false, json!(null));
    };
    let ratio = theirs.wall_s / ours.wall_s;
    let text = |tried: &TimedSetting| format!("{:.3} s ({}: {})", tried.wall_s, tried.setting, percent(tried.error));
    FigureRow::new(
        &what,
        &required,
        format!("{ratio:.1} times: {} to MuJoCo's {}", text(ours), text(theirs)),
        ratio >= REQUIRED,
        json!({ "ratio": ratio, "wall_s": ours.wall_s, "wall_mujoco_s": theirs.wall_s }),
    )
}

fn cheapest(tried: &[TimedSetting], bound: f64) -> Option<&TimedSetting> {
    tried.iter().filter(|tried| worst(tried.error) <= bound).min_by(|a, b| a.wall_s.total_cmp(&b.wall_s))
}

fn beside(what: &str, tried: &[TimedSetting]) -> FigureRow {
    let text: Vec<String> =
        tried.iter().map(|t| format!("{}: {} in {:.3} s", t.setting, percent(t.error), t.wall_s)).collect();
    let numbers: Vec<_> = tried.iter().map(|t| json!([t.setting, t.wall_s, t.error])).collect();
    FigureRow::beside(what, text.join("\n"), json!(numbers))
}

fn own(bench: &PeerSetup) -> Vec<TimedSetting> {
    let limit = refined(&bench.robot, &conditions()).limit;
    let settings = STEPS_S.into_iter().flat_map(|step_s| {
        [("f64", Precision::Double), ("f32", Precision::Single)]
            .map(|(name, precision)| (format!("{name}, {step_s:e} s"), Settings { step_s, precision }))
    });
    let tried = |(setting, settings): (String, Settings)| {
        let mut walls = Vec::new();
        let mut reached = Vec::new();
        for _ in 0..REPEATS {
            let start = Instant::now();
            reached = speeds(&bench.robot, &conditions(), settings, 2);
            walls.push(start.elapsed().as_secs_f64());
        }
        walls.sort_by(f64::total_cmp);
        TimedSetting {
            setting,
            step_s: settings.step_s,
            wall_s: walls[REPEATS / 2],
            error: rms_over_largest(&reached, &limit),
        }
    };
    // A step that the feet's stiffness forbids is no setting.
    let carried = |settings: Settings| Ensemble::new(&[plan(&bench.robot, 0.0)], settings).is_ok();
    settings.filter(|(_, settings)| carried(*settings)).map(tried).collect()
}

fn simulated(peer: &Peer, bench: &PeerSetup) -> Result<Vec<TimedSetting>, PeerError> {
    let cache = bench.out.join("mujoco-converged");
    let words = [
        "sweep".into(),
        Peer::frequencies(&FREQUENCIES_HZ),
        // Its slowest settings take half a minute: once is enough.
        "--repeats=1".into(),
        format!("--cache={}", cache.display()),
    ];
    peer.run("timing.py", &words, &models(peer, &bench.robot)).map(|printed: Printed| printed.sweep)
}
