//! What the console itself can tell: parameters, robots, commands.

use control::parameters::table;

use super::command;
use super::engine::Engine;
use super::model::Level;
use link::{Line, RobotId};

impl<L: Line> Engine<L> {
    pub(super) fn say_parameters(&mut self, part: &str) {
        let mut any = false;
        for entry in table::TABLE.iter().filter(|entry| entry.name.contains(part)) {
            any = true;
            let text = format!("{}  {} to {} {}", entry.name, entry.low, entry.high, entry.unit);
            self.model.say(None, text.trim_end());
        }
        if !any {
            self.model.log(None, Level::Warning, format!("no parameter has `{part}` in its name"));
        }
    }

    pub(super) fn say_status(&mut self, robot: usize) {
        if robot < self.model.robots.len() {
            for line in link::robot(self.session.robot(RobotId(robot)), self.session.now()) {
                self.model.say(Some(robot), line);
            }
        }
    }

    pub(super) fn say_robots(&mut self) {
        for index in 0..self.model.robots.len() {
            let robot = &self.model.robots[index];
            let state = match (robot.present, robot.state) {
                (false, _) => "not heard",
                (true, Some(state)) => link::state(state),
                (true, None) => "here",
            };
            let text = format!("{} at {}, {state}", index + 1, link::address(&robot.address));
            self.model.say(Some(index), text);
        }
    }

    pub(super) fn say_help(&mut self) {
        for (form, what) in command::HELP {
            self.model.say(None, format!("{form:<20} {what}"));
        }
    }

    /// A robot by its number from 1, its name or its address.
    pub(super) fn find(&self, which: &str) -> Result<usize, String> {
        let robots = &self.model.robots;
        let number = which.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        number
            .filter(|index| *index < robots.len())
            .or_else(|| robots.iter().position(|robot| robot.name == which))
            .or_else(|| robots.iter().position(|robot| link::address(&robot.address) == which.to_lowercase()))
            .ok_or_else(|| format!("there is no robot `{which}`; `list` lists them"))
    }
}
