//! Orders that a robot answers, what became of them, and taking a `set` back.

use control::Command as Control;
use control::parameters::table;
use control::protocol::radio::{Value, What};

use super::command::Command;
use super::diary;
use super::engine::Engine;
use super::model::Level;
use crate::link::{self, Line, Outcome, RobotId};
use crate::recording::SessionEvent;

/// Values that `undo` can bring back.
const UNDOS: usize = 100;
/// Replies that wait for whoever reads them. A screen does not.
const REPLIES: usize = 1000;

/// What became of something that was typed, for a program that reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct Reply {
    /// Which robot.
    pub robot: usize,
    /// As it was typed.
    pub text: String,
    /// What became of it; or why it was not even sent.
    pub outcome: Result<Outcome, String>,
    /// The parameter, where there is one.
    pub parameter: Option<u16>,
}

/// What a `set` replaced.
pub(super) struct Undo {
    robot: RobotId,
    index: u16,
    before: f32,
}

/// An order on its way.
pub(super) struct Pending {
    robot: RobotId,
    number: u16,
    text: String,
    why: Why,
}

#[derive(Clone, Copy, PartialEq)]
enum Why {
    /// A person wants to know.
    Asked,
    /// A `set` wants to know what was there before.
    Before(u16),
    /// It is the `set`, and what it replaces, once that is known.
    Set(u16, Option<f32>),
    /// It takes a `set` back, to this.
    Undo(u16, f32),
}

impl<L: Line> Engine<L> {
    /// What became of something, in the order in which it ended.
    pub fn next_reply(&mut self) -> Option<Reply> {
        self.replies.pop_front()
    }

    /// Takes the last `set` of the selected robot back.
    ///
    /// # Errors
    /// There is none.
    pub fn undo(&mut self) -> Result<(), String> {
        self.take_back(self.model.selected)
    }

    /// Gives an order to a robot.
    pub(super) fn give(&mut self, command: &Command, text: &str, robot: usize) -> Result<(), String> {
        let text = text.to_owned();
        match command {
            Command::Drive(order) => {
                self.order(robot, What::Command(order.command()), order.to_string(), Why::Asked);
            }
            Command::Get(index) => self.order(robot, What::Get(*index), text, Why::Asked),
            Command::Set(index, value) => {
                self.order(robot, What::Get(*index), String::new(), Why::Before(*index));
                let set = What::Set { index: *index, value: *value };
                self.order(robot, set, text, Why::Set(*index, None));
            }
            Command::Save => self.order(robot, What::Save, text, Why::Asked),
            Command::Factory => self.order(robot, What::Factory, text, Why::Asked),
            Command::Undo => self.take_back(robot)?,
            // Everything else is the console's own.
            _ => {}
        }
        Ok(())
    }

    fn take_back(&mut self, robot: usize) -> Result<(), String> {
        let last = self.undos.iter().rposition(|undo| undo.robot == RobotId(robot));
        let Undo { index, before, .. } =
            last.map(|at| self.undos.remove(at)).ok_or("there is no `set` to take back")?;
        let text = format!("set {} {before}", table::TABLE[usize::from(index)].name);
        self.order(robot, What::Set { index, value: before }, text, Why::Undo(index, before));
        Ok(())
    }

    fn order(&mut self, robot: usize, what: What, text: String, why: Why) {
        if robot >= self.model.robots.len() {
            return;
        }
        let command = if let What::Command(command) = what { Some(command) } else { None };
        if !matches!(why, Why::Before(_)) {
            self.record_event(Some(robot), &SessionEvent::Order { text: text.clone(), command, repeat: false });
        }
        let robot = RobotId(robot);
        let number = self.session.order(robot, what);
        self.pending.push(Pending { robot, number, text, why });
    }

    pub(super) fn answered(&mut self, robot: RobotId, number: u16, what: What, tick: Option<u32>, outcome: Outcome) {
        let Some(at) = self.pending.iter().position(|order| order.robot == robot && order.number == number) else {
            return;
        };
        let Pending { text, why, .. } = self.pending.remove(at);
        let value = if let Outcome::Done(value) = outcome { value } else { None };
        self.keep_undo(robot, why, value);
        if matches!(why, Why::Before(_)) {
            return;
        }
        let tick = tick.and_then(|period| self.diary.as_ref()?.tick_of(robot.0, period));
        self.record_event(Some(robot.0), &diary::answer(what, tick, outcome));
        self.tell(robot.0, &text, what, outcome, value);
        self.follow(robot.0, what, outcome, &text);
        if !matches!(outcome, Outcome::Done(_)) {
            self.end_program("a command of it was not done");
        }
        let parameter = match what {
            What::Get(index) | What::Set { index, .. } => Some(index),
            _ => None,
        };
        self.reply(Reply { robot: robot.0, text, outcome: Ok(outcome), parameter });
    }

    /// What the robot does now: an order that it did not do leaves it at what it did before.
    fn follow(&mut self, robot: usize, what: What, outcome: Outcome, text: &str) {
        let Some(shown) = self.model.robots.get_mut(robot) else { return };
        match (what, outcome) {
            // In any state but `FAULT`, where there is no target, it changes nothing.
            (What::Command(Control::ClearFault), _) => {}
            (What::Command(command), Outcome::Done(_)) => {
                shown.target = command.event().drives().then(|| text.to_owned());
            }
            // The session stops it, or did before.
            (_, Outcome::Unanswered | Outcome::Overtaken | Outcome::Absent) => shown.target = None,
            (_, Outcome::Done(_) | Outcome::Refused(_) | Outcome::TooLate) => {}
        }
    }

    fn keep_undo(&mut self, robot: RobotId, why: Why, value: Option<Value>) {
        let back = match (why, value) {
            (Why::Before(index), Some(value)) => {
                let of_this = |order: &&mut Pending| order.robot == robot && order.why == Why::Set(index, None);
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

    pub(super) fn reply(&mut self, reply: Reply) {
        if self.replies.len() == REPLIES {
            self.replies.pop_front();
        }
        self.replies.push_back(reply);
    }

    fn tell(&mut self, robot: usize, text: &str, what: What, outcome: Outcome, value: Option<Value>) {
        let level = if matches!(outcome, Outcome::Done(_)) { Level::Good } else { Level::Bad };
        let line = match (what, value) {
            (What::Get(index) | What::Set { index, .. }, Some(value)) => parameter_line(index, value),
            (What::Command(Control::ClearFault), _) if level == Level::Good => "fault cleared".into(),
            _ => format!("{text}: {}", link::outcome(outcome)),
        };
        self.model.log(Some(robot), level, line);
    }
}

/// A parameter's value, in words.
#[must_use]
pub fn parameter_line(index: u16, value: Value) -> String {
    let entry = &table::TABLE[usize::from(index)];
    let Value { now, factory } = value;
    let built_in = if now.to_bits() == factory.to_bits() { String::new() } else { format!(" (built in: {factory})") };
    format!("{} = {now} {}{built_in}", entry.name, entry.unit)
}
