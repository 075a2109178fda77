//! Theme of the screen: with and without colour, with and without Unicode. Nothing is told by colour alone.

use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;

use crate::console::model::Level;

/// What the terminal can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Theme {
    /// It has colours, and the person wants them.
    pub colour: bool,
    /// Nothing but ASCII.
    pub ascii: bool,
}

impl Theme {
    /// The terminal's, from its environment: `TERM`, the locale, `NO_COLOR`.
    #[must_use]
    pub fn detect(variable: &dyn Fn(&str) -> Option<String>) -> Self {
        let set = |name: &str| variable(name).filter(|value| !value.is_empty());
        let term = set("TERM").unwrap_or_default();
        let mono = term.starts_with("vt") || term.ends_with("-m") || term.ends_with("-mono");
        let locale = set("LC_ALL").or_else(|| set("LC_CTYPE")).or_else(|| set("LANG")).unwrap_or_default();
        let unicode = cfg!(windows) || ["utf-8", "utf8"].iter().any(|name| locale.to_lowercase().contains(name));
        // The kernel's own console has no braille in its font.
        Self {
            colour: set("NO_COLOR").is_none() && !mono,
            ascii: !unicode || term == "linux" || term.starts_with("vt"),
        }
    }

    /// What a curve is drawn with.
    #[must_use]
    pub fn marker(self) -> Marker {
        if self.ascii { Marker::Custom('*') } else { Marker::Braille }
    }

    /// Points of a [`marker`](Self::marker) in a character: beside and above each other.
    #[must_use]
    pub fn points(self) -> (usize, usize) {
        if self.ascii { (1, 1) } else { (2, 4) }
    }

    /// What stands where text was cut.
    #[must_use]
    pub fn ellipsis(self) -> &'static str {
        if self.ascii { "..." } else { "…" }
    }

    /// What a rule is made of.
    #[must_use]
    pub fn rule(self) -> &'static str {
        if self.ascii { "-" } else { "─" }
    }

    fn coloured(self, style: Style, colour: Color) -> Style {
        if self.colour { style.fg(colour) } else { style }
    }

    /// A curve.
    #[must_use]
    pub fn curve(self) -> Style {
        self.coloured(Style::new(), Color::Cyan)
    }

    /// A title, or a value that matters.
    #[must_use]
    pub fn strong(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    /// Something in the background. No grey: on some terminals that is the background's colour.
    #[must_use]
    pub fn faint(self) -> Style {
        Style::new().add_modifier(Modifier::DIM)
    }

    /// A bar across the screen, or the chosen one of several.
    #[must_use]
    pub fn bar(self) -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    /// Something of a level.
    #[must_use]
    pub fn level(self, level: Level) -> Style {
        match level {
            Level::Note => Style::new(),
            Level::Good => self.coloured(Style::new(), Color::Green),
            Level::Warning => self.coloured(Style::new(), Color::Yellow).add_modifier(Modifier::BOLD),
            Level::Bad => self.coloured(Style::new(), Color::Red).add_modifier(Modifier::BOLD),
        }
    }

    /// The same, without colour.
    #[must_use]
    pub fn mark(self, level: Level) -> &'static str {
        match level {
            Level::Note => "  ",
            Level::Good => "ok",
            Level::Warning => " !",
            Level::Bad => "!!",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn theme(environment: &[(&str, &str)]) -> Theme {
        Theme::detect(&|name| environment.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
    }

    #[test]
    #[cfg(unix)]
    fn the_environment_tells() {
        let utf8 = ("LANG", "de_AT.UTF-8");
        assert_eq!(theme(&[("TERM", "xterm-256color"), utf8]), Theme { colour: true, ascii: false });
        assert_eq!(theme(&[("TERM", "xterm"), utf8, ("NO_COLOR", "1")]), Theme { colour: false, ascii: false });
        assert_eq!(theme(&[("TERM", "xterm"), utf8, ("NO_COLOR", "")]), Theme { colour: true, ascii: false });
        assert_eq!(theme(&[("TERM", "xterm"), utf8, ("LC_ALL", "C")]), Theme { colour: true, ascii: true });
        assert_eq!(theme(&[("TERM", "linux"), utf8]), Theme { colour: true, ascii: true });
        assert_eq!(theme(&[("TERM", "vt220"), utf8]), Theme { colour: false, ascii: true });
        assert_eq!(theme(&[]), Theme { colour: true, ascii: true });
    }
}
