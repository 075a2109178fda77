//! The current controller on recorded samples and commands.

use std::collections::VecDeque;
use std::path::Path;

use control::parameters::table;
use control::{Actuation, AdcCode, Command, Controller, Gait, ParameterError, Parameters, Sample, State, Telemetry};

use recording::{FullRow, Outcome, ParameterValue, RecordedEvent, SessionEvent};
use simulation::Drive;

/// A command over the radio that the robot has not visibly followed after this long is told anyway, s: it was refused, or
/// makes no difference yet.
const FOLLOWED_WITHIN_S: f64 = 1.0;

/// Ticks that stand for those before a recording of a robot that has just started: twice the block of its check.
const RUN_IN_TICKS: u64 = 2 * control::self_check::BLOCK as u64;

/// A duty that fits better by this tells something: more than the radio's step and the clock's jitter make.
const TELLING_DUTY: f64 = 0.01;

/// What reaches the controller from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Told {
    Command(Command),
    /// Another value of a parameter, by its index in the table.
    Set(u16, f32),
    /// The parameters that the firmware was built with.
    Factory,
    /// This gait to keep.
    Gait(Gait),
}

/// What the robot answered to a command.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Answered {
    outcome: Outcome,
    tick: Option<u64>,
    parameter: Option<ParameterValue>,
}

/// The answers of a recording in the order of its commands: each command has one, and a robot answers one after the other.
pub(super) fn answers(events: &[RecordedEvent], robot: Option<&str>) -> VecDeque<Answered> {
    let of_robot = |event: &&RecordedEvent| robot.is_none() || event.robot.as_deref() == robot;
    let answered = events.iter().filter(of_robot).filter_map(|event| match &event.event {
        SessionEvent::Answer { outcome, tick, parameter, .. } => {
            Some(Answered { outcome: *outcome, tick: *tick, parameter: parameter.clone() })
        }
        _ => None,
    });
    answered.collect()
}

/// When a command over the radio is told.
#[derive(Clone, Copy, Debug, PartialEq)]
enum When {
    /// Before the decision of this tick of the recording: the robot said so.
    Tick(u64),
    /// Where the robot is seen to follow it, or after [`FOLLOWED_WITHIN_S`]: nobody knows what became of it, or it was done
    /// and the recording, an old one, does not say when.
    Seen,
    /// Where the robot is seen to follow it, or never: no answer came.
    OnlySeen,
}

/// A command over the radio that is not told yet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Waiting {
    ordered_s: f64,
    told: Told,
    when: When,
}

/// The parameter of `set NAME VALUE`, for recordings whose answers do not hold it.
fn set_of(text: &str) -> Option<(u16, f32)> {
    let mut words = text.split_whitespace();
    let (Some("set"), Some(name), Some(value)) = (words.next(), words.next(), words.next()) else { return None };
    let is_named = |entry: &table::Entry| entry.name.strip_suffix(name).is_some_and(|rest| rest.ends_with('.'));
    let index = table::find(name).or_else(|| u16::try_from(table::TABLE.iter().position(is_named)?).ok())?;
    Some((index, value.parse().ok()?))
}

/// What a command tells the controller.
fn told(event: &SessionEvent, answered: Option<&Answered>) -> Option<Told> {
    if let Some(command) = command(event) {
        return Some(Told::Command(command));
    }
    let SessionEvent::Command { text, gait, .. } = event else { return None };
    if let Some(gait) = gait {
        return Some(Told::Gait(**gait));
    }
    // Parameters change only where the robot says that they have.
    answered.filter(|answered| answered.outcome == Outcome::Done)?;
    if text.trim() == "factory" {
        return Some(Told::Factory);
    }
    let recorded = answered.and_then(|answered| answered.parameter.as_ref());
    let (index, value) = match recorded {
        Some(ParameterValue { name, value }) => (table::find(name)?, *value),
        None => set_of(text)?,
    };
    Some(Told::Set(index, value))
}

/// What the controller is told by an event; `None` for what it never hears of.
pub(super) fn command(event: &SessionEvent) -> Option<Command> {
    match event {
        SessionEvent::Command { command: Some(command), .. } => Some(*command),
        SessionEvent::Command { text, .. } => {
            let drive = Drive::parse_script(text, Path::new("order")).ok()?;
            drive.steps.first().map(|step| step.command.to_control())
        }
        SessionEvent::Stop => Some(Command::Idle),
        _ => None,
    }
}

/// The state in which a command leaves a robot that takes it.
fn state_of(command: Command) -> State {
    match command {
        Command::Idle | Command::ClearFault => State::Idle,
        Command::Coast => State::Coast,
        Command::Speed { .. } => State::Speed,
        Command::Oscillate { .. } => State::Oscillate,
        Command::Position { .. } => State::Position,
        Command::Duty { .. } => State::Duty,
        Command::Gait { .. } => State::Gait,
    }
}

/// Its effect is in the state, or there is none.
fn is_stop(told: Told) -> bool {
    told == Told::Command(Command::Idle)
}

/// Tells the controller what it was told, and asks what it decides.
pub(super) struct Decider {
    controller: Controller,
    /// As the firmware is built with: those of the robot file.
    parameters: Parameters,
    /// Commands that are not told yet.
    waiting: VecDeque<Waiting>,
    /// What the robot answered to the commands that come, in their order.
    answers: VecDeque<Answered>,
    /// Ticks that begin as those of a robot that has been on for a while.
    begins_restarted: bool,
    linked: bool,
    /// The codes of the battery are taken for healthy.
    no_battery: bool,
    /// The times are those of the rows, not of the samples.
    rounded_times: bool,
    /// A command's effect was placed by what the robot was seen to do.
    guessed: bool,
    /// A gait was played that the file only names.
    no_gait: bool,
}

impl Decider {
    /// # Errors
    /// The controller refuses the parameters.
    pub(super) fn new(parameters: &Parameters, answers: VecDeque<Answered>) -> Result<Self, ParameterError> {
        Ok(Self {
            controller: Controller::new(parameters)?,
            parameters: *parameters,
            waiting: VecDeque::new(),
            answers,
            begins_restarted: false,
            linked: true,
            no_battery: false,
            rounded_times: false,
            guessed: false,
            no_gait: false,
        })
    }

    /// Begins as a robot does that has just started: in `Fault`.
    pub(super) fn restart(&mut self) {
        if let Ok(controller) = Controller::restarted(&self.parameters, &self.parameters) {
            self.controller = controller;
            self.begins_restarted = true;
        }
    }

    pub(super) fn event(&mut self, event: &RecordedEvent) {
        match &event.event {
            SessionEvent::LinkLost => self.linked = false,
            SessionEvent::LinkRegained => self.linked = true,
            other => {
                self.no_gait |= matches!(
                    other,
                    SessionEvent::Command { text, command: None, gait: None, .. } if text.starts_with("gait ")
                );
                let is_order = matches!(other, SessionEvent::Command { repeat: false, .. });
                let answered = if is_order { self.answers.pop_front() } else { None };
                let when = match &answered {
                    // The robot went on with what it did.
                    Some(Answered { outcome: Outcome::Refused | Outcome::TooLate, tick: Some(_), .. }) => return,
                    Some(Answered { outcome: Outcome::Done, tick: Some(tick), .. }) => When::Tick(*tick),
                    Some(Answered { outcome: Outcome::Refused | Outcome::TooLate, .. }) => When::OnlySeen,
                    _ => When::Seen,
                };
                let told = told(other, answered.as_ref());
                self.waiting.extend(told.map(|told| Waiting { ordered_s: event.t_s, told, when }));
            }
        }
    }

    /// One tick; `None` where the row has no code of the angle sensor.
    pub(super) fn tick(&mut self, row: &FullRow) -> Option<Telemetry> {
        let sample = self.sample(row)?;
        if row.is_radio && std::mem::take(&mut self.begins_restarted) {
            self.run_in(&sample);
        }
        // One that shows has those before it behind it, refused or not.
        let due = match row.is_radio {
            true => self.waiting.iter().rposition(|order| self.is_due(order, row, &sample)).map_or(0, |last| last + 1),
            false => self.waiting.len(),
        };
        for at in 0..due {
            let Some(order) = self.waiting.pop_front() else { break };
            let is_last = at + 1 == due;
            self.guessed |= row.is_radio && !matches!(order.when, When::Tick(_)) && !is_stop(order.told);
            // One without an answer that does not show was not done.
            if order.when != When::OnlySeen || is_last && self.has_followed(&order, row, &sample) {
                self.tell(order.told, sample.time_us);
            }
        }
        if row.is_radio && self.linked {
            // The console's heartbeats are not in the recording: they are taken to have arrived.
            self.controller.heartbeat(sample.time_us);
        }
        self.controller.tick(&sample);
        Some(self.controller.telemetry())
    }

    /// A robot that is heard has been on for longer than its check after the start takes, which a recording does not show.
    /// The first sample stands for those before, with the noise that a working converter has.
    fn run_in(&mut self, first: &Sample) {
        let tick_us = (f64::from(self.parameters.tick) * 1e6).round() as u64;
        for back in (1..=RUN_IN_TICKS).rev() {
            let Some(time_us) = first.time_us.checked_sub(back * tick_us) else { continue };
            let noise = u16::from(back % 2 == 1);
            let dither = |code: AdcCode| AdcCode(if code.0 == 0 { noise } else { code.0 - noise });
            let (angle, second) = (dither(first.angle), first.second.map(dither));
            self.controller.tick(&Sample { time_us, angle, second, battery: first.battery });
        }
    }

    fn is_due(&self, order: &Waiting, row: &FullRow, sample: &Sample) -> bool {
        match order.when {
            When::Tick(tick) => row.tick.is_some_and(|now| now >= tick),
            When::Seen | When::OnlySeen => {
                let is_over = row.t_s - order.ordered_s > FOLLOWED_WITHIN_S;
                is_over || self.has_followed(order, row, sample)
            }
        }
    }

    /// Whether a command over the radio has reached the robot, by what the robot said: its state or, where that was the
    /// same before, a duty that fits better with the command than without.
    fn has_followed(&self, order: &Waiting, row: &FullRow, sample: &Sample) -> bool {
        let Told::Command(command) = order.told else { return row.t_s >= order.ordered_s };
        if row.t_s < order.ordered_s || row.t_s - order.ordered_s > FOLLOWED_WITHIN_S {
            return false;
        }
        let state = state_of(command);
        if row.stated.is_some_and(|stated| stated.state != state) {
            return false;
        }
        let Some(duty) = row.duty.filter(|_| self.controller.telemetry().state == state) else { return true };
        let (mut without, mut with) = (self.controller, self.controller);
        let off_by = |actuation: Actuation| (f64::from(actuation.duty) - duty).abs();
        let _ = with.command(command, sample.time_us);
        off_by(with.tick(sample)) + TELLING_DUTY < off_by(without.tick(sample))
    }

    fn tell(&mut self, told: Told, time_us: u64) {
        // What the controller refuses leaves it at what it does, here as in the robot: a difference shows in the states that
        // follow.
        match told {
            Told::Command(command) => drop(self.controller.command(command, time_us)),
            Told::Set(index, value) => {
                if let Ok(changed) = self.controller.parameters().with(index, value) {
                    let _ = self.controller.retune(&changed, &self.parameters);
                }
            }
            Told::Gait(gait) => drop(self.controller.keep_gait(&gait)),
            Told::Factory => drop(self.controller.retune(&self.parameters, &self.parameters)),
        }
    }

    fn sample(&mut self, row: &FullRow) -> Option<Sample> {
        let code = |value: f64| AdcCode(value as u16);
        let battery = &self.parameters.battery;
        let (zero, volt_per_code) = (f64::from(battery.volt_at_zero), f64::from(battery.volt_per_code));
        let is_measured = volt_per_code > 0.0;
        let of_volt = |volt: f64| AdcCode(((volt - zero) / volt_per_code).round().clamp(0.0, 65535.0) as u16);
        let battery = match (row.battery_adc, row.battery_v) {
            (Some(adc), _) => code(adc),
            (None, Some(volt)) if is_measured => of_volt(volt),
            _ => {
                self.no_battery |= is_measured;
                // As full as no cell is: its limit is not in question.
                AdcCode(u16::MAX)
            }
        };
        let tick_us = f64::from(self.parameters.tick) * 1e6;
        self.rounded_times |= row.time_us.is_none();
        let time_us = row.time_us.or_else(|| row.tick.map(|tick| tick as f64 * tick_us)).unwrap_or(row.t_s * 1e6);
        Some(Sample {
            time_us: time_us.round() as u64,
            angle: code(row.adc.or(row.angle_code)?),
            second: row.adc_second.map(code),
            battery,
        })
    }

    /// The samples' exact times are not in the recording.
    pub(super) fn rounds_times(&self) -> bool {
        self.rounded_times
    }

    /// What was not in the recording and had to be assumed.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.no_battery {
            notes.push("the battery is not recorded: it is taken for full, so SupplyLow cannot come".to_owned());
        }
        if self.no_gait {
            notes.push("the gait is not in this file, which has its name only: replay run.mcap".to_owned());
        }
        if self.guessed {
            notes.push(
                "the recording does not say in which tick each order was done: it takes effect where the robot is seen to \
                 follow it"
                    .to_owned(),
            );
        }
        if self.rounded_times {
            notes.push("the exact times of the samples are not recorded: they are taken from the ticks".to_owned());
        }
        notes
    }
}
