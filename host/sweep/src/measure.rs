//! What is measured of a run on the ground.

use hal_sim::body::{Snapshot, Track};

use super::axis::significant;

/// Digits that a table keeps: more than any comparison needs, and a resumed table has the same.
const DIGITS: usize = 9;

/// What was measured of a run; a missing number is one that the run does not have.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Measures {
    /// Longitudinal speed, mm/s.
    pub vx: Option<f64>,
    /// Lateral speed, to the left, mm/s.
    pub vy: Option<f64>,
    /// Rotational speed, counter-clockwise, °/s.
    pub yaw: Option<f64>,
    /// Energy that the bridge took in the time over which the speeds are taken, J; none without a motor.
    pub energy_j: Option<f64>,
    /// The same over the way of the centroid, J/m.
    pub energy_j_per_m: Option<f64>,
    /// Mean frequency of the shaft, Hz, positive clockwise.
    pub mean_f_hz: Option<f64>,
    /// Way of the first module over time, mm/s.
    pub front: Option<f64>,
    /// Way of the last module over time, mm/s.
    pub rear: Option<f64>,
    /// Short over long axis of the front feet's traces seen from above, 0 a line, 1 a circle.
    pub roundness: Option<f64>,
}

/// A measure's place in [`Measures`], its column, and how people call it.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// In a table.
    pub name: &'static str,
    get: fn(&Measures) -> Option<f64>,
    set: fn(&mut Measures, Option<f64>),
}

macro_rules! columns {
    ($($name:literal => $field:ident,)*) => {
        /// The measures in the order of a table's columns.
        pub const COLUMNS: &[Column] = &[
            $(Column { name: $name, get: |measures| measures.$field, set: |measures, value| measures.$field = value },)*
        ];
    };
}
columns! {
    "vx_mm_per_s" => vx,
    "vy_mm_per_s" => vy,
    "yaw_deg_per_s" => yaw,
    "energy_j" => energy_j,
    "energy_j_per_m" => energy_j_per_m,
    "mean_f_hz" => mean_f_hz,
    "front_mm_per_s" => front,
    "rear_mm_per_s" => rear,
    "roundness" => roundness,
}

impl Measures {
    /// Names with units, in the order of a table's columns.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        COLUMNS.iter().map(|column| column.name).collect()
    }

    /// In the order of `COLUMNS`.
    #[must_use]
    pub fn values(&self) -> Vec<Option<f64>> {
        COLUMNS.iter().map(|column| (column.get)(self)).collect()
    }

    /// From values in the order of `COLUMNS`.
    #[must_use]
    pub fn from_values(values: &[Option<f64>]) -> Self {
        let mut measures = Self::default();
        for (column, value) in COLUMNS.iter().zip(values) {
            (column.set)(&mut measures, *value);
        }
        measures
    }

    /// With the digits that a table keeps.
    #[must_use]
    pub fn rounded(&self) -> Self {
        let round = |value: Option<f64>| value.filter(|v| v.is_finite()).map(|v| significant(v, DIGITS));
        Self::from_values(&self.values().into_iter().map(round).collect::<Vec<_>>())
    }
}

/// Measures a run between two times, s.
#[must_use]
pub fn measure(track: &Track, from_s: f64, to_s: f64) -> Measures {
    let Some(speeds) = track.speeds(from_s, to_s) else { return Measures::default() };
    let (Some(from), Some(to)) = (track.nearest(from_s), track.nearest(to_s)) else { return Measures::default() };
    let (a, b) = (&track.snapshots[from], &track.snapshots[to]);
    let time = b.time_s - a.time_s;
    let module = |k: usize| distance(&a.modules[k].position, &b.modules[k].position) / time * 1e3;
    let energy_j = track.energy_j.get(to).zip(track.energy_j.get(from)).map(|(to, from)| to - from);
    Measures {
        vx: Some(1e3 * speeds.longitudinal),
        vy: Some(1e3 * speeds.lateral),
        yaw: Some(speeds.yaw.to_degrees()),
        energy_j,
        energy_j_per_m: track.energy_per_distance(from, to),
        mean_f_hz: None,
        front: Some(module(0)),
        rear: Some(module(a.modules.len() - 1)),
        roundness: roundness(&track.snapshots[from..=to]),
    }
}

/// On the ground.
fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Mean over the first module's two feet of the ratio of the principal axes of their traces, less a steady drift.
fn roundness(snapshots: &[Snapshot]) -> Option<f64> {
    let foot = |side: usize| {
        let trace: Vec<[f64; 2]> = snapshots
            .iter()
            .map(|snapshot| snapshot.feet.get(side).map(|foot| [foot.position[0], foot.position[1]]))
            .collect::<Option<_>>()?;
        axis_ratio(&trace)
    };
    Some(0.5 * (foot(0)? + foot(1)?))
}

/// Square root of the ratio of the eigenvalues of a trace's covariance about its line of best fit in time.
fn axis_ratio(trace: &[[f64; 2]]) -> Option<f64> {
    let count = trace.len() as f64;
    let time = |index: usize| index as f64 - 0.5 * (count - 1.0);
    let spread: f64 = (0..trace.len()).map(|index| time(index).powi(2)).sum();
    let mean = [0, 1].map(|axis| trace.iter().map(|point| point[axis]).sum::<f64>() / count);
    let slope = [0, 1].map(|axis| {
        trace.iter().enumerate().map(|(index, point)| time(index) * (point[axis] - mean[axis])).sum::<f64>() / spread
    });
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (index, point) in trace.iter().enumerate() {
        let [x, y] = [0, 1].map(|axis| point[axis] - mean[axis] - slope[axis] * time(index));
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    let (middle, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let (short, long) = ((middle - half).max(0.0), middle + half);
    (long > 0.0).then(|| (short / long).sqrt())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn axes_of_an_ellipse_that_drifts() {
        let trace: Vec<[f64; 2]> = (0..=200)
            .map(|k| {
                let (sin, cos) = (TAU * 7.0 * f64::from(k) / 200.0).sin_cos();
                // Axes 3 and 1, turned by 30°, drifting.
                let (x, y) = (3.0 * cos, sin);
                let (s, c) = (0.5_f64, 0.75_f64.sqrt());
                [c * x - s * y + 0.01 * f64::from(k), s * x + c * y - 0.02 * f64::from(k)]
            })
            .collect();
        assert!((axis_ratio(&trace).unwrap() - 1.0 / 3.0).abs() < 0.01, "{:?}", axis_ratio(&trace));
        assert_eq!(axis_ratio(&[[0.0; 2]; 10]), None, "a foot that rests has no trace");
    }

    #[test]
    fn columns_and_measures_go_both_ways_and_no_nan_passes() {
        let values: Vec<Option<f64>> = (0..COLUMNS.len()).map(|k| (k != 3).then_some(k as f64 + 1.0 / 3.0)).collect();
        let measures = Measures::from_values(&values);
        assert_eq!(measures.values(), values);
        assert_eq!(measures.rounded().vx, Some(0.333_333_333));
        let broken = Measures { vx: Some(f64::NAN), vy: Some(f64::INFINITY), ..measures };
        assert_eq!((broken.rounded().vx, broken.rounded().vy), (None, None));
    }
}
