//! Poses of a body: in the room, against its rest, in the robot's frame.

use hal_sim::body::coordinates::{quaternion, rotation};
use hal_sim::body::skeleton::{Matrix, product, times, transposed};

use super::cells::Cells;
use super::{Body, CaptureError};
use crate::backbone::Oscillation;

/// What a quaternion's length may be off by.
const UNIT: f64 = 0.02;
/// Share of a recording's end over which a body rests.
const RESTS: f64 = 0.1;
/// From Motive's axes (y up) to ours (z up): x stays, y becomes z.
const STOOD_UP: Matrix = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];

/// Unit quaternion of axis times angle, rad.
pub fn of_rotation_vector(v: [f64; 3]) -> [f64; 4] {
    let angle = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (sin, cos) = (0.5 * angle).sin_cos();
    let scale = if angle < 1e-9 { 0.5 } else { sin / angle };
    [cos, v[0] * scale, v[1] * scale, v[2] * scale]
}

impl Body {
    pub(super) fn named(name: String) -> Self {
        Self { name, t_s: Vec::new(), position: Vec::new(), orientation: Vec::new() }
    }

    /// Another frame; an orientation that is not finite is none.
    pub(super) fn push(&mut self, t_s: f64, position: [f64; 3], orientation: Option<[f64; 4]>) {
        self.t_s.push(t_s);
        self.position.push(position);
        self.orientation.push(orientation.filter(|q| q.iter().all(|x| x.is_finite())));
    }

    /// That time increases and quaternions have length 1, which they get exactly.
    pub(super) fn check(&mut self, cells: &Cells) -> Result<(), CaptureError> {
        let wrong = |k: usize, problem: String| {
            Err(cells.wrong(usize::MAX, "", format!("body `{}`, frame {}: {problem}", self.name, k + 1)))
        };
        if self.t_s.len() < 2 {
            return Err(cells.wrong(usize::MAX, "", "fewer than two frames".into()));
        }
        if let Some(k) =
            (0..self.t_s.len()).find(|&k| !self.t_s[k].is_finite() || k > 0 && self.t_s[k] <= self.t_s[k - 1])
        {
            return wrong(k, "its time does not increase".into());
        }
        for k in 0..self.orientation.len() {
            if let Some(q) = self.orientation[k] {
                let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
                if (length - 1.0).abs() > UNIT {
                    return wrong(k, format!("its rotation is no unit quaternion (length {length:.3})"));
                }
                self.orientation[k] = Some(q.map(|x| x / length));
            }
        }
        Ok(())
    }

    pub(super) fn stand_up(&mut self) {
        for position in &mut self.position {
            *position = times(STOOD_UP, *position);
        }
        for orientation in self.orientation.iter_mut().flatten() {
            // The body's own axes are turned alike, so that a body that lies as the room does keeps doing so.
            let turned = product(STOOD_UP, product(rotation(*orientation), transposed(STOOD_UP)));
            *orientation = quaternion(turned);
        }
    }

    /// How it turns against its pose at rest, which is its mean over the recording's last tenth; against another body's, if one is
    /// given that holds the fast end.
    #[must_use]
    pub fn oscillation(&self, name: &str, base: Option<&Self>) -> Oscillation {
        let turned = |k: usize| -> Option<Matrix> {
            let own = rotation(self.orientation[k]?);
            match base {
                None => Some(own),
                Some(base) => Some(product(transposed(rotation((*base.orientation.get(k)?)?)), own)),
            }
        };
        let frames: Vec<Option<Matrix>> = (0..self.t_s.len()).map(turned).collect();
        let from = ((1.0 - RESTS) * frames.len() as f64) as usize;
        let rest = mean(frames[from..].iter().flatten()).or_else(|| frames.iter().flatten().next_back().copied());
        let upright = rest.map_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], transposed);
        let angles = frames
            .iter()
            .map(|frame| frame.map_or([f64::NAN; 3], |now| crate::backbone::rotation_vector(product(now, upright))));
        Oscillation { name: name.to_owned(), t_s: self.t_s.clone(), angles: angles.collect() }
    }

    /// Where it is along the ground in the frame of its first pose, m, and how it is turned against it, rad: x ahead, y to the left.
    /// `None` for a frame in which it was lost, and for a body that never has an orientation.
    #[must_use]
    pub fn poses(&self) -> Vec<Option<[f64; 3]>> {
        let heading = |k: usize| {
            let m = rotation(self.orientation[k]?);
            Some(m[1][0].atan2(m[0][0]))
        };
        let seen =
            |k: usize| Some((self.position[k], heading(k)?)).filter(|(at, _)| at[0].is_finite() && at[1].is_finite());
        let Some((origin, zero)) = (0..self.t_s.len()).find_map(seen) else { return vec![None; self.t_s.len()] };
        let (sin, cos) = zero.sin_cos();
        (0..self.t_s.len())
            .map(|k| {
                let (at, heading) = seen(k)?;
                let [dx, dy] = [at[0] - origin[0], at[1] - origin[1]];
                Some([cos * dx + sin * dy, cos * dy - sin * dx, common::wrap(heading - zero)])
            })
            .collect()
    }
}

/// The rotation nearest to the mean of some that are close together.
fn mean<'a>(rotations: impl Iterator<Item = &'a Matrix>) -> Option<Matrix> {
    let mut sum: Option<[f64; 4]> = None;
    for one in rotations {
        let q = quaternion(*one);
        sum = Some(sum.map_or(q, |sum| {
            let sign = if sum.iter().zip(q).map(|(a, b)| a * b).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
            [0, 1, 2, 3].map(|k| sum[k] + sign * q[k])
        }));
    }
    let sum = sum?;
    let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(rotation(sum.map(|x| x / length)))
}
