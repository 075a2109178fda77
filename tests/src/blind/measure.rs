//! How large a hidden effect is in the data: a linear motor of its own, refitted to the runs for fitting, rolled out over
//! 0.1 s of the held-out runs with each piece's initial angle and speed free, against the noise that is really there.
//!
//! `ω' = g·u − p·ω` while driven and `ω' = −c·ω` while open; closed forms over each sampling interval, linear least
//! squares for everything but the two rates p and c, Gauss–Newton for those. No code is shared with the diagnosis, so
//! that the data sets' sizes do not depend on what is tested with them.

use super::files::Run;
use rayon::prelude::*;

/// Length of a rollout, s, where that is this many samples at least.
const ROLLOUT: (f64, usize) = (0.1, 25);

/// Samples of a run's rollouts.
#[must_use]
pub fn rollout(run: &Run) -> usize {
    let per_s = run.t_s.last().map_or(0.0, |end| (run.t_s.len() - 1) as f64 / end);
    ((ROLLOUT.0 * per_s).round() as usize).max(ROLLOUT.1)
}

/// The linear motor's three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// Rate while driven, (b + K²/R)/J, 1/s.
    pub driven: f64,
    /// Rate while open, b/J, 1/s.
    pub open: f64,
    /// Acceleration at full duty, K·V/(R·J), rad/s².
    pub gain: f64,
}

/// What a data set's held-out runs show, rad RMS over 0.1 s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Misfit of the refitted linear motor.
    pub misfit: f64,
    /// What is left of the true noise after fitting each piece's initial angle and speed: no model can do better.
    pub floor: f64,
}

impl Size {
    /// Misfit over floor.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.misfit / self.floor
    }
}

/// Responses over one piece: to initial speed, and to the drive at unit gain. The initial angle's response is 1.
fn responses(run: &Run, from: usize, linear: &Linear) -> (Vec<f64>, Vec<f64>) {
    let length = rollout(run);
    let (mut of_speed, mut of_drive) = (vec![0.0; length], vec![0.0; length]);
    // Speed and angle by initial speed, then by drive.
    let (mut w, mut a, mut v, mut b) = (1.0, 0.0, 0.0, 0.0);
    for n in 0..length {
        of_speed[n] = a;
        of_drive[n] = b;
        if n + 1 == length {
            break;
        }
        let h = run.t_s[from + n + 1] - run.t_s[from + n];
        let drive = run.drive[from + n];
        let (rate, push) = if drive.enable { (linear.driven, drive.duty) } else { (linear.open, 0.0) };
        let decay = (-rate * h).exp();
        let reach = if rate.abs() > 1e-9 { (1.0 - decay) / rate } else { h };
        let settle = if rate.abs() > 1e-9 { (h - reach) / rate } else { 0.5 * h * h };
        a += w * reach;
        b += v * reach + push * settle;
        w *= decay;
        v = v * decay + push * reach;
    }
    (of_speed, of_drive)
}

/// Takes the best share of `1` and `of_speed` out of `signal`, over the samples that were read.
fn without_start(signal: &mut [f64], of_speed: &[f64], blind: &[bool]) {
    let (mut n, mut sx, mut sxx, mut sy, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for k in 0..signal.len() {
        if blind[k] {
            continue;
        }
        n += 1.0;
        sx += of_speed[k];
        sxx += of_speed[k] * of_speed[k];
        sy += signal[k];
        sxy += of_speed[k] * signal[k];
    }
    let spread = n * sxx - sx * sx;
    if spread <= 0.0 {
        return;
    }
    let slope = (n * sxy - sx * sy) / spread;
    let offset = (sy - slope * sx) / n;
    for k in 0..signal.len() {
        signal[k] = if blind[k] { 0.0 } else { signal[k] - offset - slope * of_speed[k] };
    }
}

/// Sums over one piece with the initial state taken out: reading², reading·drive, drive², samples.
fn piece(run: &Run, from: usize, linear: &Linear) -> (Vec<f64>, Vec<f64>, usize) {
    let (of_speed, mut of_drive) = responses(run, from, linear);
    let blind = &run.blind[from..from + of_speed.len()];
    let base = run.reading[from];
    let mut reading: Vec<f64> = run.reading[from..from + of_speed.len()].iter().map(|read| read - base).collect();
    without_start(&mut reading, &of_speed, blind);
    without_start(&mut of_drive, &of_speed, blind);
    (reading, of_drive, blind.iter().filter(|blind| !**blind).count())
}

/// Starts of the pieces of a run.
fn pieces(run: &Run) -> impl Iterator<Item = usize> + use<> {
    let length = rollout(run);
    (0..run.t_s.len() / length).map(move |n| n * length)
}

/// Residuals of all pieces with the best gain for two given rates, and that gain.
fn residuals(runs: &[Run], linear: &Linear) -> (Vec<f64>, f64) {
    let all: Vec<_> =
        runs.par_iter().flat_map_iter(|run| pieces(run).map(move |from| piece(run, from, linear))).collect();
    let (mut xy, mut xx) = (0.0, 0.0);
    for (reading, drive, _) in &all {
        for k in 0..reading.len() {
            xy += reading[k] * drive[k];
            xx += drive[k] * drive[k];
        }
    }
    let gain = if xx > 0.0 { xy / xx } else { 0.0 };
    let left = all
        .iter()
        .flat_map(|(reading, drive, _)| reading.iter().zip(drive).map(move |(read, driven)| read - gain * driven));
    (left.collect(), gain)
}

/// Fits the linear motor: Gauss–Newton on the logarithms of the two rates with a numeric slope, halving bad steps.
#[must_use]
pub fn fit(runs: &[Run], start: Linear) -> Linear {
    let sum = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>();
    let with = |p: [f64; 2]| Linear { driven: p[0].exp(), open: p[1].exp(), gain: 0.0 };
    let mut at = [start.driven.ln(), start.open.ln()];
    let (mut left, mut gain) = residuals(runs, &with(at));
    for _ in 0..12 {
        let slopes: Vec<Vec<f64>> = (0..2)
            .map(|n| {
                let mut there = at;
                there[n] += 1e-4;
                residuals(runs, &with(there)).0.iter().zip(&left).map(|(b, a)| (b - a) / 1e-4).collect()
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let (aa, ab, bb) = (dot(&slopes[0], &slopes[0]), dot(&slopes[0], &slopes[1]), dot(&slopes[1], &slopes[1]));
        let (ra, rb) = (dot(&slopes[0], &left), dot(&slopes[1], &left));
        // A touch of damping: without a coast-down nothing is known about the open rate.
        let (aa, bb) = (aa * 1.000_001 + 1e-15, bb * 1.000_001 + 1e-15);
        let spread = aa * bb - ab * ab;
        let mut step = [-(bb * ra - ab * rb) / spread, -(aa * rb - ab * ra) / spread];
        let before = sum(&left);
        let mut better = false;
        for _ in 0..8 {
            let there = [at[0] + step[0].clamp(-1.0, 1.0), at[1] + step[1].clamp(-1.0, 1.0)];
            let (trial, trial_gain) = residuals(runs, &with(there));
            if sum(&trial) < before {
                better = before - sum(&trial) > 1e-9 * before;
                (at, left, gain) = (there, trial, trial_gain);
                break;
            }
            step = [0.5 * step[0], 0.5 * step[1]];
        }
        if !better {
            break;
        }
    }
    Linear { gain, ..with(at) }
}

/// Refits on the first `fit_runs` runs and measures on the rest.
#[must_use]
pub fn size(runs: &[Run], fit_runs: usize, start: Linear) -> Size {
    let (fitted, held) = runs.split_at(fit_runs);
    let linear = fit(fitted, start);
    let (mut misfit, mut count) = (0.0, 0);
    for run in held {
        for from in pieces(run) {
            let (reading, drive, read) = piece(run, from, &linear);
            misfit +=
                reading.iter().zip(&drive).map(|(read, driven)| (read - linear.gain * driven).powi(2)).sum::<f64>();
            count += read;
        }
    }
    Size { misfit: (misfit / count as f64).sqrt(), floor: floor(held, start.driven) }
}

/// RMS of the true noise over the pieces of some runs once each piece's initial angle and speed are fitted, rad.
/// `rate` only shapes the response to the initial speed.
#[must_use]
pub fn floor(runs: &[Run], rate: f64) -> f64 {
    let linear = Linear { driven: rate, open: rate, gain: 0.0 };
    let (mut sum, mut count) = (0.0, 0);
    for run in runs {
        for from in pieces(run) {
            let (of_speed, _) = responses(run, from, &linear);
            let piece = from..from + of_speed.len();
            let blind = &run.blind[piece.clone()];
            let both = run.reading[piece.clone()].iter().zip(&run.clean[piece]);
            let mut noise: Vec<f64> = both.map(|(read, clean)| read - clean).collect();
            without_start(&mut noise, &of_speed, blind);
            sum += noise.iter().map(|x| x * x).sum::<f64>();
            count += blind.iter().filter(|blind| !**blind).count();
        }
    }
    (sum / count as f64).sqrt()
}
