//! Whether the control loop keeps its period: the time of the periods that it missed.
//!
//! Between two samples nobody watches, so every bound holds only while the samples come. One long pause and many short ones
//! are the same evil: their time is added up and flows off slowly, so that a loop which loses more than the share that flows
//! off is found, in whatever pattern it does.

use crate::scalar::clamp;

/// Time of the missed periods that has not flowed off, s.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct LoopHealth {
    missed: f32,
}

/// More than this share of the limit is not remembered: one long pause at rest, while the flash is written, is soon over.
const REMEMBERED: f32 = 1.1;

impl LoopHealth {
    /// A sample that came `elapsed` (s) after the one before, of a loop with the period `tick` (s), of which `allowed` is the
    /// share that may be missed for ever, and `limit` (s) what may be missed at once.
    pub fn advance(&mut self, elapsed: f32, tick: f32, allowed: f32, limit: f32) {
        self.missed = clamp(self.missed + (elapsed - tick) - allowed * elapsed, 0.0, REMEMBERED * limit);
    }

    /// Time of the missed periods, s.
    #[must_use]
    pub fn missed(&self) -> f32 {
        self.missed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time until the sum passes 50 ms under a repeated pattern of gaps (ms), s; nothing within 60 s.
    fn found(pattern: &[f32]) -> Option<f32> {
        let mut health = LoopHealth::default();
        let mut time = 0.0;
        for gap in pattern.iter().cycle() {
            time += gap * 1e-3;
            health.advance(gap * 1e-3, 1e-3, 0.1, 0.05);
            if health.missed() > 0.05 {
                return Some(time);
            }
            if time > 60.0 {
                return None;
            }
        }
        None
    }

    #[test]
    fn starvation_of_any_pattern_is_found_in_time() {
        let patterns: [&[f32]; 6] = [
            &[99.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            &[90.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            &[15.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            &[2.0],
            &[5.0, 1.0],
            &[1.0, 1.0, 1.0, 1.0, 1.0, 40.0],
        ];
        for pattern in patterns {
            let after = found(pattern);
            assert!(after.is_some_and(|after| after < 0.2), "{pattern:?}: {after:?}");
        }
    }

    #[test]
    fn a_long_pause_is_soon_forgotten() {
        let mut health = LoopHealth::default();
        health.advance(400e-3, 1e-3, 0.1, 0.05);
        assert!(health.missed() > 0.05);
        (0..350).for_each(|_| health.advance(1e-3, 1e-3, 0.1, 0.05));
        assert!(health.missed() < 0.025, "{}", health.missed());
    }

    #[test]
    fn jitter_and_a_rare_miss_are_borne() {
        let mut rare = [1.0; 20];
        rare[0] = 2.0;
        for pattern in [&[0.6, 1.4][..], &rare, &[1.4, 1.4, 0.6, 0.6]] {
            assert_eq!(found(pattern), None, "{pattern:?}");
        }
    }
}
