//! The picture, one file a part of it.

mod header;
mod log;
mod matter;
mod plots;
mod popup;
mod prompt;
mod robots;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::input::Screen;
use super::layout::{LEAST, Needs, Rooms};
use super::look::Look;
use crate::console::model::{Level, Model};

/// With fewer rows beside the robots and their faults, the help lies over these, too.
const LEAST_HELP: u16 = 6;

/// Draws everything.
pub fn draw(frame: &mut Frame<'_>, model: &Model, screen: &mut Screen) {
    let (area, look) = (frame.area(), screen.look);
    let matter = matter::lines(model, look, area);
    let message = prompt::message(screen, model, area.width);
    let needs = Needs { robots: rows(model.robots.len()), matter: rows(matter.len()), message: rows(message.len()) };
    let Some(rooms) = Rooms::new(area, needs, plots::least_height(look)) else {
        return too_small(frame, model, look);
    };
    header::draw(frame, rooms.header, model, look);
    robots::draw(frame, rooms.titles, rooms.robots, model, look);
    frame.render_widget(Paragraph::new(matter), rooms.matter);
    plots::draw(frame, rooms.plots, model, look);
    screen.log_shown = log::draw(frame, rooms.log, model, screen);
    frame.render_widget(Paragraph::new(message), rooms.message);
    prompt::draw(frame, rooms.prompt, model, screen);
    prompt::keys(frame, rooms.keys, look);
    let middle = Rect { height: rooms.plots.height + rooms.log.height, ..rooms.plots };
    if let Some(from) = &mut screen.help {
        let above = Rect { height: rooms.message.y - area.y, ..area };
        let room = if middle.height < LEAST_HELP { above } else { middle };
        *from = popup::help(frame, room, look, *from);
    }
    if let Some(menu) = screen.prompt.menu() {
        popup::menu(frame, middle, menu, look);
    }
}

/// What still fits: how to stop, and whether something is wrong.
fn too_small(frame: &mut Frame<'_>, model: &Model, look: Look) {
    let (level, state) = matter::state(model);
    let lines = [
        Line::styled(format!("too small: {}x{} at least", LEAST.0, LEAST.1), look.level(Level::Warning)),
        Line::styled(format!("{} {state}", look.mark(level)), look.level(level)),
        Line::from("Esc stops every robot"),
    ];
    // In one row, the state matters more than the complaint.
    let from = usize::from(frame.area().height == 1);
    frame.render_widget(Paragraph::new(lines[from..].to_vec()), frame.area());
}

fn rows(count: usize) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}
