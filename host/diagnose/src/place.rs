//! Which coordinate the rest of a model follows: a curve over each is fitted together with the model's numbers, and judged on runs
//! that no fit has seen.
//!
//! A screen ([`super::curves`]) asks the linear model, which says little of a rest that has moved the refitted numbers far, or
//! that moves a rollout far itself.

use rayon::prelude::*;

use super::curves;
use super::probe::{Follows, Shape};
use super::screen::Screen;
use super::search::Candidate;
use super::selection::leaves_much;
use super::session::Session;

/// Rounds of a fit, which is one to the rollouts of a first look.
const ROUNDS: usize = 6;

/// The coordinates that are judged: a run that is held out has no term in a curve over the runs that were fitted on.
const JUDGED: [Follows; 10] = [
    Follows::Angle,
    Follows::Speed,
    Follows::Voltage,
    Follows::Time,
    Follows::Reading,
    Follows::Mesh,
    Follows::Current,
    Follows::Reversal,
    Follows::SlipWithSpeed,
    Follows::SlipWithCurrent,
];

/// A curve that takes away this share of the excess on runs that no fit has seen is where the rest lives.
const TAKES: f64 = 0.1;
/// This share is more than a screen's word for another coordinate, where that promises less than the second.
const TAKES_MOST: (f64, f64) = (0.5, 0.3);

/// The coordinate whose curve takes away most of the rest of a model: by a screen of it, where that is more than an accident, or on
/// held-out runs.
#[must_use]
pub fn of(session: &Session, model: &Candidate, noise: f64, screen: &Screen) -> Option<Follows> {
    let promised = screen.follows();
    if promised.is_some_and(|(_, share)| share >= TAKES_MOST.1) || !leaves_much(noise, model) {
        return promised.map(|(follows, _)| follows);
    }
    let bar = if promised.is_some() { TAKES_MOST.0 } else { TAKES };
    let taken = shares(session, model, noise).first().copied().filter(|(_, share)| *share >= bar);
    taken.or(promised).map(|(follows, _)| follows)
}

/// The share of a model's excess over the noise (mean square, rad²) that a curve over each coordinate takes away, the largest first.
fn shares(session: &Session, model: &Candidate, noise: f64) -> Vec<(Follows, f64)> {
    let spans = curves::spans(&session.model, &session.data());
    let (before, least) = (model.mean_square(), noise);
    let share = |&follows: &Follows| {
        let fit = session.look_with_curve(&model.fit, Shape { follows, spans }, ROUNDS);
        let after = session.evaluate(&fit).mean_square();
        (follows, (before - after) / (before - least).max(f64::MIN_POSITIVE))
    };
    let mut shares: Vec<(Follows, f64)> = JUDGED.par_iter().map(share).collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares
}
