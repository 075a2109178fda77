//! One run at constant duty, from a robot at rest to a robot at rest.

use std::time::Duration;

use control::protocol::dongle::Address;
use control::protocol::radio::FromRobot;
use control::{Command, Fault, Refusal, State};

use super::{Heard, Line, LinkError, Recorder, Session, words};

/// A robot sends a hundred batches a second: without any for so long it is gone.
const ROBOT_SILENT: Duration = Duration::from_millis(500);
/// A command takes effect within a tick of its arrival, which telemetry tells 10 ms later.
const EFFECT: Duration = Duration::from_secs(1);

/// A run, however it ended.
#[derive(Debug)]
pub struct Spin {
    /// What was received.
    pub recorder: Recorder,
    /// Why it ended early.
    pub end: Result<(), LinkError>,
    /// The robot said that its bridge is off.
    pub stopped: bool,
}

/// Clears a fault, drives at a duty for a number of ticks, and stops. The robot is told to stop however the run ends,
/// and its answer is waited for. `on_tick` gets the number of ticks driven so far and says whether to go on.
pub fn spin<L: Line>(
    session: &mut Session<L>,
    robot: Address,
    duty: f32,
    ticks: u64,
    on_tick: &mut dyn FnMut(u64) -> bool,
) -> Spin {
    let mut recorder = Recorder::default();
    let mut end =
        clear_fault(session, robot, on_tick).and_then(|()| drive(session, robot, duty, ticks, &mut recorder, on_tick));
    if let Err(LinkError::RobotRestarted { why }) = &mut end {
        *why = session
            .station(&robot)
            .and_then(|station| station.status.as_ref())
            .map(|status| words::reset(status.reset));
    }
    let stopped = session.stop(robot, EFFECT, |heard| {
        // The shaft running out belongs to the recording; what comes after a restart does not.
        if end.is_ok()
            && heard.from == robot
            && let FromRobot::Telemetry(batch) = &heard.message
        {
            let _ = recorder.take(batch, heard.at);
        }
    });
    Spin { recorder, end, stopped }
}

fn clear_fault<L: Line>(
    session: &mut Session<L>,
    robot: Address,
    on_tick: &mut dyn FnMut(u64) -> bool,
) -> Result<(), LinkError> {
    session.hold(robot, Command::Idle)?;
    let start = session.now();
    let mut asked = false;
    while on_tick(0) {
        let fault = match message(session, robot)? {
            Some(FromRobot::Telemetry(batch)) if batch.state != State::Fault => return Ok(()),
            Some(FromRobot::Telemetry(batch)) => batch.fault,
            // The other refusals are of commands before.
            Some(FromRobot::Answer { outcome: Err(refusal @ Refusal::CausePersists(_)), .. }) => {
                return Err(LinkError::Refused { refusal });
            }
            _ => None,
        };
        if fault.is_some() && !asked {
            session.hold(robot, Command::ClearFault)?;
            asked = true;
        }
        if session.now().saturating_sub(start) > EFFECT {
            let fault = session.station(&robot).and_then(|station| station.telemetry.as_ref()?.fault);
            return Err(
                fault.map_or(LinkError::NotDriving { what: "tells nothing" }, |fault| LinkError::Fault { fault })
            );
        }
    }
    Err(LinkError::Cancelled)
}

fn drive<L: Line>(
    session: &mut Session<L>,
    robot: Address,
    duty: f32,
    ticks: u64,
    recorder: &mut Recorder,
    on_tick: &mut dyn FnMut(u64) -> bool,
) -> Result<(), LinkError> {
    session.hold(robot, Command::Duty { duty })?;
    let start = session.now();
    while on_tick(recorder.driven()) {
        if recorder.driven() == 0 && session.now().saturating_sub(start) > EFFECT {
            return Err(LinkError::NotDriving { what: "does not switch on" });
        }
        let Some(Heard { from, at, message }) = listen(session, robot)? else { continue };
        if from != robot {
            continue;
        }
        match message {
            // The fault of this run, which a repetition of the command ran into.
            FromRobot::Answer { outcome: Err(Refusal::Faulted(fault)), .. } => return Err(stopped_by(fault)),
            FromRobot::Answer { outcome: Err(refusal), .. } => return Err(LinkError::Refused { refusal }),
            FromRobot::Telemetry(batch) => {
                recorder.take(&batch, at)?;
                if let Some(fault) = batch.fault {
                    return Err(stopped_by(fault));
                }
                if recorder.driven() >= ticks {
                    return Ok(());
                }
                if recorder.driven() > 0 && batch.state != State::Duty {
                    return Err(LinkError::NotDriving { what: "was switched off by another command" });
                }
            }
            FromRobot::Answer { .. } | FromRobot::Status(_) => {}
        }
    }
    Err(LinkError::Cancelled)
}

fn stopped_by(fault: Fault) -> LinkError {
    match fault {
        Fault::Restarted => LinkError::RobotRestarted { why: None },
        fault => LinkError::Fault { fault },
    }
}

fn message<L: Line>(session: &mut Session<L>, robot: Address) -> Result<Option<FromRobot>, LinkError> {
    Ok(listen(session, robot)?.filter(|heard| heard.from == robot).map(|heard| heard.message))
}

/// Polls, and notices a robot that has gone silent.
fn listen<L: Line>(session: &mut Session<L>, robot: Address) -> Result<Option<Heard>, LinkError> {
    let heard = session.poll()?;
    let last = session.station(&robot).map_or(Duration::ZERO, |station| station.heard);
    let silent = session.now().saturating_sub(last);
    if silent > ROBOT_SILENT {
        return Err(LinkError::RobotSilent { silent });
    }
    Ok(heard)
}
