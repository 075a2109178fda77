//! How much of a hidden effect the speeds can show.
//!
//! The file's numbers may stand for an effect: a foot that is harder where it is pressed is much like a stiffer one. What they cannot
//! stand for is worked out to first order about the robot as it is, by this simulator, without any scatter: it explains what a diagnosis
//! could have seen, and judges none.

use diagnose::walk::WalkOptions;
use hal_sim::body::Plan;
use identify::robot::{Run, simulate};
use nalgebra::{DMatrix, DVector};

use super::tables::{conditions, sigma};
use super::truth::{Truth, numbers};
use crate::body::error_measures::largest;

/// A number is moved to either side by so many deviations of what is believed of it.
const NUDGE: f64 = 0.3;

/// By how much the sum of squares of the means, in units of what they are known to, and of the numbers off what is believed of them is
/// larger at best where the effect is missing than at the robot as it is; none of what the catalogue has not, or where nothing can be
/// simulated.
#[must_use]
pub fn shows(truth: &Truth) -> Option<f64> {
    let numbers = numbers();
    let at = DVector::from_vec(truth.coordinates(&numbers));
    let sides = (0..at.len()).flat_map(|place| {
        let (at, numbers) = (&at, &numbers);
        [NUDGE, -NUDGE].map(|by| {
            let mut point = at.clone();
            point[place] += by;
            numbers.plan(point.as_slice()).ok()
        })
    });
    let with = Plan::new(&truth.file()?.robot().ok()?).ok();
    let plans: Vec<Option<Plan>> = [with, numbers.plan(at.as_slice()).ok()].into_iter().chain(sides).collect();
    let WalkOptions { window_s, step_s, .. } = WalkOptions::default();
    let run = Run::new(window_s, step_s).ok()?;
    let speeds: Vec<Vec<[f64; 3]>> = simulate(&plans, &conditions(), run).into_iter().collect::<Option<_>>()?;
    let known = largest(&speeds[0]).map(sigma);
    let scaled = |speeds: &[[f64; 3]]| -> DVector<f64> {
        let all = speeds.iter().flat_map(|one| (0..3).map(move |part| one[part] / known[part]));
        DVector::from_iterator(3 * speeds.len(), all)
    };
    let missing = scaled(&speeds[0]) - scaled(&speeds[1]);
    let slopes: Vec<DVector<f64>> =
        speeds[2..].chunks(2).map(|sides| (scaled(&sides[0]) - scaled(&sides[1])) / (2.0 * NUDGE)).collect();
    Some(left(&missing, &DMatrix::from_columns(&slopes), &at))
}

/// What numbers with these derivatives, at these coordinates, leave of a change.
fn left(missing: &DVector<f64>, slopes: &DMatrix<f64>, at: &DVector<f64>) -> f64 {
    let normal = slopes.tr_mul(slopes) + DMatrix::identity(at.len(), at.len());
    let moves = normal.cholesky().map(|factor| factor.solve(&(slopes.tr_mul(missing) - at)));
    let moves = moves.unwrap_or_else(|| DVector::zeros(at.len()));
    (missing - slopes * &moves).norm_squared() + (at + moves).norm_squared() - at.norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walks::{Hidden, truths};

    #[test]
    fn what_numbers_can_stand_for_does_not_show() {
        let slopes = DMatrix::from_columns(&[DVector::from_vec(vec![1e3, 0.0, 0.0])]);
        let at = DVector::zeros(1);
        let of = |missing: [f64; 3]| left(&DVector::from_vec(missing.to_vec()), &slopes, &at);
        assert!(of([5.0, 0.0, 0.0]) < 1e-3 && (of([5.0, 3.0, 4.0]) - 25.0).abs() < 1e-3);
        // A number is not moved far beyond what is believed of it: half of what it would have to.
        let slopes = DMatrix::from_columns(&[DVector::from_vec(vec![1.0, 0.0, 0.0])]);
        assert!((left(&DVector::from_vec(vec![4.0, 0.0, 0.0]), &slopes, &at) - 8.0).abs() < 1e-9);
    }

    #[test]
    fn a_robot_without_an_effect_shows_nothing_and_one_from_outside_cannot_be_asked() {
        let nothing = &truths(1, 0, 1, 0)[0];
        assert!(nothing.hidden == Hidden::Nothing && shows(nothing).is_some_and(|shows| shows <= 0.0));
        assert_eq!(shows(&truths(1, 0, 0, 1)[0]), None);
    }
}
