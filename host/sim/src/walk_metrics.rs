//! What a walk is judged by.

use hal_sim::body::{Snapshot, Speeds, Track};
use serde::Serialize;

use common::conventions::degrees;

/// The figures of a walk. x is ahead of the robot where it starts, y to its left; angles counter-clockwise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WalkMetrics {
    /// Mean speeds are taken from here on, s: over the second half of the run, to its end.
    pub speeds_from_s: f64,
    /// Mean speed ahead, mm/s, of the mean of the modules' centres.
    pub longitudinal_mm_per_s: Option<f64>,
    /// Mean speed to the left, mm/s.
    pub lateral_mm_per_s: Option<f64>,
    /// Mean turning rate of the line from the last module to the first, °/s.
    pub yaw_deg_per_s: Option<f64>,
    /// From start to end, mm: ahead and to the left.
    pub displacement_mm: [f64; 2],
    /// Change of the heading from start to end, °.
    pub turned_deg: f64,
    /// Length of the path of the mean of the modules' centres over the ground, its shaking included, mm.
    pub path_mm: f64,
    /// Lowest and highest centre of a module after the first tenth of the run, mm over the ground's zero.
    pub module_height_mm: [f64; 2],
    /// Largest angle between a module's axis and the vertical, °.
    pub tilt_deg: f64,
    /// Energy taken by the bridge over the distance from begin to end, both in the second half, J/m.
    pub energy_per_distance_j_per_m: Option<f64>,
    /// Share of the second half in which the ground carries a foot: of module 1 left and right, of module 2, …
    pub contact_share: Vec<f64>,
}

/// A run's second half, over which speeds are means; none for a track without snapshots.
pub(super) fn second_half(track: &Track) -> Option<&[Snapshot]> {
    let (first, last) = (track.snapshots.first()?, track.snapshots.last()?);
    let middle = 0.5 * (first.time_s + last.time_s);
    let half = track.snapshots.iter().position(|s| s.time_s >= middle - 1e-9)?;
    Some(&track.snapshots[half..])
}

/// Mean speeds, and from when to when they are taken, s: over the second half of a run. None where a module is clamped,
/// or for a run that is too short.
#[must_use]
pub fn mean_speeds(track: &Track) -> Option<(Speeds, [f64; 2])> {
    let late = second_half(track).filter(|_| track.plan.clamped.is_none())?;
    let time = [late[0].time_s, late[late.len() - 1].time_s];
    Some((track.speeds(time[0], time[1])?, time))
}

/// The figures of a walk; none where a module is clamped, or for a track without snapshots.
#[must_use]
pub fn walk_metrics(track: &Track) -> Option<WalkMetrics> {
    let late = second_half(track).filter(|_| track.plan.clamped.is_none())?;
    let (first, last) = (track.snapshots.first()?, track.snapshots.last()?);
    let half = track.snapshots.len() - late.len();
    let speeds = mean_speeds(track).map(|(speeds, _)| speeds);
    let (start, end) = (first.centroid(), last.centroid());
    let settled = &track.snapshots[track.snapshots.len() / 10..];
    let heights = settled.iter().flat_map(|s| s.modules.iter().map(|pose| 1e3 * pose.position[2]));
    let whole = track.speeds(first.time_s, last.time_s);
    Some(WalkMetrics {
        speeds_from_s: late[0].time_s,
        longitudinal_mm_per_s: speeds.map(|s| 1e3 * s.longitudinal),
        lateral_mm_per_s: speeds.map(|s| 1e3 * s.lateral),
        yaw_deg_per_s: speeds.map(|s| degrees(s.yaw)),
        displacement_mm: [0, 1].map(|axis| 1e3 * (end[axis] - start[axis])),
        turned_deg: whole.map_or(0.0, |s| degrees(s.yaw * (last.time_s - first.time_s))),
        path_mm: 1e3 * track.snapshots.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum::<f64>(),
        module_height_mm: heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]),
        tilt_deg: tilt(track),
        energy_per_distance_j_per_m: track.energy_per_distance(half, track.snapshots.len() - 1),
        contact_share: contact_share(late),
    })
}

/// Over the ground, of the mean of the modules' centres, m.
fn distance(a: &Snapshot, b: &Snapshot) -> f64 {
    let (a, b) = (a.centroid(), b.centroid());
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Largest angle between a module's z axis and the world's, °.
pub(super) fn tilt(track: &Track) -> f64 {
    let upright = |[_, x, y, _]: [f64; 4]| 1.0 - 2.0 * (x * x + y * y);
    let modules = track.snapshots.iter().flat_map(|snapshot| &snapshot.modules);
    degrees(modules.map(|module| upright(module.orientation).clamp(-1.0, 1.0).acos()).fold(0.0, f64::max))
}

/// Of every foot: the share of the snapshots in which the ground carries it.
pub(super) fn contact_share(snapshots: &[Snapshot]) -> Vec<f64> {
    let feet = snapshots.first().map_or(0, |s| s.feet.len());
    let touching = |foot: usize| snapshots.iter().filter(|s| s.feet[foot].touches()).count();
    (0..feet).map(|foot| touching(foot) as f64 / snapshots.len() as f64).collect()
}
