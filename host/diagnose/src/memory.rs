//! Noise that remembers: how much more of it a rollout shows than its fast scatter.
//!
//! Readings about a cubic over 20 of them scatter by themselves, whatever the model lacks ([`super::floor`]). Where that scatter is
//! white, it is what a right model leaves of a rollout too. Where it remembers, a rollout of five times the length shows more of it.
//! So the correlation within the windows is taken for that of white noise and a first-order Markov process (an Ornstein–Uhlenbeck
//! process, sampled), both as the cubic leaves them, and carried to the length of a rollout, of which its start takes a straight
//! line (autoregressive noise and its estimation: G. Box, G. Jenkins, G. Reinsel, "Time Series Analysis", 2008, chapters 3 and 6).

use nalgebra::{DMatrix, DVector};

/// Lags of the correlation that are compared.
const LAGS: usize = 8;
/// Readings that noise may remember for.
const REMEMBERS: [f64; 9] = [2.0, 3.0, 5.0, 8.0, 13.0, 22.0, 36.0, 60.0, 100.0];
/// The windows are divided in so many parts to see how sure the remembering noise is.
const PARTS: usize = 12;
/// It counts from so many standard errors on.
const SURE: f64 = 4.0;
/// A longer memory is spoken against from so many standard errors on.
const AGAINST: f64 = 2.0;
/// Fewest windows that say anything.
const FEWEST: usize = 5 * PARTS;

/// Sums over a part of the windows of products of residuals at each lag.
type Products = [f64; LAGS];

/// White noise and noise that remembers, mean squares in rad².
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mixture {
    white: f64,
    remembering: f64,
}

/// What a cubic leaves of one window.
#[derive(Clone, Debug)]
pub struct Window {
    /// How fast the shaft turned, rad/s.
    pub speed: f64,
    /// Residuals, rad.
    pub left: Vec<f64>,
}

/// Mean square per degree of freedom, rad², that noise leaves of rollouts of so many readings, from what cubics leave of windows of
/// one length; `None` where the noise does not remember for sure. What a model lacks may be as fast as noise, but not as large while
/// the shaft is slow: the half of the windows that remembers less counts.
#[must_use]
pub fn of_rollouts(windows: &[Window], readings: usize) -> Option<f64> {
    let length = windows.first()?.left.len();
    if windows.len() < 2 * FEWEST || length < LAGS + 4 || readings < 4 {
        return None;
    }
    let mut by_speed: Vec<&Window> = windows.iter().collect();
    by_speed.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    let (slow, fast) = by_speed.split_at(windows.len() / 2);
    let (slow, fast) = (of_half(slow, readings)?, of_half(fast, readings)?);
    Some(slow.min(fast))
}

fn of_half(windows: &[&Window], readings: usize) -> Option<f64> {
    let (length, count) = (windows[0].left.len(), windows.len() as f64);
    let part = |part: usize| products(windows.iter().skip(part).step_by(PARTS)).map(|sum| sum * PARTS as f64 / count);
    let parts: Vec<Products> = (0..PARTS).map(part).collect();
    let mean: Products = std::array::from_fn(|lag| parts.iter().map(|part| part[lag]).sum::<f64>() / PARTS as f64);
    let left = without_polynomial(length, 3);
    let white = along_diagonals(&left);
    let processes = REMEMBERS.map(|remembers| along_diagonals(&(&left * correlation(length, remembers) * &left)));
    let off = |mean: &Products, process: &Products| -> f64 {
        let mixture = mixture(mean, &white, process);
        let at = |lag: usize| mixture.white * white[lag] + mixture.remembering * process[lag];
        (0..LAGS).map(|lag| (mean[lag] - at(lag)).powi(2)).sum()
    };
    let best = processes.iter().min_by(|a, b| off(&mean, a).total_cmp(&off(&mean, b)))?;
    // How long it remembers, such short windows hardly say: as long as they do not speak against, for the floor is then higher.
    let speaks_against = |process: &Products| {
        let (average, error) = average(parts.iter().map(|part| off(part, process) - off(part, best)));
        average > AGAINST * error
    };
    let place = (0..processes.len()).rev().find(|&place| !speaks_against(&processes[place]))?;
    let process = &processes[place];
    let (average, error) = average(parts.iter().map(|part| mixture(part, &white, process).remembering));
    if average <= SURE * error {
        return None;
    }
    let mixture = mixture(&mean, &white, process);
    let left = without_polynomial(readings, 1);
    let shown = left.component_mul(&correlation(readings, REMEMBERS[place])).sum() / (readings - 2) as f64;
    Some(mixture.white + mixture.remembering * shown)
}

/// Average of the parts' values and its standard error.
fn average(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    let average = values.iter().sum::<f64>() / count;
    let spread = values.iter().map(|one| (one - average).powi(2)).sum::<f64>() / (count - 1.0);
    (average, (spread / count).sqrt())
}

fn products<'a>(windows: impl Iterator<Item = &'a &'a Window>) -> Products {
    let mut sums = [0.0; LAGS];
    for Window { left: window, .. } in windows {
        for (lag, sum) in sums.iter_mut().enumerate() {
            *sum += window.iter().zip(&window[lag..]).map(|(a, b)| a * b).sum::<f64>();
        }
    }
    sums
}

/// What a polynomial of a degree, fitted to evenly spaced readings, leaves of them.
fn without_polynomial(length: usize, degree: usize) -> DMatrix<f64> {
    let at = |i: usize| 2.0 * i as f64 / (length - 1) as f64 - 1.0;
    let powers = DMatrix::from_fn(length, degree + 1, |i, power| at(i).powi(power as i32));
    let q = powers.qr().q();
    DMatrix::identity(length, length) - &q * q.transpose()
}

/// Correlation of readings of noise that remembers for so many of them.
fn correlation(length: usize, remembers: f64) -> DMatrix<f64> {
    DMatrix::from_fn(length, length, |i, j| (-(i.abs_diff(j) as f64) / remembers).exp())
}

/// Sums along the first diagonals.
fn along_diagonals(matrix: &DMatrix<f64>) -> Products {
    std::array::from_fn(|lag| (0..matrix.nrows() - lag).map(|i| matrix[(i, i + lag)]).sum())
}

/// Least squares of two mean squares, neither negative.
fn mixture(mean: &Products, white: &Products, process: &Products) -> Mixture {
    let dot = |a: &Products, b: &Products| DVector::from_column_slice(a).dot(&DVector::from_column_slice(b));
    let (ww, wp, pp) = (dot(white, white), dot(white, process), dot(process, process));
    let (wm, pm) = (dot(white, mean), dot(process, mean));
    let spread = ww * pp - wp * wp;
    let both = Mixture { white: (pp * wm - wp * pm) / spread, remembering: (ww * pm - wp * wm) / spread };
    if both.remembering.is_nan() || both.remembering <= 0.0 {
        return Mixture { white: wm / ww, remembering: 0.0 };
    }
    if both.white < 0.0 { Mixture { white: 0.0, remembering: pm / pp } } else { both }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// White noise and noise that remembers, of unit mean square together.
    fn drawn(count: usize, white: f64, remembers: f64, seed: u64) -> Vec<f64> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let (kept, mut state) = ((-1.0 / remembers).exp(), 0.0);
        (0..count)
            .map(|_| {
                let [a, b]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
                state = kept * state + (1.0 - kept * kept).sqrt() * a;
                white.sqrt() * b + (1.0 - white).sqrt() * state
            })
            .collect()
    }

    fn left(noise: &[f64], length: usize, degree: usize) -> Vec<Window> {
        let leaves = without_polynomial(length, degree);
        let one = |window: &[f64]| (&leaves * DVector::from_column_slice(window)).as_slice().to_vec();
        noise
            .chunks_exact(length)
            .enumerate()
            .map(|(i, part)| Window { speed: (i % 7) as f64, left: one(part) })
            .collect()
    }

    fn shown(noise: &[f64]) -> f64 {
        let rollouts = left(noise, 100, 1);
        rollouts.iter().flat_map(|one| &one.left).map(|value| value * value).sum::<f64>() / (98 * rollouts.len()) as f64
    }

    #[test]
    fn what_rollouts_show_of_noise_that_remembers_is_foreseen_from_short_windows() {
        for (seed, (white, remembers)) in [(0.0, 5.0), (0.05, 20.0), (0.02, 60.0)].into_iter().enumerate() {
            let noise = drawn(60_000, white, remembers, seed as u64);
            let foreseen = of_rollouts(&left(&noise, 20, 3), 100).expect("noise that remembers");
            let shown = shown(&noise);
            // No less, and the more the less the windows say of how long it remembers.
            let times = foreseen / shown;
            assert!((0.8..2.2).contains(&times), "{foreseen} foreseen, {shown} shown: {remembers} readings");
        }
    }

    #[test]
    fn white_noise_is_not_said_to_remember() {
        let told = (0..40).filter(|&seed| of_rollouts(&left(&drawn(20_000, 1.0, 5.0, seed), 20, 3), 100).is_some());
        assert!(told.count() <= 1);
    }

    #[test]
    fn what_remembers_only_while_the_shaft_is_fast_is_no_noise() {
        let mut windows = left(&drawn(40_000, 1.0, 5.0, 1), 20, 3);
        let fast = left(&drawn(40_000, 0.0, 20.0, 2), 20, 3);
        windows.extend(fast.into_iter().map(|one| Window { speed: one.speed + 100.0, ..one }));
        assert_eq!(of_rollouts(&windows, 100), None);
    }
}
