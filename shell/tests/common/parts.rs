//! The control loop's parts of the board: a simulated robot behind converter and bridge, a watchdog, an LED.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use control::{Actuation, AdcCode, Sample};
use hal_sim::SimulatedRobot;
use shell::board::{Bridge, Converter, Led, Watchdog};

use super::journal::{Event, Journal};
use super::time::{now_us, pass};

/// Something keeps the processor busy in the control loop's first conversion from a time on, µs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// From when.
    pub at_us: u64,
    /// How long.
    pub for_us: u64,
}

/// Longer than any test.
pub const FOR_EVER: u64 = u64::MAX / 4;

/// The motor with bridge and sensor, in step with the clock.
pub struct Plant {
    robot: SimulatedRobot,
    actuation: Actuation,
    ticks: u64,
    sample: Sample,
    /// How long each of the tick's conversions still to come takes, µs.
    durations: VecDeque<u64>,
    conversions: u8,
    conversion_us: u64,
    holds: Vec<Hold>,
}

impl Plant {
    /// Brings the motor to the tick at the present time and converts there. The simulated converter makes all the
    /// conversions of a tick at once, about an instant that has a jitter: they take so long here that the control loop,
    /// which knows the instants before and after them, finds their middle there.
    fn sample(&mut self) {
        let due = (now_us() as f64 * 1e-6 / self.robot.tick_s()).round() as u64;
        while self.ticks < due {
            self.robot.advance(self.actuation);
            self.ticks += 1;
        }
        self.sample = self.robot.sample();
        let tick_us = (self.ticks as f64 * self.robot.tick_s() * 1e6).round() as u64;
        let count = u64::from(self.conversions);
        let total = (count * self.conversion_us + 2 * self.sample.time_us)
            .checked_sub(2 * tick_us)
            .expect("the jitter is less than the conversions");
        self.durations = (0..count).map(|index| total * (index + 1) / count - total * index / count).collect();
    }
}

/// The simulated robot's converter and bridge.
#[derive(Clone)]
pub struct HostParts(pub Rc<RefCell<Plant>>, pub Journal);

impl HostParts {
    /// So many conversions a tick, of `conversion_us` each.
    pub fn new(robot: SimulatedRobot, conversions: u8, conversion_us: u64, holds: &[Hold], journal: &Journal) -> Self {
        let (holds, durations) = (holds.to_vec(), VecDeque::new());
        let (actuation, sample) = (Actuation::OFF, Sample::default());
        let plant = Plant { robot, actuation, ticks: 0, sample, durations, conversions, conversion_us, holds };
        Self(Rc::new(RefCell::new(plant)), journal.clone())
    }
}

impl Converter for HostParts {
    fn angle(&mut self) -> AdcCode {
        let mut plant = self.0.borrow_mut();
        if let Some(index) = plant.holds.iter().position(|hold| hold.at_us <= now_us()) {
            let hold = plant.holds.remove(index);
            pass(hold.for_us);
        }
        if now_us() >= FOR_EVER {
            // The bench forgets what comes after the end of its time.
            return AdcCode::default();
        }
        if plant.durations.is_empty() {
            plant.sample();
        }
        pass(plant.durations.pop_front().unwrap_or_default());
        self.1.note(Event::Converted(plant.sample.angle));
        plant.sample.angle
    }

    fn battery(&mut self) -> AdcCode {
        let plant = self.0.borrow();
        pass(plant.conversion_us);
        plant.sample.battery
    }
}

impl Bridge for HostParts {
    fn apply(&mut self, actuation: Actuation) {
        self.0.borrow_mut().actuation = actuation;
        self.1.note(Event::Applied(actuation));
    }
}

/// A converter with codes that a test wrote down; the last one from then on.
pub struct Written {
    /// The codes to come.
    pub codes: VecDeque<u16>,
    /// What comes after.
    pub last: u16,
}

impl Converter for Written {
    fn angle(&mut self) -> AdcCode {
        AdcCode(self.codes.pop_front().unwrap_or(self.last))
    }

    fn battery(&mut self) -> AdcCode {
        AdcCode(2048)
    }
}

/// Journals its feeds.
#[derive(Clone)]
pub struct HostWatchdog(pub Journal);

impl Watchdog for HostWatchdog {
    fn feed(&mut self) {
        self.0.note(Event::Fed);
    }
}

/// Journals its changes.
pub struct HostLed(pub Journal, pub Option<bool>);

impl Led for HostLed {
    fn set(&mut self, on: bool) {
        if self.1.replace(on) != Some(on) {
            self.0.note(Event::Lit(on));
        }
    }
}
