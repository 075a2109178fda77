//! A file of text as rows of cells.

use std::path::{Path, PathBuf};

use super::CaptureError;

/// Rows of cells, separated by whatever the file separates them with, without the blanks around them.
pub struct Cells {
    path: PathBuf,
    rows: Vec<Vec<String>>,
    /// Line of each row, from 1: empty lines are no rows.
    lines: Vec<usize>,
}

impl Cells {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, CaptureError> {
        let unreadable = |problem: String| CaptureError::Unreadable { path: path.into(), problem };
        let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
        let text = String::from_utf8_lossy(&bytes);
        let text = text.trim_start_matches('\u{feff}');
        let count = |delimiter: u8| text.bytes().take(20_000).filter(|byte| *byte == delimiter).count();
        let delimiter = [b',', b'\t', b';'].into_iter().max_by_key(|one| count(*one)).unwrap_or(b',');
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(delimiter)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let (mut rows, mut lines) = (Vec::new(), Vec::new());
        for record in reader.records() {
            let record = record.map_err(|error| unreadable(error.to_string()))?;
            if record.iter().any(|cell| !cell.is_empty()) {
                lines.push(record.position().map_or(0, |position| position.line() as usize));
                rows.push(record.iter().map(str::to_owned).collect());
            }
        }
        let cells = Self { path: path.into(), rows, lines };
        if cells.rows.is_empty() {
            return Err(cells.wrong(0, "", "the file is empty".into()));
        }
        Ok(cells)
    }

    /// Row `k`; empty beyond the last.
    pub fn row(&self, k: usize) -> &[String] {
        self.rows.get(k).map_or(&[], Vec::as_slice)
    }

    /// The rows from `k` on, with their places.
    pub fn from(&self, k: usize) -> impl Iterator<Item = (usize, &[String])> {
        self.rows.iter().enumerate().skip(k).map(|(place, row)| (place, row.as_slice()))
    }

    /// The first row that begins with a word.
    pub fn beginning_with(&self, word: &str) -> Option<usize> {
        self.rows.iter().position(|row| row.first().is_some_and(|cell| cell == word))
    }

    /// What is wrong with a row, or with the file's end beyond the last.
    pub fn wrong(&self, row: usize, column: &str, problem: String) -> CaptureError {
        let line = self.lines.get(row).or(self.lines.last()).copied().unwrap_or(1);
        let column = if column.is_empty() { String::new() } else { format!(", column `{column}`") };
        CaptureError::Wrong { path: self.path.clone(), line, column, problem }
    }

    /// The number in a cell; NaN for an empty one.
    pub fn number(&self, row: usize, column: usize, name: &str) -> Result<f64, CaptureError> {
        match self.row(row).get(column).map_or("", String::as_str) {
            "" => Ok(f64::NAN),
            text => text.parse().map_err(|_| self.wrong(row, name, format!("`{text}` is not a number"))),
        }
    }
}
