//! The console without a screen: runs commands to their end and says what became of each.

use std::time::Duration;

use control::Fault;
use control::protocol::radio::Value;
use serde::Serialize;

use super::{CommandOutcome, Engine};
use link::{Line, LinkError, Outcome};

/// Where a fault, or a robot that is gone, ends a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Everything was done.
    Done,
    /// Something could not even be sent.
    Failed,
    /// A robot said no to something, or it was too late.
    Refused,
    /// A robot did not answer, or was not heard any more.
    Lost,
    /// A robot stopped itself.
    Fault,
}

impl End {
    /// Exit code of `scram console`; 2 is wrong usage.
    #[must_use]
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::Refused => 3,
            Self::Lost => 4,
            Self::Fault => 5,
        }
    }
}

/// Output of `scram console` while commands run.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Output {
    /// What became of a command.
    Answer {
        /// Since the console began, s.
        t_s: f64,
        /// Name of the robot, as its status tells it.
        robot: String,
        /// As it was typed.
        command: String,
        /// `done`, `refused`, `too_late`, `unanswered`, `absent`, `overtaken`, or `failed`: it could not even be sent.
        outcome: &'static str,
        /// The same in words.
        text: String,
        /// The parameter.
        #[serde(skip_serializing_if = "Option::is_none")]
        parameter: Option<Parameter>,
    },
    /// How a robot is.
    Robot(Box<RobotState>),
    /// A robot stopped itself.
    Fault {
        /// Since the console began, s.
        t_s: f64,
        /// Name of the robot, as its status tells it.
        robot: String,
        /// Cause.
        fault: Fault,
        /// The same in words.
        text: String,
    },
    /// A line for people.
    Note {
        /// Since the console began, s.
        t_s: f64,
        /// Message.
        text: String,
    },
}

/// A parameter that was told.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its path in the robot file.
    pub name: &'static str,
    /// Its value.
    pub value: f32,
    /// What was built in.
    pub factory: f32,
    /// The unit of both.
    pub unit: &'static str,
}

/// How a robot is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobotState {
    /// Since the console began, s.
    pub t_s: f64,
    /// Its name.
    pub robot: String,
    /// ESP-NOW (MAC) address, as colon-separated hexadecimal bytes.
    pub address: String,
    /// It is heard.
    pub present: bool,
    /// Its state.
    pub state: Option<&'static str>,
    /// Why it stopped itself.
    pub fault: Option<Fault>,
    /// Actuation frequency, Hz, positive clockwise from above.
    pub frequency_hz: Option<f64>,
    /// Duty, −1 … 1.
    pub duty: Option<f64>,
    /// Battery voltage, V; `None` where it is not measured.
    pub battery_v: Option<f64>,
    /// Since its boot, s.
    pub uptime_s: Option<f64>,
    /// Its frames a second.
    pub rate_hz: f64,
    /// Share of its frames that is missing.
    pub loss: Option<f64>,
    /// There and back, ms.
    pub round_trip_ms: Option<f64>,
    /// Signal, dBm.
    pub rssi_dbm: Option<i8>,
}

/// Runs until everything that was submitted has ended. `told` gets every answer, and `cancelled` says when to leave.
///
/// # Errors
/// The line to the dongle broke.
pub fn run<L: Line>(
    engine: &mut Engine<L>,
    told: &mut dyn FnMut(Output),
    cancelled: &dyn Fn() -> bool,
) -> Result<End, LinkError> {
    let mut end = End::Done;
    let mut faults: Vec<Option<Fault>> = engine.model().robots.iter().map(|robot| robot.fault).collect();
    let mut present: Vec<bool> = engine.model().robots.iter().map(|robot| robot.present).collect();
    let mut logged = engine.model().logged;
    while !cancelled() {
        engine.poll()?;
        while let Some(reply) = engine.next_reply() {
            end = worst(end, of(&reply.outcome));
            told(answer(engine, reply));
        }
        let t_s = engine.model().now.as_secs_f64();
        for (index, robot) in engine.model().robots.iter().enumerate() {
            if robot.fault != faults[index] {
                faults[index] = robot.fault;
                if let Some(fault) = robot.fault.filter(|fault| *fault != Fault::Restarted) {
                    end = End::Fault;
                    told(Output::Fault { t_s, robot: robot.name.clone(), fault, text: link::fault(fault).0.into() });
                }
            }
            if present[index] && !robot.present {
                end = worst(end, End::Lost);
            }
            present[index] = robot.present;
        }
        // What is only said, such as a list.
        let model = engine.model();
        let new = usize::try_from(model.logged - logged).unwrap_or(usize::MAX).min(model.log.len());
        for line in model.log.iter().skip(model.log.len() - new).filter(|line| line.only_said) {
            told(Output::Note { t_s, text: line.text.clone() });
        }
        logged = model.logged;
        if engine.is_idle() || engine.wants_to_quit() || end == End::Fault {
            return Ok(end);
        }
    }
    Ok(End::Lost)
}

/// Waits until robots are here: the selected one, or with `all` as long as others may come.
///
/// # Errors
/// The line to the dongle broke.
pub fn wait_for_robots<L: Line>(
    engine: &mut Engine<L>,
    all: bool,
    patience: Duration,
    cancelled: &dyn Fn() -> bool,
) -> Result<bool, LinkError> {
    let start = engine.model().now;
    while engine.model().now.saturating_sub(start) < patience && !cancelled() {
        engine.poll()?;
        let ready = |robot: &super::model::RobotModel| robot.present && robot.state.is_some();
        let model = engine.model();
        let here = if all { model.robots.iter().all(ready) } else { model.robot().is_some_and(ready) };
        if here {
            return Ok(true);
        }
    }
    Ok(false)
}

/// How a robot is, from what the console knows.
#[must_use]
pub fn robot_state<L: Line>(engine: &Engine<L>, index: usize) -> Option<RobotState> {
    let model = engine.model();
    let robot = model.robots.get(index)?;
    Some(RobotState {
        t_s: model.now.as_secs_f64(),
        robot: robot.name.clone(),
        address: link::address(&robot.address),
        present: robot.present,
        state: robot.state.map(link::state),
        fault: robot.fault,
        frequency_hz: robot.series.frequency.last(),
        duty: robot.series.duty.last(),
        battery_v: robot.battery_v,
        uptime_s: robot.uptime.map(|up| up.as_secs_f64()),
        rate_hz: robot.quality.rate_hz,
        loss: robot.quality.loss,
        round_trip_ms: robot.quality.round_trip.map(|trip| trip.as_secs_f64() * 1e3),
        rssi_dbm: robot.quality.rssi_dbm,
    })
}

fn of(outcome: &Result<Outcome, String>) -> End {
    match outcome {
        Ok(Outcome::Done(_)) => End::Done,
        Err(_) => End::Failed,
        Ok(Outcome::Refused(_) | Outcome::TooLate) => End::Refused,
        Ok(Outcome::Unanswered | Outcome::Absent | Outcome::Overtaken) => End::Lost,
    }
}

fn worst(a: End, b: End) -> End {
    if b.code() > a.code() { b } else { a }
}

fn answer<L: Line>(engine: &Engine<L>, reply: CommandOutcome) -> Output {
    let model = engine.model();
    let word = match reply.outcome {
        Err(_) => "failed",
        Ok(Outcome::Done(_)) => "done",
        Ok(Outcome::Refused(_)) => "refused",
        Ok(Outcome::TooLate) => "too_late",
        Ok(Outcome::Unanswered) => "unanswered",
        Ok(Outcome::Absent) => "absent",
        Ok(Outcome::Overtaken) => "overtaken",
    };
    let value = if let Ok(Outcome::Done(value)) = reply.outcome { value } else { None };
    let text = match (reply.parameter, value, reply.outcome) {
        (Some(index), Some(value), _) => super::parameter_line(index, value),
        (_, _, Ok(outcome)) => link::outcome(outcome),
        (_, _, Err(problem)) => problem,
    };
    let parameter = reply.parameter.zip(value).map(|(index, Value { now, factory })| {
        let entry = &control::parameters::table::TABLE[usize::from(index)];
        Parameter { name: entry.name, value: now, factory, unit: entry.unit }
    });
    Output::Answer {
        t_s: model.now.as_secs_f64(),
        robot: model.robots.get(reply.robot).map(|robot| robot.name.clone()).unwrap_or_default(),
        command: reply.text,
        outcome: word,
        text,
        parameter,
    }
}
