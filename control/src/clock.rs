//! When a sample was really taken, against the even grid of control ticks.

use crate::scalar::clamp;

/// What a sample's time says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elapsed {
    /// Control periods since the last sample, for the prediction; 0 for the very first and wherever it cannot be said.
    pub ticks: u16,
    /// Time since the last sample, s, for every limit on time: one period at least where time stands still or goes
    /// backwards, so that no clock, however broken, keeps a limit from running out.
    pub seconds: f32,
    /// The conversion was this much later than its tick, s (sampling jitter).
    pub offset: f32,
    /// Time went backwards or leapt: what was known before is worth nothing.
    pub jumped: bool,
    /// Time stood still, went backwards or leapt: nothing that a healthy clock does.
    pub clock_invalid: bool,
}

/// Follows the grid that the samples jitter about.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    started: bool,
    /// Time of the last sample.
    last_us: u64,
    grid_us: u64,
    /// Mean lateness against the grid that is not yet moved into it, µs.
    slack_us: f32,
}

/// Longest gap that the estimator bridges by prediction, ticks.
const LONGEST_GAP: f32 = 20.0;
/// Share of a sample's lateness that moves the grid.
const FOLLOW: f32 = 1.0 / 64.0;

impl Clock {
    /// Takes in the time of a sample; `tick` is the control period, s.
    pub fn advance(&mut self, time_us: u64, tick: f32) -> Elapsed {
        if !self.started {
            self.restart(time_us);
            return Elapsed { ticks: 0, seconds: tick, offset: 0.0, jumped: false, clock_invalid: false };
        }
        let passed = signed_difference(time_us, self.last_us) * 1e-6;
        self.last_us = time_us;
        let since_us = signed_difference(time_us, self.grid_us) - self.slack_us;
        let tick_us = tick * 1e6;
        let ticks = since_us / tick_us;
        if !(-0.5..=LONGEST_GAP).contains(&ticks) {
            self.restart(time_us);
            return Elapsed {
                ticks: 0,
                seconds: at_least(passed, tick),
                offset: 0.0,
                jumped: true,
                clock_invalid: true,
            };
        }
        let whole = whole(ticks);
        let late_us = since_us - f32::from(whole) * tick_us;
        if whole > 0 {
            self.grid_us = self.grid_us.saturating_add(rounded(f32::from(whole) * tick_us));
            self.slack_us += late_us * FOLLOW;
            self.move_whole_slack();
        }
        let clock_invalid = whole == 0;
        let seconds = if clock_invalid || passed <= 0.0 { at_least(passed, tick) } else { passed };
        Elapsed { ticks: whole, seconds, offset: late_us * 1e-6, jumped: false, clock_invalid }
    }

    fn restart(&mut self, time_us: u64) {
        *self = Self { started: true, last_us: time_us, grid_us: time_us, slack_us: 0.0 };
    }

    /// Whole microseconds belong to the grid: a clock that drifts for ever must not outgrow the slack's digits.
    fn move_whole_slack(&mut self) {
        if self.slack_us >= 1.0 {
            let whole = floor(self.slack_us);
            self.grid_us = self.grid_us.saturating_add(u64::from(whole));
            self.slack_us -= f32::from(whole);
        } else if self.slack_us <= -1.0 {
            let whole = floor(-self.slack_us);
            self.grid_us = self.grid_us.saturating_sub(u64::from(whole));
            self.slack_us += f32::from(whole);
        }
    }
}

/// `a − b`, µs; saturates where an `f32` could not tell ticks apart.
#[expect(clippy::cast_precision_loss, reason = "differences of many seconds are jumps whatever their last digit")]
fn signed_difference(a: u64, b: u64) -> f32 {
    if a >= b { a.saturating_sub(b) as f32 } else { -(b.saturating_sub(a) as f32) }
}

fn at_least(seconds: f32, least: f32) -> f32 {
    if seconds > least { seconds } else { least }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is at most a period")]
fn floor(us: f32) -> u16 {
    us as u16
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "kept within 0 … 20")]
fn whole(ticks: f32) -> u16 {
    (clamp(ticks, 0.0, LONGEST_GAP) + 0.5) as u16
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is at most 0.2 s")]
fn rounded(us: f32) -> u64 {
    (us + 0.5) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_is_told_from_ticks() {
        let mut clock = Clock::default();
        let jitter = [0, 12, -9, 3, -20, 15, 0, 7];
        clock.advance(5000, 1e-3);
        for (k, jitter) in jitter.iter().cycle().take(400).enumerate() {
            let time = 6000 + 1000 * k as u64;
            let elapsed = clock.advance(time.saturating_add_signed(*jitter), 1e-3);
            assert_eq!(elapsed.ticks, 1);
            assert!((elapsed.offset * 1e6 - *jitter as f32).abs() < 8.0, "{elapsed:?} for {jitter}");
        }
    }

    #[test]
    fn a_constant_lateness_becomes_the_grid() {
        let mut clock = Clock::default();
        clock.advance(0, 1e-3);
        let mut last = 1.0;
        for k in 1..1000u64 {
            last = clock.advance(k * 1000 + 100, 1e-3).offset;
        }
        assert!(last.abs() < 1e-6, "{last}");
    }

    #[test]
    fn a_drifting_clock_leaves_no_slack_behind() {
        for period_us in [1001u64, 999] {
            let mut clock = Clock::default();
            for k in 0..20_000u64 {
                let elapsed = clock.advance(k * period_us, 1e-3);
                assert!(k == 0 || elapsed.ticks == 1, "{k}: {elapsed:?}");
                assert!(clock.slack_us.abs() < 1.0, "{k}: {} us", clock.slack_us);
            }
        }
    }

    #[test]
    fn time_passes_for_the_limits_whatever_the_clock_does() {
        let mut clock = Clock::default();
        clock.advance(1 << 32, 1e-3);
        let stuck = clock.advance(1 << 32, 1e-3);
        assert!(stuck.clock_invalid && stuck.ticks == 0 && (stuck.seconds - 1e-3).abs() < 1e-9, "{stuck:?}");
        let slow = clock.advance((1 << 32) + 1, 1e-3);
        assert!(slow.clock_invalid && (slow.seconds - 1e-3).abs() < 1e-9, "{slow:?}");
        let wrapped = clock.advance(0, 1e-3);
        assert!(wrapped.clock_invalid && wrapped.jumped && (wrapped.seconds - 1e-3).abs() < 1e-9, "{wrapped:?}");
        let late = clock.advance(25_000, 1e-3);
        assert!(late.clock_invalid && late.jumped && (late.seconds - 25e-3).abs() < 1e-6, "{late:?}");
        let healthy = clock.advance(26_003, 1e-3);
        assert!(!healthy.clock_invalid && (healthy.seconds - 1.003e-3).abs() < 1e-8, "{healthy:?}");
    }

    #[test]
    fn missed_ticks_are_counted_and_leaps_are_called() {
        let mut clock = Clock::default();
        clock.advance(1000, 1e-3);
        assert_eq!(clock.advance(4010, 1e-3).ticks, 3);
        assert_eq!(clock.advance(4010, 1e-3).ticks, 0);
        assert!(clock.advance(2000, 1e-3).jumped);
        assert!(!clock.advance(3000, 1e-3).jumped);
        assert!(clock.advance(u64::MAX, 1e-3).jumped);
        assert!(clock.advance(0, 1e-3).jumped);
    }
}
