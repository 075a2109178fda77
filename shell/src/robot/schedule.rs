//! When the control loop ticks: once in every control period, on an even grid, and never in a burst.
//!
//! A tick that comes late or takes too long costs the periods that it covers; they are counted and not made up for. The
//! controller sees from the samples' times how many there were. After a tick that began late the next is on the grid
//! again, half a period later at least; after one that took too long the next waits for the grid, which leaves the
//! other tasks some time even if every tick takes too long.

use control::Parameters;

/// The control period, µs: the nearest whole number.
#[must_use]
pub fn period_us(parameters: &Parameters) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let period_us = (parameters.tick * 1e6 + 0.5) as u32;
    period_us.max(1)
}

/// The grid of a control period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schedule {
    period_us: u32,
    /// The grid point of the present tick, and its time.
    slot: u32,
    due_us: u64,
}

impl Schedule {
    /// The first tick is due now.
    pub fn new(parameters: &Parameters, now_us: u64) -> Self {
        Self { period_us: period_us(parameters), slot: 0, due_us: now_us }
    }

    /// A tick begins: the number of its period.
    pub fn begin(&mut self, now_us: u64) -> u32 {
        self.skip((self.behind(now_us).saturating_add(self.period_us / 2)) / self.period_us);
        self.slot
    }

    /// It has ended: when the next is due.
    pub fn end(&mut self, now_us: u64) -> u64 {
        self.skip(self.behind(now_us).div_ceil(self.period_us).max(1));
        self.due_us
    }

    fn behind(&self, now_us: u64) -> u32 {
        u32::try_from(now_us.saturating_sub(self.due_us)).unwrap_or(u32::MAX)
    }

    fn skip(&mut self, periods: u32) {
        self.slot = self.slot.wrapping_add(periods);
        self.due_us += u64::from(periods) * u64::from(self.period_us);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule() -> Schedule {
        Schedule { period_us: 1000, slot: 0, due_us: 500 }
    }

    #[test]
    fn on_time_it_keeps_to_the_grid() {
        let mut schedule = schedule();
        for slot in 0..5 {
            let due = 500 + 1000 * u64::from(slot);
            assert_eq!(schedule.begin(due + 40), slot);
            assert_eq!(schedule.end(due + 300), due + 1000);
        }
    }

    #[test]
    fn a_late_tick_counts_for_the_nearest_period_and_the_next_is_on_the_grid() {
        for (began, slot) in [(999, 0), (1000, 1), (1450, 1), (4499, 4), (4500, 4)] {
            let mut schedule = schedule();
            assert_eq!(schedule.begin(began), slot, "{began}");
            assert_eq!(schedule.end(began), 500 + 1000 * u64::from(slot + 1), "{began}");
        }
    }

    #[test]
    fn a_long_tick_waits_for_the_grid() {
        let mut schedule = schedule();
        assert_eq!(schedule.begin(500), 0);
        assert_eq!(schedule.end(1500), 1500, "in time, to the microsecond");
        assert_eq!(schedule.begin(1500), 1);
        assert_eq!(schedule.end(2501), 3500);
        assert_eq!(schedule.begin(3500), 3);
    }

    #[test]
    fn hours_of_silence_and_a_clock_that_goes_backwards_are_borne() {
        let mut schedule = schedule();
        schedule.begin(u64::MAX / 2);
        schedule.end(u64::MAX / 2);
        schedule.begin(0);
        schedule.end(0);
    }
}
