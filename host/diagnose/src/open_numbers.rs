//! What the numbers of a fit do to the held-out rollouts as far as the fit runs leave them open.
//!
//! Held-out runs may go where the fit runs say little of a number: only there is the friction slow enough, or the current large enough. Then
//! the refitted model misses them by more than noise although it lacks nothing, and an effect whose number moves with the loose ones
//! takes the miss away. Numbers are drawn from what the fit knows of them (its covariance): how far the held-out rollouts move
//! from draw to draw is how far the model may be expected to miss.

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::fit::{self, Data, Fit, Followed};
use super::normal_equations;
use super::search::Candidate;
use super::session::Session;

/// Draws.
const DRAWS: usize = 1000;
/// A miss that at least this share of the draws move the rollouts by is one of the numbers.
const USUAL: f64 = 0.05;

/// Whether what a model leaves of the held-out runs beyond noise (mean square, rad²) is no more than its numbers leave open, for small
/// changes of the numbers.
#[must_use]
pub fn explain(session: &Session, model: &Candidate, noise: f64, seed: u64) -> bool {
    let excess = (model.mean_square() / noise - 1.0) * model.evaluation.readings();
    let held_out = Data { tracks: &session.held_out, sigma: noise.sqrt(), sigma_current: None };
    let curvature = curvature(session, &held_out, model);
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let drawn = model.fit.drawn_offsets(&mut random).take(DRAWS);
    let as_far = drawn.filter(|off| off.dot(&(&curvature * off)) >= excess).count();
    as_far as f64 >= USUAL * DRAWS as f64
}

/// How the sum of squares by which the held-out rollouts move grows with the numbers, in units of the noise, each rollout's start fitted.
fn curvature(session: &Session, held_out: &Data, model: &Candidate) -> DMatrix<f64> {
    let fit = Fit { starts: model.evaluation.starts.clone(), ..model.fit.clone() };
    let rolled = &model.evaluation.rolled;
    let columns = fit::columns_of(&session.model, held_out, &fit, rolled, Followed::WithinSegment, Vec::new());
    let equations = normal_equations::of_tracks(held_out, rolled, &columns);
    equations.into_iter().fold(DMatrix::zeros(fit.free.len(), fit.free.len()), |sum, track| sum + track.matrix)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Rig, bench};
    use super::super::{Options, judged};
    use super::*;

    #[test]
    fn a_miss_is_one_of_the_numbers_as_far_as_they_are_open() {
        let runs = Rig::off().runs(3);
        let (mut session, fit) = Session::open(&bench(), &runs[..4], &runs[4..], &Options::default()).unwrap();
        let truth = judged(&mut session, fit);
        let held_out = Data { tracks: &session.held_out, sigma: session.noise.sqrt(), sigma_current: None };
        let curvature = curvature(&session, &held_out, &truth);
        let spread = truth.fit.covariance.clone().symmetric_eigen();
        // The one of the axes of what is known along which the held-out rollouts move most; along that of the scale of torques they hardly do.
        let moved = |axis: &usize| {
            let along = spread.eigenvectors.column(*axis);
            spread.eigenvalues[*axis] * along.dot(&(&curvature * along))
        };
        let axis = (0..spread.eigenvalues.len()).max_by(|a, b| moved(a).total_cmp(&moved(b))).unwrap();
        let away = |deviations: f64| {
            let mut fit = truth.fit.clone();
            let length = deviations * spread.eigenvalues[axis].sqrt();
            for (at, along) in fit.coordinates.iter_mut().zip(spread.eigenvectors.column(axis).iter()) {
                *at += length * along;
            }
            explain(&session, &Candidate::of(&session, fit, true), truth.mean_square(), 1)
        };
        assert!(away(1.0));
        assert!(!away(4.0));
    }
}
