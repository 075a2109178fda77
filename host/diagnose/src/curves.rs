//! Curves over coordinates that a model lacks: screened with a chance, and estimated with an interval.
//!
//! A curve is a direction of [`super::screen`] with a term for every knot or wave ([`super::probe`]). Each is worked out by itself
//! and let go before the next, for its sensitivities fill as many columns as it has terms.

use nalgebra::{DMatrix, DVector};

use super::fit::{self, Columns, Data, Fit, Followed, Moved};
use super::nominal::FileModel;
use super::one_step::one_step;
use super::probe::{Follows, Probe, Shape, Spans};
use super::rollout::Rolled;
use super::screen::{Direction, Group, Scores, Screened, block_rollouts, family};
use super::track::Track;

/// A curve as one step of the linear model has it.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatedCurve {
    /// What it follows on this rig.
    pub shape: Shape,
    /// By how much it promises to lower the sum of squares, and how likely chance is to promise as much.
    pub screened: Screened,
    /// Its terms, in each one's own size.
    pub terms: DVector<f64>,
    /// Of the terms.
    pub covariance: DMatrix<f64>,
}

/// Screens curves about what a fit leaves, as one family.
#[must_use]
pub fn screen(model: &FileModel, data: &Data, fit: &Fit, seed: u64, which: &[Follows]) -> Vec<Screened> {
    let about = About::new(model, data, fit);
    let mut signs = Vec::new();
    let tested = which.iter().map(|&follows| {
        let (group, columns) = about.curve(follows);
        let scores = Scores::new(data, fit, &about.rolled, &columns);
        if signs.is_empty() {
            signs = scores.signs(seed);
        }
        scores.test(&group, &signs)
    });
    family(tested.collect())
}

/// Those of the curves that a fit lacks which are more than an accident. What the fit's numbers could do is not in them.
#[must_use]
pub fn estimate(model: &FileModel, data: &Data, fit: &Fit, seed: u64) -> Vec<EstimatedCurve> {
    let about = About::new(model, data, fit);
    let screened = screen(model, data, fit, seed, &Follows::ALL);
    let sure = Follows::ALL.into_iter().zip(screened).filter(|(_, screened)| screened.is_sure());
    let estimate = |(follows, screened)| {
        let (group, columns) = about.curve(follows);
        let block = |track: usize| block_rollouts(&data.tracks[track]);
        let (terms, covariance) = one_step(data, fit, &about.rolled, &columns, &group.columns, &block);
        EstimatedCurve { shape: Shape { follows, spans: about.spans }, screened, terms, covariance }
    };
    sure.map(estimate).collect()
}

/// What the curves about a fit have in common.
struct About<'a> {
    model: &'a FileModel,
    data: &'a Data<'a>,
    fit: &'a Fit,
    rolled: Vec<Rolled>,
    /// Sensitivities to the starts and to the fit's numbers.
    columns: Vec<Columns>,
    spans: Spans,
}

impl<'a> About<'a> {
    fn new(model: &'a FileModel, data: &'a Data<'a>, fit: &'a Fit) -> Self {
        let rolled = fit::roll_all(model, data, fit);
        let columns = fit::columns_of(model, data, fit, &rolled, Followed::WithinSegment, Vec::new());
        Self { model, data, fit, rolled, columns, spans: spans(model, data) }
    }

    /// A curve, and its columns after those of the starts and the fit's numbers.
    fn curve(&self, follows: Follows) -> (Group, Vec<Columns>) {
        let (base, shape) = (self.fit.plant(self.model), Shape { follows, spans: self.spans });
        let terms = shape.terms();
        let moved: Vec<Moved> = (0..terms).map(|term| Some((base.with_probe(Probe::term(shape, term)), 1.0))).collect();
        let own = fit::sensitivities(self.data, &base, &self.fit.starts, &self.rolled, Followed::WithinSegment, &moved);
        let after = |(known, own): (&Columns, Columns)| known.iter().cloned().chain(own.into_iter().skip(2)).collect();
        let columns = self.columns.iter().zip(own).map(after).collect();
        let numbers = self.fit.free.len();
        let direction = Direction::Curve(follows);
        (Group { direction, columns: numbers..numbers + terms, moved, sizes: Vec::new() }, columns)
    }
}

/// The scales of a rig's runs.
#[must_use]
pub fn spans(model: &FileModel, data: &Data) -> Spans {
    let volts = |track: &Track| track.drive_scale * if track.terminals_measured { 1.0 } else { model.rail_v };
    let voltage = data.tracks.iter().map(volts).fold(0.0, f64::max).max(1e-9);
    let length = |track: &Track| track.t.last().map_or(0.0, |last| last - track.t[0]);
    Spans {
        speed: model.no_load_speed(voltage),
        voltage,
        current: model.stall_current(voltage),
        time: data.tracks.iter().map(length).fold(0.0, f64::max).max(1e-9),
        runs: data.tracks.len(),
        torque: 0.01 * model.stall_torque(),
    }
}

#[cfg(test)]
mod tests;
