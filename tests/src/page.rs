//! `docs/figures.md`: what a campaign measured, written between the markers of its section, so that no figure is typed.
//!
//! A section is everything between `<!-- figures: NAME -->` and `<!-- end of figures: NAME -->`, each on a line of its own.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::row::FigureRow;

/// Names of the sections, in the document's order.
pub const SECTIONS: [&str; 6] = ["control", "link", "safety", "blind", "walks", "body"];

/// Why a section could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// The document could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// The document.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A marker is missing, or is there more than once.
    #[error("{path}: the line `{marker}` must be there exactly once, and before the section's end")]
    Marker {
        /// The document.
        path: String,
        /// The marker's line.
        marker: String,
    },
}

/// The document in this source tree.
#[must_use]
pub fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/figures.md")
}

/// Line that begins a section, and line that ends it.
#[must_use]
pub fn markers(name: &str) -> [String; 2] {
    [format!("<!-- figures: {name} -->\n"), format!("<!-- end of figures: {name} -->\n")]
}

/// Bytes of a section's text within the document, without the markers' lines; otherwise the marker that is at fault.
fn span(document: &str, name: &str) -> Result<std::ops::Range<usize>, String> {
    let [begin, end] = markers(name);
    let only = |marker: &String| {
        let mut found = document.match_indices(marker.as_str()).filter(|&(at, _)| document[..at].ends_with('\n'));
        match (found.next(), found.next()) {
            (Some((at, _)), None) => Ok(at),
            _ => Err(marker.trim_end().to_owned()),
        }
    };
    let (from, to) = (only(&begin)? + begin.len(), only(&end)?);
    if from <= to { Ok(from..to) } else { Err(begin.trim_end().to_owned()) }
}

/// A section's text.
///
/// # Errors
/// The marker that is missing, doubled or misplaced.
pub fn section<'t>(document: &'t str, name: &str) -> Result<&'t str, String> {
    span(document, name).map(|span| &document[span])
}

/// The document with a section's text replaced.
///
/// # Errors
/// The marker that is missing, doubled or misplaced.
pub fn replaced(document: &str, name: &str, text: &str) -> Result<String, String> {
    let span = span(document, name)?;
    Ok(format!("{}\n{}\n\n{}", &document[..span.start], text.trim(), &document[span.end..]))
}

/// Rows as a Markdown table.
#[must_use]
pub fn table(rows: &[FigureRow]) -> String {
    let mut text = String::from("| what | required | measured | holds |\n|---|---|---|---|\n");
    for row in rows {
        let holds = match row.holds {
            Some(true) => "yes",
            Some(false) => "**no**",
            None => "",
        };
        let cell = |text: &str| text.trim().replace('\n', " ").replace('|', "\\|");
        let [what, required, measured] = [&row.what, &row.required, &row.measured].map(|text| cell(text));
        text += &format!("| {what} | {required} | {measured} | {holds} |\n");
    }
    text
}

/// Cells of the rows of a section's table: what, required, measured, holds.
#[must_use]
pub fn parsed(section: &str) -> Vec<[String; 4]> {
    section
        .lines()
        .skip_while(|line| !line.starts_with("|---"))
        .skip(1)
        .map_while(|line| {
            let line = line.strip_prefix('|')?.strip_suffix('|')?.replace("\\|", "\u{0}");
            let cells: Vec<String> = line.split('|').map(|cell| cell.trim().replace('\u{0}', "|")).collect();
            cells.try_into().ok()
        })
        .collect()
}

/// The commit of the source tree with its date; says so where the tree differs from it.
fn commit() -> String {
    let git = |arguments: &[&str]| {
        let run = Command::new("git").args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().ok()?;
        run.status.success().then(|| String::from_utf8_lossy(&run.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["log", "-1", "--format=commit %h of %cs"]) else { return "commit unknown".to_owned() };
    // Documents change no figure.
    let changed = git(&["status", "--porcelain", "--untracked-files=no", "--", ":(top)*.rs", ":(top)*.toml"]);
    if changed.is_some_and(|list| list.is_empty()) { commit } else { format!("{commit}, with changes") }
}

/// Replaces a section of `docs/figures.md` by a line that says what measured it, and `body`.
///
/// # Errors
/// The document cannot be read or written, or a marker is at fault.
pub fn write(name: &str, command: &str, size: (&str, u64), body: &str) -> Result<(), PageError> {
    let path = path();
    let shown = || path.display().to_string();
    let file = |source| PageError::File { path: shown(), source };
    let document = std::fs::read_to_string(&path).map_err(file)?;
    let text = format!("Measured by `{command}`, {} {}, {}.\n\n{body}", size.1, size.0, commit());
    let whole = replaced(&document, name, &text).map_err(|marker| PageError::Marker { path: shown(), marker })?;
    common::atomic::write_atomically(&path, |out| out.write_all(whole.as_bytes())).map_err(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    const PAGE: &str = "# T\n\n<!-- figures: a -->\nold\n<!-- end of figures: a -->\n\nkept\n";

    #[test]
    fn a_section_is_replaced_and_the_rest_stays() {
        let rows = [
            FigureRow::new("  a | b", "1 %", "2 %".to_owned(), false, Value::Null),
            FigureRow::beside("c", "3".to_owned(), Value::Null),
        ];
        let page = replaced(PAGE, "a", &table(&rows)).expect("both markers are there");
        assert!(
            page.starts_with("# T\n\n<!-- figures: a -->\n") && page.ends_with("<!-- end of figures: a -->\n\nkept\n")
        );
        let again = replaced(&page, "a", &table(&rows)).expect("both markers are still there");
        assert_eq!(again, page, "writing twice changes nothing");
        let cells = parsed(section(&page, "a").expect("a section"));
        assert_eq!(cells, [["a | b", "1 %", "2 %", "**no**"], ["c", "", "3", ""]]);
    }

    #[test]
    fn a_marker_that_is_missing_or_doubled_is_named() {
        assert_eq!(section(PAGE, "b"), Err("<!-- figures: b -->".to_owned()));
        let doubled = format!("{PAGE}<!-- end of figures: a -->\n");
        assert_eq!(section(&doubled, "a"), Err("<!-- end of figures: a -->".to_owned()));
        let turned = "\n<!-- end of figures: a -->\n<!-- figures: a -->\n";
        assert_eq!(section(turned, "a"), Err("<!-- figures: a -->".to_owned()));
    }
}
