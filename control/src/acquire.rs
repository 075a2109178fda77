//! What the last dozen readings say by themselves: the line through them, and with it an unknown angle.
//!
//! At rest no reading is trusted: the wiper may lie on insulation, holding or drifting. So the shaft is driven, and the
//! readings must advance in a straight line relative to what the model predicts. Only then angle and speed are taken.

use crate::angle::{BINARY_PART, to_binary, wrap};
use crate::parameters::{Acquisition, WINDOW};
use crate::scalar::square;

/// One reading with what the model expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
struct Entry {
    /// Angle read, moved back to its tick, less the predicted one; binary angle.
    deviation: i32,
    /// Angle predicted for the same tick, binary; only its differences count.
    predicted: i32,
}

/// The readings in a row, newest first.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    entries: [Entry; WINDOW],
    filled: u16,
}

/// The line through a full window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Angle at the newest sample, rad, −π … π.
    pub angle: f32,
    /// Speed at the newest sample, rad/s: the model's there, and what the readings gain on it.
    pub speed: f32,
    /// Mean square of what the line leaves, rad².
    pub residual: f32,
}

impl Default for Window {
    fn default() -> Self {
        Self { entries: [Entry::default(); WINDOW], filled: 0 }
    }
}

impl Window {
    /// Forgets everything: the readings are not in a row any more.
    pub fn clear(&mut self) {
        self.filled = 0;
    }

    /// Takes in a reading (rad) of a tick and the prediction (rad) for it.
    pub fn push(&mut self, angle: f32, predicted: f32) {
        let predicted = to_binary(predicted);
        let mut carried = Entry { deviation: to_binary(angle).wrapping_sub(predicted), predicted };
        for slot in &mut self.entries {
            core::mem::swap(slot, &mut carried);
        }
        self.filled = self.filled.saturating_add(1);
    }

    /// The line through the newest samples, once there are enough; `tick` in s.
    #[must_use]
    pub fn line(&self, acquisition: &Acquisition, tick: f32) -> Option<Line> {
        if self.filled < acquisition.samples {
            return None;
        }
        let newest = self.entries.first()?;
        let (mut sum, mut sum_age, mut sum_square) = (0i64, 0i64, 0i64);
        // Twice the age of an entry, from the middle of the line on.
        let mut age = 1i64.wrapping_sub(i64::from(acquisition.samples));
        for entry in self.entries.iter().take(usize::from(acquisition.samples)) {
            let deviation = i64::from(entry.deviation.wrapping_sub(newest.deviation));
            sum = sum.wrapping_add(deviation);
            sum_age = sum_age.wrapping_add(age.wrapping_mul(deviation));
            let coarse = deviation >> COARSE_BITS;
            sum_square = sum_square.wrapping_add(coarse.wrapping_mul(coarse));
            age = age.wrapping_add(2);
        }
        let count = f32::from(acquisition.samples);
        let middle = 0.5 * (count - 1.0);
        // Σ (age − middle)² of 0 … n−1, over n.
        let moment = (square(count) - 1.0) / 12.0;
        let share = 1.0 / count;
        let mean = share * rad(sum);
        let per_age = 0.5 * share * rad(sum_age) / moment;
        let mean_square = share * square(COARSE_PART) * whole(sum_square);
        let residual = mean_square - square(mean) - square(per_age) * moment;
        Some(Line {
            angle: wrap(rad(i64::from(newest.predicted.wrapping_add(newest.deviation))) + mean - per_age * middle),
            speed: (self.predicted_travel() - per_age) / tick,
            residual: if residual > 0.0 { residual } else { 0.0 },
        })
    }

    /// What the model travels in a tick as fast as at the newest sample, rad: the last two differences, carried on by half.
    fn predicted_travel(&self) -> f32 {
        let [newest, before, earlier, ..] = &self.entries;
        let last = i64::from(newest.predicted.wrapping_sub(before.predicted));
        let last_but_one = i64::from(before.predicted.wrapping_sub(earlier.predicted));
        1.5 * rad(last) - 0.5 * rad(last_but_one)
    }
}

/// Sixteen squares of half a turn fit into an `i64` when so many of the last bits are left out.
const COARSE_BITS: u32 = 4;
/// rad in what is left.
const COARSE_PART: f32 = 16.0 * BINARY_PART;

/// A sum of binary angles in rad.
fn rad(sum: i64) -> f32 {
    BINARY_PART * whole(sum)
}

#[expect(clippy::cast_precision_loss, reason = "the sums are exact; a 24th bit less in the result does not matter")]
fn whole(sum: i64) -> f32 {
    sum as f32
}

impl Line {
    /// Whether the readings form a line at all.
    #[must_use]
    pub fn is_straight(&self, acquisition: &Acquisition) -> bool {
        self.residual <= square(acquisition.residual)
    }

    /// Whether it gives an angle to start from; `direction` is that of the drive (+1, −1), 0 with the bridge off.
    #[must_use]
    pub fn is_trusted(&self, acquisition: &Acquisition, direction: f32) -> bool {
        let forward = if direction.abs() > 0.5 { direction * self.speed } else { self.speed.abs() };
        self.is_straight(acquisition) && forward >= acquisition.least_speed
    }
}

/// A line that looks like a turning shaft, until a second one confirms it.
///
/// A held reading that drifts in the gap is a straight line too. But a shaft that starts from rest gains speed as the
/// model does, and a drift does not: the second line, of other samples, must have followed the model at least half-way.
#[derive(Clone, Copy, Debug, Default)]
pub struct Candidate {
    /// Line's and model's speed when it was found, rad/s.
    first: Option<(f32, f32)>,
    age: u16,
}

/// Speeds of two lines differ by this much from noise alone, rad/s.
const SPEED_NOISE: f32 = 4.0;

impl Candidate {
    /// Forgets the candidate: the readings are not in a row any more.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Takes in a tick's trusted line with the model's speed (rad/s); true when it confirms the candidate.
    pub fn confirm(&mut self, acquisition: &Acquisition, line: &Line, model_speed: f32) -> bool {
        let Some((line_then, model_then)) = self.first else {
            *self = Self { first: Some((line.speed, model_speed)), age: 0 };
            return false;
        };
        self.age = self.age.saturating_add(1);
        if self.age < acquisition.samples {
            return false;
        }
        let gained = model_speed - model_then;
        let deviation = (line.speed - line_then) - gained;
        let confirmed = deviation.abs() <= 0.5 * gained.abs() + SPEED_NOISE;
        *self = Self { first: Some((line.speed, model_speed)), age: 0 };
        confirmed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACQUISITION: Acquisition =
        Acquisition { samples: 12, residual: 0.05, least_speed: 5.0, speed: 25.0, patience: 0.1 };
    const TICK: f32 = 1e-3;

    /// A window filled with a shaft's angle and what a model thought of it.
    fn fill(truth: impl Fn(f32) -> f32, model: impl Fn(f32) -> f32) -> Line {
        let mut window = Window::default();
        for k in 0..12u16 {
            assert!(window.line(&ACQUISITION, TICK).is_none());
            let t = f32::from(k) * TICK;
            window.push(wrap(truth(t)), wrap(model(t)));
        }
        window.line(&ACQUISITION, TICK).expect("full")
    }

    #[test]
    fn a_line_over_the_seam_gives_angle_and_speed() {
        let line = fill(|t| 3.0 + 40.0 * t, |t| 30.0 * t);
        assert!((line.speed - 40.0).abs() < 1e-2, "{line:?}");
        assert!(wrap(line.angle - (3.0 + 40.0 * 0.011)).abs() < 1e-4, "{line:?}");
        assert!(line.is_trusted(&ACQUISITION, 1.0) && !line.is_trusted(&ACQUISITION, -1.0));
    }

    #[test]
    fn an_accelerating_shaft_is_a_line_when_the_model_accelerates_too() {
        let line = fill(|t| 1.0 + 10.0 * t + 550.0 * t * t, |t| 8.0 * t + 500.0 * t * t);
        assert!(line.is_trusted(&ACQUISITION, 1.0), "{line:?}");
        assert!((line.angle - (1.0 + 10.0 * 0.011 + 550.0 * 0.011 * 0.011)).abs() < 2e-3, "{line:?}");
        // The shaft's speed now, not over the window: half a window's share of the unknown acceleration is missed.
        let missed = 2.0 * 50.0 * 0.0055;
        assert!((line.speed - (10.0 + 2.0 * 550.0 * 0.011) + missed).abs() < 1e-2, "{line:?}");
    }

    #[test]
    fn a_held_reading_is_not_trusted() {
        let line = fill(|t| 0.3 + t, |t| 30.0 * t);
        assert!(line.is_straight(&ACQUISITION) && !line.is_trusted(&ACQUISITION, 1.0), "{line:?}");
    }

    #[test]
    fn noise_all_over_the_turn_is_not_a_line() {
        let line = fill(|t| (t * 1e3).powi(3) * 1.7, |t| 30.0 * t);
        assert!(!line.is_straight(&ACQUISITION), "{line:?}");
    }

    #[test]
    fn a_drifting_reading_is_not_confirmed_and_a_starting_shaft_is() {
        for (drifting, expected) in [(true, false), (false, true)] {
            let mut candidate = Candidate::default();
            let confirmed = (0..15u16).any(|tick| {
                let model = 1.1 * f32::from(tick);
                // A shaft that starts a third more slowly than the model.
                let speed = if drifting { 15.0 } else { 10.0 + 0.7 * model };
                let line = Line { angle: 0.0, speed, residual: 0.0 };
                candidate.confirm(&ACQUISITION, &line, 10.0 + model)
            });
            assert_eq!(confirmed, expected, "drifting: {drifting}");
        }
    }
}
