//! The current controller on recorded samples and orders.

use std::collections::VecDeque;
use std::path::Path;

use control::{Actuation, AdcCode, Command, Controller, ParameterError, Parameters, Sample, State, Telemetry};

use recording::{FullRow, RecordedEvent, SessionEvent};
use simulation::{Drive, REFRESH_S};

/// An order over the radio that the robot has not visibly followed after this long is told anyway, s: it was refused, or
/// makes no difference yet.
const FOLLOWED_WITHIN_S: f64 = 1.0;

/// A duty that fits better by this tells something: more than the radio's step and the clock's jitter make.
const TELLING_DUTY: f64 = 0.01;

/// What the controller is told by an event; `None` for what it never hears of.
pub(super) fn command(event: &SessionEvent) -> Option<Command> {
    match event {
        SessionEvent::Order { command: Some(command), .. } => Some(*command),
        SessionEvent::Order { text, .. } => {
            let drive = Drive::parse_script(text, Path::new("order")).ok()?;
            drive.steps.first().map(|step| step.order.command())
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
    }
}

/// Tells the controller what it was told, and asks what it decides.
pub(super) struct Decider {
    controller: Controller,
    parameters: Parameters,
    /// Orders that are not told yet, with their times.
    waiting: VecDeque<(f64, Command)>,
    /// The order that a host keeps fresh over the radio, and when it was last told, µs.
    current: Option<(Command, u64)>,
    linked: bool,
    /// The codes of the battery are taken for healthy.
    no_battery: bool,
    /// The times are those of the rows, not of the samples.
    rounded_times: bool,
}

impl Decider {
    /// # Errors
    /// The controller refuses the parameters.
    pub(super) fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        Ok(Self {
            controller: Controller::new(parameters)?,
            parameters: *parameters,
            waiting: VecDeque::new(),
            current: None,
            linked: true,
            no_battery: false,
            rounded_times: false,
        })
    }

    /// Begins as a robot does that has just started: in `Fault`.
    pub(super) fn restart(&mut self) {
        if let Ok(controller) = Controller::restarted(&self.parameters, &self.parameters) {
            self.controller = controller;
        }
    }

    pub(super) fn event(&mut self, event: &RecordedEvent) {
        match event.event {
            SessionEvent::LinkLost => self.linked = false,
            SessionEvent::LinkRegained => self.linked = true,
            _ => self.waiting.extend(command(&event.event).map(|command| (event.t_s, command))),
        }
    }

    /// One tick; `None` where the row has no code of the angle sensor.
    pub(super) fn tick(&mut self, row: &FullRow) -> Option<Telemetry> {
        let sample = self.sample(row)?;
        // One that shows has those before it behind it, refused or not.
        let due = match row.is_radio {
            true => {
                self.waiting.iter().rposition(|order| self.has_followed(order, row, &sample)).map_or(0, |last| last + 1)
            }
            false => self.waiting.len(),
        };
        for _ in 0..due {
            let Some((_, command)) = self.waiting.pop_front() else { break };
            self.tell(command, sample.time_us);
        }
        if row.is_radio {
            self.keep_fresh(sample.time_us);
        }
        self.controller.tick(&sample);
        Some(self.controller.telemetry())
    }

    /// Whether an order over the radio has reached the robot, by what the robot said: its state or, where that was the
    /// same before, a duty that fits better with the order than without.
    fn has_followed(&self, &(at_s, command): &(f64, Command), row: &FullRow, sample: &Sample) -> bool {
        if row.t_s < at_s || row.t_s - at_s > FOLLOWED_WITHIN_S {
            return row.t_s > at_s;
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

    fn tell(&mut self, command: Command, time_us: u64) {
        // A refusal shows in the states that follow.
        let _ = self.controller.command(command, time_us);
        self.current = (command != Command::ClearFault).then_some((command, time_us));
    }

    /// What a host repeats over the radio is not in the recording.
    fn keep_fresh(&mut self, time_us: u64) {
        let Some((command, told_us)) = self.current else { return };
        let is_due = time_us.saturating_sub(told_us) as f64 >= REFRESH_S * 1e6;
        if self.linked && is_due && self.controller.telemetry().state != State::Fault {
            self.tell(command, time_us);
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
        if self.rounded_times {
            notes.push("the exact times of the samples are not recorded: they are taken from the ticks".to_owned());
        }
        notes
    }
}
