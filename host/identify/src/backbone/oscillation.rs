//! One recording of an oscillation, from its release on.

use common::median;

use super::BackboneError;

/// How a backbone's end turns after it is let go.
#[derive(Clone, Debug, PartialEq)]
pub struct Oscillation {
    /// For messages and plots.
    pub name: String,
    /// Increasing, s.
    pub t_s: Vec<f64>,
    /// Rotation of the end about x, y and z against its pose at rest, rad; NaN where it is missing.
    pub angles: Vec<[f64; 3]>,
}

/// A run of fewer samples says nothing.
const FEWEST: usize = 20;
/// Samples at the start that must stand still to be called the hold before the release.
const HELD: usize = 4;
/// Shares of the run's largest swing: what still counts as held, and what has left the hold.
const STILL: f64 = 0.05;
const LEFT: f64 = 0.1;

impl Oscillation {
    /// The samples from the release on, with the first as time 0.
    pub(super) fn released(&self) -> Result<Self, BackboneError> {
        let wrong =
            |problem: String, help: &str| BackboneError::Run { run: self.name.clone(), problem, help: help.to_owned() };
        if let Some(k) = (1..self.t_s.len()).find(|&k| self.t_s[k] <= self.t_s[k - 1] || !self.t_s[k].is_finite()) {
            return Err(wrong(
                format!("time does not increase at sample {k}"),
                "t_s is in seconds and strictly increasing",
            ));
        }
        let seen: Vec<usize> = (0..self.t_s.len()).filter(|&k| self.angles[k].iter().any(|x| x.is_finite())).collect();
        if seen.len() < FEWEST {
            return Err(wrong(
                format!("{} samples with an angle, of {FEWEST} at least", seen.len()),
                "record at 100 frames a second or more, until the swing has died down",
            ));
        }
        if let Some(largest) = self.angles.iter().flatten().map(|x| x.abs()).filter(|x| *x > 1.6).reduce(f64::max) {
            return Err(wrong(
                format!("an angle of {largest:.1} rad: a backbone's end does not turn as far"),
                "angles are in radians, against the pose at rest; name a column …_deg where it holds degrees",
            ));
        }
        let first = self.release(&seen);
        let zero = self.t_s[first];
        Ok(Self {
            name: self.name.clone(),
            t_s: self.t_s[first..].iter().map(|t| t - zero).collect(),
            angles: self.angles[first..].to_vec(),
        })
    }

    /// The first sample after the hold, where there is one; else the first with an angle.
    fn release(&self, seen: &[usize]) -> usize {
        let axis = (0..3).max_by(|&a, &b| self.swing(a).total_cmp(&self.swing(b))).unwrap_or(0);
        let swing = self.swing(axis);
        let angle = |k: usize| self.angles[k][axis];
        let usable: Vec<usize> = seen.iter().copied().filter(|&k| angle(k).is_finite()).collect();
        let Some(held) = median(&mut usable.iter().take(HELD).map(|&k| angle(k)).collect::<Vec<_>>()) else {
            return seen[0];
        };
        let stands = usable.iter().take(HELD).all(|&k| (angle(k) - held).abs() < STILL * swing);
        let left = usable.iter().position(|&k| (angle(k) - held).abs() > LEFT * swing);
        match left {
            Some(place) if stands => usable[place],
            _ => seen[0],
        }
    }

    fn swing(&self, axis: usize) -> f64 {
        let angles = || self.angles.iter().map(|angles| angles[axis]).filter(|x| x.is_finite());
        angles().fold(f64::NEG_INFINITY, f64::max) - angles().fold(f64::INFINITY, f64::min)
    }

    /// From the first sample to the last, s.
    pub(super) fn seconds(&self) -> f64 {
        self.t_s.last().copied().unwrap_or(0.0)
    }
}
