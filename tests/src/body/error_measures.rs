//! Comparing tables of speeds.

/// Root of the mean square of the difference over the largest of `b`, for each of vx, vy, yaw. Infinite where a number is
/// missing.
#[must_use]
pub fn rms_over_largest(a: &[[f64; 3]], b: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|part| {
        let square = a.iter().zip(b).map(|(a, b)| (a[part] - b[part]).powi(2)).sum::<f64>();
        let share = (square / b.len() as f64).sqrt() / largest(b)[part];
        if a.len() == b.len() && share.is_finite() { share } else { f64::INFINITY }
    })
}

/// The largest absolute value of each part.
#[must_use]
pub fn largest(table: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|part| table.iter().map(|row| row[part].abs()).fold(0.0, f64::max))
}

/// In how many rows every part of `b` that is larger than `threshold` of the largest has its sign in `a`, too.
#[must_use]
pub fn same_signs(a: &[[f64; 3]], b: &[[f64; 3]], threshold: f64) -> usize {
    let top = largest(b);
    let agrees = |a: &[f64; 3], b: &[f64; 3]| {
        (0..3).all(|part| b[part].abs() <= threshold * top[part] || a[part] * b[part] > 0.0)
    };
    a.iter().zip(b).filter(|(a, b)| agrees(a, b)).count()
}

/// The largest of three shares.
#[must_use]
pub fn worst(shares: [f64; 3]) -> f64 {
    shares.into_iter().fold(0.0, f64::max)
}

/// "1.2/3.4/5.6 %".
#[must_use]
pub fn percent(shares: [f64; 3]) -> String {
    let [x, y, yaw] = shares.map(|share| 100.0 * share);
    format!("{x:.1}/{y:.1}/{yaw:.1} %")
}

/// Slope of a line through points by least squares.
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count);
    let over: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    over / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_speeds_may_have_any_sign() {
        let b = [[10.0, 1.0, -4.0], [-2.0, 5.0, 4.0]];
        assert_eq!(same_signs(&[[1.0, 1.0, -1.0], [-1.0, 1.0, 1.0]], &b, 0.15), 2);
        assert_eq!(same_signs(&[[1.0, -1.0, -1.0], [-1.0, 1.0, 1.0]], &b, 0.15), 1, "1 is a fifth of 5");
        assert_eq!(same_signs(&[[1.0, -1.0, -1.0], [-1.0, 1.0, 1.0]], &b, 0.25), 2);
        assert_eq!(same_signs(&[[f64::NAN, 1.0, -1.0], [-1.0, 1.0, 1.0]], &b, 0.15), 1);
    }

    #[test]
    fn what_is_missing_is_infinitely_wrong() {
        let b = [[1.0, 2.0, 4.0], [1.0, -2.0, 4.0]];
        assert_eq!(rms_over_largest(&b, &b), [0.0; 3]);
        assert_eq!(rms_over_largest(&[[2.0, 2.0, 4.0], [2.0, -2.0, f64::NAN]], &b), [1.0, 0.0, f64::INFINITY]);
        assert_eq!(rms_over_largest(&b[..1], &b), [f64::INFINITY; 3]);
    }

    #[test]
    fn a_straight_line_has_its_slope() {
        assert!((slope(&[(0.0, 1.0), (1.0, 3.0), (4.0, 9.0)]) - 2.0).abs() < 1e-12);
    }
}
