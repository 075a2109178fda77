//! What the console itself can tell: parameters, robots, commands.

use control::parameters::table;

use super::command;
use super::model::{Level, Model};
use link::{Line, RobotId, Session};

/// Lists the parameters with a part in their names.
pub(super) fn parameters(model: &mut Model, part: &str) {
    let mut any = false;
    for entry in table::TABLE.iter().filter(|entry| entry.name.contains(part)) {
        any = true;
        let text = format!("{}  {} to {} {}", entry.name, entry.low, entry.high, entry.unit);
        model.say(None, text.trim_end());
    }
    if !any {
        model.log(None, Level::Warning, format!("no parameter has `{part}` in its name"));
    }
}

/// What a robot tells about itself.
pub(super) fn status<L: Line>(model: &mut Model, session: &Session<L>, robot: usize) {
    if robot < model.robots.len() {
        for line in link::robot(session.robot(RobotId(robot)), session.now()) {
            model.say(Some(robot), line);
        }
    }
}

/// Lists the robots.
pub(super) fn robots(model: &mut Model) {
    for index in 0..model.robots.len() {
        let robot = &model.robots[index];
        let state = match (robot.present, robot.state) {
            (false, _) => "not heard",
            (true, Some(state)) => link::state(state),
            (true, None) => "here",
        };
        let text = format!("{} at {}, {state}", index + 1, link::address(&robot.address));
        model.say(Some(index), text);
    }
}

/// Lists the commands.
pub(super) fn help(model: &mut Model) {
    for (form, what) in command::HELP {
        model.say(None, format!("{form:<20} {what}"));
    }
}

/// A robot by its number from 1, its name or its address.
pub(super) fn find(model: &Model, which: &str) -> Result<usize, String> {
    let robots = &model.robots;
    let number = which.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
    number
        .filter(|index| *index < robots.len())
        .or_else(|| robots.iter().position(|robot| robot.name == which))
        .or_else(|| robots.iter().position(|robot| link::address(&robot.address) == which.to_lowercase()))
        .ok_or_else(|| format!("there is no robot `{which}`; `list` lists them"))
}
