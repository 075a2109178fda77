//! What lies over the plots and the log for a while: the help, and what a word could become.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Clear, Paragraph};

use super::rows;
use crate::console::HELP;
use crate::console::screen::input::KEYS;
use crate::console::screen::prompt::Menu;
use crate::console::screen::text::{cut, fold, width};
use crate::console::screen::theme::Theme;

/// Possibilities that are shown at a time.
const SHOWN: usize = 8;

/// Draws the help from a row on; the row from which it was.
pub fn help(frame: &mut Frame<'_>, area: Rect, theme: Theme, from: u16) -> u16 {
    let mut lines = Vec::new();
    let columns = usize::from(area.width);
    list(&mut lines, "Keys", KEYS, columns, theme);
    list(&mut lines, "Commands; several with `;` between", HELP, columns, theme);
    let room = area.height.saturating_sub(1);
    let from = from.min(rows(lines.len()).saturating_sub(room));
    let more = if rows(lines.len()) > room { ", PgUp PgDn: more" } else { "" };
    let title = format!("Help; F1: away{more}");
    frame.render_widget(Clear, area);
    let bar = Rect { height: area.height.min(1), ..area };
    frame.render_widget(Paragraph::new(format!(" {title:<columns$}")).style(theme.bar()), bar);
    let text = Rect { y: area.y + bar.height, height: room, ..area };
    frame.render_widget(Paragraph::new(lines).scroll((from, 0)), text);
    from
}

fn list(lines: &mut Vec<Line<'static>>, title: &str, entries: &[(&str, &str)], columns: usize, theme: Theme) {
    let first = entries.iter().map(|(name, _)| width(name)).max().unwrap_or(0);
    lines.push(Line::styled(title.to_owned(), theme.strong()));
    for (name, what) in entries {
        let texts = fold(what, columns.saturating_sub(first + 4));
        let names = std::iter::once(*name).chain(std::iter::repeat(""));
        lines.extend(names.zip(texts).map(|(name, text)| {
            Line::from(vec![Span::styled(format!("  {name:<first$}  "), theme.strong()), Span::raw(text)])
        }));
    }
}

/// Draws what a word could become, at the lower edge of an area.
pub fn menu(frame: &mut Frame<'_>, area: Rect, menu: &Menu, theme: Theme) {
    let count = menu.candidates.len();
    let shown = count.min(SHOWN).min(usize::from(area.height.saturating_sub(1)));
    let height = rows(shown + 1).min(area.height);
    let area = Rect { y: area.bottom() - height, height, ..area };
    let columns = usize::from(area.width);
    let chosen = menu.chosen.unwrap_or(0);
    let start = chosen.saturating_sub(shown / 2).min(count - shown);
    let first = menu.candidates.iter().map(|candidate| width(&candidate.text)).max().unwrap_or(0).min(columns / 2 + 6);
    let mut lines = vec![Line::styled(
        format!(" {:<columns$}", format!("{count} possibilities; Tab: next, Enter: take it")),
        theme.bar(),
    )];
    for (index, candidate) in menu.candidates.iter().enumerate().skip(start).take(shown) {
        let chosen = menu.chosen == Some(index);
        let (mark, style) = if chosen { ('>', theme.bar()) } else { (' ', theme.strong()) };
        let text = cut(candidate.text.trim_end(), first, theme);
        let space = " ".repeat(first.saturating_sub(width(&text)));
        lines.push(Line::from(vec![
            Span::styled(format!("{mark}{text}{space}"), style),
            Span::raw(format!("  {}", cut(&candidate.help, columns.saturating_sub(first + 3), theme))),
        ]));
    }
    frame.render_widget(Clear, area);
    frame.render_widget(Paragraph::new(lines), area);
}
