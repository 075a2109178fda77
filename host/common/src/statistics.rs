//! Order statistics of a few or many numbers.

/// The value at a share of the sorted numbers: linear between the two that it lies between, as NumPy and R (type 7) have it.
/// Share 0 is the smallest, 1 the largest, 0.5 the median; a share beyond 0 … 1 counts as the nearer of the two.
///
/// `None` where there are no numbers or `share` is NaN. NaNs sort as [`f64::total_cmp`] does, to the ends. The order of `values`
/// afterwards is not specified.
///
/// ```
/// use common::quantile;
///
/// let mut delays = [4.0, 1.0, 3.0, 2.0];
/// assert_eq!(quantile(&mut delays, 0.5), Some(2.5));
/// assert_eq!(quantile(&mut delays, 1.0), Some(4.0));
/// assert_eq!(quantile(&mut [], 0.5), None);
/// ```
#[must_use]
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    if share.is_nan() {
        return None;
    }
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (_, low, above) = values.select_nth_unstable_by(place as usize, f64::total_cmp);
    let (low, part) = (*low, place.fract());
    let high = above.iter().copied().min_by(f64::total_cmp).filter(|_| part > 0.0);
    // Two equal infinities have no difference.
    Some(high.filter(|high| *high != low).map_or(low, |high| (1.0 - part) * low + part * high))
}

/// The middle value: of an even number the mean of the middle two. `None` where there are no numbers. See [`quantile`].
///
/// ```
/// assert_eq!(common::median(&mut [3.0, 1.0, 2.0]), Some(2.0));
/// assert_eq!(common::median(&mut []), None);
/// ```
#[must_use]
pub fn median(values: &mut [f64]) -> Option<f64> {
    quantile(values, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_linear_between_neighbours() {
        let at = |share| quantile(&mut [40.0, 10.0, 30.0, 20.0, 50.0], share);
        for (share, wanted) in
            [(0.0, 10.0), (0.25, 20.0), (0.5, 30.0), (0.6, 34.0), (1.0, 50.0), (-1.0, 10.0), (7.0, 50.0)]
        {
            assert!((at(share).unwrap() - wanted).abs() < 1e-12, "{share}: {:?}", at(share));
        }
        assert_eq!(at(f64::NAN), None);
        assert_eq!(quantile(&mut [5.0], 0.3), Some(5.0));
    }

    #[test]
    fn the_median_is_the_middle_or_the_mean_of_the_middle_two() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [7.0]), Some(7.0));
        assert_eq!(median(&mut [9.0, 1.0]), Some(5.0));
        assert_eq!(median(&mut [9.0, 1.0, 2.0]), Some(2.0));
    }

    #[test]
    fn infinite_values_are_values() {
        let infinite = f64::INFINITY;
        assert_eq!(median(&mut [infinite, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [infinite, 1.0, infinite, 2.0]), Some(infinite));
        assert_eq!(median(&mut [infinite, infinite]), Some(infinite));
        assert!(median(&mut [f64::NAN, f64::NAN, 1.0]).unwrap().is_nan());
    }
}
