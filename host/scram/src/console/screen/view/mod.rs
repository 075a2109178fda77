//! The picture, one file a part of it.

mod header;
mod health;
mod log;
mod plots;
mod popup;
mod prompt;
mod robots;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::input::Screen;
use super::layout::{Areas, LEAST, WantedRows};
use super::theme::Theme;
use crate::console::model::{Level, Model};

/// With fewer rows beside the robots and their faults, the help lies over these, too.
const LEAST_HELP: u16 = 6;

/// Draws everything.
pub fn draw(frame: &mut Frame<'_>, model: &Model, screen: &mut Screen) {
    let (area, theme) = (frame.area(), screen.theme);
    let health = health::lines(model, theme, area);
    let message = prompt::message(screen, model, area.width);
    let needs =
        WantedRows { robots: rows(model.robots.len()), health: rows(health.len()), message: rows(message.len()) };
    let Some(areas) = Areas::new(area, needs, plots::least_height(theme)) else {
        return too_small(frame, model, theme);
    };
    header::draw(frame, areas.header, model, theme);
    robots::draw(frame, areas.titles, areas.robots, model, theme);
    frame.render_widget(Paragraph::new(health), areas.health);
    plots::draw(frame, areas.plots, model, theme);
    screen.log_shown = log::draw(frame, areas.log, model, screen);
    frame.render_widget(Paragraph::new(message), areas.message);
    prompt::draw(frame, areas.prompt, model, screen);
    prompt::keys(frame, areas.keys, theme);
    let middle = Rect { height: areas.plots.height + areas.log.height, ..areas.plots };
    if let Some(from) = &mut screen.help {
        let above = Rect { height: areas.message.y - area.y, ..area };
        let room = if middle.height < LEAST_HELP { above } else { middle };
        *from = popup::help(frame, room, theme, *from);
    }
    if let Some(menu) = screen.prompt.menu() {
        popup::menu(frame, middle, menu, theme);
    }
}

/// What still fits: how to stop, and whether something is wrong.
fn too_small(frame: &mut Frame<'_>, model: &Model, theme: Theme) {
    let (level, state) = health::state(model);
    let lines = [
        Line::styled(format!("too small: {}x{} at least", LEAST.0, LEAST.1), theme.level(Level::Warning)),
        Line::styled(format!("{} {state}", theme.mark(level)), theme.level(level)),
        Line::from("Esc stops every robot"),
    ];
    // In one row, the state matters more than the complaint.
    let from = usize::from(frame.area().height == 1);
    frame.render_widget(Paragraph::new(lines[from..].to_vec()), frame.area());
}

fn rows(count: usize) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}
