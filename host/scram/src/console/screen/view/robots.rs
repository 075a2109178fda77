//! The list of robots.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use crate::console::model::{Level, Model, RobotModel};
use crate::console::screen::text::{cut, width};
use crate::console::screen::theme::Theme;

/// A column of the list.
struct Column {
    title: &'static str,
    width: usize,
    right: bool,
    /// Columns with a lower one go first where the window is narrow.
    importance: u8,
    value: fn(&RobotModel) -> String,
}

const COLUMNS: &[Column] = &[
    Column { title: "robot", width: 13, right: false, importance: 9, value: |robot| robot.name.clone() },
    Column { title: "state", width: 9, right: false, importance: 9, value: |robot| state(robot).1.into() },
    Column { title: "target", width: 14, right: false, importance: 5, value: target },
    Column { title: "cell", width: 6, right: true, importance: 8, value: cell },
    Column { title: "rate", width: 5, right: true, importance: 2, value: rate },
    Column { title: "lost", width: 6, right: true, importance: 7, value: lost },
    Column { title: "trip", width: 6, right: true, importance: 3, value: trip },
    Column { title: "signal", width: 7, right: true, importance: 6, value: signal },
];
/// Mark and number.
const FRONT: usize = 4;

/// Draws it. Where not all fit, those around the selected one are shown.
pub fn draw(frame: &mut Frame<'_>, titles: Rect, area: Rect, model: &Model, theme: Theme) {
    let columns = fitting(usize::from(area.width));
    let row = |value: &dyn Fn(&Column) -> String| {
        let cells = columns.iter().map(|column| aligned(column, &value(column), theme));
        cells.collect::<Vec<_>>().join(" ")
    };
    let line = format!("{:FRONT$}{}", "", row(&|column| column.title.into()));
    frame.render_widget(Line::styled(line, theme.faint()), titles);
    let rows = usize::from(area.height);
    let last_start = model.robots.len().saturating_sub(rows);
    let start = model.selected.saturating_sub(rows / 2).min(last_start);
    let mut lines = Vec::new();
    for (index, robot) in model.robots.iter().enumerate().skip(start).take(rows) {
        let chosen = index == model.selected;
        let mark = if chosen { '>' } else { ' ' };
        let line = format!("{mark}{:<2} {}", index + 1, row(&|column| (column.value)(robot)));
        lines.push(Line::styled(line, style(robot, chosen, theme)));
    }
    if model.robots.is_empty() {
        lines.push(Line::from("    no robots"));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

fn style(robot: &RobotModel, chosen: bool, theme: Theme) -> Style {
    let style = match state(robot).0 {
        _ if !robot.present => theme.faint(),
        Level::Note | Level::Good => Style::new(),
        level => theme.level(level),
    };
    if chosen { style.patch(theme.strong()) } else { style }
}

fn fitting(width: usize) -> Vec<&'static Column> {
    let mut columns: Vec<&Column> = COLUMNS.iter().collect();
    while FRONT + columns.iter().map(|column| column.width + 1).sum::<usize>() > width + 1 {
        let Some(at) = (0..columns.len()).min_by_key(|at| columns[*at].importance) else { break };
        columns.remove(at);
    }
    columns
}

fn aligned(column: &Column, text: &str, theme: Theme) -> String {
    let text = cut(text, column.width, theme);
    let space = " ".repeat(column.width.saturating_sub(width(&text)));
    if column.right { format!("{space}{text}") } else { format!("{text}{space}") }
}

/// What a robot does, in a word.
pub fn state(robot: &RobotModel) -> (Level, &'static str) {
    match robot.state {
        _ if robot.other_version.is_some() => (Level::Bad, "VERSION!"),
        _ if !robot.present => (Level::Bad, "absent"),
        _ if robot.stopping => (Level::Warning, "STOPPING"),
        Some(state @ control::State::Fault) => (Level::Bad, link::state(state)),
        Some(state) if state.is_driving() => (Level::Good, link::state(state)),
        Some(state) => (Level::Note, link::state(state)),
        None => (Level::Note, "?"),
    }
}

fn target(robot: &RobotModel) -> String {
    robot.target.clone().unwrap_or_else(|| "-".into())
}

fn cell(robot: &RobotModel) -> String {
    robot.battery_v.filter(|_| robot.present).map_or_else(|| "-".into(), |volts| format!("{volts:.2} V"))
}

fn rate(robot: &RobotModel) -> String {
    format!("{:.0}/s", robot.quality.rate_hz)
}

fn lost(robot: &RobotModel) -> String {
    robot.quality.loss.map_or_else(|| "-".into(), |loss| format!("{:.1} %", 100.0 * loss))
}

fn trip(robot: &RobotModel) -> String {
    let trip = robot.quality.round_trip.filter(|_| robot.present);
    trip.map_or_else(|| "-".into(), |trip| format!("{:.0} ms", 1e3 * trip.as_secs_f64()))
}

fn signal(robot: &RobotModel) -> String {
    let signal = robot.quality.rssi_dbm.filter(|_| robot.present);
    signal.map_or_else(|| "-".into(), |dbm| format!("{dbm} dBm"))
}
