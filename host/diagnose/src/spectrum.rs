//! Where in the spectrum the misfit lies: mean periodograms of what the rollouts leave (P. D. Welch, "The use of fast Fourier
//! transform for the estimation of power spectra", IEEE Transactions on Audio and Electroacoustics 15, 1967), a rollout a window.

use std::f64::consts::TAU;

use super::rollout::{Rolled, residual};
use super::track::Track;
use super::verdict::{MisfitBin, MisfitCurve};

/// Name of the coordinate.
pub const NAME: &str = "frequency_hz";
/// Bins at most: beyond, neighbours are taken together.
const BINS: usize = 40;
/// Windows of fewer samples have no spectrum, and fewer windows no mean.
const FEWEST_SAMPLES: usize = 16;
const FEWEST_WINDOWS: usize = 5;
/// A window's spans may differ by this share.
const UNEVEN: f64 = 0.1;

/// The curve over the frequency of two models' rollouts. White noise of a variance has its root in every bin, so that the floor
/// is a level here too; the bin of the mean is left out, for a rollout's start is fitted.
#[must_use]
pub fn of(tracks: &[Track], before: &[Rolled], after: &[Rolled]) -> MisfitCurve {
    // All windows are as long as the usual one, which has one grid of frequencies.
    let lengths = tracks.iter().flat_map(|track| track.segments.iter().map(|one| (one.last - one.first) as f64));
    let length = common::median(&mut lengths.collect::<Vec<f64>>()).unwrap_or(0.0) as usize;
    let mut bins = Vec::new();
    let windows: Vec<Window> =
        tracks.iter().zip(before.iter().zip(after)).flat_map(|(track, of)| windows(track, of, length)).collect();
    if length >= FEWEST_SAMPLES && windows.len() >= FEWEST_WINDOWS {
        let step_s = windows.iter().map(|window| window.step_s).sum::<f64>() / windows.len() as f64;
        let resolution = 1.0 / (length as f64 * step_s);
        let together = (length / 2).div_ceil(BINS);
        for first in (1..=(length - 1) / 2).step_by(together) {
            let last = (first + together - 1).min((length - 1) / 2);
            let mean = |side: usize| {
                let powers = windows.iter().map(|window| {
                    (first..=last).map(|bin| power(&window.left[side], bin)).sum::<f64>() / (last + 1 - first) as f64
                });
                (powers.sum::<f64>() / windows.len() as f64).sqrt()
            };
            bins.push(MisfitBin {
                from: (first as f64 - 0.5) * resolution,
                to: (last as f64 + 0.5) * resolution,
                samples: 2 * (last + 1 - first) * windows.len(),
                before: mean(0),
                after: mean(1),
                bias_before: 0.0,
                bias_after: 0.0,
            });
        }
    }
    MisfitCurve { coordinate: NAME.to_owned(), bins }
}

/// What two models leave in one rollout.
struct Window {
    step_s: f64,
    left: [Vec<f64>; 2],
}

/// The rollouts of a track that have a length, every reading and even steps.
fn windows(track: &Track, (before, after): (&Rolled, &Rolled), length: usize) -> Vec<Window> {
    let mut offset = 0;
    let mut out = Vec::new();
    for segment in &track.segments {
        let own = segment.last - segment.first;
        let complete = (segment.first..segment.first + length.min(own)).all(|k| track.weight[k] > 0.0);
        if own >= length && length > 1 && complete {
            let spans: Vec<f64> =
                (1..length).map(|i| track.t[segment.first + i] - track.t[segment.first + i - 1]).collect();
            let step_s = spans.iter().sum::<f64>() / spans.len() as f64;
            if spans.iter().all(|span| (span / step_s - 1.0).abs() < UNEVEN) {
                let left = [before, after].map(|rolled| {
                    (0..length)
                        .map(|i| residual(track, segment, segment.first + i, rolled.readings[offset + i]))
                        .collect()
                });
                out.push(Window { step_s, left });
            }
        }
        offset += own;
    }
    out
}

/// Power of a window in a bin, tapered (J. von Hann): of white noise its variance.
fn power(left: &[f64], bin: usize) -> f64 {
    let n = left.len() as f64;
    let (mut real, mut imaginary, mut weight) = (0.0, 0.0, 0.0);
    for (i, value) in left.iter().enumerate() {
        let taper = 0.5 - 0.5 * (TAU * (i as f64 + 0.5) / n).cos();
        let phase = TAU * ((bin * i) % left.len()) as f64 / n;
        real += taper * value * phase.cos();
        imaginary += taper * value * phase.sin();
        weight += taper * taper;
    }
    (real * real + imaginary * imaginary) / weight
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn white_noise_has_its_variance_in_every_bin_and_a_tone_one_bin() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let noise: Vec<Vec<f64>> =
            (0..400).map(|_| (0..100).map(|_| 12.0_f64.sqrt() * random.random_range(-0.5..0.5)).collect()).collect();
        for bin in [1, 7, 25, 49] {
            let mean = noise.iter().map(|window| power(window, bin)).sum::<f64>() / 400.0;
            // Its deviation is a twentieth.
            assert!((mean - 1.0).abs() < 0.2, "{mean} in bin {bin}");
        }
        let tone: Vec<f64> = (0..100).map(|i| (TAU * 0.12 * f64::from(i)).sin()).collect();
        assert!(power(&tone, 12) > 10.0 && power(&tone, 16) < 1e-9 && power(&tone, 30) < 1e-9);
    }
}
