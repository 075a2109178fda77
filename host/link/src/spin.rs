//! One run at constant duty, from a robot at rest to a robot at rest.

use std::time::Duration;

use control::protocol::radio::Request;
use control::{Command, Fault, State};

use super::{Event, Heard, Line, LinkError, Outcome, Recorder, RobotId, Session, words};

/// Silence after which the robot is gone: it sends a hundred batches a second.
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
    robot: RobotId,
    duty: f32,
    ticks: u64,
    on_tick: &mut dyn FnMut(u64) -> bool,
) -> Spin {
    let mut recorder = Recorder::default();
    let mut end =
        clear_fault(session, robot, on_tick).and_then(|()| drive(session, robot, duty, ticks, &mut recorder, on_tick));
    let stopped = session.stop_and_wait(robot, EFFECT, |heard| {
        // The shaft running out belongs to the recording; what comes after a restart does not.
        if end.is_ok()
            && heard.robot == robot
            && let Event::Telemetry(batch) = &heard.event
        {
            let _ = recorder.take(batch, heard.at);
        }
    });
    if let Err(LinkError::RobotRestarted { why }) = &mut end {
        *why = session.robot(robot).status().map(|status| words::reset(status.reset));
    }
    Spin { recorder, end, stopped }
}

impl<L: Line> Session<L> {
    /// Ends whatever a robot does and waits until it says so: false if it has not after `patience`. Its own limit on the
    /// age of heartbeats stops it then.
    pub fn stop_and_wait(&mut self, robot: RobotId, patience: Duration, mut heard: impl FnMut(&Heard)) -> bool {
        let start = self.now();
        let mut told = self.stop(robot);
        while told.is_ok() && self.now().saturating_sub(start) < patience {
            match self.poll() {
                Ok(Some(message)) => {
                    heard(&message);
                    if message.robot == robot && message.event == Event::Stopped {
                        return true;
                    }
                }
                // A dongle may find its voice again, and a robot that has restarted may come back.
                Ok(None) | Err(LinkError::DongleSilent { .. }) => {}
                Err(error) => told = Err(error),
            }
            let at_rest = self.robot(robot).telemetry().is_some_and(|batch| !batch.state.is_driving());
            if self.robot(robot).is_present() && !self.robot(robot).is_stopping() && at_rest {
                return true;
            }
        }
        false
    }
}

fn clear_fault<L: Line>(
    session: &mut Session<L>,
    robot: RobotId,
    on_tick: &mut dyn FnMut(u64) -> bool,
) -> Result<(), LinkError> {
    let start = session.now();
    let mut cleared = false;
    while on_tick(0) {
        match session.robot(robot).telemetry() {
            Some(batch) if batch.state != State::Fault => return Ok(()),
            Some(_) if !cleared => match session.ask(robot, Request::Command(Command::ClearFault), |_| {})? {
                Outcome::Done(_) => cleared = true,
                outcome => return Err(not_done(session, robot, outcome)),
            },
            // What comes now was told before.
            _ => drop(listen(session, robot)?),
        }
        if session.now().saturating_sub(start) > EFFECT {
            return Err(LinkError::NotDriving { what: "tells nothing" });
        }
    }
    Err(LinkError::Cancelled)
}

fn not_done<L: Line>(session: &Session<L>, robot: RobotId, outcome: Outcome) -> LinkError {
    match outcome {
        Outcome::Refused(control::Refusal::Faulted(fault)) => stopped_by(fault),
        Outcome::Refused(refusal) => LinkError::Refused { refusal },
        _ => {
            let last = session.robot(robot).heard().unwrap_or_default();
            LinkError::RobotSilent { silent: session.now().saturating_sub(last) }
        }
    }
}

fn drive<L: Line>(
    session: &mut Session<L>,
    robot: RobotId,
    duty: f32,
    ticks: u64,
    recorder: &mut Recorder,
    on_tick: &mut dyn FnMut(u64) -> bool,
) -> Result<(), LinkError> {
    let asked = session.request(robot, Request::Command(Command::Duty { duty }));
    let start = session.now();
    while on_tick(recorder.driven()) {
        if recorder.driven() == 0 && session.now().saturating_sub(start) > EFFECT {
            return Err(LinkError::NotDriving { what: "does not switch on" });
        }
        let Some(Heard { robot: from, at, event }) = listen(session, robot)? else { continue };
        if from != robot {
            continue;
        }
        match event {
            Event::Answered { number, outcome, .. } if number == asked && !matches!(outcome, Outcome::Done(_)) => {
                return Err(not_done(session, robot, outcome));
            }
            Event::Telemetry(batch) => {
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
            _ => {}
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

/// Polls, and notices a robot that has gone silent.
fn listen<L: Line>(session: &mut Session<L>, robot: RobotId) -> Result<Option<Heard>, LinkError> {
    let heard = session.poll()?;
    let last = session.robot(robot).heard().unwrap_or_default();
    let silent = session.now().saturating_sub(last);
    if silent > ROBOT_SILENT {
        return Err(LinkError::RobotSilent { silent });
    }
    Ok(heard)
}
