//! The bench of the thesis's Fig. 2.1: two modules, the rear one held fast, nothing under the feet, the eccentric at a
//! prescribed phase. Where the left foot of the front module goes.

use std::f64::consts::TAU;
use std::path::PathBuf;

use hal_sim::body::{Drive, Ensemble, Plan};
use mjcf::Options;
use serde::Deserialize;
use serde_json::json;

use super::PeerSetup;
use super::peer::{Peer, PeerError, not_compared};
use super::reference::{ALPHAS_DEG, Condition, FREQUENCIES_HZ, at_step, conditions, pair};
use crate::row::FigureRow;

/// Our step, s.
const STEP_S: f64 = 1e-4;
/// MuJoCo's steps in this comparison, s. Its paths converge with the first order and are still 2.7 % off at the finer one:
/// both together give the limit of small steps, to 0.1 %.
const FINE_S: [f64; 2] = [1e-4, 5e-5];
/// From when to when the paths are compared, s: the last periods.
const SPAN_S: [f64; 2] = [1.5, 2.0];
/// Time between two points, s.
const SAMPLE_S: f64 = 1e-3;

type Path = Vec<[f64; 3]>;

/// What the script prints.
#[derive(Deserialize)]
struct Printed {
    paths: Vec<Path>,
}

/// Runs the campaign; the table has one row.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let what = "foot path, two modules, rear one clamped, no contact, prescribed rotor, against MuJoCo's limit of small steps: \
                worst of ±6–8 Hz × α 0–120°";
    let required = "1 % RMS of its size";
    let theirs = match bench.peer.as_ref() {
        Ok(peer) => match simulated(peer, bench) {
            Ok(theirs) => theirs,
            Err(why) => return vec![not_compared(what, required, &why)],
        },
        Err(why) => return vec![not_compared(what, required, why)],
    };
    let conditions = conditions();
    let off: Vec<f64> = conditions.iter().zip(&theirs).map(|(at, path)| difference(&run(bench, *at), path)).collect();
    let worst = off.iter().copied().fold(0.0, f64::max);
    let at = off.iter().position(|share| *share == worst).map_or(conditions[0], |index| conditions[index]);
    vec![FigureRow::new(
        what,
        required,
        format!(
            "{:.3} % at α {}°, {:+} Hz counter-clockwise; size: RMS about the path's mean",
            100.0 * worst,
            at.alpha_deg,
            at.frequency_hz
        ),
        worst <= 0.01 && theirs.len() == conditions.len(),
        json!({ "rms_over_size": off }),
    )]
}

fn clamped(bench: &PeerSetup, alpha_deg: f64) -> Plan {
    Plan { clamped: Some(1), contact: None, ..pair(&bench.robot, alpha_deg) }
}

fn simulated(peer: &Peer, bench: &PeerSetup) -> Result<Vec<Path>, PeerError> {
    let export = |alpha: &f64| peer.export(&format!("bench{alpha}"), &clamped(bench, *alpha), &Options::default());
    let models: Vec<PathBuf> = ALPHAS_DEG.iter().map(export).collect();
    let at = |step_s: f64| {
        let words = [
            Peer::frequencies(&FREQUENCIES_HZ),
            "--foot=foot1L".into(),
            format!("--from={}", SPAN_S[0]),
            format!("--seconds={}", SPAN_S[1]),
            format!("--step={step_s}"),
            format!("--sample={SAMPLE_S}"),
        ];
        peer.run("foot_path.py", &words, &models).map(|printed: Printed| printed.paths)
    };
    let [coarse, fine] = FINE_S.map(at);
    Ok(coarse?.iter().zip(&fine?).map(|(coarse, fine)| extrapolated(coarse, fine)).collect())
}

/// Richardson's limit of a path that converges with the first order, from a step and half of it.
fn extrapolated(coarse: &[[f64; 3]], fine: &[[f64; 3]]) -> Path {
    coarse.iter().zip(fine).map(|(a, b)| [0, 1, 2].map(|axis| 2.0 * b[axis] - a[axis])).collect()
}

fn run(bench: &PeerSetup, at: Condition) -> Path {
    let made = Ensemble::new(&[clamped(bench, at.alpha_deg)], at_step(STEP_S));
    let mut body = made.unwrap_or_else(|error| panic!("{error}"));
    let drive = [Drive::Phase { speed: TAU * at.frequency_hz }];
    let steps = |time_s: f64| (time_s / STEP_S).round() as usize;
    body.advance(steps(SPAN_S[0]), &drive);
    let mut path = vec![body.snapshot(0).feet[0].position];
    for _ in 0..((SPAN_S[1] - SPAN_S[0]) / SAMPLE_S).round() as usize {
        body.advance(steps(SAMPLE_S), &drive);
        path.push(body.snapshot(0).feet[0].position);
    }
    path
}

/// RMS distance of two paths over the RMS distance of the second one from its mean. Infinite where a number is missing.
fn difference(ours: &[[f64; 3]], theirs: &[[f64; 3]]) -> f64 {
    if ours.len() != theirs.len() || theirs.is_empty() {
        return f64::INFINITY;
    }
    let count = theirs.len() as f64;
    let mean = [0, 1, 2].map(|axis| theirs.iter().map(|point| point[axis]).sum::<f64>() / count);
    let square = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>();
    let off: f64 = ours.iter().zip(theirs).map(|(a, b)| square(a, b)).sum();
    let size: f64 = theirs.iter().map(|point| square(point, &mean)).sum();
    let share = (off / size).sqrt();
    if share.is_finite() { share } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_without_numbers_is_infinitely_wrong() {
        let path = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        assert_eq!(difference(&path, &path), 0.0);
        let aside = path.map(|[x, _, z]| [x, 0.5, z]);
        assert!((difference(&aside, &path) - 0.5).abs() < 1e-12, "0.5 beside a size of 1");
        let broken = [[0.0, f64::NAN, 0.0], [2.0, 0.0, 0.0]];
        for (ours, theirs) in [(&broken[..], &path[..]), (&path, &broken), (&path, &path[..1]), (&[], &[])] {
            assert_eq!(difference(ours, theirs), f64::INFINITY);
        }
        assert_eq!(difference(&path, &[[1.0; 3]; 2]), f64::INFINITY, "a point has no size");
    }
}
