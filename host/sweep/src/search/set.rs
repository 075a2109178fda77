//! A set of the unknown numbers: where they may be, and what came of it.

use crate::axis::significant;

/// Ratio of the ends of a spread from which on it is searched by its logarithm.
const DECADES: f64 = 3.0;
/// Digits of a number that is tried: what is written is what was run.
const DIGITS: usize = 6;

/// A number that is searched.
#[derive(Clone, Debug)]
pub(crate) struct Unknown {
    pub path: String,
    pub low: f64,
    pub high: f64,
}

impl Unknown {
    fn logarithmic(&self) -> bool {
        self.low > 0.0 && self.high > DECADES * self.low
    }

    /// From 0 … 1.
    pub(crate) fn value(&self, share: f64) -> f64 {
        let value = if self.logarithmic() {
            self.low * (self.high / self.low).powf(share)
        } else {
            self.low + share * (self.high - self.low)
        };
        significant(value, DIGITS).clamp(self.low, self.high)
    }

    /// To 0 … 1.
    pub(super) fn share(&self, value: f64) -> f64 {
        if self.logarithmic() {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }
}

/// A set and what it gave.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EvaluatedSet {
    pub values: Vec<f64>,
    /// By how much each claim holds; none where one could not be judged.
    pub margins: Vec<Option<f64>>,
    /// Why the set is not admissible; empty where it is.
    pub note: String,
}

/// A margin that is enough.
const ENOUGH: f64 = 0.05;
/// A claim that falls short by this counts half.
const SHORT: f64 = 0.2;

impl EvaluatedSet {
    pub(super) fn holds(&self, claim: usize) -> bool {
        self.margins[claim].is_some_and(|margin| margin > 0.0)
    }

    pub(super) fn held(&self) -> usize {
        (0..self.margins.len()).filter(|claim| self.holds(*claim)).count()
    }

    /// What a search makes small: every claim's lack of an ample margin, so that none that is far from holding outweighs those that are
    /// near; more than all of them where a run blew up.
    pub(super) fn cost(&self) -> f64 {
        if !self.note.is_empty() {
            return self.margins.len() as f64;
        }
        let lack = |margin: &Option<f64>| {
            let short = margin.map_or(f64::INFINITY, |margin| (ENOUGH - margin).max(0.0));
            if short.is_finite() { short / (short + SHORT) } else { 1.0 }
        };
        self.margins.iter().map(lack).sum()
    }

    pub(super) fn cells(&self) -> Vec<String> {
        let claims = self.margins.iter().map(|margin| margin.map_or(String::new(), |margin| margin.to_string()));
        let held = self.held().to_string();
        self.values.iter().map(f64::to_string).chain(claims).chain([held, self.note.clone()]).collect()
    }

    /// None where a cell is not what [`Self::cells`] writes.
    pub(super) fn parse(cells: &[String], unknowns: usize, claims: usize) -> Option<Self> {
        let value = |text: &String| text.parse().ok().filter(|value: &f64| value.is_finite());
        let margin = |text: &String| if text.is_empty() { Some(None) } else { value(text).map(Some) };
        Some(Self {
            values: cells.get(..unknowns)?.iter().map(value).collect::<Option<_>>()?,
            margins: cells.get(unknowns..unknowns + claims)?.iter().map(margin).collect::<Option<_>>()?,
            note: cells.last()?.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stay_within_the_spread_and_come_back() {
        for (low, high) in [(0.45, 1.3), (1.0, 500.0), (0.0, 0.004), (2.5e-5, 3.78e-4)] {
            let unknown = Unknown { path: String::new(), low, high };
            for k in 0..=20 {
                let share = f64::from(k) / 20.0;
                let value = unknown.value(share);
                assert!((low..=high).contains(&value));
                assert!((unknown.share(value) - share).abs() < 1e-4, "{low} {high} {share}");
            }
        }
        let wide = Unknown { path: String::new(), low: 1.0, high: 100.0 };
        assert_eq!(wide.value(0.5), 10.0, "the middle of a wide spread is its geometric mean");
    }

    #[test]
    fn rows_are_read_as_they_were_written() {
        let evaluated =
            EvaluatedSet { values: vec![1.5, 2e-5], margins: vec![Some(0.1), None, Some(-1e-3)], note: "why".into() };
        assert_eq!(EvaluatedSet::parse(&evaluated.cells(), 2, 3), Some(evaluated.clone()));
        for (place, wrong) in [(0, "x"), (1, "NaN"), (2, "inf"), (4, "no")] {
            let mut cells = evaluated.cells();
            cells[place] = wrong.into();
            assert_eq!(EvaluatedSet::parse(&cells, 2, 3), None, "{wrong}");
        }
    }

    #[test]
    fn what_nearly_holds_costs_less_than_what_does_not_and_an_ample_margin_nothing() {
        let cost = |margins: &[f64], note: &str| {
            let margins = margins.iter().map(|margin| Some(*margin)).collect();
            EvaluatedSet { values: vec![], margins, note: note.into() }.cost()
        };
        assert_eq!(cost(&[0.05, 3.0], ""), 0.0);
        assert!(cost(&[0.01, 1.0], "") < cost(&[-0.01, 1.0], ""));
        assert!(cost(&[-9.0, 1.0], "") < cost(&[-0.3, -0.3], ""), "one that is hopeless counts once");
        assert_eq!(cost(&[1.0, 1.0], "2 runs blew up"), 2.0);
    }
}
