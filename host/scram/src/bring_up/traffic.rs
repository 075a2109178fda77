//! A long time of traffic, measured once for all the steps that look at it.

use std::time::Duration;

use control::Command;
use control::protocol::radio::{Request, Reset, Status};

use super::operator::number;
use super::rig::{GENTLE, Halt, Rig};
use link::{Event, Outcome};

/// The robot drives for one of these periods and rests for the next.
const PERIOD: Duration = Duration::from_secs(2);
/// The first of these periods is what the rest is compared with.
const REFERENCE: Duration = Duration::from_secs(60);

/// What was seen.
#[derive(Clone, Debug, Default)]
pub struct Traffic {
    /// How long it took, s.
    pub seconds: f64,
    first: Option<Status>,
    last: Option<Status>,
    /// Largest difference between the periods of one status, µs.
    pub spread_us: u32,
    /// Longest tick, µs.
    pub longest_tick_us: u32,
    /// Longest time in which neither `sent` nor `send_failed` rose, s.
    pub still_s: f64,
    codes: Codes,
    /// Signal strengths of the reference time, and those after it, dBm.
    rssi: [Mean; 2],
    /// Sessions that were lost.
    pub lost_sessions: u32,
    /// Statuses after a boot.
    pub boots: Vec<Reset>,
    /// Commands that were not done.
    pub undone: u32,
    /// Faults that ended a drive.
    pub faults: Vec<String>,
    /// The heap's least free bytes at the first status after the reference time.
    early_heap: Option<u32>,
    /// Ticks that telemetry told about.
    pub telemetry_rows: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    sum: f64,
    squares: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.squares += value * value;
        self.count += 1.0;
    }

    fn mean(&self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }

    fn deviation(&self) -> Option<f64> {
        self.mean().map(|mean| (self.squares / self.count - mean * mean).max(0.0).sqrt())
    }
}

/// Codes of a constant voltage.
#[derive(Clone, Copy, Debug, Default)]
struct Codes {
    all: Mean,
    low: u16,
    high: u16,
}

impl Codes {
    fn add(&mut self, code: u16) {
        if self.all.count == 0.0 {
            (self.low, self.high) = (code, code);
        }
        (self.low, self.high) = (self.low.min(code), self.high.max(code));
        self.all.add(code.into());
    }
}

impl Traffic {
    /// Lets the robot drive gently and rest in turn, and asks it for parameters, for so long.
    fn measure(rig: &mut Rig) -> Result<Self, Halt> {
        let mut traffic = Self::default();
        let start = rig.session.now();
        let (length, mut drives, mut sent_at) = (rig.options.length, false, start);
        while rig.session.now().saturating_sub(start) < length {
            drives = !drives;
            if drives {
                rig.drive(Command::Duty { duty: GENTLE })?;
            }
            traffic.order(rig)?;
            let (now, period) = (rig.session.now(), PERIOD.min(length));
            let mut heard = Vec::new();
            rig.listen(period, |event| {
                heard.push(event.clone());
                true
            })?;
            let rssi = rig.session.robot(rig.robot).quality(rig.session.now()).rssi_dbm;
            let early = now.saturating_sub(start) < REFERENCE.min(length / 2);
            rssi.into_iter().for_each(|dbm| traffic.rssi[usize::from(!early)].add(dbm.into()));
            heard.iter().for_each(|event| traffic.take(event, rig.session.now(), &mut sent_at));
            if !early && traffic.early_heap.is_none() {
                traffic.early_heap = traffic.last.as_ref().map(|status| status.counters.heap_least_free);
            }
            if !drives {
                rig.stop()?;
            }
        }
        traffic.seconds = rig.session.now().saturating_sub(start).as_secs_f64();
        Ok(traffic)
    }

    fn order(&mut self, rig: &mut Rig) -> Result<(), Halt> {
        let value = match rig.ask(Request::Get(0))? {
            Outcome::Done(Some(value)) => value,
            _ => {
                self.undone += 1;
                return Ok(());
            }
        };
        let set = rig.ask(Request::Set { index: 0, value: value.now })?;
        self.undone += u32::from(!matches!(set, Outcome::Done(_)));
        Ok(())
    }

    fn take(&mut self, event: &Event, now: Duration, sent_at: &mut Duration) {
        match event {
            Event::Lost => self.lost_sessions += 1,
            Event::Telemetry(batch) => {
                batch.rows.iter().for_each(|row| self.codes.add(row.code));
                self.telemetry_rows += batch.rows.len() as u64;
                if let Some(fault) = batch.fault.map(|fault| format!("{fault:?}"))
                    && self.faults.last() != Some(&fault)
                {
                    self.faults.push(fault);
                }
            }
            Event::Status(status) => self.take_status(status, now, sent_at),
            _ => {}
        }
    }

    fn take_status(&mut self, status: &Status, now: Duration, sent_at: &mut Duration) {
        let counters = &status.counters;
        if counters.longest_period_us > 0 {
            self.spread_us = self.spread_us.max(counters.longest_period_us - counters.shortest_period_us);
        }
        self.longest_tick_us = self.longest_tick_us.max(counters.longest_tick_us);
        if let Some(last) = &self.last {
            if counters.ticks < last.counters.ticks {
                self.boots.push(status.reset);
            }
            let ended = |status: &Status| status.counters.sent.wrapping_add(status.counters.send_failed);
            if ended(status) != ended(last) {
                *sent_at = now;
            }
            self.still_s = self.still_s.max(now.saturating_sub(*sent_at).as_secs_f64());
        }
        self.first.get_or_insert_with(|| status.clone());
        self.last = Some(status.clone());
    }

    /// What was counted in the meantime; nothing where the robot was not heard, or booted.
    pub fn counted(&self, counter: impl Fn(&Status) -> u32) -> Option<u32> {
        let (first, last) = (self.first.as_ref()?, self.last.as_ref()?);
        self.boots.is_empty().then(|| counter(last).wrapping_sub(counter(first)))
    }

    /// The heap's least free bytes after the reference time and at the end.
    pub fn heap(&self) -> Option<[u32; 2]> {
        let last = self.last.as_ref()?.counters.heap_least_free;
        Some([self.early_heap.unwrap_or(last), last])
    }

    /// Standard deviation of the codes, LSB.
    pub fn deviation(&self) -> Option<f64> {
        self.codes.all.deviation()
    }

    /// Farthest code from the mean, LSB.
    pub fn farthest(&self) -> Option<f64> {
        let mean = self.codes.all.mean()?;
        Some((f64::from(self.codes.high) - mean).max(mean - f64::from(self.codes.low)))
    }

    /// How much weaker the signal was after the reference time, dB.
    pub fn weaker(&self) -> Option<f64> {
        let [reference, after] = &self.rssi;
        Some(reference.mean()? - after.mean()?)
    }
}

impl Rig<'_> {
    /// Traffic as long as the options say, and whether that is as long as a step wants. Measured once.
    pub fn traffic(&mut self, wanted: Duration) -> Result<Traffic, Halt> {
        let traffic = match self.traffic.take() {
            Some(traffic) => traffic,
            None => Traffic::measure(self)?,
        };
        self.traffic = Some(traffic.clone());
        let heard = traffic.telemetry_rows as f64 / (1000.0 * traffic.seconds);
        let expected = "above 0.9 of the ticks";
        self.check("telemetry heard", number(heard, "of the ticks"), expected, heard > 0.9);
        self.shortened_to(self.options.length, wanted);
        Ok(traffic)
    }
}
