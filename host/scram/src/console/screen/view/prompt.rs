//! The lower edge: what became of the last line, the command line, the keys.

use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use crate::console::model::{Level, Model};
use crate::console::screen::input::Screen;
use crate::console::screen::text::{cut, fold, width};
use crate::console::screen::theme::Theme;

/// What the keys do, the most important first.
const KEYS: &[(&str, &str)] = &[
    ("Esc", "STOP ALL"),
    ("^C", "leave"),
    ("F1", "help"),
    ("Tab", "complete"),
    ("^N", "next robot"),
    ("^Z", "undo set"),
    ("PgUp", "older"),
];

/// What was wrong, or which script runs; folded.
pub fn message(screen: &Screen, model: &Model, columns: u16) -> Vec<Line<'static>> {
    let script = || {
        let (path, line) = model.script.as_ref()?;
        Some((Level::Note, format!("{}: line {line} is next", path.display())))
    };
    let Some((level, text)) = screen.message.clone().or_else(script) else { return Vec::new() };
    let theme = screen.theme;
    let rows = text.lines().flat_map(|line| fold(line, usize::from(columns).saturating_sub(3)));
    let line = |(row, text): (usize, String)| {
        let mark = if row == 0 { theme.mark(level) } else { "  " };
        Line::styled(format!("{mark} {text}"), theme.level(level))
    };
    rows.enumerate().map(line).collect()
}

/// The command line, with the cursor.
pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, screen: &Screen) {
    let name = model.robot().map(|robot| robot.name.as_str()).unwrap_or_default();
    let name = format!("{}> ", cut(name, usize::from(area.width) / 4, screen.theme));
    let front = width(&name).min(usize::from(area.width));
    let room = usize::from(area.width) - front;
    let input = screen.prompt.input();
    let scroll = input.visual_scroll(room.saturating_sub(1));
    frame.render_widget(Paragraph::new(Span::styled(name, screen.theme.strong())), area);
    let offset = u16::try_from(front).unwrap_or(u16::MAX);
    let area = Rect { x: area.x + offset, width: area.width - offset, ..area };
    let scrolled = u16::try_from(scroll).unwrap_or(u16::MAX);
    frame.render_widget(Paragraph::new(input.value()).scroll((0, scrolled)), area);
    let cursor = input.visual_cursor().saturating_sub(scroll).min(room.saturating_sub(1));
    frame.set_cursor_position(Position::new(area.x + u16::try_from(cursor).unwrap_or(0), area.y));
}

/// As many keys as fit.
pub fn keys(frame: &mut Frame<'_>, area: Rect, theme: Theme) {
    let mut room = usize::from(area.width);
    let mut spans = Vec::new();
    for (key, what) in KEYS {
        let needed = width(key) + width(what) + 3;
        if needed > room + 2 {
            break;
        }
        room = room.saturating_sub(needed);
        spans.push(Span::styled(*key, theme.strong()));
        spans.push(Span::styled(format!(" {what}  "), theme.faint()));
    }
    frame.render_widget(Paragraph::new(Line::from(spans)), area);
}
