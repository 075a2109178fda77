//! How good a link is: what came in the last two seconds, what is missing among it, how long there and back takes.

use std::collections::VecDeque;
use std::time::Duration;

use control::protocol::radio::Echo;

/// What is looked back at.
const WINDOW: Duration = Duration::from_secs(2);
/// Commands whose echo is waited for.
const ORDERS: usize = 64;
/// Round trips whose median counts.
const TRIPS: usize = 15;

/// A link to a robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Frames of the robot a second.
    pub rate_hz: f64,
    /// Share of its frames that is missing, 0 … 1; `None` while nothing comes.
    pub loss: Option<f64>,
    /// Round trip of a command and its echo, median; `None` before the first.
    pub round_trip: Option<Duration>,
    /// Strength of its latest signal, dBm.
    pub rssi_dbm: Option<i8>,
}

/// Measures a link. Its memory is bounded by what a window holds.
#[derive(Clone, Debug, Default)]
pub(super) struct Meter {
    /// Time of each frame in the window, and how many are missing before it.
    frames: VecDeque<(Duration, u32)>,
    orders: VecDeque<(u32, Duration)>,
    trips: VecDeque<Duration>,
    echoed: Option<u32>,
}

impl Meter {
    /// A session begins: counters begin anew.
    pub fn begin(&mut self) {
        self.orders.clear();
        self.echoed = None;
    }

    /// A command was handed to the dongle.
    pub fn sent(&mut self, counter: u32, now: Duration) {
        if self.orders.len() == ORDERS {
            self.orders.pop_front();
        }
        self.orders.push_back((counter, now));
    }

    /// Counts a frame that has arrived.
    pub fn received(&mut self, now: Duration, missing: u32, echo: &Echo) {
        self.frames.push_back((now, missing));
        while self.frames.front().is_some_and(|(at, _)| now.saturating_sub(*at) > WINDOW) {
            self.frames.pop_front();
        }
        // Only the first echo of a command: later ones are as old as the commands are apart.
        if self.echoed == Some(echo.counter) {
            return;
        }
        self.echoed = Some(echo.counter);
        while let Some((counter, sent)) = self.orders.pop_front_if(|(counter, _)| *counter <= echo.counter) {
            if counter == echo.counter {
                if self.trips.len() == TRIPS {
                    self.trips.pop_front();
                }
                let age = Duration::from_millis(echo.age_ms.into());
                self.trips.push_back(now.saturating_sub(sent).saturating_sub(age));
            }
        }
    }

    pub fn quality(&self, now: Duration, rssi_dbm: Option<i8>) -> Quality {
        let window = self.frames.iter().filter(|(at, _)| now.saturating_sub(*at) <= WINDOW);
        let (mut came, mut missing) = (0_u32, 0_u32);
        for (_, before) in window {
            came += 1;
            missing = missing.saturating_add(*before);
        }
        let all = came.saturating_add(missing);
        let mut trips: Vec<Duration> = self.trips.iter().copied().collect();
        trips.sort_unstable();
        Quality {
            rate_hz: f64::from(came) / WINDOW.as_secs_f64(),
            loss: (came > 0).then(|| f64::from(missing) / f64::from(all)),
            round_trip: trips.get(trips.len() / 2).copied(),
            rssi_dbm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn rate_and_loss_are_of_the_last_two_seconds() {
        let mut meter = Meter::default();
        for index in 0..300 {
            let missing = u32::from(index % 4 == 0 && index >= 100);
            meter.received(ms(10 * index), missing, &Echo::default());
        }
        let quality = meter.quality(ms(2990), Some(-50));
        assert!((quality.rate_hz - 100.5).abs() < 1e-9, "{quality:?}");
        assert!((quality.loss.expect("frames came") - 50.0 / 251.0).abs() < 1e-9, "{quality:?}");
        let later = meter.quality(ms(10_000), None);
        assert_eq!((later.rate_hz, later.loss), (0.0, None));
    }

    #[test]
    fn a_round_trip_is_without_the_time_that_the_robot_kept_it() {
        let mut meter = Meter::default();
        for (counter, (sent, heard, age_ms)) in (0..).zip([(0, 20, 10), (50, 58, 0), (100, 140, 33)]) {
            meter.sent(counter, ms(sent));
            meter.received(ms(heard), 0, &Echo { counter, age_ms });
            // Again, later: it says nothing new.
            meter.received(ms(heard + 10), 0, &Echo { counter, age_ms });
        }
        assert_eq!(meter.quality(ms(150), None).round_trip, Some(ms(8)));
    }
}
