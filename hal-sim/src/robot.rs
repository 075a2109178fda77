//! The simulated robot: every part of the world around the firmware, one control period at a time.

use std::collections::VecDeque;
use std::f64::consts::PI;

use control::{Actuation, AdcCode, Sample};
use effects::{Laws, SensorNonlinearity};
use robot_file::angle_code::{AdcCurve, Track, angle_scale, battery_curve};
use robot_file::robot::{InGap, Robot, Sensor};

use crate::adc::Adc;
use crate::digital::Digital;
use crate::driver::Driver;
use crate::faults::{Fault, Faults, Line};
use crate::heat::Heat;
use crate::history::History;
use crate::linearity;
use crate::plant::Plant;
use crate::potentiometer::Potentiometer;
use crate::random::{Seeds, Source, Stream};
use crate::second_sensor::{SecondSensor, Timing, voltage};
use crate::shaft::{Shaft, ShaftState, StepMeans, Stepper, Terminals};
use crate::supply::{Cell, Supply};

/// Meaning of `Sample::time_us`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SampleTime {
    /// The middle of the tick's conversions, as the firmware reads its clock around them: the jitter is known.
    #[default]
    Conversions,
    /// The tick: the jitter is not known.
    Tick,
}

/// What a seed draws, taken out of its hands where something is given; and the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Integration steps per control period.
    pub steps_per_tick: usize,
    /// Shaft angle at the start, rad.
    pub start_angle: Option<f64>,
    /// State of charge at the start, 0 … 1.
    pub charge: Option<f64>,
    /// What the wiper shows in its gap.
    pub in_gap: Option<InGap>,
    /// Peak of the linearity error, rad; the shape stays the seed's. Only where the file lists `sensor_nonlinearity`.
    pub linearity_peak: Option<f64>,
    /// What the samples' time is.
    pub sample_time: SampleTime,
    /// A seed of its own for what belongs to the robot and not to a run: the sensors' errors and mounting, what a wiper shows in its gap, the
    /// converters' noise level and nonlinearity. The run's seed draws them where it is not given.
    pub specimen: Option<u64>,
}

impl Default for Settings {
    /// Ten steps of 0.1 ms: after 2 s and 13 hard reversals the default robot is within 1e-3 rad, less than one code of
    /// its converter, of where ten times finer steps lead (hal-sim/tests/suite/convergence.rs prints the figures).
    fn default() -> Self {
        Self {
            steps_per_tick: 10,
            start_angle: None,
            charge: None,
            in_gap: None,
            linearity_peak: None,
            sample_time: SampleTime::default(),
            specimen: None,
        }
    }
}

/// What really is, at the current tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Time since the start, s.
    pub time_s: f64,
    /// Shaft angle, rad, not wrapped.
    pub angle: f64,
    /// Shaft speed, rad/s.
    pub speed: f64,
    /// Winding current, A.
    pub current: f64,
    /// Mean voltage at the motor's terminals behind the bridge's drop, V.
    pub terminal_v: f64,
    /// The bridge's supply, V.
    pub bridge_supply_v: f64,
    /// The cell's voltage, V; the bridge's supply where there is no cell.
    pub battery_v: f64,
    /// The wiper stands on insulation. Never for other sensors.
    pub in_gap: bool,
}

/// The angle sensor with its converter.
#[derive(Clone, Debug)]
enum AngleSensor {
    Digital(Box<Digital>),
    Analogue(Box<(Potentiometer, Adc)>),
}

/// The cell's divider at its converter.
#[derive(Clone, Debug)]
struct BatteryReading {
    curve: AdcCurve,
    divider: f64,
    noise_lsb: f64,
    noise: Stream,
}

/// A robot up to its shaft. A value: deterministic from its seed, cloned and sent to threads freely.
#[derive(Clone, Debug)]
pub struct SimulatedRobot {
    stepper: Stepper,
    steps_per_tick: usize,
    tick_s: f64,
    driver: Driver,
    /// The command on its way to the bridge, where it takes a while.
    late: Option<Late>,
    supply: Supply,
    /// What heat changes, where there is such an effect.
    warmth: Option<Warmth>,
    state: ShaftState,
    sensor: AngleSensor,
    second: Option<Box<SecondSensor>>,
    age: Age,
    holding: Option<Holding>,
    sample_time: SampleTime,
    history: History,
    battery: Option<BatteryReading>,
    faults: Faults,
    bad_contact: Stream,
    last_code: u16,
    energy_j: f64,
    tick: u64,
}

/// How old a reading is.
#[derive(Clone, Copy, Debug)]
struct Age {
    at_start_s: f64,
    /// Seconds a second.
    ageing: f64,
}

/// A reading that ages goes back no farther than this beyond its age at the start, s.
const MOST_AGED_S: f64 = 1.0;

impl Age {
    /// At a time of the run, s. What comes as it is read is never of the future.
    fn at(&self, time_s: f64) -> f64 {
        (self.at_start_s + (self.ageing * time_s).min(MOST_AGED_S)).max(0.0)
    }

    fn most_s(&self) -> f64 {
        self.at_start_s + if self.ageing > 0.0 { MOST_AGED_S } else { 0.0 }
    }
}

/// Which readings repeat the one before.
#[derive(Clone, Debug)]
pub(crate) struct Holding {
    share: f64,
    stream: Stream,
}

impl Holding {
    fn new(share: f64, seed: u64, source: Source) -> Option<Self> {
        (share > 0.0).then(|| Self { share, stream: Stream::new(seed, source) })
    }

    pub(crate) fn holds(&mut self) -> bool {
        self.stream.uniform(0.0, 1.0) < self.share
    }
}

/// The shaft as cold as the file's, and the heat of this control period.
#[derive(Clone, Copy, Debug)]
struct Warmth {
    cold: Shaft,
    heat: Heat,
}

/// The duties of past control periods, for a bridge that follows late.
#[derive(Clone, Debug)]
struct Late {
    /// By this many integration steps.
    steps: f64,
    steps_per_tick: f64,
    /// Newest first; `None`: every switch is off.
    duties: VecDeque<Option<f64>>,
    /// Steps taken in this period.
    taken: f64,
}

impl Late {
    /// A bridge that was open before.
    fn new(latency_s: f64, tick_s: f64, steps_per_tick: usize) -> Option<Self> {
        let ticks = latency_s / tick_s;
        let duties = VecDeque::from(vec![None; ticks.ceil() as usize + 1]);
        let per_tick = steps_per_tick as f64;
        (latency_s > 0.0).then_some(Self { steps: ticks * per_tick, steps_per_tick: per_tick, duties, taken: 0.0 })
    }

    fn push(&mut self, duty: Option<f64>) {
        self.duties.pop_back();
        self.duties.push_front(duty);
        self.taken = 0.0;
    }

    /// The duty that arrives over the next step: where two periods meet in it, their mean; of an open bridge and one that
    /// drives, what holds longer.
    fn next(&mut self) -> Option<f64> {
        let from = self.taken - self.steps;
        self.taken += 1.0;
        let period = |at: f64| self.duties[(-(at / self.steps_per_tick).floor()).max(0.0) as usize];
        // Rounding must not make a sliver of a period of a step that lies on its edge.
        let (first, last) = (period(from + 1e-6), period(from + 1.0 - 1e-6));
        let share = (from + 1.0).rem_euclid(self.steps_per_tick).min(1.0);
        match (first, last) {
            (Some(first), Some(last)) => Some(first + (last - first) * share),
            _ => {
                if share < 0.5 {
                    first
                } else {
                    last
                }
            }
        }
    }
}

/// What holds during a control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Period {
    /// What reaches the bridge, −1 … 1; none: every switch is off.
    duty: Option<f64>,
    /// The sensor's line is open.
    cut: bool,
}

/// How the output shaft turned in a step: angle (rad), speed (rad/s) and acceleration (rad/s²) at its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShaftMotion {
    pub angle: f64,
    pub speed: f64,
    pub acceleration: f64,
}

/// Control period where the file has no controller, s.
const DEFAULT_TICK_S: f64 = 1e-3;

impl SimulatedRobot {
    /// The robot of a file at its nominal parameters. The seed draws the start angle (uniform over the turn), the charge
    /// (50 to 100 %), what the wiper shows in its gap (where the file says `any`), the linearity error
    /// ([`linearity::draw`]), the converter's noise level (from its range) and nonlinearity, noise, spikes and jitter; and
    /// the same for a second sensor, with where it is mounted.
    #[must_use]
    pub fn new(robot: &Robot, seed: u64) -> Self {
        Self::with(robot, seed, &Settings::default())
    }

    /// The same with some of the draws replaced.
    #[must_use]
    pub fn with(robot: &Robot, seed: u64, settings: &Settings) -> Self {
        let tick_s = robot.controller.as_ref().map_or(DEFAULT_TICK_S, |controller| controller.tick_s.value);
        let steps_per_tick = settings.steps_per_tick.max(1);
        let step = tick_s / steps_per_tick as f64;
        let drawn_angle = Stream::new(seed, Source::StartAngle).uniform(-PI, PI);
        let angle = settings.start_angle.unwrap_or(drawn_angle);
        let charge = settings.charge.unwrap_or_else(|| Stream::new(seed, Source::Charge).uniform(0.5, 1.0));
        let Plant { driver, supply, shaft, .. } = Plant::new(robot, charge);
        let seeds = Seeds { specimen: settings.specimen.unwrap_or(seed), run: seed };
        let sensor = AngleSensor::new(robot, specimen_laws(robot, seeds, settings), seeds, settings, angle);
        let age = Age { at_start_s: shaft.laws.reading_age(), ageing: shaft.laws.ageing() };
        let holding = |source| Holding::new(shaft.laws.held(), seed, source);
        let reach = (age.most_s() + sensor.reach_s()) / step;
        let second = match &robot.sensor {
            Sensor::Potentiometer(file) => {
                let timing = Timing { delay_s: age.most_s(), step_s: step };
                SecondSensor::new(file, &robot.effects, seeds, angle, timing, holding(Source::SecondHeldReadings))
            }
            Sensor::Ideal | Sensor::Encoder(_) => None,
        };
        let mut simulated = Self {
            late: Late::new(shaft.laws.command_age(), tick_s, steps_per_tick),
            warmth: shaft.laws.warms().then_some(Warmth { cold: shaft, heat: Heat::default() }),
            stepper: shaft.stepper(step),
            steps_per_tick,
            tick_s,
            driver,
            supply,
            state: ShaftState { angle, ..ShaftState::default() },
            sensor,
            second: second.map(Box::new),
            age,
            holding: holding(Source::HeldReadings),
            sample_time: settings.sample_time,
            history: History::new(angle, reach.ceil() as usize + 1),
            battery: BatteryReading::new(robot, seed),
            faults: Faults::default(),
            bad_contact: Stream::new(seed, Source::BadContact),
            last_code: 0,
            energy_j: 0.0,
            tick: 0,
        };
        simulated.supply.idle(&shaft.laws);
        // What a sensor frozen from the start repeats.
        simulated.last_code = simulated.convert_angle().0;
        simulated
    }

    /// The conversions of the current tick: of the angle around it (each at its own instant, jitter and delay included),
    /// of the battery at it. `time_us` is what [`Settings::sample_time`] says, never before the start. The actuation that
    /// follows counts from the tick on: the microseconds of conversion and computing are not modelled as a latency.
    pub fn sample(&mut self) -> Sample {
        if self.faults.due(self.time_s()) {
            self.apply_supply_faults();
        }
        let (code, middle) = self.convert_angle();
        let [first, other] = self.faults.lines;
        let held = self.holding.as_mut().is_some_and(Holding::holds);
        if first.line != Some(Line::Frozen) && !held {
            self.last_code = code;
        }
        let timing = Timing { delay_s: self.age.at(self.time_s()), step_s: self.stepper.step() };
        let second = self.second.as_mut().map(|second| AdcCode(second.code(&other, middle, timing)));
        let late_s = match self.sample_time {
            SampleTime::Conversions => middle,
            SampleTime::Tick => 0.0,
        };
        Sample {
            time_us: ((self.time_s() + late_s) * 1e6).round() as u64,
            angle: AdcCode(self.last_code),
            second,
            battery: AdcCode(self.battery_code()),
        }
    }

    /// One control period with the bridge as told.
    pub fn advance(&mut self, actuation: Actuation) {
        let period = self.begin_period(actuation);
        for _ in 0..self.steps_per_tick {
            self.step(period, 0.0);
        }
        self.end_period();
    }

    /// Begins a control period: [`Self::steps_per_tick`] calls of [`Self::step`] and one of [`Self::end_period`] belong
    /// to it. For a shaft that something outside pulls at; otherwise [`Self::advance`] does all of it.
    pub(crate) fn begin_period(&mut self, actuation: Actuation) -> Period {
        if self.faults.due(self.time_s()) {
            self.apply_supply_faults();
        }
        let laws = &self.stepper.shaft().laws;
        let duty = self.driver.effective(actuation).map(|duty| laws.duty(duty));
        if let Some(late) = &mut self.late {
            late.push(duty);
        }
        Period { duty: self.at_motor(duty), cut: self.faults.lines[0].is_cut() }
    }

    /// The duty that a motor gets whose leads may be broken or swapped.
    fn at_motor(&self, duty: Option<f64>) -> Option<f64> {
        let duty = duty.map(|duty| if self.faults.reversed { -duty } else { duty });
        if self.faults.motor_open { None } else { duty }
    }

    /// One integration step under a torque (N·m) on the output shaft from outside; how the shaft turned in it.
    pub(crate) fn step(&mut self, period: Period, torque: f64) -> ShaftMotion {
        let step = self.stepper.step();
        let before = self.state;
        let arrived = self.late.as_mut().map(Late::next);
        let duty = arrived.map_or(period.duty, |duty| self.at_motor(duty));
        let terminals = match duty {
            Some(duty) => {
                let speed = self.stepper.motor_speed(&self.state);
                let rail = self.supply.drive(self.stepper.shaft(), duty, speed);
                self.stepper.terminals(duty, rail)
            }
            None => {
                self.supply.idle(&self.stepper.shaft().laws);
                Terminals::Open
            }
        };
        let means = if self.faults.stalled {
            self.blocked(terminals)
        } else {
            self.stepper.advance_under(&mut self.state, terminals, torque)
        };
        if let Some(warmth) = &mut self.warmth {
            warmth.heat.add(self.stepper.shaft(), &means, step);
        }
        if let Some(duty) = duty {
            self.supply.book(duty * means.current, step);
            self.energy_j += duty * means.current * self.supply.bridge_v() * step;
        }
        let seen = match &mut self.sensor {
            AngleSensor::Analogue(parts) => parts.0.step(self.state.angle, step, period.cut),
            AngleSensor::Digital(digital) => digital.step(self.state.angle, step),
        };
        self.history.push(seen);
        if let Some(second) = &mut self.second {
            second.step(self.state.angle, step, &self.faults.lines[1]);
        }
        ShaftMotion {
            angle: 0.5 * (before.angle + self.state.angle),
            speed: means.speed,
            acceleration: (self.state.speed - before.speed) / step,
        }
    }

    /// Ends a control period.
    pub(crate) fn end_period(&mut self) {
        self.supply.end_period(&self.stepper.shaft().laws, self.tick_s);
        if let Some(Warmth { cold, heat }) = &mut self.warmth {
            heat.warm(&cold.laws, &mut self.supply.states, self.tick_s);
            self.stepper.warm(cold, &self.supply.states);
        }
        self.faults.advance(self.tick_s);
        self.tick += 1;
    }

    /// Integration steps per control period.
    pub(crate) fn steps_per_tick(&self) -> usize {
        self.steps_per_tick
    }

    /// Energy that the bridge has taken from its supply since the start, J; what it gave back counts negative.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// What really is, at the current tick.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let shaft = self.stepper.shaft();
        Truth {
            time_s: self.time_s(),
            angle: self.state.angle,
            speed: self.state.speed,
            current: self.state.current,
            terminal_v: shaft.torque_constant * self.stepper.motor_speed(&self.state)
                + shaft.resistance_ohm * self.state.current,
            bridge_supply_v: self.supply.bridge_v(),
            battery_v: self.supply.cell.as_ref().map_or(self.supply.bridge_v(), |cell| cell.voltage()),
            in_gap: match &self.sensor {
                AngleSensor::Analogue(parts) => parts.0.track.in_gap(parts.0.wiper()),
                AngleSensor::Digital(_) => false,
            },
        }
    }

    /// Breaks something from now on. Faults of different parts add up; the sensor's line has its latest one.
    pub fn inject(&mut self, fault: Fault) {
        self.faults.set(fault);
        self.apply_supply_faults();
    }

    /// Mends everything but a collapsed rail.
    pub fn mend(&mut self) {
        self.faults = Faults::default();
        self.apply_supply_faults();
    }

    /// Breaks something from a time (s since the start) on.
    pub fn schedule(&mut self, fault: Fault, at_s: f64) {
        self.faults.schedule(fault, at_s);
    }

    /// Time since the start, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.tick as f64 * self.tick_s
    }

    /// Control period, s.
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// State of charge of the cell, 0 … 1.
    #[must_use]
    pub fn charge(&self) -> Option<f64> {
        self.supply.cell.as_ref().map(Cell::charge)
    }

    /// What the wiper shows in its gap, with a potentiometer.
    #[must_use]
    pub fn in_gap(&self) -> Option<InGap> {
        match &self.sensor {
            AngleSensor::Analogue(parts) => Some(parts.0.in_gap),
            AngleSensor::Digital(_) => None,
        }
    }

    /// The sensor's linearity error.
    #[must_use]
    pub fn linearity(&self) -> SensorNonlinearity {
        let laws = match &self.sensor {
            AngleSensor::Analogue(parts) => &parts.0.laws,
            AngleSensor::Digital(digital) => &digital.laws,
        };
        laws.sensor_nonlinearity.unwrap_or_default()
    }

    /// Middle of the second sensor's gap on the shaft, rad.
    #[must_use]
    pub fn second_mounting(&self) -> Option<f64> {
        self.second.as_ref().map(|second| second.mounting())
    }

    fn apply_supply_faults(&mut self) {
        if let Some(rail_v) = self.faults.rail_v {
            self.supply.rail_v = rail_v;
        }
        if let Some(cell) = &mut self.supply.cell {
            cell.force(self.faults.open_circuit_v);
        }
    }

    /// A step of a shaft that cannot move: the winding settles within it.
    fn blocked(&mut self, terminals: Terminals) -> StepMeans {
        let current = match terminals {
            Terminals::Driven { voltage } => self.stepper.shaft().settled_current(voltage, 0.0, 0.0).0,
            Terminals::Switched { voltage, switching_v } => {
                self.stepper.shaft().settled_current(voltage, 0.0, switching_v).0
            }
            Terminals::Open => 0.0,
        };
        (self.state.speed, self.state.twist_rate) = (0.0, 0.0);
        self.state.current = current;
        StepMeans { current, ..StepMeans::default() }
    }

    /// The code, and the middle of its conversions against the tick, s.
    fn convert_angle(&mut self) -> (u16, f64) {
        let fault = self.faults.lines[0];
        let (delay, history, step) = (self.age.at(self.time_s()), &self.history, self.stepper.step());
        let (factor, offset) = fault.disturbance(&mut self.bad_contact);
        match &mut self.sensor {
            AngleSensor::Digital(digital) => {
                let top = f64::from(digital.scale.top_code);
                let code = match fault.line {
                    Some(Line::Low) => 0,
                    Some(Line::High | Line::Open) => digital.scale.top_code,
                    _ => {
                        let code = f64::from(digital.code(history.angle(delay / step)));
                        (factor * code + offset * top).round().clamp(0.0, top) as u16
                    }
                };
                (code, 0.0)
            }
            AngleSensor::Analogue(parts) => {
                let (potentiometer, adc) = parts.as_mut();
                adc.sample(|instant| {
                    let angle = history.angle((delay - instant) / step);
                    voltage(potentiometer, &fault, (factor, offset), angle)
                })
            }
        }
    }

    /// Without a cell: full scale.
    fn battery_code(&mut self) -> u16 {
        let (Some(reading), Some(cell)) = (&mut self.battery, &self.supply.cell) else {
            return battery_curve(&Sensor::Ideal).top_code as u16;
        };
        let noise = reading.noise_lsb * reading.noise.normal() / reading.curve.codes_per_v;
        reading.curve.code(reading.divider * cell.voltage() + noise).round() as u16
    }
}

impl AngleSensor {
    fn new(robot: &Robot, laws: Laws, seeds: Seeds, settings: &Settings, angle: f64) -> Self {
        let scale = angle_scale(&robot.sensor);
        let encoder_noise = Stream::new(seeds.run, Source::Encoder);
        match &robot.sensor {
            Sensor::Ideal => Self::Digital(Box::new(Digital::new(scale, laws, 0.0, angle, encoder_noise))),
            Sensor::Encoder(encoder) => {
                let noise = encoder.noise_deg.value.to_radians();
                Self::Digital(Box::new(Digital::new(scale, laws, noise, angle, encoder_noise)))
            }
            Sensor::Potentiometer(file) => {
                let behaviours = [InGap::Hold, InGap::Random, InGap::Zero];
                let drawn = behaviours[Stream::new(seeds.specimen, Source::GapBehaviour).below(3) as usize];
                let in_gap = match settings.in_gap.unwrap_or(file.in_gap) {
                    InGap::Any => drawn,
                    known => known,
                };
                let potentiometer = Potentiometer::new(
                    Track::new(file),
                    laws,
                    file.hysteresis_deg.value.to_radians(),
                    in_gap,
                    angle,
                    Stream::new(seeds.run, Source::Gap),
                );
                Self::Analogue(Box::new((potentiometer, Adc::of(&file.adc, seeds))))
            }
        }
    }

    /// How far before the tick the sensor looks, its delay aside, s.
    fn reach_s(&self) -> f64 {
        match self {
            Self::Digital(_) => 0.0,
            Self::Analogue(parts) => parts.1.reach_s(),
        }
    }
}

/// The file's laws, with the sensor's error drawn where the file knows only its bounds.
fn specimen_laws(robot: &Robot, seeds: Seeds, settings: &Settings) -> Laws {
    let drawn = linearity::draw(&robot.effects, &mut Stream::new(seeds.specimen, Source::Linearity));
    let sensor_nonlinearity = drawn.map(|error| settings.linearity_peak.map_or(error, |peak| error.with_peak(peak)));
    Laws { sensor_nonlinearity, ..robot.effects.laws() }
}

impl BatteryReading {
    fn new(robot: &Robot, seed: u64) -> Option<Self> {
        let battery = robot.supply.battery.as_ref()?;
        let noise_lsb = match &robot.sensor {
            Sensor::Potentiometer(file) => file.adc.noise_lsb.value,
            Sensor::Ideal | Sensor::Encoder(_) => 0.0,
        };
        Some(Self {
            curve: battery_curve(&robot.sensor),
            divider: battery.divider.value,
            noise_lsb,
            noise: Stream::new(seed, Source::BatteryNoise),
        })
    }
}

pub use common::wrap;
