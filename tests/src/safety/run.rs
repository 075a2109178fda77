//! One run: a robot that follows changing commands, something that breaks, and what the bridge did from then on.

use std::collections::VecDeque;

use control::parameters::{Parameters, table};
use control::{Actuation, AdcCode, Controller, Fault as Cause, State};
use hal_sim::{Fault, Settings, SimulatedRobot};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::broken::{Broken, Converter, Kind, Starved};
use super::commands::{Orders, Sequence};
use crate::figures::run::DesignedRobot;

/// The run's length, ticks.
const TICKS: u64 = 6000;
/// Something breaks before this tick, or from the start on.
const BREAKS_BEFORE: u64 = 1500;
/// Ticks between two heartbeats of the console.
const HEARTBEAT: u64 = 50;

/// What a run is about.
#[derive(Clone, Debug)]
pub struct Conditions {
    /// Of everything that is drawn.
    pub seed: u64,
    /// What the controller runs on.
    pub parameters: Parameters,
    /// The commands.
    pub sequence: Sequence,
    /// What must come of it.
    pub broken: Broken,
    /// The faults of the robot.
    pub faults: Vec<Fault>,
    /// What the converter does.
    pub converter: Converter,
    /// How the loop is starved.
    pub starved: Option<Starved>,
    /// When it breaks, ticks.
    pub at: u64,
}

impl Conditions {
    /// Draws them. Every other seed has the weakest failsafes that are ever taken.
    #[must_use]
    pub fn drawn(bench: &DesignedRobot, kind: &Kind, seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let parameters = if seed.is_multiple_of(2) { bench.parameters } else { weakest(&bench.parameters) };
        Self {
            seed,
            parameters,
            sequence: Sequence::drawn(&mut random, kind.shortest),
            broken: kind.broken,
            faults: (kind.faults)(&mut random),
            converter: (kind.converter)(&mut random),
            starved: (kind.starved)(&mut random),
            at: if random.random_range(0..4) == 0 { 0 } else { random.random_range(0..BREAKS_BEFORE) },
        }
    }
}

impl Conditions {
    /// What a person needs to see it again.
    #[must_use]
    pub fn said(&self) -> String {
        let Self { sequence, faults, converter, starved, at, .. } = self;
        format!("{sequence:?}, {faults:?} at {at} ms, converter {converter:?}, starved {starved:?}")
    }
}

/// Every failsafe at the weak end of its range. The bounds go first, for they hold the others.
#[must_use]
pub fn weakest(factory: &Parameters) -> Parameters {
    let mut set = *factory;
    for wants_bound in [true, false] {
        for (index, entry) in (0..).zip(table::TABLE) {
            let end = match entry.weaker {
                table::Weaker::Never => continue,
                table::Weaker::Above => entry.high,
                table::Weaker::Below => entry.low,
            };
            // Without an end of their own: what follows from the fastest command, from the cell and from the bridge.
            let has_end =
                !["runaway_rad_per_s", "supply_high_v", "rest_least_lsb", "blind_reading_deg", "drop_v", "width_duty"]
                    .iter()
                    .any(|key| entry.name.ends_with(key));
            if has_end && entry.name.ends_with("bound_s") == wants_bound {
                set = set.with(index, end).unwrap_or_else(|error| panic!("{}: {error}", entry.name));
            }
        }
    }
    set
}

/// What happened.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// From the trouble's beginning on, the time for which the bridge drove a current, ticks.
    pub driven: u64,
    /// The fault that the robot first named, and how long the bridge had driven a current by then.
    pub fault: Option<Cause>,
    /// It named it before anything was broken.
    pub fault_before: bool,
    /// Ticks with the bridge on in `Fault`.
    pub on_in_fault: u64,
    /// Largest heat in the winding, from the simulated current, as a multiple of what the continuous current keeps there.
    pub heat: f64,
}

/// Runs it.
#[must_use]
pub fn run(bench: &DesignedRobot, conditions: &Conditions) -> Outcome {
    let mut robot = SimulatedRobot::with(&bench.robot, conditions.seed, &Settings::default());
    for fault in &conditions.faults {
        robot.schedule(*fault, conditions.at as f64 * 1e-3);
    }
    let controller = Controller::new(&conditions.parameters).expect("sound parameters");
    let random = Pcg64::seed_from_u64(conditions.seed ^ 0x5eed);
    let mut run = Run {
        conditions,
        robot,
        controller,
        commands: Orders::new(conditions.sequence.clone(), random.clone()),
        random,
        codes: VecDeque::new(),
        actuation: Actuation::OFF,
        tick: 0,
        heat: 0.0,
        outcome: Outcome::default(),
    };
    while run.tick < TICKS {
        run.step();
    }
    run.outcome
}

struct Run<'c> {
    conditions: &'c Conditions,
    robot: SimulatedRobot,
    controller: Controller,
    commands: Orders,
    random: Pcg64,
    codes: VecDeque<AdcCode>,
    actuation: Actuation,
    tick: u64,
    heat: f64,
    outcome: Outcome,
}

impl Run<'_> {
    fn step(&mut self) {
        let mut sample = self.robot.sample();
        sample.angle = self.convert(sample.angle);
        if let Some(order) = self.commands.due() {
            let _ = self.controller.command(order, sample.time_us);
        }
        if self.tick.is_multiple_of(HEARTBEAT) {
            self.controller.heartbeat(sample.time_us);
        }
        self.actuation = self.controller.tick(&sample);
        self.note();
        self.pass();
        if let Some((hung, good)) = self.conditions.starved
            && self.tick >= self.conditions.at
            && (self.tick - self.conditions.at) % (hung + good) < hung
        {
            for _ in 1..hung {
                // What the fault's sensor is asked now nobody hears; the bridge goes on.
                let _ = self.robot.sample();
                self.pass();
            }
        }
    }

    /// A control period with the bridge as it was told.
    fn pass(&mut self) {
        self.robot.advance(self.actuation);
        self.tick += 1;
        let p = &self.conditions.parameters.motor;
        let share = 1e-3 / f64::from(p.thermal_time_constant);
        let ratio = self.robot.truth().current / f64::from(p.continuous_current);
        self.heat += share * (ratio * ratio - self.heat);
        self.outcome.heat = self.outcome.heat.max(self.heat);
        let drives = self.actuation.enable && self.drives_current();
        if self.tick > self.conditions.at && drives && self.outcome.fault.is_none() {
            self.outcome.driven += 1;
        }
    }

    /// Whether the bridge would drive a significant current through a motor at rest: from the robot's own numbers.
    fn drives_current(&self) -> bool {
        let p = &self.conditions.parameters;
        let left_v = f64::from(p.bridge.rail) * f64::from(self.actuation.duty.abs()) - f64::from(p.bridge.drop);
        left_v > 1.5 * f64::from(p.supervisor.driven_current * p.motor.resistance)
    }

    fn note(&mut self) {
        let telemetry = self.controller.telemetry();
        let faulted = telemetry.state == State::Fault;
        self.outcome.on_in_fault += u64::from(faulted && self.actuation.enable);
        if faulted && self.outcome.fault.is_none() {
            self.outcome.fault = telemetry.fault;
            self.outcome.fault_before = self.tick < self.conditions.at;
        }
    }

    /// The code as the converter gives it.
    fn convert(&mut self, code: AdcCode) -> AdcCode {
        self.codes.push_front(code);
        self.codes.truncate(64);
        if self.tick < self.conditions.at {
            return code;
        }
        let phase = |whole: u64| (self.tick - self.conditions.at) % whole;
        match self.conditions.converter {
            Converter::Works => code,
            Converter::Late(ticks) => self.codes.get(ticks).copied().unwrap_or(code),
            Converter::Loose(bad, whole) if phase(whole) < bad => AdcCode(self.random.random_range(0..4096)),
            Converter::Sticks(bad, whole) if phase(whole) < bad => {
                let last = self.codes.get(1).copied().unwrap_or(code);
                self.codes[0] = last;
                last
            }
            Converter::Loose(..) | Converter::Sticks(..) => code,
        }
    }
}
