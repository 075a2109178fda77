//! A robot that is alike on the left and on the right, turned the other way round, walks its own mirror image.

use serde_json::json;

use super::PeerSetup;
use super::error_measures::{percent, rms_over_largest, worst};
use super::reference::{Condition, at_step, conditions, speeds};
use crate::row::FigureRow;

/// Runs the campaign; the table has one row.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let settings = at_step(1e-4);
    let straight = speeds(&bench.robot, &conditions(), settings, 2);
    let other: Vec<Condition> = conditions().into_iter().map(Condition::mirrored).collect();
    let mirrored = speeds(&bench.robot, &other, settings, 2);
    let image: Vec<[f64; 3]> = mirrored.iter().map(|[vx, vy, yaw]| [*vx, -vy, -yaw]).collect();
    let off = rms_over_largest(&image, &straight);
    vec![FigureRow::new(
        "the mirror (α, f) ↔ (180° − α, −f): vx even, vy and yaw odd; RMS over the largest, vx/vy/yaw",
        "1 %",
        format!("{} over 24 pairs", percent(off)),
        worst(off) <= 0.01,
        json!({ "rms_over_largest": off }),
    )]
}
