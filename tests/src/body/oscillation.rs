//! A backbone let go: module 1 clamped, a passive module on the end, no gravity, every hinge of one axis turned alike.

use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::{Drive, Ensemble, Plan};
use mjcf::Options;
use serde::Deserialize;
use serde_json::json;

use super::PeerSetup;
use super::peer::{Peer, PeerError, not_compared};
use super::reference::{at_step, pair};
use crate::row::FigureRow;

/// The axes with the angle of each hinge at the start, rad.
const AXES: [(&str, f64); 3] = [("x", 0.02), ("y", 0.01), ("z", 0.01)];
/// MuJoCo's step in this comparison, s: its result does not change with smaller ones.
const FINE_S: f64 = 1e-5;
/// Our step, and time between two samples, s.
const STEP_S: f64 = 1e-4;
/// Length of a run, s.
const LENGTH_S: f64 = 1.0;
/// Peaks that the fit uses.
const PEAKS: usize = 5;

/// What a decaying oscillation does.
#[derive(Clone, Copy, Debug)]
struct Oscillation {
    frequency_hz: f64,
    /// Logarithm of the ratio of two successive peaks.
    decrement: f64,
}

/// What the script prints.
#[derive(Deserialize)]
struct Printed {
    sample_s: f64,
    angle: Vec<f64>,
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    AXES.iter().enumerate().map(|(axis, (name, angle))| row(bench, axis, name, *angle)).collect()
}

fn row(bench: &PeerSetup, axis: usize, name: &str, angle: f64) -> FigureRow {
    let what = format!("free oscillation about {name} at {STEP_S} s against MuJoCo at {FINE_S} s");
    let required = "frequency 0.2 %, decrement 2 %";
    let plan = clamped(bench);
    let theirs = match &bench.peer {
        Ok(peer) => match simulated(peer, &plan, name, angle) {
            Ok(theirs) => theirs,
            Err(why) => return not_compared(&what, required, &why),
        },
        Err(why) => return not_compared(&what, required, why),
    };
    let ours = fitted(&run(&plan, axis, angle), STEP_S);
    let off = |a: f64, b: f64| a / b - 1.0;
    let frequency = off(ours.frequency_hz, theirs.frequency_hz);
    let decrement = off(ours.decrement, theirs.decrement);
    FigureRow::new(
        &what,
        required,
        format!(
            "{:.4} Hz ({:+.3} %), {:.4} ({:+.2} %)",
            ours.frequency_hz,
            100.0 * frequency,
            ours.decrement,
            100.0 * decrement
        ),
        frequency.abs() <= 0.002 && decrement.abs() <= 0.02,
        json!({
            "frequency_hz": ours.frequency_hz, "frequency_mujoco_hz": theirs.frequency_hz,
            "decrement": ours.decrement, "decrement_mujoco": theirs.decrement,
        }),
    )
}

fn clamped(bench: &PeerSetup) -> Plan {
    Plan { clamped: Some(0), eccentric: None, contact: None, gravity: [0.0; 3], ..pair(&bench.robot, 0.0) }
}

fn simulated(peer: &Peer, plan: &Plan, axis: &str, angle: f64) -> Result<Oscillation, PeerError> {
    let model = peer.export("clamped", plan, &Options::default());
    let words = [
        format!("--axis={axis}"),
        format!("--angle={angle}"),
        format!("--step={FINE_S}"),
        format!("--sample={STEP_S}"),
        format!("--seconds={LENGTH_S}"),
    ];
    let printed: Printed = peer.run("oscillation.py", &words, &[model])?;
    Ok(fitted(&printed.angle, printed.sample_s))
}

/// The sum of the axis's angles at every step.
fn run(plan: &Plan, axis: usize, angle: f64) -> Vec<f64> {
    let made = Ensemble::new(std::slice::from_ref(plan), at_step(STEP_S));
    let mut body = made.unwrap_or_else(|error| panic!("{error}"));
    let mut start = Coordinates::nominal(plan);
    for angles in &mut start.angles {
        angles[axis] = angle;
    }
    body.put(0, &start);
    let steps = (LENGTH_S / STEP_S).round() as usize;
    let at = |body: &Ensemble| body.coordinates(0).angles.iter().map(|angles| angles[axis]).sum();
    let mut seen = vec![at(&body)];
    for _ in 0..steps {
        // There is no rotor to drive.
        body.advance(1, &[Drive::Phase { speed: 0.0 }]);
        seen.push(at(&body));
    }
    seen
}

/// Frequency and decrement from the first positive peaks, each the top of a parabola through three samples.
fn fitted(angle: &[f64], sample_s: f64) -> Oscillation {
    let peak = |(i, y): (usize, &[f64])| {
        let (bend, slope) = (0.5 * (y[0] - 2.0 * y[1] + y[2]), 0.5 * (y[2] - y[0]));
        let is_peak = y[1] > y[0] && y[1] >= y[2] && y[1] > 0.0;
        is_peak.then(|| (((i + 1) as f64 - 0.5 * slope / bend) * sample_s, y[1] - 0.25 * slope * slope / bend))
    };
    let peaks: Vec<(f64, f64)> = angle.windows(3).enumerate().filter_map(peak).take(PEAKS).collect();
    let (Some(first), Some(last)) = (peaks.first(), peaks.last()) else {
        return Oscillation { frequency_hz: f64::NAN, decrement: f64::NAN };
    };
    let periods = (peaks.len() - 1) as f64;
    Oscillation { frequency_hz: periods / (last.0 - first.0), decrement: (first.1 / last.1).ln() / periods }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_known_oscillation_is_found() {
        let at = |k: i32| {
            let t = f64::from(k) * 1e-4;
            (-3.0 * t).exp() * (TAU * 5.0 * t).cos()
        };
        let angle: Vec<f64> = (0..12_000).map(at).collect();
        let found = fitted(&angle, 1e-4);
        assert!((found.frequency_hz - 5.0).abs() < 1e-4, "{found:?}");
        assert!((found.decrement - 0.6).abs() < 1e-4, "{found:?}");
    }
}
