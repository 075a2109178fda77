//! Telemetry becomes a recording.

use std::time::Duration;

use control::protocol::radio::{Batch, PackedTick};

use super::LinkError;
use recording::{AngleReading, Drive, Recording};

/// The computer's clock against tick numbers: beyond this the robot's tick is another. A busy computer may read a
/// message a few tenths of a second late.
const TICK_TOLERANCE: f64 = 0.25;
/// Least time in which ticks can be compared with a clock, s.
const CLOCK_SPAN_S: f64 = 1.0;

/// Collects batches.
#[derive(Clone, Debug, Default)]
pub struct Recorder {
    /// Ticks since the first one received, and what they hold.
    rows: Vec<(u64, PackedTick)>,
    /// Number of the tick that comes next, as the robot counts.
    expected: Option<u32>,
    /// Control periods since the first batch.
    passed: u64,
    lost: u64,
    gaps: u64,
    /// First and latest tick with the bridge on.
    driven: Option<[u64; 2]>,
    /// Arrival of the first and the latest batch, each with the ticks passed at its end.
    arrived: Option<[(Duration, u64); 2]>,
}

impl Recorder {
    /// Takes a batch that arrived at a time of the line's clock.
    ///
    /// # Errors
    /// [`LinkError::RobotRestarted`]: its numbers went back.
    pub fn take(&mut self, batch: &Batch, at: Duration) -> Result<(), LinkError> {
        if let Some(expected) = self.expected {
            // The robot's counter wraps after seven weeks: a step is what is left modulo 2³².
            let skipped = batch.first_tick.wrapping_sub(expected);
            if skipped.cast_signed() < 0 {
                return Err(LinkError::RobotRestarted { why: None });
            }
            self.passed += u64::from(skipped);
            self.lost += u64::from(skipped);
            self.gaps += u64::from(skipped > 0);
        }
        for row in &batch.rows {
            if row.duty.is_some() {
                self.driven = Some([self.driven.map_or(self.passed, |[first, _]| first), self.passed]);
            }
            self.rows.push((self.passed, *row));
            self.passed += 1;
        }
        let count = u32::try_from(batch.rows.len()).unwrap_or(u32::MAX);
        self.expected = Some(batch.first_tick.wrapping_add(count));
        let here = (at, self.passed);
        self.arrived = Some(self.arrived.map_or([here, here], |[first, _]| [first, here]));
        Ok(())
    }

    /// Number of ticks received.
    #[must_use]
    pub fn received(&self) -> u64 {
        self.rows.len() as u64
    }

    /// Ticks missing between the first and the last, and in how many gaps.
    #[must_use]
    pub fn lost(&self) -> (u64, u64) {
        (self.lost, self.gaps)
    }

    /// Share that is missing between the first and the last.
    #[must_use]
    pub fn lost_share(&self) -> f64 {
        self.lost as f64 / (self.passed.max(1)) as f64
    }

    /// Ticks from the first with the bridge on to the latest with it on, both counted.
    #[must_use]
    pub fn driven(&self) -> u64 {
        self.driven.map_or(0, |[first, last]| last - first + 1)
    }

    /// Compares the ticks with the computer's clock, once there is enough to compare.
    ///
    /// # Errors
    /// [`LinkError::OtherTick`].
    pub fn check_tick(&self, tick_s: f64) -> Result<(), LinkError> {
        let Some([(from, first), (to, last)]) = self.arrived else { return Ok(()) };
        let seconds = to.saturating_sub(from).as_secs_f64();
        if seconds < CLOCK_SPAN_S || last == first {
            return Ok(());
        }
        let measured = seconds / (last - first) as f64;
        if (measured / tick_s - 1.0).abs() > TICK_TOLERANCE {
            return Err(LinkError::OtherTick { measured_ms: 1e3 * measured, expected_ms: 1e3 * tick_s });
        }
        Ok(())
    }

    /// What was received; a lost tick is a gap in the times.
    #[must_use]
    pub fn recording(&self, tick_s: f64) -> Recording {
        let duty = |row: &PackedTick| f64::from(row.duty().unwrap_or(0.0));
        let has_second = !self.rows.is_empty() && self.rows.iter().all(|(_, row)| row.second.is_some());
        let seconds = self.rows.iter().filter(|_| has_second).map(|(_, row)| row.second);
        Recording {
            adc_second: seconds.collect(),
            t_s: self.rows.iter().map(|(tick, _)| time_s(*tick, tick_s)).collect(),
            enable: self.rows.iter().map(|(_, row)| row.duty.is_some()).collect(),
            drive: Drive::Duty(self.rows.iter().map(|(_, row)| duty(row)).collect()),
            angle: AngleReading::Adc(self.rows.iter().map(|(_, row)| Some(row.code)).collect()),
            ..Recording::default()
        }
    }
}

/// Time of a tick, s. Rounded to whole µs, as the robot's own clock counts: 0.003 and not 0.0030000000000000005.
fn time_s(tick: u64, tick_s: f64) -> f64 {
    (tick as f64 * tick_s * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use control::State;
    use control::protocol::radio::BATCH;

    use super::*;

    fn batch(first_tick: u32, duty: Option<i16>) -> Batch {
        let rows = (0..BATCH).map(|i| PackedTick { code: i as u16, duty, ..PackedTick::default() }).collect();
        Batch {
            first_tick,
            time_us: 1000 * u64::from(first_tick),
            state: State::Idle,
            fault: None,
            tracking: false,
            failed_sensor: None,
            battery_mv: 3900,
            rows,
        }
    }

    #[test]
    fn lost_ticks_are_gaps_and_are_counted_across_the_wrap_of_the_counter() {
        let mut recorder = Recorder::default();
        let start = u32::MAX - 14;
        for first in [start, start.wrapping_add(10), start.wrapping_add(40)] {
            recorder.take(&batch(first, Some(32_767)), Duration::ZERO).expect("goes on");
        }
        assert_eq!((recorder.received(), recorder.lost(), recorder.driven()), (30, (20, 1), 50));
        let recording = recorder.recording(1e-3);
        assert_eq!((recording.t_s[19], recording.t_s[20], recording.len()), (0.019, 0.04, 30));
        assert_eq!(recording.drive, Drive::Duty(vec![1.0; 30]));
    }

    #[test]
    fn numbers_that_go_back_are_a_restart() {
        let mut recorder = Recorder::default();
        recorder.take(&batch(5000, None), Duration::ZERO).expect("starts");
        assert!(matches!(recorder.take(&batch(0, None), Duration::ZERO), Err(LinkError::RobotRestarted { .. })));
        assert_eq!(recorder.recording(1e-3).len(), BATCH);
    }

    #[test]
    fn the_bridge_off_is_no_duty() {
        let mut recorder = Recorder::default();
        recorder.take(&batch(0, None), Duration::ZERO).expect("starts");
        recorder.take(&batch(10, Some(-16_384)), Duration::ZERO).expect("goes on");
        let recording = recorder.recording(2e-3);
        assert_eq!((recording.enable[9], recording.enable[10], recorder.driven()), (false, true, 10));
        let Drive::Duty(duty) = recording.drive else { unreachable!("telemetry has duties") };
        assert!(duty[9] == 0.0 && (duty[10] + 0.5).abs() < 1e-4);
        assert_eq!(recording.t_s[19], 0.038);
    }

    #[test]
    fn another_tick_than_the_files_is_seen_against_the_clock() {
        let mut recorder = Recorder::default();
        for n in 0..200u32 {
            recorder.take(&batch(10 * n, None), Duration::from_millis(u64::from(n) * 20)).expect("goes on");
        }
        assert!(recorder.check_tick(2e-3).is_ok());
        assert!(matches!(recorder.check_tick(1e-3), Err(LinkError::OtherTick { .. })));
    }
}
