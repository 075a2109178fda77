//! The bar at the top: whom the console talks to, and where everything is recorded.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Modifier;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use crate::console::model::{Level, Model, RecordingModel};
use crate::console::screen::text::{cut, width};
use crate::console::screen::theme::Theme;

/// Draws it.
pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, theme: Theme) {
    let columns = usize::from(area.width);
    let (level, recording) = recording(model.recording.as_ref());
    // What is recorded matters more than where the dongle is.
    let recording = cut(&recording, columns.saturating_sub(16), theme);
    let left = cut(&dongle(model), columns.saturating_sub(width(&recording) + 3), theme);
    let gap = columns.saturating_sub(width(&left) + width(&recording) + 2);
    let style = theme.bar();
    let line = Line::from(vec![
        Span::styled(format!(" {left}{}", " ".repeat(gap)), style),
        Span::styled(format!("{recording} "), theme.level(level).add_modifier(Modifier::REVERSED)),
    ]);
    frame.render_widget(Paragraph::new(line), area);
}

/// The least important at the end, which is cut where the window is narrow.
fn dongle(model: &Model) -> String {
    let dongle =
        model.dongle.map(|(address, channel)| format!("  channel {channel}  dongle {}", link::address(&address)));
    format!("scram  {}{}", model.port, dongle.unwrap_or_default())
}

fn recording(recording: Option<&RecordingModel>) -> (Level, String) {
    match recording {
        None => (Level::Warning, "! not recorded".into()),
        Some(RecordingModel { failed: Some(why), .. }) => (Level::Bad, format!("!! NOT RECORDED: {why}")),
        Some(RecordingModel { path, bytes, .. }) => {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            (Level::Note, format!("recording {name} {:.1} MB", *bytes as f64 / 1e6))
        }
    }
}
