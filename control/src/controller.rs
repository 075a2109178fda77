//! The tick: sample in, actuation out.
//!
//! What a tick costs where floating point is software, in instructions on RV32IMC under QEMU with a calibrated sensor
//! (`cargo pil` measures it anew and holds it to its budgets): idle 13 000, speed 25 000, oscillator 26 000, and 31 000
//! at most, when missed ticks are caught up with. That is under a fifth of 1 ms at 160 MHz if an instruction takes a
//! cycle. What holds it there:
//!
//! * An addition or multiplication is some 70 to 100 instructions, a comparison 30, a division 150 (estimated from the
//!   machine code). Most of them are the covariance and mean of the filter, predicted and corrected in every tick: a
//!   steady gain would be cheaper, and the blind arc has none.
//! * The correction of a calibrated sensor is 4400 (measured): sine, cosine and six harmonics.
//! * The line through the last dozen readings, which the supervisor asks for in every tick, is summed in integers
//!   ([`crate::angle::to_binary`]).
//! * Missed ticks are predicted in one step and one more ([`crate::estimator::Estimator::predict`]), however many.

use crate::acquire::{Candidate, Line, Window};
use crate::clock::{Clock, Elapsed};
use crate::command::{Command, Refusal};
use crate::drive::{self, Drive};
use crate::estimator::{Estimate, Estimator, GateOutcome};
use crate::fault_detectors::{FaultDetectors, Inputs};
use crate::gait::{Gait, GaitLabel, Motion, Sequencer};
use crate::loop_health::LoopHealth;
use crate::oscillator::Oscillator;
use crate::parameters::{AngleSource, BlindArcHandling, ParameterError, Parameters, Tuning};
use crate::position::{MovingAverage, PositionControl};
use crate::sample::{Actuation, Sample};
use crate::scalar::{clamp, sign};
use crate::self_check::{SelfCheck, Unready};
use crate::sensor::Reading;
use crate::sensor_pair::{Pair, PairReading};
use crate::speed::SpeedControl;
use crate::supervisor::{Event, Fault, State, Supervisor};
use crate::telemetry::Telemetry;
use crate::winding::{Winding, standstill_current};

/// What the present state works with.
#[derive(Clone, Copy, Debug)]
enum Mode {
    Off,
    Speed(SpeedControl),
    Oscillate(Oscillator),
    Position(PositionControl),
    Duty(f32),
}

/// Every decision of the robot.
#[derive(Clone, Copy, Debug)]
pub struct Controller {
    parameters: Parameters,
    supervisor: Supervisor,
    fault_detectors: FaultDetectors,
    clock: Clock,
    estimator: Estimator,
    pair: Pair,
    window: Window,
    candidate: Candidate,
    mode: Mode,
    command: Command,
    /// Age of the last accepted driving command, s.
    age: f32,
    /// Time of the last sample, µs; `None` before the first.
    sampled_us: Option<u64>,
    /// That time was no healthy clock's.
    clock_invalid: bool,
    tracking: bool,
    /// How long the bridge has been driving without an angle, s.
    time_without_angle: f32,
    average: MovingAverage,
    actuation: Actuation,
    saturated: f32,
    battery: Option<f32>,
    winding: Winding,
    loop_health: LoopHealth,
    self_check: SelfCheck,
    /// Index of a parameter that is a weaker failsafe than the factory's.
    weak_failsafe: Option<u16>,
    /// Speed of the last straight line of readings, rad/s.
    line_speed: Option<f32>,
    gait: Option<Gait>,
    /// Where the gait is, while it is played; the mode is that of its present step.
    sequencer: Option<Sequencer>,
    telemetry: Telemetry,
}

impl Controller {
    /// A controller at rest in `Idle`, of a robot that has long been switched on and found in order, with a cold winding.
    ///
    /// # Errors
    /// What [`Parameters::check`] finds.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        Ok(Self {
            parameters: *parameters,
            supervisor: Supervisor::default(),
            fault_detectors: FaultDetectors::default(),
            clock: Clock::default(),
            estimator: Estimator::new(parameters),
            pair: Pair::default(),
            window: Window::default(),
            candidate: Candidate::default(),
            mode: Mode::Off,
            command: Command::Idle,
            age: 0.0,
            sampled_us: None,
            clock_invalid: false,
            tracking: false,
            time_without_angle: 0.0,
            average: MovingAverage::default(),
            actuation: Actuation::OFF,
            saturated: 0.0,
            battery: None,
            winding: Winding::default(),
            loop_health: LoopHealth::default(),
            self_check: SelfCheck::passed(),
            weak_failsafe: None,
            line_speed: None,
            gait: None,
            sequencer: None,
            telemetry: Telemetry::default(),
        })
    }

    /// A controller of a robot that has just started: in `Fault` until `ClearFault`. A host repeats the command that it
    /// holds, and a robot that starts again in the middle of it must not go on by itself. It drives only once it has checked
    /// itself, and never with a failsafe that is weaker than in the `factory`'s parameters. How hot the winding is nobody
    /// knows: hot.
    ///
    /// # Errors
    /// What [`Parameters::check`] finds.
    pub fn restarted(parameters: &Parameters, factory: &Parameters) -> Result<Self, ParameterError> {
        let mut controller = Self::new(parameters)?;
        controller.supervisor.raise(Fault::Restarted);
        controller.self_check = SelfCheck::pending();
        controller.weak_failsafe = parameters.weaker_than(factory);
        controller.winding = Winding::with_heat(HOT_SHARE * parameters.supervisor.overheated.limit);
        Ok(controller)
    }

    /// State of the supervisor.
    #[must_use]
    pub fn state(&self) -> State {
        self.supervisor.state()
    }

    /// The parameters that it runs on.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// What it saw and did in the last tick.
    #[must_use]
    pub fn telemetry(&self) -> Telemetry {
        self.telemetry
    }

    /// Keeps a gait in place of the one before, to be played on [`Command::Gait`].
    ///
    /// # Errors
    /// It cannot be played, or the motor is driven. What was there before is kept.
    pub fn keep_gait(&mut self, gait: &Gait) -> Result<(), Refusal> {
        self.check_gait(gait)?;
        self.gait = Some(*gait);
        Ok(())
    }

    /// Whether [`Controller::keep_gait`] would keep it.
    ///
    /// # Errors
    /// Why not.
    pub fn check_gait(&self, gait: &Gait) -> Result<(), Refusal> {
        if self.supervisor.state().is_driving() {
            return Err(Refusal::Driving);
        }
        gait.check(&self.parameters.limits, self.parameters.tick).map(drop)
    }

    /// The gait that it has.
    #[must_use]
    pub fn gait(&self) -> Option<GaitLabel> {
        self.gait.as_ref().map(Gait::label)
    }

    /// The beginning of the stored gait, if it is the one that is meant and can be played with the present parameters.
    fn sequencer(&self, id: u32) -> Result<Sequencer, Refusal> {
        let gait = self.gait.as_ref().filter(|gait| gait.id() == id).ok_or(Refusal::NoGait)?;
        gait.check(&self.parameters.limits, self.parameters.tick).map(Sequencer::new)
    }

    /// Takes a command given at `time_us`. A repeated equal command only refreshes its age. A stamp ahead of the samples,
    /// or more than a minute behind, comes from another clock or one that has wrapped: the command then counts as fresh.
    ///
    /// # Errors
    /// Why it is refused; the robot goes on with what it does, and the age of the last accepted command counts on.
    pub fn command(&mut self, command: Command, time_us: u64) -> Result<(), Refusal> {
        command.check(&self.parameters.limits)?;
        let begins = if let Command::Gait { id } = command { Some(self.sequencer(id)?) } else { None };
        if let Some(fault) = self.supervisor.fault() {
            if command != Command::ClearFault {
                return Err(Refusal::Faulted(fault));
            }
            if self.persists(fault) {
                return Err(Refusal::CausePersists(fault));
            }
        }
        if command.event().drives()
            && !self.supervisor.state().is_driving()
            && let Some(unready) = self.unready()
        {
            return Err(Refusal::NotReady(unready));
        }
        let Some(before) = self.supervisor.request(command.event()) else {
            return Err(Refusal::Faulted(self.supervisor.fault().unwrap_or(Fault::CommandTooOld)));
        };
        if command.event() != Event::Clear {
            self.age = self.age_on_arrival(time_us);
        }
        if command == Command::ClearFault {
            if before == State::Fault {
                self.command = Command::Idle;
            }
        } else if command != self.command || before != self.supervisor.state() {
            self.command = command;
            self.sequencer = begins;
            self.enter(before);
        }
        Ok(())
    }

    /// A sign of life of whoever drives, of the time `time_us` on the samples' clock: what was commanded last counts on. One
    /// that is older than the last changes nothing.
    pub fn heartbeat(&mut self, time_us: u64) {
        let age = seconds(self.sampled_us.map_or(0, |now| now.saturating_sub(time_us)));
        if age < self.age {
            self.age = age;
        }
    }

    /// Goes on with other parameters: from the next tick on, whatever the state. With a failsafe that is weaker than in the
    /// `factory`'s it begins no drive.
    ///
    /// # Errors
    /// What [`Parameters::check`] finds; it goes on with those that it has.
    pub fn retune(&mut self, parameters: &Parameters, factory: &Parameters) -> Result<(), ParameterError> {
        parameters.check()?;
        self.parameters = *parameters;
        self.estimator.retune(parameters);
        self.weak_failsafe = parameters.weaker_than(factory);
        Ok(())
    }

    /// Why the bridge must not be switched on, if it must not.
    fn unready(&self) -> Option<Unready> {
        let missed = self.loop_health.missed();
        let starved = missed > GONE_SHARE * self.parameters.supervisor.loop_starved.limit;
        self.self_check
            .finding()
            .or(self.weak_failsafe.map(Unready::WeakFailsafe))
            .or(starved.then_some(Unready::LoopStarved(missed)))
    }

    /// Age of a command with this stamp, s. From then on the samples' elapsed time is added, which no clock can stop.
    fn age_on_arrival(&self, time_us: u64) -> f32 {
        let age = self.sampled_us.map_or(0, |now| now.saturating_sub(time_us));
        if age > OLDEST_US { 0.0 } else { seconds(age) }
    }

    /// Sets the mode up for a new command.
    fn enter(&mut self, before: State) {
        let slow = self.estimator.estimate().speed.abs() < self.parameters.acquisition.least_speed;
        if self.supervisor.state().is_driving() && !before.is_driving() && slow {
            // At rest no reading is trusted, nor what was known before somebody may have turned the shaft.
            self.lose_track();
        }
        self.set_mode_for(self.command);
        if before != self.supervisor.state() {
            self.average = MovingAverage::default();
        }
    }

    /// Sets the mode up for a command, or goes on with it where it is one of the same kind.
    fn set_mode_for(&mut self, command: Command) {
        let x = self.estimator.estimate();
        match (command, &mut self.mode) {
            (Command::Speed { omega }, Mode::Speed(speed)) => speed.retarget(omega),
            (Command::Position { angle }, Mode::Position(position)) => position.retarget(angle),
            (Command::Speed { omega }, mode) => *mode = Mode::Speed(SpeedControl::new(omega, &x)),
            (Command::Position { angle }, mode) => *mode = Mode::Position(PositionControl::new(angle)),
            (Command::Oscillate { from, to, style }, mode) => {
                *mode = Mode::Oscillate(Oscillator::new(from, to, style, &x));
            }
            (Command::Duty { duty }, mode) => *mode = Mode::Duty(duty),
            // A gait's first step sets it up.
            (Command::Gait { .. } | Command::Idle | Command::Coast | Command::ClearFault, mode) => *mode = Mode::Off,
        }
    }

    fn persists(&self, fault: Fault) -> bool {
        let limits = &self.parameters.supervisor;
        match fault {
            Fault::SupplyLow => self.battery.is_some_and(|volt| volt < limits.supply_low.limit),
            Fault::Runaway => {
                // In the blind arc there is no line: then the best guess.
                self.line_speed.unwrap_or(self.estimator.estimate().speed).abs() > limits.runaway.limit
            }
            Fault::ClockFault => self.clock_invalid,
            Fault::LoopStarved => self.loop_health.missed() > GONE_SHARE * limits.loop_starved.limit,
            Fault::Overheated => self.winding.heat() > GONE_SHARE * limits.overheated.limit,
            // The others only show while the bridge drives; they come back within their bounds.
            _ => false,
        }
    }

    /// One control period. Never panics, whatever the sample holds.
    pub fn tick(&mut self, sample: &Sample) -> Actuation {
        let elapsed = self.clock.advance(sample.time_us, self.parameters.tick);
        self.sampled_us = Some(sample.time_us);
        self.clock_invalid = elapsed.clock_invalid;
        self.age += elapsed.seconds;
        let seen = self.pair.read(&self.parameters, sample);
        self.battery = self.parameters.battery.volt(sample.battery);
        let limits = &self.parameters.supervisor;
        let (share, most) = (limits.starved_share, limits.loop_starved.limit);
        self.loop_health.advance(elapsed.seconds, self.parameters.tick, share, most);
        // Before anything looks at the mode, as where a command came.
        self.play(elapsed);
        let (gate, line) = self.observe(sample, &seen, elapsed);
        let (code, reading) = self.pair.watched(sample, &seen);
        let watched = Sample { angle: code, ..*sample };
        let is_driving = self.supervisor.state().is_driving();
        self.self_check.update(&self.parameters, &watched, reading, is_driving);
        self.supervise(&watched, reading, gate, line, elapsed);
        self.actuate(sample, elapsed);
        self.slow_down_alone();
        if !is_sound(&self.estimator.estimate(), self.actuation) {
            self.lose_track();
            self.actuation = Actuation::OFF;
        }
        self.report(sample, &seen, reading, gate);
        self.actuation
    }

    fn tuning(&self) -> Tuning {
        match self.mode {
            Mode::Oscillate(_) | Mode::Position(_) => self.parameters.estimator.stroke,
            Mode::Speed(_) | Mode::Duty(_) | Mode::Off => self.parameters.estimator.speed,
        }
    }

    fn lose_track(&mut self) {
        self.tracking = false;
        self.time_without_angle = 0.0;
        self.estimator.restart(&self.parameters);
        self.window.clear();
        self.candidate.clear();
    }

    /// Prediction, reading, acquisition.
    fn observe(
        &mut self,
        sample: &Sample,
        seen: &PairReading,
        elapsed: Elapsed,
    ) -> (Option<GateOutcome>, Option<Line>) {
        let tuning = self.tuning();
        if elapsed.jumped {
            self.lose_track();
        }
        if elapsed.ticks > 1 {
            self.window.clear();
        }
        self.estimator.predict(&self.parameters, &tuning, self.actuation, elapsed.ticks);
        if elapsed.ticks == 0 {
            return (None, None);
        }
        let x = self.estimator.estimate();
        // Of the reading's time, against the tick's.
        let offset = elapsed.offset - self.parameters.estimator.reading_age;
        let line = self.follow_readings(seen, &tuning, (offset, elapsed.seconds), &x);
        self.line_speed = line.map(|line| line.speed);
        let mut gate = None;
        if self.tracking {
            let p = &self.parameters;
            gate = Some(match p.estimator.handling {
                BlindArcHandling::Full => {
                    let times = (offset, elapsed.seconds);
                    self.pair.update(p, &tuning, &mut self.estimator, seen, times)
                }
                BlindArcHandling::None => {
                    let reading = Reading::Angle(p.sensor.angle(sample.angle));
                    self.estimator.update(p, &tuning, reading, offset)
                }
            });
            if self.estimator.is_lost(&self.parameters) {
                // The speed is still the best guess there is; only the angle starts over.
                self.tracking = false;
                self.window.clear();
            }
        } else if let Some(line) = line
            && self.actuation.enable
        {
            // Of a shaft that coasts nobody knows whether it obeys: an angle that is found then would tell for the sensor, and
            // against nothing, however often the drive is broken off.
            self.try_acquire(&line);
        } else {
            self.candidate.clear();
        }
        (gate, line)
    }

    /// Keeps the window of readings that are in a row outside the arc.
    fn follow_readings(
        &mut self,
        seen: &PairReading,
        tuning: &Tuning,
        (offset, time): (f32, f32),
        x: &Estimate,
    ) -> Option<Line> {
        let p = &self.parameters;
        let Some(lead) = self.pair.lead(p, tuning, seen, (self.tracking, time)) else {
            self.window.clear();
            return None;
        };
        if lead.changed {
            self.window.clear();
        }
        self.window.push(lead.angle - x.speed * (offset + lead.delay), x.angle);
        self.window.line(&p.acquisition, p.tick).filter(|line| line.is_straight(&p.acquisition))
    }

    fn try_acquire(&mut self, line: &Line) {
        let direction = sign(self.actuation.duty);
        let acquisition = &self.parameters.acquisition;
        if !line.is_trusted(acquisition, direction) {
            self.candidate.clear();
            return;
        }
        if !self.candidate.confirm(acquisition, line, self.estimator.estimate().speed) {
            return;
        }
        let lag = self.pair.lag(&self.parameters, line.speed);
        self.estimator.acquire(&self.parameters, line.angle + lag, line.speed);
        self.tracking = true;
        let x = self.estimator.estimate();
        match &mut self.mode {
            Mode::Speed(speed) => speed.reset_phase(&x),
            Mode::Oscillate(oscillator) => oscillator.reset_phase(&x),
            Mode::Position(_) | Mode::Duty(_) | Mode::Off => {}
        }
    }

    fn supervise(
        &mut self,
        sample: &Sample,
        reading: Reading,
        gate: Option<GateOutcome>,
        line: Option<Line>,
        elapsed: Elapsed,
    ) {
        let at_rest = standstill_current(&self.parameters, self.actuation);
        // Where no angle is known, neither is the back-EMF.
        let current = self.estimator.estimate().current;
        let current = if self.tracking && current.is_finite() { current } else { at_rest };
        self.winding.advance(&self.parameters, current, elapsed.seconds);
        let inputs = Inputs {
            code: sample.angle,
            reading,
            gate,
            line,
            speed: self.estimator.estimate().speed,
            actuation: self.actuation,
            battery: self.battery,
            age: self.age,
            since_sample: elapsed.seconds,
            clock_invalid: elapsed.clock_invalid,
            missed: self.loop_health.missed(),
            has_current: at_rest.abs() > self.parameters.supervisor.driven_current,
            heat: self.winding.heat(),
        };
        let detections = self.fault_detectors.update(&self.parameters, &inputs);
        let (limits, tick) = (&self.parameters.supervisor, self.parameters.tick);
        self.supervisor.update(limits, &detections, elapsed.seconds, tick, self.actuation.enable);
        if !self.supervisor.state().is_driving() {
            self.mode = Mode::Off;
        }
    }

    /// Goes on with the gait: to its present step, or its end.
    fn play(&mut self, elapsed: Elapsed) {
        if self.supervisor.state() != State::Gait {
            return;
        }
        let step = self.gait.as_ref().zip(self.sequencer.as_mut());
        match step.and_then(|(gait, sequencer)| sequencer.advance(gait, elapsed.ticks)) {
            Some(Motion::Oscillation { from, to }) if self.oscillates(from, to) => {}
            Some(motion) => self.set_mode_for(motion.command()),
            None => {
                self.supervisor.request(Event::Coast);
                self.command = Command::Coast;
                self.mode = Mode::Off;
            }
        }
    }

    /// Whether it swings between two angles, rad.
    fn oscillates(&self, from: f32, to: f32) -> bool {
        matches!(&self.mode, Mode::Oscillate(oscillator) if oscillator.is_between(from, to))
    }

    fn actuate(&mut self, sample: &Sample, elapsed: Elapsed) {
        if !self.supervisor.state().is_driving() {
            self.actuation = Actuation::OFF;
            self.saturated = 0.0;
            self.time_without_angle = 0.0;
            return;
        }
        if let Mode::Duty(duty) = self.mode {
            self.actuation = Actuation { duty, enable: true };
            self.saturated = 0.0;
            self.time_without_angle = 0.0;
            return;
        }
        if self.parameters.position.source == AngleSource::MovingAverage && !matches!(self.mode, Mode::Speed(_)) {
            self.actuate_as_the_thesis(sample, elapsed);
            return;
        }
        let p = &self.parameters;
        let x = self.estimator.estimate();
        let supply = drive::supply(&p.bridge, self.actuation.duty, x.current);
        let time = f32::from(elapsed.ticks) * p.tick;
        self.time_without_angle = if self.tracking { 0.0 } else { self.time_without_angle + time };
        let voltage = match &mut self.mode {
            Mode::Speed(speed) => {
                speed.advance(time);
                if self.tracking {
                    speed.voltage(p, &x, supply)
                } else {
                    speed.reset_phase(&x);
                    search_voltage(p, speed.omega(), &x, self.time_without_angle)
                }
            }
            // Any motion will do to find the angle.
            Mode::Oscillate(_) | Mode::Position(_) if !self.tracking => {
                search_voltage(p, p.acquisition.speed, &x, self.time_without_angle)
            }
            Mode::Oscillate(oscillator) => oscillator.voltage(p, &x, supply),
            Mode::Position(position) => {
                position.voltage(p, x.angle, self.saturated, time) + position.drag_voltage(p, &x)
            }
            Mode::Duty(_) | Mode::Off => 0.0,
        };
        if !(voltage.is_finite() && x.speed.is_finite()) {
            // A duty from NaN would be full voltage one way.
            self.lose_track();
            self.actuation = Actuation::OFF;
            self.saturated = 0.0;
            return;
        }
        let Drive { duty, saturated } = drive::invert(&p.bridge, &p.motor, voltage, x.speed, supply);
        self.actuation = Actuation { duty, enable: true };
        self.saturated = saturated;
    }

    /// Without a sign of life the duty fades to zero, at which the bridge shorts the motor and so brakes it, until the age is
    /// that of a fault. Whatever the mode: this needs no angle and no model.
    fn slow_down_alone(&mut self) {
        let limits = &self.parameters.supervisor;
        let (slow_after, off_after) = (limits.slow_after, limits.command_old.limit);
        if self.age > slow_after && off_after > slow_after {
            self.actuation.duty *= clamp((off_after - self.age) / (off_after - slow_after), 0.0, 1.0);
        }
    }

    /// P on a moving average of the readings, wherever they come from, and no drop inverted: for comparison.
    fn actuate_as_the_thesis(&mut self, sample: &Sample, elapsed: Elapsed) {
        let p = &self.parameters;
        let reading = p.sensor.angle(sample.angle);
        let time = f32::from(elapsed.ticks) * p.tick;
        let voltage = match &mut self.mode {
            Mode::Oscillate(oscillator) => {
                let averaged = self.average.push(reading, p.position.average);
                let angle = Estimate { angle: averaged, speed: 0.0, current: 0.0, drag: 0.0 };
                oscillator.thesis_voltage(p, &angle)
            }
            // It averages by itself.
            Mode::Position(position) => position.voltage(p, reading, self.saturated, time),
            Mode::Speed(_) | Mode::Duty(_) | Mode::Off => 0.0,
        };
        let wanted = voltage / p.bridge.rail;
        if !wanted.is_finite() {
            self.lose_track();
            self.actuation = Actuation::OFF;
            self.saturated = 0.0;
            return;
        }
        self.actuation = Actuation { duty: clamp(wanted, -1.0, 1.0), enable: true };
        self.saturated = if wanted.abs() > 1.0 { sign(wanted) } else { 0.0 };
    }

    fn is_blind(&self, seen: &PairReading, angle: f32) -> bool {
        let p = &self.parameters;
        p.estimator.handling == BlindArcHandling::Full && self.pair.is_blind(p, seen, angle)
    }

    fn report(&mut self, sample: &Sample, seen: &PairReading, reading: Reading, gate: Option<GateOutcome>) {
        let x = self.estimator.estimate();
        let (reference_angle, reference_speed) = match &self.mode {
            Mode::Speed(speed) => (speed.phase(), speed.omega()),
            Mode::Oscillate(oscillator) => (oscillator.bound(), 0.0),
            Mode::Position(position) => (position.target(), 0.0),
            Mode::Duty(_) | Mode::Off => (x.angle, 0.0),
        };
        self.telemetry = Telemetry {
            time_us: sample.time_us,
            state: self.supervisor.state(),
            fault: self.supervisor.fault(),
            tracking: self.tracking,
            angle: x.angle,
            speed: x.speed,
            current: x.current,
            drag: x.drag,
            reference_angle,
            reference_speed,
            reading: match reading {
                Reading::Angle(angle) => Some(angle),
                Reading::LowEnd | Reading::HighEnd => None,
            },
            accepted: gate == Some(GateOutcome::Accepted),
            blind: self.is_blind(seen, x.angle_of_reading(&self.parameters)),
            failed_sensor: self.pair.failed(),
            saturated: self.saturated.abs() > 0.5,
            battery: self.battery.unwrap_or(0.0),
            actuation: self.actuation,
        };
    }
}

/// Voltage while the angle is unknown: what the model needs for a speed that shows on the readings, and all there is
/// when that has not brought an angle: the shaft may be heavier to turn than the model thinks.
fn search_voltage(p: &Parameters, omega: f32, x: &Estimate, time_without_angle: f32) -> f32 {
    let direction = if omega < 0.0 { -1.0 } else { 1.0 };
    if time_without_angle > p.acquisition.patience {
        return direction * p.bridge.rail;
    }
    let speed = if omega.abs() > p.acquisition.speed { omega.abs() } else { p.acquisition.speed };
    SpeedControl::voltage_without_phase(p, direction * speed, x)
}

/// Of a limit on what gathers slowly: under this share its cause counts as gone.
const GONE_SHARE: f32 = 0.5;
/// Of the limit on the winding's heat: what a robot that has just started is taken to have.
const HOT_SHARE: f32 = 0.75;
/// No link keeps a command for longer, µs.
const OLDEST_US: u64 = 60_000_000;

/// Whether a tick left numbers behind.
fn is_sound(x: &Estimate, actuation: Actuation) -> bool {
    let state = x.angle.is_finite() && x.speed.is_finite() && x.current.is_finite() && x.drag.is_finite();
    state && actuation.duty.is_finite()
}

/// µs to s; ages beyond a few seconds only need to be large.
#[expect(clippy::cast_precision_loss, reason = "an age is compared with limits of a second")]
fn seconds(us: u64) -> f32 {
    us as f32 * 1e-6
}
