//! What a run of a clamped robot is judged by: it goes nowhere, its feet draw their paths.

use hal_sim::body::Track;
use serde::Serialize;

use super::walk_metrics::{contact_share, second_half, tilt};

/// The figures of a run with a module held fast. x is ahead of the robot where it starts, y to its left.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClampedMetrics {
    /// The module that is held fast, 1 is the front one.
    pub clamped_module: usize,
    /// The feet's paths are taken from here on, s: over the second half of the run, to its end.
    pub feet_from_s: f64,
    /// Size of every foot's path ahead, aside and up, mm: of module 1 left and right, of module 2, …
    pub foot_path_mm: Vec<[f64; 3]>,
    /// Largest angle between a module's axis and the vertical, °.
    pub tilt_deg: f64,
    /// Share of the second half in which the ground carries a foot, as the paths are ordered.
    pub contact_share: Vec<f64>,
}

/// The figures of a run; none where no module is clamped, or for a track without snapshots.
#[must_use]
pub fn clamped_metrics(track: &Track) -> Option<ClampedMetrics> {
    let clamped = track.plan.clamped?;
    let late = second_half(track)?;
    let size = |foot: usize, axis: usize| {
        let reach = late.iter().map(|snapshot| 1e3 * snapshot.feet[foot].position[axis]);
        let (low, high) = reach.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        high - low
    };
    Some(ClampedMetrics {
        clamped_module: clamped + 1,
        feet_from_s: late[0].time_s,
        foot_path_mm: (0..late[0].feet.len()).map(|foot| [0, 1, 2].map(|axis| size(foot, axis))).collect(),
        tilt_deg: tilt(track),
        contact_share: contact_share(late),
    })
}
