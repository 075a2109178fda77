//! The last events.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use crate::console::model::{LogLine, Model};
use crate::console::screen::input::Screen;
use crate::console::screen::text::{fold, width};
use crate::console::screen::theme::Theme;

/// A longer window has a rule above the log.
const RULED: u16 = 3;

/// Draws it from its end, or from where the person looks; how many events were shown.
pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, screen: &Screen) -> usize {
    let theme = screen.theme;
    let end = screen.log_end(model).min(model.log.len());
    let mut area = area;
    if area.height >= RULED {
        let newer = model.log.len() - end;
        let title = if newer == 0 { " events ".into() } else { format!(" events, {newer} newer: PgDn ") };
        rule(frame, area, &title, theme);
        area.y += 1;
        area.height -= 1;
    }
    let room = usize::from(area.height);
    let (mut lines, mut shown) = (Vec::new(), 0);
    for event in model.log.iter().take(end).rev() {
        let mut rows = rows(event, usize::from(area.width), theme);
        // The end of a sentence tells nothing; of the latest event its beginning is shown.
        if shown > 0 && lines.len() + rows.len() > room {
            break;
        }
        rows.truncate(room);
        lines.extend(rows.into_iter().rev());
        shown += 1;
    }
    lines.reverse();
    frame.render_widget(Paragraph::new(lines), area);
    shown
}

fn rule(frame: &mut Frame<'_>, area: Rect, title: &str, theme: Theme) {
    let rest = usize::from(area.width).saturating_sub(width(title) + 2);
    let line = Line::from(vec![
        Span::styled(theme.rule().repeat(2), theme.faint()),
        Span::raw(title.to_owned()),
        Span::styled(theme.rule().repeat(rest), theme.faint()),
    ]);
    frame.render_widget(Paragraph::new(line), Rect { height: 1, ..area });
}

/// An event, folded; its further rows are indented.
fn rows(event: &LogLine, columns: usize, theme: Theme) -> Vec<Line<'static>> {
    let at = event.at.as_secs_f64();
    let front = format!("{at:7.1} {} ", theme.mark(event.level));
    let robot = event.robot.as_ref().map(|robot| format!("{robot}: ")).unwrap_or_default();
    let indent = width(&front);
    let texts = fold(&format!("{robot}{}", event.text), columns.saturating_sub(indent));
    let fronts = std::iter::once(front).chain(std::iter::repeat(" ".repeat(indent)));
    let row = |(front, text)| {
        Line::from(vec![Span::styled(front, theme.faint()), Span::styled(text, theme.level(event.level))])
    };
    fronts.zip(texts).map(row).collect()
}
