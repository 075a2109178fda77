//! A line that keeps its extremes in bounded memory, however long the run.

/// Points held at most; a screen has a fraction of them.
const MOST_POINTS: usize = 60_000;
/// Points that become their lowest and highest (and a break) when there are too many.
const BUCKET: usize = 8;

/// A line; a `None` breaks it.
#[derive(Clone, Debug, Default)]
pub(super) struct Trail {
    points: Vec<(f64, Option<f64>)>,
}

impl Trail {
    pub(super) fn push(&mut self, at: f64, value: Option<f64>) {
        // A long break is one break.
        if value.is_none() && self.points.last().is_none_or(|(_, last)| last.is_none()) {
            return;
        }
        self.points.push((at, value));
        if self.points.len() > MOST_POINTS {
            self.points = self.points.chunks(BUCKET).flat_map(extremes).collect();
        }
    }

    pub(super) fn points(&self) -> &[(f64, Option<f64>)] {
        &self.points
    }

    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

/// Lowest and highest point in the order of time, and one break where there is any.
fn extremes(bucket: &[(f64, Option<f64>)]) -> Vec<(f64, Option<f64>)> {
    let values = || bucket.iter().filter_map(|(at, value)| value.map(|value| (*at, value)));
    let low = values().min_by(|a, b| a.1.total_cmp(&b.1));
    let high = values().max_by(|a, b| a.1.total_cmp(&b.1));
    let gap = bucket.iter().find(|(_, value)| value.is_none()).map(|(at, _)| *at);
    let mut kept: Vec<(f64, Option<f64>)> = [low, high].into_iter().flatten().map(|(at, v)| (at, Some(v))).collect();
    kept.dedup();
    kept.extend(gap.map(|at| (at, None)));
    kept.sort_by(|a, b| a.0.total_cmp(&b.0));
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_keeps_its_extremes_and_no_more_points_than_it_may() {
        let mut trail = Trail::default();
        for i in 0..2_000_000 {
            let value = if i == 1_234_567 { 9.0 } else { f64::from(i % 3) };
            trail.push(f64::from(i), (i % 1000 != 0).then_some(value));
        }
        assert!(trail.points().len() <= MOST_POINTS);
        assert!(trail.points().contains(&(1_234_567.0, Some(9.0))));
        assert!(trail.points().windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }
}
