//! Whether a model leaves no more than what repeats scatter by.

use hal_sim::random::Stream;
use identify::least_squares::Minimum;
use identify::robot::{Posterior, RobotError, freedom};
use nalgebra::{Cholesky, DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// A model that is right is called inadequate in so many of a hundred tables by each of the two tests.
const REJECTED: f64 = 0.01;
/// Sets drawn about the most probable one, to see how far it knows what it has not been fitted to, ...
const DRAWN: usize = 24;
/// ... and so near to it, in deviations of what is probable, that only a gait that jumps changes its speeds.
const NEAR: f64 = 0.1;

/// Two tests of what a model leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adequacy {
    /// Root mean square of the fitted means' deviations, in units of what the means are known to and, where a gait jumps, can be foreseen
    /// to, the numbers' freedom given back.
    pub misfit: f64,
    /// How probable such a misfit is, or a larger one, if the model is right.
    pub fitted: f64,
    /// How probable such deviations of the held-out means are, or larger ones; none without held-out conditions.
    pub held_out: Option<f64>,
}

impl Adequacy {
    /// Whether neither test rejects the model.
    pub fn holds(&self) -> bool {
        self.fitted >= REJECTED && self.held_out.is_none_or(|p| p >= REJECTED)
    }

    /// Of a model at its most probable numbers.
    pub fn of(posterior: &mut Posterior, best: &Minimum, draws: &mut Stream) -> Result<Self, RobotError> {
        let freedom = freedom(best);
        let spoken = posterior.speeds(std::slice::from_ref(&best.point))?.pop().flatten();
        let Some(speeds) = spoken else { return Err(RobotError::CannotRun("a run blew up".into())) };
        let root = best.covariance().and_then(|covariance| Some(Cholesky::new(covariance)?.l()));
        let off = posterior.deviations(&speeds);
        let (jumps, held_out) = match root {
            Some(root) => (
                jumps(posterior, &best.point, (&off, &root), draws)?,
                held_out(posterior, &best.point, (&speeds, &root), draws)?,
            ),
            None => (DVector::zeros(off.len()), None),
        };
        let mean_square = square_beyond(&off, &jumps) / freedom;
        Ok(Self {
            misfit: mean_square.sqrt(),
            fitted: beyond(mean_square, freedom, posterior.table.repeated()),
            held_out,
        })
    }
}

/// How probable it is that a mean square of so many degrees of freedom, over a variance known from some others, is larger.
fn beyond(mean_square: f64, freedom: f64, of_scatter: Option<usize>) -> f64 {
    let tail = match of_scatter {
        Some(others) => FisherSnedecor::new(freedom, others.max(1) as f64).map(|f| f.sf(mean_square)),
        None => return tail_of_square(mean_square * freedom, freedom),
    };
    tail.unwrap_or(0.0)
}

fn tail_of_square(square: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom).map_or(0.0, |chi| chi.sf(square))
}

/// Sets about the most probable one, a share of what is probable away.
fn about(best: &DVector<f64>, root: &DMatrix<f64>, share: f64, draws: &mut Stream) -> Vec<DVector<f64>> {
    (0..DRAWN).map(|_| best + share * root * DVector::from_fn(best.len(), |_, _| draws.normal())).collect()
}

/// Mean squares by which the fitted means' deviations change beside the most probable set, next to nothing where a gait is steady: a
/// speed that hangs on the last digit of the numbers cannot be foreseen better, whatever the model.
fn jumps(
    posterior: &mut Posterior,
    best: &DVector<f64>,
    (off, root): (&DVector<f64>, &DMatrix<f64>),
    draws: &mut Stream,
) -> Result<DVector<f64>, RobotError> {
    let speeds = posterior.speeds(&about(best, root, NEAR, draws))?;
    let drawn: Vec<_> = speeds.iter().flatten().map(|speeds| posterior.deviations(speeds) - off).collect();
    let sum = drawn.iter().fold(DVector::zeros(off.len()), |sum: DVector<f64>, one| sum + one.component_mul(one));
    Ok(sum / drawn.len().max(1) as f64)
}

/// Square of deviations of which each is known to 1, and foreseen to what its gait jumps by.
fn square_beyond(off: &DVector<f64>, jumps: &DVector<f64>) -> f64 {
    off.zip_map(jumps, |off, jump| off * off / (1.0 + jump)).sum()
}

/// Mahalanobis's distance of the held-out means from what the model foresees, with what its numbers leave open.
fn held_out(
    posterior: &mut Posterior,
    best: &DVector<f64>,
    (speeds, root): (&[f64], &DMatrix<f64>),
    draws: &mut Stream,
) -> Result<Option<f64>, RobotError> {
    let points = about(best, root, 1.0, draws);
    let off = posterior.table.deviations_where(speeds, true);
    if off.is_empty() {
        return Ok(None);
    }
    let drawn: Vec<DVector<f64>> = posterior
        .speeds(&points)?
        .iter()
        .flatten()
        .map(|speeds| posterior.table.deviations_where(speeds, true) - &off)
        .collect();
    let mut scatter = DMatrix::identity(off.len(), off.len());
    for one in &drawn {
        scatter += one * one.transpose() / drawn.len() as f64;
    }
    let Some(factors) = Cholesky::new(scatter) else { return Ok(None) };
    let square = off.dot(&factors.solve(&off));
    let count = off.len() as f64;
    Ok(Some(beyond(square / count, count, posterior.table.repeated())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_table_in_a_hundred_is_rejected() {
        // F(40, 48) at 1 %: 2.02; χ²(40)/40 at 1 %: 63.69/40.
        assert!((beyond(2.02, 40.0, Some(48)) - 0.01).abs() < 5e-4, "{}", beyond(2.02, 40.0, Some(48)));
        assert!((beyond(63.69 / 40.0, 40.0, None) - 0.01).abs() < 1e-4);
        assert!(beyond(1.0, 40.0, None) > 0.4 && beyond(1e9, 3.0, Some(1)) < 1e-3);
    }

    #[test]
    fn a_deviation_counts_less_where_a_gait_jumps_as_far() {
        let off = DVector::from_vec(vec![1.0, -8.0]);
        assert_eq!(square_beyond(&off, &DVector::from_vec(vec![0.0, 63.0])), 2.0);
        assert_eq!(square_beyond(&off, &DVector::zeros(2)), off.norm_squared());
    }
}
