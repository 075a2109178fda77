//! The status LED.

use control::supervisor::FAULTS;
use control::{Fault, State};
use embassy_time::{Duration, Ticker};

use super::Shared;
use crate::board::Led;

/// What the LED shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The control loop has not started: a fast blink, 10 Hz.
    NotStarted,
    /// The robot's state: driving is steady on, ready one short flash a second, a fault its number in flashes and a pause.
    State(State, Option<Fault>),
}

/// Half a period of the fastest blink.
const STEP: Duration = Duration::from_millis(50);
/// Steps in a second.
const SECOND: u32 = 20;
/// Steps of a fault's flash with the dark after it, dark before the first, and the pause.
const FLASH: u32 = 8;
const PAUSE: u32 = 24;

/// Shows the robot's state. A new one is shown from its beginning.
pub async fn led(mut led: impl Led, shared: &Shared) -> ! {
    let mut ticker = Ticker::every(STEP);
    let mut shown = shared.shown();
    let mut step = 0;
    loop {
        led.set(shown.is_lit(step));
        ticker.next().await;
        let now = shared.shown();
        step = if now == shown { step.wrapping_add(1) } else { 0 };
        shown = now;
    }
}

impl Shown {
    /// Whether the LED is lit so many steps of 50 ms after the beginning.
    fn is_lit(self, step: u32) -> bool {
        match self {
            Self::NotStarted => step.is_multiple_of(2),
            Self::State(_, Some(fault)) => {
                let flashes = number(fault) * FLASH;
                let phase = step % (flashes + PAUSE);
                phase < flashes && phase % FLASH >= FLASH / 2
            }
            Self::State(state, None) => state.is_driving() || step.is_multiple_of(SECOND),
        }
    }
}

/// Number of a fault, from 1, in the order of [`FAULTS`].
fn number(fault: Fault) -> u32 {
    FAULTS.iter().zip(1..).find_map(|(this, number)| (*this == fault).then_some(number)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::String;

    fn drawn(shown: Shown, steps: u32) -> String {
        (0..steps).map(|step| if shown.is_lit(step) { '#' } else { '.' }).collect()
    }

    #[test]
    fn every_state_has_its_pattern() {
        assert_eq!(drawn(Shown::NotStarted, 8), "#.#.#.#.");
        assert_eq!(drawn(Shown::State(State::Idle, None), 42), "#...................#...................#.");
        assert_eq!(drawn(Shown::State(State::Coast, None), 21), "#...................#");
        for state in [State::Speed, State::Oscillate, State::Position, State::Gait] {
            assert_eq!(drawn(Shown::State(state, None), 8), "########");
        }
    }

    #[test]
    fn a_fault_flashes_its_number_and_pauses() {
        assert_eq!(
            drawn(Shown::State(State::Fault, Some(Fault::Runaway)), 48),
            "....####....####............................####"
        );
        for (fault, number) in FAULTS.into_iter().zip(1..) {
            let period = number * FLASH + PAUSE;
            let drawn = drawn(Shown::State(State::Fault, Some(fault)), 3 * period);
            let flashes = drawn.split('.').filter(|lit| !lit.is_empty()).count();
            assert_eq!(flashes, 3 * number as usize, "{fault:?}");
        }
    }
}
