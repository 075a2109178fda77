//! The console without a screen: a session with the robots, what was typed and what became of it, the recording.
//!
//! Everything happens in [`Engine::poll`], which whoever shows the [`Model`] calls repeatedly. The heartbeats that keep
//! a robot going are sent there and nowhere else: a console that hangs, is stopped or killed sends none.

use std::path::Path;
use std::time::Duration;

use control::{Fault, Sensor};

use super::command::{self, ConsoleCommand};
use super::complete::{Completion, complete};
use super::context::Context;
use super::model::{Level, Model, RobotModel};
use super::policy::{Choice, PATIENCE, PolicyDrive};
use super::poses::{News, Poses};
use super::program::{Later, Program};
use super::reports;
use super::requests::{CommandOutcome, Requests, Undone};
use super::session_log::SessionLog;
use link::{Event, Heard, Line, LinkError, Outcome, RobotId, Session};
use recording::{RecordingError, SessionEvent};

/// A robot says within this time that it has stopped.
const STOPPING: Duration = Duration::from_secs(1);
/// Interval at which link quality and file size are updated.
const REFRESH: Duration = Duration::from_millis(200);

/// Console without a screen: session, programs, recording and the model that a screen shows.
pub struct Engine<L: Line> {
    session: Session<L>,
    model: Model,
    session_log: Option<SessionLog>,
    requests: Requests,
    program: Option<Program>,
    poses: Option<Poses>,
    /// Of each robot that a policy drives.
    policies: Vec<PolicyDrive>,
    quit: bool,
    /// When link and file sizes are looked at again.
    refresh_due: Duration,
}

impl<L: Line> Engine<L> {
    /// A console on a session; `port` is for people.
    pub fn new(session: Session<L>, port: impl Into<String>) -> Self {
        let robots = session.robots().map(|(_, robot)| RobotModel {
            name: robot.name().to_owned(),
            address: robot.address(),
            ..RobotModel::default()
        });
        let mut model = Model {
            robots: robots.collect(),
            dongle: Some((session.address(), session.channel())),
            port: port.into(),
            now: session.now(),
            ..Model::default()
        };
        number_twins(&mut model.robots);
        Self {
            session,
            model,
            session_log: None,
            requests: Requests::default(),
            program: None,
            poses: None,
            policies: Vec::new(),
            quit: false,
            refresh_due: Duration::ZERO,
        }
    }

    /// Hears the robots' poses from now on, which policies drive by.
    pub fn hear_poses(&mut self, poses: Poses) {
        self.poses = Some(poses);
    }

    /// Records everything from now on into a new file of a directory.
    ///
    /// # Errors
    /// The file cannot be made.
    pub fn record(&mut self, directory: &Path, tick_s: f64) -> Result<(), RecordingError> {
        let names: Vec<String> = self.model.robots.iter().map(|robot| robot.name.clone()).collect();
        let session_log = SessionLog::begin(directory, &names, tick_s, self.poses.is_some(), self.session.now())?;
        self.model.recording = Some(session_log.model());
        self.session_log = Some(session_log);
        Ok(())
    }

    /// What there is to show.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// `quit` was typed.
    pub fn wants_to_quit(&self) -> bool {
        self.quit
    }

    /// Nothing is on its way and nothing waits to be done.
    pub fn is_idle(&self) -> bool {
        self.is_settled() && self.program.is_none()
    }

    /// Everything that was sent has come to its end.
    fn is_settled(&self) -> bool {
        self.requests.is_settled() && !self.session.robots().any(|(_, robot)| robot.is_stopping())
    }

    /// Reads for some milliseconds, sends what is due, goes on with a script; whether something happened.
    ///
    /// # Errors
    /// The line to the dongle broke, or the dongle is silent.
    pub fn poll(&mut self) -> Result<bool, LinkError> {
        let heard = self.session.poll()?;
        self.model.now = self.session.now();
        let happened = heard.is_some();
        if let Some(heard) = heard {
            self.take(heard);
        }
        self.show();
        if self.model.now >= self.refresh_due {
            self.refresh_due = self.model.now + REFRESH;
            self.refresh();
        }
        self.receive_poses();
        self.go_on();
        self.choose();
        Ok(happened)
    }

    /// Does what was typed, for the selected robot. A line that drives ends a script that runs.
    ///
    /// # Errors
    /// What is wrong with it; nothing was done then.
    pub fn submit(&mut self, line: &str) -> Result<(), String> {
        let commands = command::parse(line)?;
        let robot = self.model.selected;
        match commands.as_slice() {
            [] => Ok(()),
            [ConsoleCommand::Script(path)] => self.run_script(path),
            [only] if !matches!(only, ConsoleCommand::Drive(_) | ConsoleCommand::Wait(_)) && !only.drives() => {
                self.execute(only, line.trim(), robot)
            }
            _ => {
                let texts = line.split(';').map(str::trim).filter(|text| !text.is_empty()).map(str::to_owned);
                let typed = Program::typed(commands.into_iter().zip(texts), robot, self.session.now());
                self.end_program("replaced by what was typed");
                self.program = Some(typed);
                self.go_on();
                Ok(())
            }
        }
    }

    /// What became of something, in the order in which it ended.
    pub fn next_reply(&mut self) -> Option<CommandOutcome> {
        self.requests.next_reply()
    }

    /// Takes the last `set` of the selected robot back.
    ///
    /// # Errors
    /// There is none.
    pub fn undo(&mut self) -> Result<(), String> {
        let selected = self.model.selected;
        let (requests, mut context) = self.requests();
        requests.take_back(&mut context, selected)
    }

    /// Runs a file of commands, for the selected robot: another one that is looked at meanwhile is not meant.
    ///
    /// # Errors
    /// It cannot be read, or a line of it is wrong: nothing was done then.
    pub fn run_script(&mut self, path: &Path) -> Result<(), String> {
        let program = Program::load(path, self.model.selected, self.session.now())?;
        self.end_program("replaced by another");
        self.program = Some(program);
        Ok(())
    }

    /// What could be meant at a place of a line.
    pub fn complete(&self, line: &str, cursor: usize) -> Completion {
        complete(line, cursor, self.model.robots.iter().map(|robot| robot.name.as_str()))
    }

    /// Stops every robot, before everything else, and ends a script.
    pub fn stop_all(&mut self) {
        self.stop_robots(None);
        self.end_program("stopped");
    }

    /// Stops one robot, or every one.
    fn stop_robots(&mut self, only: Option<usize>) {
        // First the radio, then everything else. If the line breaks, `poll` says so.
        for index in 0..self.model.robots.len() {
            if only.is_none_or(|robot| robot == index) {
                let _ = self.session.stop(RobotId(index));
                self.model.robots[index].target = None;
                self.record_event(Some(index), &SessionEvent::Stop);
                self.end_policy(index);
            }
        }
        self.model.log(only, Level::Warning, if only.is_none() { "STOP all" } else { "STOP" });
    }

    /// Picks the robot that commands are for.
    pub fn select(&mut self, index: usize) {
        if index < self.model.robots.len() {
            self.model.selected = index;
        }
    }

    /// Stops every robot, whether it seems to drive or not, waits until each says so, and ends the recording.
    pub fn finish(&mut self) {
        self.policies.clear();
        self.end_program("the console ends");
        let start = self.session.now();
        let _ = self.session.stop_all();
        for index in 0..self.model.robots.len() {
            if self.model.robots[index].present {
                self.record_event(Some(index), &SessionEvent::Stop);
            }
        }
        while !self.is_settled() && self.session.now().saturating_sub(start) < STOPPING {
            match self.poll() {
                // A dongle may find its voice again.
                Ok(_) | Err(LinkError::DongleSilent { .. }) => {}
                Err(_) => break,
            }
        }
        if let Some(session_log) = &mut self.session_log {
            session_log.finish();
            self.model.recording = Some(session_log.model());
        }
    }

    /// Does a command for a robot.
    fn execute(&mut self, command: &ConsoleCommand, text: &str, robot: usize) -> Result<(), String> {
        match command {
            ConsoleCommand::Policy(file) => self.begin_policy(file, robot)?,
            ConsoleCommand::Stop => {
                // The motors of a script that runs and of policies are meant, too, whichever robot is looked at.
                for other in 0..self.model.robots.len() {
                    let by_policy = self.policies.iter().any(|policy| policy.robot == other);
                    if other == robot || by_policy || self.has_program(other) {
                        self.stop_robots(Some(other));
                    }
                }
                self.end_program("stopped");
            }
            ConsoleCommand::StopAll => self.stop_all(),
            ConsoleCommand::Parameters(part) => reports::parameters(&mut self.model, part),
            ConsoleCommand::Status => reports::status(&mut self.model, &self.session, robot),
            ConsoleCommand::List => reports::robots(&mut self.model),
            ConsoleCommand::Robot(which) => {
                let index = reports::find(&self.model, which)?;
                self.select(index);
            }
            ConsoleCommand::Script(path) => self.run_script(path)?,
            ConsoleCommand::Note(text) => {
                self.note(None, Level::Note, text.clone());
            }
            ConsoleCommand::Help => reports::help(&mut self.model),
            ConsoleCommand::Quit => {
                self.quit = true;
                self.end_program("quit");
            }
            // Only in programs.
            ConsoleCommand::Wait(_) => {}
            command => {
                let (requests, mut context) = self.requests();
                requests.give(&mut context, command, text, robot)?;
                if command.drives() && self.end_policy(robot) {
                    // What takes its place is done, or the robot is stopped: nobody steers what it does now.
                    self.requests.must_be_done(RobotId(robot));
                }
            }
        }
        Ok(())
    }

    fn take(&mut self, heard: Heard) {
        let Heard { robot, at, event } = heard;
        let index = robot.0;
        match event {
            Event::Present => {
                if let Some(session_log) = &mut self.session_log {
                    session_log.renew(index);
                }
                self.record_event(Some(index), &SessionEvent::LinkRegained);
                self.model.log(Some(index), Level::Good, "is here");
            }
            Event::Lost => {
                self.record_event(Some(index), &SessionEvent::LinkLost);
                self.model.robots[index].target = None;
                let text = "is not heard any more: it stops by itself within half a second";
                self.model.log(Some(index), Level::Bad, text);
                self.end_policy(index);
                self.end_program("a robot is not heard any more");
            }
            Event::Telemetry(batch) => {
                self.note_fault(index, batch.fault);
                self.note_failed_sensor(index, batch.failed_sensor);
                let missing =
                    self.session_log.as_mut().map_or(0, |session_log| session_log.telemetry(index, &batch, at));
                let robot = &mut self.model.robots[index];
                robot.state = Some(batch.state);
                robot.fault = batch.fault;
                robot.tracking = batch.tracking;
                robot.battery_v = (batch.battery_mv > 0).then(|| f64::from(batch.battery_mv) / 1e3);
                robot.ticks.0 += batch.rows.len() as u64;
                robot.ticks.1 += missing;
                robot.series.take(&batch, at.as_secs_f64());
            }
            Event::Status(status) => self.model.robots[index].counters = Some(status.counters),
            Event::Answered { number, request, tick, outcome } => {
                let tick = tick.and_then(|period| self.session_log.as_ref()?.tick_of(index, period));
                let (requests, mut context) = self.requests();
                let undone = requests.answered(&mut context, robot, number, request, tick, outcome);
                if let Some(undone) = undone {
                    self.undone(robot.0, undone, outcome);
                }
            }
            Event::Stopped => self.model.log(Some(index), Level::Good, "has stopped"),
            Event::OtherVersion(version) => {
                self.model.robots[index].other_version = Some(version);
                let text =
                    format!("speaks version {version:08x} of the protocol: flash it from this state of the project");
                self.model.log(Some(index), Level::Bad, text);
            }
        }
    }

    /// Something that a robot was given was not done.
    fn undone(&mut self, robot: usize, undone: Undone, outcome: Outcome) {
        match undone {
            Undone::Typed | Undone::InsteadOfPolicy => self.end_program("a command of it was not done"),
            Undone::OfPolicy if self.has_program(robot) => self.end_program("a policy's choice was not done"),
            Undone::OfPolicy => {}
        }
        if outcome.stops() {
            // The session has told it to stop.
            self.end_policy(robot);
        } else if undone != Undone::Typed {
            self.stop_robots(Some(robot));
        }
    }

    /// Once, and in the recording: the robot goes on, but has a blind arc again.
    fn note_failed_sensor(&mut self, index: usize, failed: Option<Sensor>) {
        let robot = &mut self.model.robots[index];
        if std::mem::replace(&mut robot.failed_sensor, failed) == failed {
            return;
        }
        let Some(failed) = failed else { return };
        let (broken, other) = match failed {
            Sensor::First => ("first", "second"),
            Sensor::Second => ("second", "first"),
        };
        let text =
            format!("its {broken} angle sensor has failed: it goes on with the {other} one until it is restarted");
        self.note(Some(index), Level::Warning, text);
    }

    fn note_fault(&mut self, index: usize, fault: Option<Fault>) {
        if self.model.robots[index].fault == fault {
            return;
        }
        if let Some(fault) = fault {
            self.record_event(Some(index), &SessionEvent::Fault { fault });
            self.model.robots[index].target = None;
            let (what, advice) = link::fault(fault);
            self.model.log(Some(index), Level::Bad, format!("FAULT: {what}"));
            self.model.log(Some(index), Level::Note, advice);
            self.end_policy(index);
            if fault != Fault::Restarted {
                self.end_program("a robot stopped itself");
            }
        }
    }

    /// Brings what comes from the session up to date.
    fn show(&mut self) {
        let now = self.model.now;
        for (id, robot) in self.session.robots() {
            let shown = &mut self.model.robots[id.0];
            shown.present = robot.is_present();
            shown.stopping = robot.is_stopping();
            shown.uptime = robot.uptime();
            shown.other_version = robot.other_version();
        }
        let Some(session_log) = &mut self.session_log else { return };
        let session = &self.session;
        session_log.write_due(now, |index| session.robot(RobotId(index)).quality(now));
        if let (Some(why), Some(shown)) = (session_log.failure(), &self.model.recording)
            && shown.failed.is_none()
        {
            let text = format!("nothing is recorded any more: {why}");
            self.model.recording = Some(session_log.model());
            self.model.log(None, Level::Bad, text);
        }
    }

    /// What costs a little: some times a second is enough.
    fn refresh(&mut self) {
        let now = self.model.now;
        for (id, robot) in self.session.robots() {
            let quality = robot.quality(now);
            let shown = &mut self.model.robots[id.0];
            shown.quality = quality;
            let t_s = now.as_secs_f64();
            if let Some(loss) = quality.loss {
                shown.series.loss.push(t_s, loss);
            }
            if let Some(trip) = quality.round_trip {
                shown.series.round_trip.push(t_s, trip.as_secs_f64() * 1e3);
            }
        }
        if let Some(session_log) = &self.session_log {
            self.model.recording = Some(session_log.model());
        }
    }

    /// The commands, and what they act on.
    fn requests(&mut self) -> (&mut Requests, Context<'_, L>) {
        let Self { session, model, session_log, requests, .. } = self;
        (requests, Context { session, model, session_log: session_log.as_mut() })
    }

    fn record_event(&mut self, robot: Option<usize>, event: &SessionEvent) {
        self.requests().1.record_event(robot, event);
    }

    /// Goes on with a program as far as it can.
    fn go_on(&mut self) {
        while self.is_settled()
            && let Some(program) = &mut self.program
        {
            let command = match program.next(self.session.now()) {
                Some(Ok(command)) => command,
                Some(Err(Later)) => break,
                None => {
                    self.program = None;
                    break;
                }
            };
            let (robot, text) = (program.robot, program.text());
            if let Err(problem) = self.step(&command, &text, robot) {
                self.model.log(Some(robot), Level::Bad, format!("{text}: {problem}"));
                self.requests.reply(CommandOutcome { robot, text, outcome: Err(problem), parameter: None });
                self.end_program("a command of it cannot be done");
            }
        }
        self.model.script = self.program.as_ref().and_then(Program::place);
    }

    /// A command of a program: what it stops and picks is its own.
    fn step(&mut self, command: &ConsoleCommand, text: &str, robot: usize) -> Result<(), String> {
        match command {
            ConsoleCommand::Stop => self.stop_robots(Some(robot)),
            ConsoleCommand::StopAll => self.stop_robots(None),
            ConsoleCommand::Robot(which) => {
                let index = reports::find(&self.model, which)?;
                if let Some(program) = &mut self.program {
                    program.robot = index;
                    if program.is_typed() {
                        self.select(index);
                    }
                }
            }
            command => self.execute(command, text, robot)?,
        }
        Ok(())
    }

    /// Lets a policy drive a robot, in place of what drives it now.
    fn begin_policy(&mut self, file: &str, robot: usize) -> Result<(), String> {
        if self.poses.is_none() {
            return Err("it drives by the robot's poses, and the console hears none: begin it with --poses".into());
        }
        let policy = PolicyDrive::load(file, robot)?;
        self.end_policy(robot);
        self.note(Some(robot), Level::Note, format!("policy {file} drives, learned by {}", policy.learned_by));
        self.policies.push(policy);
        Ok(())
    }

    /// Says something, of one robot or of all, and records it.
    fn note(&mut self, robot: Option<usize>, level: Level, text: String) {
        self.record_event(robot, &SessionEvent::Note { text: text.clone() });
        self.model.log(robot, level, text);
    }

    /// Takes the poses that have come.
    fn receive_poses(&mut self) {
        let Some(poses) = &mut self.poses else { return };
        let (now, model) = (self.model.now, &mut self.model);
        let news = poses.receive(now, model.robots.len(), &|name| reports::find(model, name));
        for news in news {
            match (news, &mut self.session_log) {
                (News::Pose(robot, pose), Some(session_log)) => session_log.pose(robot, pose),
                (News::Pose(..), None) => {}
                (News::Wrong(problem), _) => model.log(None, Level::Bad, problem),
            }
        }
    }

    /// Lets the policies choose, each once what it chose before has come to its end.
    fn choose(&mut self) {
        for index in 0..self.policies.len() {
            let policy = &mut self.policies[index];
            let (robot, settled) = (policy.robot, !self.requests.is_pending(RobotId(policy.robot)));
            let last = self.poses.as_ref().and_then(|poses| poses.last(robot));
            match policy.choose(self.model.now, last, settled) {
                Choice::Same => {}
                Choice::New(step) => {
                    let name = policy.name.clone();
                    let (requests, mut context) = self.requests();
                    requests.choose(&mut context, robot, step.into(), &name);
                }
                Choice::NoPose => {
                    let name = policy.name.clone();
                    // The others choose when this is called again.
                    return self.lost_pose(robot, &name);
                }
            }
        }
    }

    /// Stops a robot whose poses stay away.
    fn lost_pose(&mut self, robot: usize, policy: &str) {
        let text = format!("policy {policy}");
        let problem = format!("no pose of the robot has come for {} s: it is told to stop", PATIENCE.as_secs_f64());
        self.note(Some(robot), Level::Bad, format!("{text}: {problem}"));
        self.requests.reply(CommandOutcome { robot, text, outcome: Err(problem), parameter: None });
        self.stop_robots(Some(robot));
        if self.has_program(robot) {
            self.end_program("the robot's poses stay away");
        }
    }

    /// The policy that drives a robot drives it no more; whether there was one.
    fn end_policy(&mut self, robot: usize) -> bool {
        let before = self.policies.len();
        self.policies.retain(|policy| policy.robot != robot);
        self.policies.len() < before
    }

    /// Whether what was typed, or a script, is not at its end and is for this robot.
    fn has_program(&self, robot: usize) -> bool {
        self.program.as_ref().is_some_and(|program| program.robot == robot)
    }

    fn end_program(&mut self, why: &str) {
        if let Some(program) = self.program.take()
            && let Some((path, line)) = program.place()
        {
            self.model.log(None, Level::Warning, format!("{}: ended before line {line}: {why}", path.display()));
        }
        self.model.script = None;
    }
}

/// Robots of one name get a number behind it.
fn number_twins(robots: &mut [RobotModel]) {
    for index in 1..robots.len() {
        let base = robots[index].name.clone();
        let mut number = 1;
        while robots[..index].iter().any(|other| other.name == robots[index].name) {
            number += 1;
            robots[index].name = format!("{base}-{number}");
        }
    }
}
