//! What was typed before, over sessions too.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use common::atomic::write_atomically_private;

/// Lines that are kept.
const LINES: usize = 1000;
/// Longest line that is kept, bytes.
const LONGEST: usize = 1000;

/// What was typed, the latest last, and where in it a person looks.
#[derive(Clone, Debug, Default)]
pub struct History {
    lines: Vec<String>,
    /// Lines of this session: only these are added to the file, where another console may have written meanwhile.
    typed: usize,
    at: Option<usize>,
    /// What was in the prompt before the person looked.
    draft: String,
}

impl History {
    /// `scram/history` in the user's directory for such things.
    #[must_use]
    pub fn default_path() -> Option<PathBuf> {
        let set = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let base = set("XDG_STATE_HOME")
            .or_else(|| set("LOCALAPPDATA"))
            .or_else(|| set("HOME").map(|home| home.join(".local").join("state")))?;
        Some(base.join("scram").join("history"))
    }

    /// What a file has; nothing where there is none.
    #[must_use]
    pub fn load(path: &Path) -> Self {
        Self { lines: read(path), ..Self::default() }
    }

    /// Adds what was typed in this session to the file. It can be read by its user only.
    ///
    /// # Errors
    /// The system refuses.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        let typed = &self.lines[self.lines.len().saturating_sub(self.typed)..];
        if typed.is_empty() {
            return Ok(());
        }
        let mut lines = read(path);
        lines.extend_from_slice(typed);
        let from = lines.len().saturating_sub(LINES);
        write_atomically_private(path, |file| lines[from..].iter().try_for_each(|line| writeln!(file, "{line}")))
    }

    /// Adds a line, unless it is empty or the same as the last.
    pub fn push(&mut self, line: &str) {
        self.at = None;
        let line = line.trim();
        if is_kept(line) && self.lines.last().is_none_or(|last| last != line) {
            self.lines.push(line.to_owned());
            self.typed += 1;
        }
        if self.lines.len() > LINES {
            self.lines.remove(0);
        }
    }

    /// The line before; `present` is what stands in the prompt.
    pub fn older(&mut self, present: &str) -> Option<&str> {
        let at = self.at.unwrap_or(self.lines.len()).checked_sub(1)?;
        if self.at.is_none() {
            present.clone_into(&mut self.draft);
        }
        self.at = Some(at);
        self.lines.get(at).map(String::as_str)
    }

    /// The line after; behind the last, what stood in the prompt before.
    pub fn newer(&mut self) -> Option<&str> {
        let at = self.at? + 1;
        self.at = (at < self.lines.len()).then_some(at);
        Some(self.lines.get(at).map_or(self.draft.as_str(), String::as_str))
    }
}

fn is_kept(line: &str) -> bool {
    !line.is_empty() && line.len() <= LONGEST && !line.contains(char::is_control)
}

fn read(path: &Path) -> Vec<String> {
    let Ok(bytes) = std::fs::read(path) else { return Vec::new() };
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<String> = text.lines().filter(|line| is_kept(line)).map(str::to_owned).collect();
    let from = lines.len().saturating_sub(LINES);
    lines[from..].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_and_down_and_back_to_what_was_typed() {
        let mut history = History::default();
        assert_eq!(history.older("x"), None);
        for line in ["freq 7", "freq 7", " stop ", ""] {
            history.push(line);
        }
        assert_eq!(history.older("dra"), Some("stop"));
        assert_eq!(history.older("stop"), Some("freq 7"));
        assert_eq!(history.older("freq 7"), None);
        assert_eq!(history.newer(), Some("stop"));
        assert_eq!(history.newer(), Some("dra"));
        assert_eq!(history.newer(), None);
    }

    #[test]
    fn a_file_keeps_it_bounded_and_for_its_user_only() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("new").join("history");
        let (mut one, mut other) = (History::load(&path), History::load(&path));
        one.push("freq 1");
        other.push("freq 2");
        one.save(&path).expect("it is written");
        other.save(&path).expect("it is written");
        assert_eq!(History::load(&path).lines, ["freq 1", "freq 2"], "two consoles at a time");
        let mut long = History::load(&path);
        for number in 0..3 * LINES {
            long.push(&format!("freq {number}"));
        }
        long.save(&path).expect("it is written");
        let kept = History::load(&path).lines;
        assert_eq!((kept.len(), kept.last().map(String::as_str)), (LINES, Some("freq 2999")));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&path).expect("it is there").permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn rubbish_in_the_file_is_left_out() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("history");
        std::fs::write(&path, b"freq 7\n\x1b[2J\n\n\xff\xfe\nstop\n").expect("it is written");
        assert_eq!(History::load(&path).lines, ["freq 7", "\u{fffd}\u{fffd}", "stop"]);
    }
}
