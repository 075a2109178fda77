//! Commands that a robot answers, what became of them, and taking a `set` back.

use std::collections::VecDeque;

use control::Command;
use control::parameters::table;
use control::protocol::radio::{Request, Value};

use super::command::ConsoleCommand;
use super::context::Context;
use super::model::{Level, Model};
use super::session_log;
use link::{Line, Outcome, RobotId};
use recording::SessionEvent;
use robot_file::gait::GaitFile;
use simulation::DriveCommand;

/// Values that `undo` can bring back.
const UNDOS: usize = 100;
/// Replies that wait for whoever reads them. A screen does not.
const REPLIES: usize = 1000;

/// What became of something that was typed, for a program that reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandOutcome {
    /// Index of the robot in the console's list.
    pub robot: usize,
    /// As it was typed.
    pub text: String,
    /// What became of it; or why it was not even sent.
    pub outcome: Result<Outcome, String>,
    /// The parameter, where there is one.
    pub parameter: Option<u16>,
}

/// What a `set` replaced.
struct Undo {
    robot: RobotId,
    index: u16,
    before: f32,
}

/// Command that was sent and is not answered yet.
struct PendingCommand {
    robot: RobotId,
    number: u16,
    text: String,
    why: Why,
}

#[derive(Clone, Copy, PartialEq)]
enum Why {
    /// A person wants to know.
    Asked,
    /// A policy chose it: only what is not done is worth a word.
    Policy,
    /// A person wants it in place of a policy, which drives no more.
    InsteadOfPolicy,
    /// A `set` wants to know what was there before.
    Before(u16),
    /// It is the `set`, and what it replaces, once that is known.
    Set(u16, Option<f32>),
    /// It takes a `set` back, to this.
    Undo(u16, f32),
}

/// Whose command it was that was not done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Undone {
    /// A person's, or a script's.
    Typed,
    /// The same, in place of a policy.
    InsteadOfPolicy,
    /// A policy's choice.
    OfPolicy,
}

/// The commands on their way, what a `set` replaced, and the replies that nobody has read yet.
#[derive(Default)]
pub(super) struct Requests {
    pending: Vec<PendingCommand>,
    undos: Vec<Undo>,
    replies: VecDeque<CommandOutcome>,
}

impl Requests {
    /// What became of something, in the order in which it ended.
    pub fn next_reply(&mut self) -> Option<CommandOutcome> {
        self.replies.pop_front()
    }

    /// Every command that was typed has come to its end; policies go on choosing.
    pub fn is_settled(&self) -> bool {
        self.pending.iter().all(|request| request.why == Why::Policy)
    }

    /// Whether a robot has been sent something that has not come to its end.
    pub fn is_pending(&self, robot: RobotId) -> bool {
        self.pending.iter().any(|request| request.robot == robot)
    }

    /// What was asked of a robot takes the place of a policy.
    pub fn must_be_done(&mut self, robot: RobotId) {
        for request in self.pending.iter_mut().filter(|request| request.robot == robot && request.why == Why::Asked) {
            request.why = Why::InsteadOfPolicy;
        }
    }

    /// Gives a command to a robot.
    pub fn give<L: Line>(
        &mut self,
        context: &mut Context<'_, L>,
        command: &ConsoleCommand,
        text: &str,
        robot: usize,
    ) -> Result<(), String> {
        let text = text.to_owned();
        match command {
            ConsoleCommand::Drive(drive) => {
                self.request(context, robot, Request::Command(drive.to_control()), drive.to_string(), Why::Asked);
            }
            ConsoleCommand::Gait(name) => self.play(context, name, robot)?,
            ConsoleCommand::Get(index) => self.request(context, robot, Request::Get(*index), text, Why::Asked),
            ConsoleCommand::Set(index, value) => {
                self.request(context, robot, Request::Get(*index), String::new(), Why::Before(*index));
                let set = Request::Set { index: *index, value: *value };
                self.request(context, robot, set, text, Why::Set(*index, None));
            }
            ConsoleCommand::Save => self.request(context, robot, Request::Save, text, Why::Asked),
            ConsoleCommand::Factory => self.request(context, robot, Request::Factory, text, Why::Asked),
            ConsoleCommand::Undo => self.take_back(context, robot)?,
            // Everything else is the console's own.
            _ => {}
        }
        Ok(())
    }

    /// Gives a robot what a policy chose.
    pub fn choose<L: Line>(&mut self, context: &mut Context<'_, L>, robot: usize, command: DriveCommand, policy: &str) {
        let text = format!("{command} ({policy})");
        self.request(context, robot, Request::Command(command.to_control()), text, Why::Policy);
    }

    /// Plays a gait; sends it first, unless the robot says that it has it.
    fn play<L: Line>(&mut self, context: &mut Context<'_, L>, name: &str, robot: usize) -> Result<(), String> {
        let file = GaitFile::load(&GaitFile::path_of(name)).map_err(|error| error.to_string())?;
        let gait = *file.gait();
        let label = gait.label();
        if robot >= context.model.robots.len() {
            return Ok(());
        }
        let stored = context.session.robot(RobotId(robot)).status().and_then(|status| status.gait);
        if stored != Some(label) {
            let text = format!("keep gait {}", label.name);
            self.request(context, robot, Request::KeepGait(gait), text, Why::Asked);
        }
        // Where it was not kept, this is refused: another gait is never played.
        let play = Request::Command(Command::Gait { id: label.id });
        self.request(context, robot, play, format!("gait {}", label.name), Why::Asked);
        Ok(())
    }

    /// Takes the last `set` of a robot back.
    pub fn take_back<L: Line>(&mut self, context: &mut Context<'_, L>, robot: usize) -> Result<(), String> {
        let last = self.undos.iter().rposition(|undo| undo.robot == RobotId(robot));
        let Undo { index, before, .. } =
            last.map(|at| self.undos.remove(at)).ok_or("there is no `set` to take back")?;
        let text = format!("set {} {before}", table::TABLE[usize::from(index)].name);
        self.request(context, robot, Request::Set { index, value: before }, text, Why::Undo(index, before));
        Ok(())
    }

    fn request<L: Line>(
        &mut self,
        context: &mut Context<'_, L>,
        robot: usize,
        request: Request,
        text: String,
        why: Why,
    ) {
        if robot >= context.model.robots.len() {
            return;
        }
        let command = if let Request::Command(command) = request { Some(command) } else { None };
        let gait = if let Request::KeepGait(gait) = request { Some(Box::new(gait)) } else { None };
        if !matches!(why, Why::Before(_)) {
            let event = SessionEvent::Command { text: text.clone(), command, repeat: false, gait };
            context.record_event(Some(robot), &event);
        }
        let robot = RobotId(robot);
        let number = context.session.request(robot, request);
        self.pending.push(PendingCommand { robot, number, text, why });
    }

    /// Takes what became of a command, and the tick of the recording from which on it counts; whose it was if it was not done.
    pub fn answered<L: Line>(
        &mut self,
        context: &mut Context<'_, L>,
        robot: RobotId,
        number: u16,
        request: Request,
        tick: Option<u64>,
        outcome: Outcome,
    ) -> Option<Undone> {
        let at = self.pending.iter().position(|request| request.robot == robot && request.number == number)?;
        let PendingCommand { text, why, .. } = self.pending.remove(at);
        let value = if let Outcome::Done(value) = outcome { value } else { None };
        self.keep_undo(robot, why, value);
        if matches!(why, Why::Before(_)) {
            return None;
        }
        context.record_event(Some(robot.0), &session_log::answer(request, tick, outcome));
        follow(context.model, robot.0, request, outcome, &text);
        // A stop that overtakes a choice is the policy's end, and was said.
        if why == Why::Policy && matches!(outcome, Outcome::Done(_) | Outcome::Overtaken) {
            return None;
        }
        tell(context.model, robot.0, &text, request, outcome, value);
        let parameter = match request {
            Request::Get(index) | Request::Set { index, .. } => Some(index),
            _ => None,
        };
        self.reply(CommandOutcome { robot: robot.0, text, outcome: Ok(outcome), parameter });
        match (outcome, why) {
            (Outcome::Done(_), _) => None,
            (_, Why::Policy) => Some(Undone::OfPolicy),
            (_, Why::InsteadOfPolicy) => Some(Undone::InsteadOfPolicy),
            _ => Some(Undone::Typed),
        }
    }

    fn keep_undo(&mut self, robot: RobotId, why: Why, value: Option<Value>) {
        let back = match (why, value) {
            (Why::Before(index), Some(value)) => {
                let of_this =
                    |request: &&mut PendingCommand| request.robot == robot && request.why == Why::Set(index, None);
                if let Some(set) = self.pending.iter_mut().find(of_this) {
                    set.why = Why::Set(index, Some(value.now));
                }
                return;
            }
            (Why::Set(index, Some(before)), Some(_)) => Undo { robot, index, before },
            // It was not taken back: it can still be.
            (Why::Undo(index, before), None) => Undo { robot, index, before },
            _ => return,
        };
        if self.undos.len() == UNDOS {
            self.undos.remove(0);
        }
        self.undos.push(back);
    }

    /// Keeps a reply for whoever reads them.
    pub fn reply(&mut self, reply: CommandOutcome) {
        if self.replies.len() == REPLIES {
            self.replies.pop_front();
        }
        self.replies.push_back(reply);
    }
}

/// What the robot does now: a command that it did not do leaves it at what it did before.
fn follow(model: &mut Model, robot: usize, request: Request, outcome: Outcome, text: &str) {
    let Some(shown) = model.robots.get_mut(robot) else { return };
    match (request, outcome) {
        // In any state but `FAULT`, where there is no target, it changes nothing.
        (Request::Command(Command::ClearFault), _) => {}
        (Request::Command(command), Outcome::Done(_)) => {
            shown.target = command.event().drives().then(|| text.to_owned());
        }
        (_, outcome) if outcome.stops() => shown.target = None,
        _ => {}
    }
}

fn tell(model: &mut Model, robot: usize, text: &str, request: Request, outcome: Outcome, value: Option<Value>) {
    let level = if matches!(outcome, Outcome::Done(_)) { Level::Good } else { Level::Bad };
    let line = match (request, value) {
        (Request::Get(index) | Request::Set { index, .. }, Some(value)) => parameter_line(index, value),
        (Request::Command(Command::ClearFault), _) if level == Level::Good => "fault cleared".into(),
        _ => format!("{text}: {}", link::outcome(outcome)),
    };
    model.log(Some(robot), level, line);
}

/// A parameter's value, in words.
#[must_use]
pub fn parameter_line(index: u16, value: Value) -> String {
    let entry = &table::TABLE[usize::from(index)];
    let Value { now, factory } = value;
    let built_in = if now.to_bits() == factory.to_bits() { String::new() } else { format!(" (built in: {factory})") };
    format!("{} = {now} {}{built_in}", entry.name, entry.unit)
}
