//! The speeds on the ground against the limit of small steps.

use robot_file::Robot;
use serde_json::json;

use super::PeerSetup;
use super::error_measures::{percent, rms_over_largest, slope, worst};
use super::reference::{Condition, at_step, conditions, speeds};
use crate::row::FigureRow;

/// The step that is judged, s; the others are halves of halves of it.
const STEP_S: f64 = 1e-4;
/// How often it is halved for the limit.
const HALVINGS: i32 = 4;

/// The speeds at a step and its halves, and their limit.
#[derive(Clone, Debug)]
pub struct Refined {
    /// At `1e-4 s / 2^k`.
    pub tables: Vec<Vec<[f64; 3]>>,
    /// Richardson's extrapolation of the finest two with the order that the last three show, 1 to 2.
    pub limit: Vec<[f64; 3]>,
}

/// Runs conditions at ever smaller steps.
#[must_use]
pub fn refined(robot: &Robot, conditions: &[Condition]) -> Refined {
    let at = |halvings| speeds(robot, conditions, at_step(STEP_S / f64::from(2_i32.pow(halvings))), 2);
    let tables: Vec<_> = (0..=HALVINGS as u32).map(at).collect();
    let [.., coarse, middle, fine] = tables.as_slice() else { return Refined { limit: Vec::new(), tables } };
    let size = |a: &[[f64; 3]], b: &[[f64; 3]]| rms_over_largest(a, b).iter().sum::<f64>();
    let order = (size(coarse, middle) / size(middle, fine)).log2().clamp(1.0, 2.0);
    let extrapolated = |(fine, middle): (&[f64; 3], &[f64; 3])| {
        [0, 1, 2].map(|part| fine[part] + (fine[part] - middle[part]) / (order.exp2() - 1.0))
    };
    let limit = fine.iter().zip(middle).map(extrapolated).collect();
    Refined { tables, limit }
}

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let Refined { tables, limit } = refined(&bench.robot, &conditions());
    let off: Vec<[f64; 3]> = tables.iter().map(|table| rms_over_largest(table, &limit)).collect();
    // Of the error's size over all three, at the steps that are well above the limit's own error.
    let judged = off.len() - 2;
    let size = |off: &[f64; 3]| (off.iter().map(|share| share * share).sum::<f64>() / 3.0).sqrt();
    let points: Vec<(f64, f64)> =
        off[..judged].iter().enumerate().map(|(halvings, off)| (-(halvings as f64), size(off).log2())).collect();
    let order = slope(&points);
    let steps: Vec<String> = off[..judged].iter().map(|off| percent(*off)).collect();
    let numbers = json!({ "rms_over_largest": off, "order": order });
    vec![
        FigureRow::new(
            "own 24 speeds at 1e-4 s against the limit of small steps: RMS over the largest, vx/vy/yaw",
            "2 %",
            percent(off[0]),
            worst(off[0]) <= 0.02,
            numbers,
        ),
        FigureRow::new(
            "their order of convergence on the ground",
            "above 1",
            format!("{order:.2}, from 1e-4 s halved: {}", steps.join(", ")),
            order > 1.0,
            json!({ "order": order }),
        ),
    ]
}
