//! The noise floor: how much readings scatter about any smooth motion, whatever moves the shaft.
//!
//! A cubic is fitted to some 20 readings at a time of what a rollout leaves (measured minus simulated). Over 20 ms
//! whatever the model lacks is smooth, so what the cubic leaves is the sensor's own scatter: noise, quantisation,
//! jitter. The rollout only takes the known steps of the drive out of the motion; no number of it needs to be right.
//! Readings far off the cubic are spikes and take no further part, before as after.

use common::median;

use super::memory;
use super::rollout::{Rolled, residual};
use super::track::{Segment, Track};

/// Readings a window has, about.
const READINGS: usize = 20;
/// Longest window, s.
const LONGEST_S: f64 = 0.025;
/// Fewest readings that a cubic leaves something of.
const FEWEST: usize = 9;
/// Coefficients of the cubic.
const COEFFICIENTS: usize = 4;
/// Beyond this many standard deviations a reading is a spike.
const SPIKE: f64 = 6.0;

/// What the windows of a track say.
#[derive(Clone, Debug, Default)]
pub struct Scatter {
    /// Per window: sum of squares left by the cubic, and its degrees of freedom.
    pub windows: Vec<(f64, f64)>,
    /// Samples that are spikes.
    pub spikes: Vec<usize>,
    /// What the cubic leaves of windows without any.
    pub left: Vec<memory::Window>,
}

impl Scatter {
    /// Mean square over windows, rad².
    #[must_use]
    pub fn mean_square(scatters: &[Self]) -> f64 {
        let (sum, freedom) = scatters
            .iter()
            .flat_map(|scatter| &scatter.windows)
            .fold((0.0, 0.0), |total, window| (total.0 + window.0, total.1 + window.1));
        if freedom > 0.0 { sum / freedom } else { 0.0 }
    }

    /// Mean square that the noise leaves of rollouts of so many readings, rad²: that of the windows, or more where it remembers.
    #[must_use]
    pub fn of_rollouts(scatters: &[Self], readings: usize) -> f64 {
        let windows = || scatters.iter().flat_map(|one| &one.left);
        let count = |length: usize| windows().filter(|window| window.left.len() == length).count();
        let length = (FEWEST..=READINGS).max_by_key(|&length| count(length)).unwrap_or(READINGS);
        let alike: Vec<memory::Window> = windows().filter(|window| window.left.len() == length).cloned().collect();
        let fast = Self::mean_square(scatters);
        // Of slow readings a window is hardly shorter than a rollout.
        if readings < 3 * length { fast } else { memory::of_rollouts(&alike, readings).unwrap_or(fast).max(fast) }
    }
}

/// Measures a track's scatter about its rollouts.
#[must_use]
pub fn scatter(track: &Track, rolled: &Rolled) -> Scatter {
    let mut windows = Vec::new();
    let mut place = 0;
    for segment in &track.segments {
        let length = segment.last - segment.first;
        windows.extend(windows_of(track, segment, &rolled.readings[place..place + length]));
        place += length;
    }
    let mut usual: Vec<f64> = windows.iter().map(|window| middle_size(&cubic_leaves(window))).collect();
    let usual = median(&mut usual).unwrap_or(0.0);
    let mut scatter = Scatter::default();
    for window in &windows {
        clean(track, window, usual, &mut scatter);
    }
    scatter
}

/// Sample, time and what is left, of readings that a cubic is fitted to.
type Window = Vec<(usize, f64, f64)>;

/// Standard deviation of what fourth differences of readings see, which the motion itself hardly has.
pub fn fast_noise(angle: &[f64]) -> f64 {
    let fourth = |w: &[f64]| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs();
    let mut sizes: Vec<f64> = angle.windows(5).map(fourth).filter(|size| size.is_finite()).collect();
    // Of a normal distribution, whose median size is 0.6745 of its deviation; the weights' squares sum to 70.
    median(&mut sizes).unwrap_or(0.0) / 0.6745 / 70f64.sqrt()
}

/// The windows of one segment.
fn windows_of(track: &Track, segment: &Segment, readings: &[f64]) -> Vec<Window> {
    let mut windows = Vec::new();
    let mut window: Window = Vec::new();
    for (k, reading) in (segment.first..segment.last).zip(readings) {
        if track.weight[k] > 0.0 {
            let t = track.t[k];
            let full = window.len() >= READINGS
                || window.first().is_some_and(|first| t - first.1 > LONGEST_S && window.len() >= FEWEST + 3);
            if full {
                windows.push(std::mem::take(&mut window));
            }
            window.push((k, t, residual(track, segment, k, *reading)));
        }
    }
    windows.push(window);
    windows.retain(|window| window.len() >= FEWEST);
    windows
}

/// Mean square that cubics leave of one rollout, spikes that are known left out, rad²; `None` where no window is long enough.
#[must_use]
pub fn of_segment(track: &Track, segment: &Segment, readings: &[f64]) -> Option<f64> {
    let add = |total: (f64, f64), window: &Window| {
        let left = cubic_leaves(window);
        (total.0 + left.iter().map(|value| value * value).sum::<f64>(), total.1 + (left.len() - COEFFICIENTS) as f64)
    };
    let (sum, freedom) = windows_of(track, segment, readings).iter().fold((0.0, 0.0), add);
    (freedom > 0.0).then(|| sum / freedom)
}

/// Takes spikes out of one window, one after the other, and books what the rest leaves.
fn clean(track: &Track, window: &Window, usual: f64, scatter: &mut Scatter) {
    let mut kept = window.to_vec();
    let mut spikes = Vec::new();
    while kept.len() >= FEWEST {
        let left = cubic_leaves(&kept);
        let scale = middle_size(&left).max(usual).max(1e-9);
        let (worst, size) = left
            .iter()
            .enumerate()
            .map(|(i, value)| (i, value.abs()))
            .fold((0, 0.0), |best, one| if one.1 > best.1 { one } else { best });
        if size <= SPIKE * scale || spikes.len() >= 3 {
            let sum: f64 = left.iter().map(|value| value * value).sum();
            // A window full of outliers is a kink in the motion, not a sensor's doing: it says nothing about the noise.
            if size <= SPIKE * scale {
                scatter.windows.push((sum, (left.len() - COEFFICIENTS) as f64));
                scatter.spikes.append(&mut spikes);
                scatter.left.push(memory::Window { speed: turned(track, window).abs(), left });
            }
            return;
        }
        spikes.push(kept.remove(worst).0);
    }
}

/// Mean speed over a window, rad/s.
fn turned(track: &Track, window: &Window) -> f64 {
    let (first, last) = (window[0].0, window[window.len() - 1].0);
    (track.angle[last] - track.angle[first]) / (track.t[last] - track.t[first])
}

/// Standard deviation from the median size, corrected for the cubic's freedom.
fn middle_size(left: &[f64]) -> f64 {
    let n = left.len() as f64;
    let mut sizes: Vec<f64> = left.iter().map(|value| value.abs()).collect();
    1.4826 * median(&mut sizes).unwrap_or(0.0) * (n / (n - COEFFICIENTS as f64)).sqrt()
}

/// What a cubic in time leaves of a window, by orthogonal polynomials on its own sample times.
fn cubic_leaves(window: &[(usize, f64, f64)]) -> Vec<f64> {
    let n = window.len();
    let (first, last) = (window[0].1, window[n - 1].1);
    let scale = if last > first { 2.0 / (last - first) } else { 0.0 };
    let times: Vec<f64> = window.iter().map(|point| (point.1 - first) * scale - 1.0).collect();
    let mut left: Vec<f64> = window.iter().map(|point| point.2).collect();
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(COEFFICIENTS);
    for power in 0..COEFFICIENTS {
        let mut column: Vec<f64> = times.iter().map(|t| t.powi(power as i32)).collect();
        for known in &basis {
            let product: f64 = known.iter().zip(&column).map(|(a, b)| a * b).sum();
            column.iter_mut().zip(known).for_each(|(value, known)| *value -= product * known);
        }
        let size = column.iter().map(|value| value * value).sum::<f64>().sqrt();
        if size < 1e-9 {
            continue;
        }
        column.iter_mut().for_each(|value| *value /= size);
        let product: f64 = column.iter().zip(&left).map(|(a, b)| a * b).sum();
        left.iter_mut().zip(&column).for_each(|(value, basis)| *value -= product * basis);
        basis.push(column);
    }
    left
}
