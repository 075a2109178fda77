//! The turning points of an oscillation, from the true motion of the shaft.

use super::Tick;
use common::conventions::degrees;
use common::wrap;

/// A stroke that goes this much further than from bound to bound has run away.
pub const RUNAWAY_DEG: f64 = 90.0;
/// Back and forth by less than this is not a turn: the shaft trembles at rest.
const TREMBLE_RAD: f64 = 0.1;
/// A stroke that has not ended after this many seconds has run away, or stands.
const LONGEST_STROKE_S: f64 = 1.0;

/// The strokes of one oscillation.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Strokes {
    /// Angle of every turn, degrees, on the turn of the bound that it belongs to.
    pub turning_points_deg: Vec<f64>,
    /// How far beyond (positive) or short of (negative) its bound every turn is, degrees.
    pub errors_deg: Vec<f64>,
    /// Strokes longer than from bound to bound by [`RUNAWAY_DEG`] or more, or that did not end.
    pub ran_away: usize,
    /// Full swings, there and back, per second.
    pub frequency_hz: Option<f64>,
}

/// Where the motion changes its direction: tick, angle (rad), and whether it was an upper one.
fn reversals(ticks: &[Tick]) -> Vec<(usize, f64, bool)> {
    let mut found = Vec::new();
    let Some(first) = ticks.first() else { return found };
    let (mut low, mut high) = ((0, first.truth.angle), (0, first.truth.angle));
    let mut rising: Option<bool> = None;
    for (index, tick) in ticks.iter().enumerate() {
        let angle = tick.truth.angle;
        if angle > high.1 {
            high = (index, angle);
        }
        if angle < low.1 {
            low = (index, angle);
        }
        if rising != Some(false) && high.1 - angle > TREMBLE_RAD {
            if rising.is_some() {
                found.push((high.0, high.1, true));
            }
            rising = Some(false);
            low = (index, angle);
        } else if rising != Some(true) && angle - low.1 > TREMBLE_RAD {
            if rising.is_some() {
                found.push((low.0, low.1, false));
            }
            rising = Some(true);
            high = (index, angle);
        }
    }
    found
}

impl Strokes {
    /// Of an oscillation between two angles (rad). The first reversal after the shaft was found is the acquisition's
    /// own and does not count; every later one does.
    pub(super) fn of(ticks: &[Tick], from: f64, to: f64) -> Self {
        let Some(tracked) = ticks.iter().position(|tick| tick.telemetry.tracking) else {
            return Self::default();
        };
        let ticks = &ticks[tracked..];
        let all = reversals(ticks);
        let Some((start, turns)) = all.split_first() else {
            let stuck = Self::lasts(ticks, 0, ticks.len() - 1) > LONGEST_STROKE_S;
            return Self { ran_away: usize::from(stuck), ..Self::default() };
        };
        let mut strokes = Self::default();
        let mut last = *start;
        for &(index, angle, upper) in turns {
            let bound = if upper { to } else { from };
            let beyond = wrap(angle - bound);
            strokes.turning_points_deg.push(degrees(bound + beyond));
            strokes.errors_deg.push(degrees(if upper { beyond } else { -beyond }));
            let too_far = (angle - last.1).abs() - (to - from) > RUNAWAY_DEG.to_radians();
            // The first stroke comes from wherever the shaft was.
            let counts = last.0 != start.0 || (angle - last.1).abs() > std::f64::consts::TAU;
            if (too_far && counts) || Self::lasts(ticks, last.0, index) > LONGEST_STROKE_S {
                strokes.ran_away += 1;
            }
            last = (index, angle, upper);
        }
        if Self::lasts(ticks, last.0, ticks.len() - 1) > LONGEST_STROKE_S {
            strokes.ran_away += 1;
        }
        if let ([first, .., final_turn], count) = (turns, turns.len() - usize::from(!turns.is_empty()))
            && Self::lasts(ticks, first.0, final_turn.0) > 0.0
        {
            strokes.frequency_hz = Some(0.5 * count as f64 / Self::lasts(ticks, first.0, final_turn.0));
        }
        strokes
    }

    fn lasts(ticks: &[Tick], from: usize, to: usize) -> f64 {
        ticks[to].time_s - ticks[from].time_s
    }
}
