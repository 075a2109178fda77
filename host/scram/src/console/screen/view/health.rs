//! What the matter is with the selected robot, and what to do about it.

use std::time::Duration;

use ratatui::layout::Rect;
use ratatui::text::Line;

use super::robots;
use crate::console::model::{Level, Model, Plot, RobotModel};
use crate::console::screen::text::fold;
use crate::console::screen::theme::Theme;

/// A value is of the present while it is not older than this.
const PRESENT_S: f64 = 1.0;
/// Windows of at least so many rows have one for the robot's health; where something is the matter, higher ones.
const HIGH: u16 = 24;
const HIGHER: u16 = 32;

/// The rows of it, folded to the window's width.
pub fn lines(model: &Model, theme: Theme, area: Rect) -> Vec<Line<'static>> {
    let (level, first) = state(model);
    let mut lines = Vec::new();
    let columns = usize::from(area.width).saturating_sub(3);
    for (row, text) in fold(&first, columns).into_iter().enumerate() {
        let mark = if row == 0 { theme.mark(level) } else { "  " };
        lines.push(Line::styled(format!("{mark} {text}"), theme.level(level)));
    }
    let advice = advice(model);
    if !advice.is_empty() {
        lines.extend(fold(&advice, columns).into_iter().map(|text| Line::from(format!("   {text}"))));
    }
    if area.height >= if advice.is_empty() { HIGH } else { HIGHER }
        && let Some(health) = model.robot().filter(|robot| robot.present).and_then(health)
    {
        lines.push(Line::styled(format!("   {health}"), theme.faint()));
    }
    lines
}

/// The state in a sentence.
pub fn state(model: &Model) -> (Level, String) {
    let Some(robot) = model.robot() else {
        return (Level::Warning, "no robot is paired with this console".into());
    };
    let name = &robot.name;
    let text = match (robot.fault, robot.other_version) {
        (_, Some(version)) => format!("{name} speaks version {version:08x} of the messages, this program another"),
        _ if !robot.present && robot.state.is_none() => format!("{name} has not answered yet"),
        _ if !robot.present => format!("{name} does not answer any more"),
        (Some(fault), _) => format!("{name} FAULT: {}", link::fault(fault).0),
        _ => format!("{name}  {}", doing(robot, model.now)),
    };
    (robots::state(robot).0, text)
}

fn doing(robot: &RobotModel, now: Duration) -> String {
    let mut words = vec![robots::state(robot).1.to_owned()];
    words.extend(robot.target.iter().map(|target| format!("({target})")));
    words.extend(value(&robot.series.frequency, now).map(|hz| format!("{hz:.2} Hz")));
    words.push(match value(&robot.series.angle, now) {
        Some(degrees) if robot.tracking => format!("{degrees:.0} deg"),
        _ => "angle not known".into(),
    });
    words.extend(value(&robot.series.duty, now).map(|duty| format!("duty {:+.0} %", 100.0 * duty)));
    words.join("  ")
}

/// The latest value of a plot, if it is of the present.
pub fn value(plot: &Plot, now: Duration) -> Option<f64> {
    plot.since(now.as_secs_f64() - PRESENT_S).last().map(|(_, value)| value)
}

fn advice(model: &Model) -> String {
    let Some(robot) = model.robot() else { return "pair one over its USB cable: `scram pair`".into() };
    match robot.fault {
        _ if robot.other_version.is_some() => "build all from one state of the project and flash it".into(),
        _ if !robot.present => {
            "is its battery in, and does its LED flash? Is it in range? Its motor stops by itself where it hears nothing".into()
        }
        Some(fault) => format!("{}. Then type `clear`", link::fault(fault).1),
        None => String::new(),
    }
}

fn health(robot: &RobotModel) -> Option<String> {
    let up = robot.uptime?.as_secs();
    let (came, missing) = robot.ticks;
    let mut text =
        format!("up {}:{:02}:{:02}  ticks lost {missing} of {}", up / 3600, up / 60 % 60, up % 60, came + missing);
    if let Some(counters) = &robot.counters {
        text += &format!(
            "  missed {}  frames forged {}, outdated {}",
            counters.missed_deadlines, counters.forged, counters.outdated
        );
    }
    Some(text)
}
