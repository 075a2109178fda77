//! Where the fit begins: every pair of stiffness and damping of a grid, judged by a linear fit of the start.

use nalgebra::{DMatrix, DVector};

use super::oscillation::Oscillation;
use super::rig::{Hinges, Release, Rig, START, between, of_axis};

/// Factors on the file's stiffness: 1/4 to 4, 5 % of a frequency apart.
const STIFFNESSES: usize = 29;
const FURTHEST: f64 = 4.0;
/// Factors on the file's damping.
const DAMPINGS: [f64; 5] = [0.04, 0.15, 0.5, 1.0, 2.5];
/// Pairs of them.
pub const GRID: usize = STIFFNESSES * DAMPINGS.len();
/// A response is simulated to a start of this size, rad, where everything is linear still.
const SMALL: f64 = 0.02;
/// Longer than this, s, and the grid is too coarse to keep the phase.
const LONGEST_S: f64 = 1.0;

/// The best of the grid, axis by axis; `None` where nothing can be simulated.
pub fn of_grid(rig: &Rig<'_>, runs: &[Oscillation]) -> Option<Hinges> {
    let seconds = runs.iter().map(Oscillation::seconds).fold(0.0, f64::max).min(LONGEST_S);
    let file = rig.file();
    let mut best = [(f64::INFINITY, [1.0, 1.0]); 3];
    for k in 0..STIFFNESSES {
        let stiffness = FURTHEST.powf(2.0 * k as f64 / (STIFFNESSES - 1) as f64 - 1.0);
        for damping in DAMPINGS {
            let mut hinges = file;
            hinges.iter_mut().take(3).for_each(|value| *value *= stiffness);
            hinges.iter_mut().skip(3).for_each(|value| *value *= damping);
            // The same number of the shape, of every axis, in one simulation.
            let releases = (0..4).map(|number| {
                let mut start = [0.0; START];
                for axis in 0..3 {
                    if let Some(place) = of_axis(axis).nth(number) {
                        start[place] = if place < START / 2 { SMALL } else { SMALL * 30.0 };
                    }
                }
                Release { hinges, start, seconds }
            });
            let Some(responses) = rig.oscillations(&releases.collect::<Vec<_>>()) else { continue };
            for (axis, best) in best.iter_mut().enumerate() {
                let numbers = of_axis(axis).count();
                let left: f64 = runs.iter().map(|run| left_over(run, axis, &responses[..numbers], seconds)).sum();
                if left < best.0 {
                    *best = (left, [stiffness, damping]);
                }
            }
        }
    }
    best.iter().all(|(left, _)| left.is_finite()).then(|| {
        let mut hinges = file;
        for (axis, (_, [stiffness, damping])) in best.into_iter().enumerate() {
            hinges[axis] *= stiffness;
            hinges[axis + 3] *= damping;
        }
        hinges
    })
}

/// Sum of squares that responses and a constant leave of a run's angle about an axis.
fn left_over(run: &Oscillation, axis: usize, responses: &[Vec<[f64; 3]>], seconds: f64) -> f64 {
    let used: Vec<usize> =
        (0..run.t_s.len()).filter(|&k| run.t_s[k] <= seconds && run.angles[k][axis].is_finite()).collect();
    if used.len() <= responses.len() + 1 {
        return 0.0;
    }
    let angles = DVector::from_iterator(used.len(), used.iter().map(|&k| run.angles[k][axis]));
    let columns = DMatrix::from_fn(used.len(), responses.len() + 1, |row, column| {
        responses.get(column).map_or(1.0, |response| between(response, run.t_s[used[row]])[axis])
    });
    let (q, _) = columns.qr().unpack();
    angles.norm_squared() - q.tr_mul(&angles).norm_squared()
}
