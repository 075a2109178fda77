//! What the file's model lacks, as a curve over one coordinate: a torque on the shaft, or an error of the reading.
//!
//! The curves are the screen's own ([`super::probe`]): waves of the angle, and splines of first order over speed, voltage and time.
//! They are estimated by one step of the linear model about the refitted one, so that a curve is true to scale where the effect
//! moves a rollout little beside the motion itself, and still shows its shape where it does not.

use nalgebra::DVector;

use super::curves::{self, EstimatedCurve};
use super::fit::WIDE;
use super::probe::{Follows, Moment, Probe};
use super::search::Candidate;
use super::session::Session;
use super::verdict::{MisfitCurve, MissingTerm, TermKind, TermPoint};

/// Points of a curve.
const POINTS: usize = 61;

/// The curves about the refitted model that are more than an accident, the most promising first.
#[must_use]
pub fn of(session: &Session, refitted: &Candidate, covered: &[MisfitCurve], seed: u64) -> Vec<MissingTerm> {
    let mut curves = curves::estimate(&session.model, &session.data(), &refitted.fit, seed);
    curves.sort_by(|a, b| b.screened.beyond_accident().total_cmp(&a.screened.beyond_accident()));
    curves
        .iter()
        .flat_map(|curve| kinds(curve.shape.follows).iter().filter_map(|kind| term(curve, *kind, covered)))
        .collect()
}

fn kinds(follows: Follows) -> &'static [TermKind] {
    match follows {
        Follows::Angle | Follows::Speed | Follows::Voltage | Follows::Current => &[TermKind::TorqueNm],
        Follows::Time | Follows::Run => &[TermKind::TorqueAlongMotionNm, TermKind::TorqueAlongVoltageNm],
        Follows::Mesh | Follows::Reversal => &[TermKind::TorqueAlongMotionNm],
        Follows::Reading => &[TermKind::ReadingRad],
        Follows::SlipWithSpeed | Follows::SlipWithCurrent => &[TermKind::SlipRadPerS],
    }
}

/// A curve over the range that the runs cover; `None` where they cover none.
fn term(curve: &EstimatedCurve, kind: TermKind, covered: &[MisfitCurve]) -> Option<MissingTerm> {
    let follows = curve.shape.follows;
    let coordinate = follows.name();
    let bins = &covered.iter().find(|one| one.coordinate == coordinate)?.bins;
    let (from, to) = (bins.first()?.from, bins.last()?.to);
    // Of runs there is nothing in between.
    let last = if follows == Follows::Run { curve.shape.spans.runs.max(2) - 1 } else { POINTS - 1 };
    let (from, to) = if follows == Follows::Run { (0.0, last as f64) } else { (from, to) };
    let point = |i: usize| {
        let at = from + (to - from) * i as f64 / last as f64;
        let shares = shares(curve, kind, at);
        let value = shares.dot(&curve.terms);
        let half = WIDE * (&curve.covariance * &shares).dot(&shares).max(0.0).sqrt();
        TermPoint { at, value, low: value - half, high: value + half }
    };
    Some(MissingTerm {
        coordinate: coordinate.to_owned(),
        kind,
        promised: curve.screened.promised,
        chance: curve.screened.family_chance,
        points: (0..=last).map(point).collect(),
    })
}

/// How much of each term of a curve there is at a place on its coordinate.
fn shares(curve: &EstimatedCurve, kind: TermKind, at: f64) -> DVector<f64> {
    let (follows, spans) = (curve.shape.follows, curve.shape.spans);
    let rest = Moment { angle: 0.0, speed: 0.0, voltage: 0.0, current: 0.0, time: 0.0, since_reversal: 0.0, run: 0 };
    let moves = if kind == TermKind::TorqueAlongMotionNm { spans.speed } else { 0.0 };
    let pulls = if kind == TermKind::TorqueAlongVoltageNm { spans.voltage } else { 0.0 };
    let driven = Moment { speed: moves, voltage: pulls, ..rest };
    let moment = match follows {
        Follows::Angle | Follows::Reading | Follows::Mesh => Moment { angle: at, ..driven },
        Follows::Speed | Follows::SlipWithSpeed => Moment { speed: at, ..rest },
        Follows::Voltage => Moment { voltage: at, ..rest },
        Follows::Current => Moment { current: at, ..rest },
        Follows::SlipWithCurrent => Moment { current: at, speed: spans.speed, ..rest },
        Follows::Time => Moment { time: at, ..driven },
        Follows::Reversal => Moment { since_reversal: at, ..driven },
        Follows::Run => Moment { run: at as usize, ..driven },
    };
    let share = |term: usize| {
        let probe = Probe::term(curve.shape, term);
        probe.torque(moment) + probe.reading_error(moment.angle) + probe.slip(moment)
    };
    DVector::from_fn(curve.shape.terms(), |term, _| share(term))
}
