//! The shaft's phase against time from readings that are garbage for a fifth of each turn.

use std::f64::consts::TAU;

use common::{median, wrap};

use super::error::PotentiometerError;

/// Windows whose speed is farther than this from the settled speed are not steady (start, stop).
const STEADY: f64 = 0.03;
/// Length of the mean vector of a window's phases below which the shaft does not turn steadily. The garbage of the
/// blind arc takes about 0.2, a linearity error of 6° nearly nothing.
const COHERENT: f64 = 0.6;
/// Turns that are this smooth (RMS of their phases about the polynomial, rad) need no better: 0.05°.
const SMOOTH: f64 = 1e-3;
/// Fewest turns in the steady stretch.
pub(super) const FEWEST_TURNS: f64 = 5.0;
/// Degree of the phase polynomial: constant speed and its slow drift.
pub(super) const PHASE_DEGREE: usize = 3;

/// A sample that can be used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    /// Time, s.
    pub t: f64,
    /// Raw code.
    pub code: f64,
    /// The code without the converter's nominal bends.
    pub straightened: f64,
    /// Angle by the nominal curve of sensor and converter, rad, 0 … 2π.
    pub nominal: f64,
    /// Whether the code lies in the middle of the track, where the nominal curve is straight.
    pub middle: bool,
}

/// Phase polynomial: angle = Σ c_j x^j with x = −1 … 1 over the stretch.
#[derive(Clone, Debug)]
pub(super) struct Ramp {
    /// Middle of the stretch, s.
    pub center: f64,
    /// Half of its length, s.
    pub half: f64,
    /// Coefficients, rad, constant first.
    pub coefficients: Vec<f64>,
}

impl Ramp {
    /// Scaled time.
    pub fn x(&self, t: f64) -> f64 {
        (t - self.center) / self.half
    }

    /// Unwrapped angle, rad.
    pub fn angle(&self, t: f64) -> f64 {
        let x = self.x(t);
        self.coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
    }

    /// Speed, rad/s.
    pub fn speed(&self, t: f64) -> f64 {
        let x = self.x(t);
        let mut slope = 0.0;
        for (j, c) in self.coefficients.iter().enumerate().skip(1).rev() {
            slope = slope * x + j as f64 * c;
        }
        slope / self.half
    }

    /// Slowest and fastest speed in the stretch, rad/s, without sign.
    pub fn speed_range(&self) -> (f64, f64) {
        (0..=40)
            .map(|i| self.speed(self.center + self.half * (f64::from(i) / 20.0 - 1.0)).abs())
            .fold((f64::INFINITY, 0.0), |(low, high), speed| (low.min(speed), f64::max(high, speed)))
    }

    /// Turns in the stretch.
    pub fn turns(&self) -> f64 {
        (self.angle(self.center + self.half) - self.angle(self.center - self.half)).abs() / TAU
    }
}

/// A reading this far from its turn's mean phase comes from the blind arc (or is a spike), rad.
const OUTLIER: f64 = 0.4;

/// One turn's worth of samples: the mean phase against a steady rotation.
struct Window {
    from: f64,
    to: f64,
    phase: f64,
    coherence: f64,
}

/// Finds the rotation and the stretch in which it is steady.
pub(super) fn find(readings: &[Reading]) -> Result<Ramp, PotentiometerError> {
    let mut speed = rough_speed(readings)?;
    // The first pass uses the slope of the codes (a few percent off), the second the phase over several turns.
    let mut stretch = steady_stretch(readings, speed)?;
    speed = stretch.2;
    stretch = steady_stretch(readings, speed)?;
    let (from, to, speed) = stretch;
    let windows = windows(readings, speed, from, to);
    let (ramp, _) = fit(smooth_stretch(&windows, speed), speed);
    let turns = ramp.turns();
    if turns < FEWEST_TURNS {
        return Err(PotentiometerError::TooShort { turns, seconds: 2.0 * ramp.half, fewest: FEWEST_TURNS });
    }
    Ok(ramp)
}

/// The end of the run-up and the beginning of a stop are within the tolerance of the speed, but their phase is not on
/// the polynomial: leaves out as few turns at the ends as make the rest (nearly) as smooth as it gets.
fn smooth_stretch(windows: &[Window], speed: f64) -> &[Window] {
    let most = windows.len() / 3;
    let ends: Vec<(usize, usize)> =
        (0..=most).flat_map(|dropped| (0..=dropped.min(3)).map(move |last| (dropped - last, last))).collect();
    let cut = |&(first, last): &(usize, usize)| &windows[first..windows.len() - last];
    let roughness: Vec<f64> = ends.iter().map(|end| fit(cut(end), speed).1).collect();
    let least = roughness.iter().copied().fold(f64::INFINITY, f64::min);
    let limit = (1.5 * least).max(SMOOTH);
    let chosen = roughness.iter().position(|&r| r <= limit).unwrap_or(0);
    cut(&ends[chosen])
}

/// Median slope of consecutive readings in the middle of the track, rad/s.
fn rough_speed(readings: &[Reading]) -> Result<f64, PotentiometerError> {
    // Over several samples the converter's noise counts less; at most a twelfth of the track is passed in between.
    let mut slopes = Vec::new();
    let mut best = 0.0_f64;
    for span in [8, 4, 2, 1] {
        slopes.clear();
        for pair in readings.windows(span + 1) {
            let (a, b) = (&pair[0], &pair[span]);
            if pair.iter().all(|r| r.middle) {
                slopes.push((b.nominal - a.nominal) / (b.t - a.t));
            }
        }
        if slopes.len() < 20 {
            continue;
        }
        best = median(&mut slopes).unwrap_or(f64::NAN);
        let dt = (readings[readings.len() - 1].t - readings[0].t) / (readings.len() - 1) as f64;
        if (best * dt * span as f64).abs() < TAU / 6.0 {
            break;
        }
    }
    if slopes.len() < 20 {
        return Err(PotentiometerError::NotTurning { detail: "the codes never cross the middle of the track".into() });
    }
    let total = (readings[readings.len() - 1].t - readings[0].t) * best.abs();
    if total < TAU {
        return Err(PotentiometerError::NotTurning {
            detail: format!("the median speed is {:.2} turns/s", best / TAU),
        });
    }
    Ok(best)
}

/// From, to (s) and speed (rad/s) of the longest stretch of steady rotation near a speed.
fn steady_stretch(readings: &[Reading], speed: f64) -> Result<(f64, f64, f64), PotentiometerError> {
    let windows = windows(readings, speed, readings[0].t, readings[readings.len() - 1].t);
    if windows.len() < 3 {
        let seconds = readings[readings.len() - 1].t - readings[0].t;
        return Err(PotentiometerError::TooShort { turns: seconds * speed.abs() / TAU, seconds, fewest: FEWEST_TURNS });
    }
    // Speed between neighbouring windows, NaN where either is no rotation.
    let speeds: Vec<f64> = windows
        .windows(2)
        .map(|pair| {
            if pair.iter().any(|w| w.coherence < COHERENT) {
                return f64::NAN;
            }
            speed + (pair[1].phase - pair[0].phase) / (pair[1].from - pair[0].from)
        })
        .collect();
    let mut settled: Vec<f64> = speeds.iter().copied().filter(|s| s.is_finite()).collect();
    if settled.len() * 2 < speeds.len() {
        return Err(PotentiometerError::NotTurning {
            detail: format!(
                "near {:.2} turns/s only {} of {} turns look like a rotation",
                speed / TAU,
                settled.len(),
                speeds.len()
            ),
        });
    }
    let settled = median(&mut settled).unwrap_or(f64::NAN);
    let (mut best, mut start) = ((0, 0), 0);
    for i in 0..=speeds.len() {
        let good = i < speeds.len() && (speeds[i] / settled - 1.0).abs() < STEADY;
        if !good {
            if i - start > best.1 - best.0 {
                best = (start, i);
            }
            start = i + 1;
        }
    }
    if best.1 - best.0 < speeds.len() / 2 {
        let (low, high) = speeds
            .iter()
            .filter(|s| s.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &s| (low.min(s.abs()), high.max(s.abs())));
        return Err(PotentiometerError::SpeedVaries { low_hz: low / TAU, high_hz: high / TAU });
    }
    Ok((windows[best.0].from, windows[best.1].to, settled))
}

/// Windows of one turn each, with their phases on one continuous scale.
fn windows(readings: &[Reading], speed: f64, from: f64, to: f64) -> Vec<Window> {
    let turn = TAU / speed.abs();
    let count = ((to - from) / turn).floor() as usize;
    let mut out: Vec<Window> = Vec::with_capacity(count);
    let mut i = readings.partition_point(|r| r.t < from);
    for n in 0..count {
        let (begin, end) = (from + n as f64 * turn, from + (n + 1) as f64 * turn);
        let last = readings[i..].partition_point(|r| r.t < end) + i;
        let deviations: Vec<f64> =
            readings[i..last].iter().filter(|r| r.middle).map(|r| r.nominal - speed * r.t).collect();
        i = last;
        let (sin, cos) = deviations.iter().fold((0.0, 0.0), |(sin, cos), d| (sin + d.sin(), cos + d.cos()));
        let coherence = if deviations.len() < 4 { 0.0 } else { f64::hypot(sin, cos) / deviations.len() as f64 };
        let rough = f64::atan2(sin, cos);
        let near: Vec<f64> = deviations.iter().map(|d| wrap(d - rough)).filter(|d| d.abs() < OUTLIER).collect();
        let mut phase = rough + near.iter().sum::<f64>() / near.len().max(1) as f64;
        if let Some(last) = out.last() {
            phase = last.phase + wrap(phase - last.phase);
        }
        out.push(Window { from: begin, to: end, phase, coherence });
    }
    out
}

/// Polynomial through the windows' phases and their RMS about it, rad.
fn fit(windows: &[Window], speed: f64) -> (Ramp, f64) {
    let (from, to) = (windows[0].from, windows[windows.len() - 1].to);
    let (center, half) = (0.5 * (from + to), 0.5 * (to - from));
    let degree = PHASE_DEGREE.min(windows.len().saturating_sub(1) / 3).max(1);
    let mut design = nalgebra::DMatrix::zeros(windows.len(), degree + 1);
    let mut phases = nalgebra::DVector::zeros(windows.len());
    for (row, window) in windows.iter().enumerate() {
        let x = (0.5 * (window.from + window.to) - center) / half;
        for j in 0..=degree {
            design[(row, j)] = x.powi(j as i32);
        }
        phases[row] = window.phase;
    }
    let solution =
        design.clone().svd(true, true).solve(&phases, 1e-12).unwrap_or_else(|_| nalgebra::DVector::zeros(degree + 1));
    let rms = ((&design * &solution - &phases).norm_squared() / windows.len() as f64).sqrt();
    let mut coefficients: Vec<f64> = solution.iter().copied().collect();
    coefficients[0] += speed * center;
    coefficients[1] += speed * half;
    coefficients.resize(PHASE_DEGREE + 1, 0.0);
    (Ramp { center, half, coefficients }, rms)
}
