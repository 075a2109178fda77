//! A run as it is kept: snapshots at even times, and the speeds that the thesis defines.

use super::plan::Plan;
use super::snapshot::Snapshot;
use crate::robot::wrap;

/// Motion of a robot: snapshots at a fixed interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Geometry and masses of the robot that moved.
    pub plan: Plan,
    /// At even times, the first at the start.
    pub snapshots: Vec<Snapshot>,
    /// Electrical energy taken by the motor until each snapshot, J; empty where no motor drove.
    pub energy_j: Vec<f64>,
}

/// Mean speeds over a time, in the frame of the start: the robot starts along +x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speeds {
    /// Longitudinal, m/s.
    pub longitudinal: f64,
    /// Lateral, to the left, m/s.
    pub lateral: f64,
    /// Of the heading, counter-clockwise, rad/s.
    pub yaw: f64,
}

impl Track {
    /// The snapshot nearest to a time, s.
    #[must_use]
    pub fn nearest(&self, time_s: f64) -> Option<usize> {
        let off = |index: &usize| (self.snapshots[*index].time_s - time_s).abs();
        (0..self.snapshots.len()).min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// Electrical energy over the way of the centroid between two snapshots, J/m; none where the robot stays within 0.1 mm,
    /// for it trembles on the spot, or where no motor drove.
    #[must_use]
    pub fn energy_per_distance(&self, from: usize, to: usize) -> Option<f64> {
        let taken = self.energy_j.get(to)? - self.energy_j.get(from)?;
        let (a, b) = (self.snapshots.get(from)?.centroid(), self.snapshots.get(to)?.centroid());
        let way = (b[0] - a[0]).hypot(b[1] - a[1]);
        (way >= 1e-4).then(|| taken / way)
    }

    /// Mean speeds between two times (s), of the snapshots nearest to them: displacement of the centroid of the modules'
    /// centres and change of the heading, unwrapped, over the time between. None where the run is too short.
    #[must_use]
    pub fn speeds(&self, from_s: f64, to_s: f64) -> Option<Speeds> {
        let (from, to) = (self.nearest(from_s)?, self.nearest(to_s)?);
        let interval = self.snapshots.get(1)?.time_s - self.snapshots[0].time_s;
        let there = |index: usize, time: f64| (self.snapshots[index].time_s - time).abs() <= 0.51 * interval;
        if to <= from || !there(from, from_s) || !there(to, to_s) {
            return None;
        }
        let (a, b) = (&self.snapshots[from], &self.snapshots[to]);
        let time = b.time_s - a.time_s;
        let (start, end) = (a.centroid(), b.centroid());
        let turned: f64 =
            self.snapshots[from..=to].windows(2).map(|pair| wrap(pair[1].heading() - pair[0].heading())).sum();
        Some(Speeds {
            longitudinal: (end[0] - start[0]) / time,
            lateral: (end[1] - start[1]) / time,
            yaw: turned / time,
        })
    }
}
