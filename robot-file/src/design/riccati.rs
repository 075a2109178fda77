//! The discrete algebraic Riccati equation
//! `X = Aᵀ X A − Aᵀ X B (R + Bᵀ X B)⁻¹ Bᵀ X A + Q`
//! by the structure-preserving doubling algorithm (Chu, Fan, Lin, Wang, "Structure-preserving algorithms for periodic
//! discrete-time algebraic Riccati equations", 2004): quadratic convergence, no eigenvectors.

use nalgebra::DMatrix;

/// Why there is no solution.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RiccatiError {
    /// A matrix has an element that is NaN or infinite.
    #[error("a matrix holds what is not a finite number")]
    NonFinite,
    /// The doubling did not settle: not stabilisable or not detectable.
    #[error("the Riccati equation has no stabilising solution")]
    NoSolution,
    /// It settled on something that does not fulfil the equation.
    #[error("the Riccati equation's residual is {residual:e} of its solution")]
    Residual {
        /// Relative residual.
        residual: f64,
    },
    /// The closed loop has a pole on or outside the unit circle.
    #[error("the closed loop has a pole of magnitude {magnitude}")]
    Unstable {
        /// The largest pole's magnitude.
        magnitude: f64,
    },
}

/// The stabilising solution and the gain `(R + Bᵀ X B)⁻¹ Bᵀ X A`.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// X: stabilising solution.
    pub x: DMatrix<f64>,
    /// Gain, `inputs × states`.
    pub gain: DMatrix<f64>,
    /// ‖residual‖ / ‖X‖.
    pub residual: f64,
}

/// Solves the equation for `A` (n × n), `B` (n × m), `Q` (n × n, symmetric, ≥ 0), `R` (m × m, symmetric, > 0).
///
/// States of very different magnitude (rad beside N·m) are scaled by the caller to what counts as one unit of each.
///
/// # Errors
/// No stabilising solution, or one that does not fulfil the equation to 1e-8.
pub fn solve(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<Solution, RiccatiError> {
    let finite = |m: &DMatrix<f64>| m.iter().all(|value| value.is_finite());
    if ![a, b, q, r].into_iter().all(finite) {
        return Err(RiccatiError::NonFinite);
    }
    let n = a.nrows();
    let identity = DMatrix::<f64>::identity(n, n);
    let inverse_r = r.clone().try_inverse().ok_or(RiccatiError::NoSolution)?;
    let (mut ak, mut gk, mut hk) = (a.clone(), b * &inverse_r * b.transpose(), q.clone());
    let mut settled = false;
    for _ in 0..60 {
        let w = (&identity + &gk * &hk).try_inverse().ok_or(RiccatiError::NoSolution)?;
        let next_g = symmetric(&(&gk + &ak * &w * &gk * ak.transpose()));
        let step = symmetric(&(ak.transpose() * &hk * &w * &ak));
        let next_a = &ak * &w * &ak;
        hk += &step;
        (ak, gk) = (next_a, next_g);
        if !finite(&hk) || !finite(&ak) {
            return Err(RiccatiError::NoSolution);
        }
        if step.norm() <= 1e-14 * hk.norm() {
            settled = true;
            break;
        }
    }
    if !settled {
        return Err(RiccatiError::NoSolution);
    }
    finish(a, b, q, r, hk)
}

fn finish(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &DMatrix<f64>,
    r: &DMatrix<f64>,
    x: DMatrix<f64>,
) -> Result<Solution, RiccatiError> {
    let inner = (r + b.transpose() * &x * b).try_inverse().ok_or(RiccatiError::NoSolution)?;
    let gain = inner * b.transpose() * &x * a;
    let back = a.transpose() * &x * (a - b * &gain) + q;
    let residual = (&back - &x).norm() / x.norm().max(f64::MIN_POSITIVE);
    if residual > 1e-8 {
        return Err(RiccatiError::Residual { residual });
    }
    let magnitude = largest_pole(&(a - b * &gain));
    if magnitude >= 1.0 - 1e-9 {
        return Err(RiccatiError::Unstable { magnitude });
    }
    Ok(Solution { x, gain, residual })
}

fn symmetric(m: &DMatrix<f64>) -> DMatrix<f64> {
    (m + m.transpose()) * 0.5
}

/// Magnitude of the largest eigenvalue.
#[must_use]
pub fn largest_pole(m: &DMatrix<f64>) -> f64 {
    m.complex_eigenvalues().iter().map(|pole| pole.norm()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: usize, columns: usize, values: &[f64]) -> DMatrix<f64> {
        DMatrix::from_row_slice(rows, columns, values)
    }

    #[test]
    fn scalar_equation_against_its_closed_form() {
        for (a, b, q, r) in [(0.9, 1.0, 1.0, 1.0), (1.2, 0.5, 2.0, 0.3), (1.0, 2.0, 0.1, 5.0), (0.0, 1.0, 1.0, 1.0)] {
            let one = |value: f64| matrix(1, 1, &[value]);
            let solution = solve(&one(a), &one(b), &one(q), &one(r)).unwrap();
            // b²x² + (r − a²r − b²q) x − q r = 0
            let (p2, p1, p0) = (b * b, r - a * a * r - b * b * q, -q * r);
            let x = (-p1 + f64::sqrt(p1 * p1 - 4.0 * p2 * p0)) / (2.0 * p2);
            assert!((solution.x[0] - x).abs() < 1e-10 * x, "{} against {x}", solution.x[0]);
        }
    }

    #[test]
    fn double_integrator_against_its_poles() {
        // For q on the position alone the closed-loop poles solve the symplectic characteristic equation
        // (z−1)²(z⁻¹−1)² + ρ (z+1)(z⁻¹+1)/4 = 0 with ρ = q T⁴/r; with s = z + 1/z: (2 − s)² + ρ (2 + s)/4 = 0.
        let (period, q, r) = (0.1f64, 1.0, 0.01);
        let a = matrix(2, 2, &[1.0, period, 0.0, 1.0]);
        let b = matrix(2, 1, &[0.5 * period * period, period]);
        let solution = solve(&a, &b, &matrix(2, 2, &[q, 0.0, 0.0, 0.0]), &matrix(1, 1, &[r])).unwrap();
        let rho = q * period.powi(4) / r;
        let poles = (&a - &b * &solution.gain).complex_eigenvalues();
        for z in poles.iter() {
            let s = z + z.inv();
            let two = nalgebra::Complex::new(2.0, 0.0);
            let value = (two - s) * (two - s) + (two + s) * (rho / 4.0);
            assert!(value.norm() < 1e-10, "{z}: {value}");
        }
    }

    #[test]
    fn what_cannot_be_stabilised_is_refused() {
        // An unstable mode that the input does not reach.
        let a = matrix(2, 2, &[1.1, 0.0, 0.0, 0.5]);
        let b = matrix(2, 1, &[0.0, 1.0]);
        assert!(solve(&a, &b, &DMatrix::identity(2, 2), &matrix(1, 1, &[1.0])).is_err());
        // An integrator that the cost does not see.
        let b = matrix(2, 1, &[1.0, 1.0]);
        let a = matrix(2, 2, &[1.0, 0.0, 0.0, 0.5]);
        let q = matrix(2, 2, &[0.0, 0.0, 0.0, 1.0]);
        assert!(solve(&a, &b, &q, &matrix(1, 1, &[1.0])).is_err());
        assert_eq!(
            solve(&matrix(1, 1, &[f64::NAN]), &matrix(1, 1, &[1.0]), &matrix(1, 1, &[1.0]), &matrix(1, 1, &[1.0])),
            Err(RiccatiError::NonFinite)
        );
    }
}
