//! The control loop's parts of the board: a simulated robot behind converter and bridge, a watchdog, an LED.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;

use control::protocol::radio::{Crash, Reset};
use control::protocol::secure::Nonce;
use control::{Actuation, AdcCode, Sample};
use hal_sim::adc::Adc;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use shell::board::{Bridge, Converter, Entropy, Led, Watchdog, WatchdogTimeout};
use shell::inject::FaultInjector;

use crate::broken::Broken;
use crate::event_log::{Event, EventLog};
use crate::power::Power;
use crate::simulated::Simulated;
use crate::time::{now_us, pass};

/// Interval in which something keeps the processor busy, from the control loop's first conversion after its begin, µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProcessorHold {
    /// Begin, µs.
    pub at_us: u64,
    /// Length, µs.
    pub for_us: u64,
}

/// The motor with bridge and sensor, and on the ground the body, in step with the clock.
pub struct Plant {
    /// Motor, bridge, sensor; the body.
    pub robot: Simulated,
    /// How long a conversion takes, µs.
    pub conversion_us: u64,
    actuation: Actuation,
    driven: u64,
    ticks: u64,
    sample: Sample,
    /// How long each of the tick's conversions still to come takes, µs.
    durations: VecDeque<u64>,
    conversions: u8,
    holds: Vec<ProcessorHold>,
    /// A voltage in the place of the wiper's, and what converts it.
    supply: Option<(f64, Adc)>,
    broken: Vec<Broken>,
}

impl Plant {
    /// A motor that is not driven, its wiper converted so often in a tick.
    #[must_use]
    pub fn new(robot: impl Into<Simulated>, conversions: u8, conversion_us: u64) -> Self {
        Self {
            robot: robot.into(),
            conversion_us,
            actuation: Actuation::OFF,
            driven: 0,
            ticks: 0,
            sample: Sample::default(),
            durations: VecDeque::new(),
            conversions,
            holds: Vec::new(),
            supply: None,
            broken: Vec::new(),
        }
    }

    /// The same on a board that is broken.
    #[must_use]
    pub fn with(self, broken: Vec<Broken>) -> Self {
        Self { broken, ..self }
    }

    /// Whether the board has this.
    #[must_use]
    pub fn has(&self, broken: Broken) -> bool {
        self.broken.contains(&broken)
    }

    /// From now on a laboratory supply is on the wiper's pin, V, or the wiper again.
    pub fn supply(&mut self, supply: Option<(f64, Adc)>) {
        self.supply = supply;
    }

    /// Brings the motor to the tick at the present time.
    pub fn advance(&mut self) {
        let due = (now_us() as f64 * 1e-6 / self.robot.tick_s()).round() as u64;
        while self.ticks < due {
            self.robot.advance(self.actuation);
            self.ticks += 1;
        }
    }

    /// Converts. The simulated converter makes all the conversions of a tick at once, about an instant that has a jitter:
    /// they take so long here that the control loop, which knows the instants before and after them, finds their middle
    /// there.
    fn sample(&mut self) {
        self.advance();
        self.sample = self.robot.sample();
        if let Some((volt, adc)) = &mut self.supply {
            self.sample.angle = AdcCode(adc.sample(|_| *volt).0);
        }
        if self.has(Broken::Converter) {
            self.sample.angle = AdcCode(Broken::CODE);
        }
        let tick_us = (self.ticks as f64 * self.robot.tick_s() * 1e6).round() as u64;
        let count = u64::from(self.conversions);
        // A jitter before all conversions is cut: they begin now.
        let total = (count * self.conversion_us + 2 * self.sample.time_us).saturating_sub(2 * tick_us);
        self.durations = (0..count).map(|index| total * (index + 1) / count - total * index / count).collect();
    }

    /// How long it is busy with something else now, µs.
    fn held_us(&mut self) -> u64 {
        match self.holds.iter().position(|hold| hold.at_us <= now_us()) {
            Some(index) => self.holds.remove(index).for_us,
            None => 0,
        }
    }

    /// Opens the bridge.
    pub fn cut(&mut self) {
        self.advance();
        self.actuation = Actuation { duty: 0.0, enable: self.has(Broken::PullDown) };
        self.durations.clear();
    }

    /// What the bridge is told at present.
    #[must_use]
    pub fn actuation(&self) -> Actuation {
        self.actuation
    }

    /// Ticks so far that drove.
    #[must_use]
    pub fn driven(&self) -> u64 {
        self.driven
    }

    /// Keeps the converter busy.
    pub fn hold(&mut self, hold: ProcessorHold) {
        self.holds.push(hold);
    }
}

/// The hardware watchdog's patience while the motor is driven, µs: from the last tick that ended to the reset.
pub const WATCHDOG_US: u64 = WatchdogTimeout::Driving.us();

/// A hardware watchdog. Clones are the same one.
#[derive(Clone)]
pub struct SimulatedWatchdog(Rc<Cell<(u64, WatchdogTimeout)>>);

impl Default for SimulatedWatchdog {
    /// Armed now.
    fn default() -> Self {
        Self(Rc::new(Cell::new((now_us(), WatchdogTimeout::Starting))))
    }
}

impl SimulatedWatchdog {
    /// When it bites, µs.
    #[must_use]
    pub fn bites_us(&self) -> u64 {
        let (fed_us, patience) = self.0.get();
        fed_us + patience.us()
    }
}

impl Watchdog for SimulatedWatchdog {
    fn expect(&mut self, patience: WatchdogTimeout) {
        if self.0.get().1 != patience {
            self.0.set((now_us(), patience));
        }
    }

    fn feed(&mut self) {
        self.0.set((now_us(), self.0.get().1));
    }
}

/// The simulated robot's converter, bridge and watchdog.
#[derive(Clone)]
pub struct Board {
    plant: Rc<RefCell<Plant>>,
    power: Power,
    dog: SimulatedWatchdog,
    event_log: EventLog,
}

impl Board {
    /// The parts of one processor. The watchdog is armed.
    #[must_use]
    pub fn new(plant: &Rc<RefCell<Plant>>, power: &Power, event_log: &EventLog) -> Self {
        Self {
            plant: Rc::clone(plant),
            power: power.clone(),
            dog: SimulatedWatchdog::default(),
            event_log: event_log.clone(),
        }
    }

    /// Keeps the processor busy for `for_us`, µs, unless the watchdog ends it.
    pub fn block(&self, for_us: u64) {
        if self.plant.borrow().has(Broken::Watchdog) {
            return pass(for_us);
        }
        let left_us = self.dog.bites_us().saturating_sub(now_us());
        pass(for_us.min(left_us));
        if for_us > left_us {
            self.power.reset(Reset::Watchdog);
        }
    }
}

impl Converter for Board {
    fn angle(&mut self) -> AdcCode {
        let held_us = self.plant.borrow_mut().held_us();
        self.block(held_us);
        let (code, duration_us) = {
            let mut plant = self.plant.borrow_mut();
            if plant.durations.is_empty() {
                plant.sample();
            }
            (plant.sample.angle, plant.durations.pop_front().unwrap_or_default())
        };
        pass(duration_us);
        self.event_log.note(Event::Converted(code));
        code
    }

    fn second(&mut self) -> Option<AdcCode> {
        let plant = self.plant.borrow();
        plant.sample.second.inspect(|_| pass(plant.conversion_us))
    }

    fn battery(&mut self) -> AdcCode {
        let plant = self.plant.borrow();
        pass(plant.conversion_us);
        plant.sample.battery
    }
}

impl Bridge for Board {
    fn apply(&mut self, actuation: Actuation) {
        let mut plant = self.plant.borrow_mut();
        plant.advance();
        plant.actuation = actuation;
        plant.driven += u64::from(actuation.enable);
        self.event_log.note(Event::Applied(actuation));
    }
}

impl Board {
    /// The watchdog was not fed for so long that it bites.
    pub(crate) fn is_hungry(&self) -> bool {
        !self.plant.borrow().has(Broken::Watchdog) && now_us() >= self.dog.bites_us()
    }
}

/// How long the firmware takes to print the cause of a panic before it resets, µs.
const PRINTING_US: u64 = 50_000;

impl FaultInjector for Board {
    fn mark(&mut self) {
        self.event_log.note(Event::Injected);
    }

    fn block(&mut self, for_us: u64) {
        Board::block(self, for_us);
    }

    /// As `firmware/src/panic.rs` does: exceptions and overflows of a stack end there, too.
    fn crash(&mut self, _how: Crash) -> ! {
        if !self.plant.borrow().has(Broken::PanicCut) {
            self.apply(Actuation::OFF);
        }
        pass(PRINTING_US);
        self.power.reset(Reset::Panic)
    }
}

impl Watchdog for Board {
    fn expect(&mut self, patience: WatchdogTimeout) {
        self.dog.expect(patience);
        self.event_log.note(Event::Expected(patience));
    }

    fn feed(&mut self) {
        self.dog.feed();
        self.event_log.note(Event::Fed);
    }
}

/// Journals its changes.
pub struct StatusLed {
    event_log: EventLog,
    lit: Option<bool>,
}

impl StatusLed {
    /// Creates the LED, off.
    #[must_use]
    pub fn new(event_log: &EventLog) -> Self {
        Self { event_log: event_log.clone(), lit: None }
    }
}

impl Led for StatusLed {
    fn set(&mut self, on: bool) {
        if self.lit.replace(on) != Some(on) {
            self.event_log.note(Event::Lit(on));
        }
    }
}

/// Randomness from a seed: the same nonces in every run, and never the same one twice in a run.
#[derive(Clone)]
pub struct SeededEntropy(Rc<RefCell<Pcg64Mcg>>);

impl SeededEntropy {
    /// Creates a generator from a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(Rc::new(RefCell::new(Pcg64Mcg::seed_from_u64(seed))))
    }

    /// So many random bytes.
    #[must_use]
    pub fn bytes<const COUNT: usize>(&self) -> [u8; COUNT] {
        let mut bytes = [0; COUNT];
        self.0.borrow_mut().fill_bytes(&mut bytes);
        bytes
    }

    /// Uniform from 0 to `most`.
    #[must_use]
    pub fn up_to(&self, most: u64) -> u64 {
        u64::from_le_bytes(self.bytes()) % most.saturating_add(1)
    }
}

impl Entropy for SeededEntropy {
    fn nonce(&mut self) -> Nonce {
        Nonce(self.bytes())
    }
}
