//! A foreign file in memory: the columns that a mapping names, as numbers, before units mean anything.

use std::path::{Path, PathBuf};

use crate::{Place, RecordingError, RowNumber};

/// Columns of a foreign file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    pub(super) path: PathBuf,
    /// Every column of the file, as it spells them.
    pub(super) names: Vec<String>,
    /// Names of those that were read.
    pub(super) read: Vec<String>,
    /// A vector a column that was read; NaN where the cell is empty or no finite number.
    pub(super) columns: Vec<Vec<f64>>,
    /// Where each row is in the file.
    pub(super) rows: Vec<RowNumber>,
}

impl Table {
    pub(super) fn column(&self, name: &str) -> Option<&[f64]> {
        self.read.iter().position(|read| read == name).map(|index| self.columns[index].as_slice())
    }

    /// Columns that were not read.
    pub(super) fn unread(&self) -> Vec<String> {
        self.names.iter().filter(|name| !name.is_empty() && !self.read.contains(name)).cloned().collect()
    }

    pub(super) fn place(&self, row: usize) -> Place {
        Place { path: self.path.clone(), row: self.rows[row] }
    }
}

/// Where the wanted columns are among the names of a file; each is read once, however often it is wanted.
///
/// # Errors
/// A name is there twice, or a wanted one is not there.
pub(super) fn locate(path: &Path, names: &[String], wanted: &[String]) -> Result<Vec<(String, usize)>, RecordingError> {
    for (index, name) in names.iter().enumerate() {
        if !name.is_empty() && names[..index].contains(name) {
            return Err(RecordingError::Duplicate { path: path.to_owned(), column: name.clone() });
        }
    }
    let mut found: Vec<(String, usize)> = Vec::new();
    for name in wanted {
        if found.iter().any(|(known, _)| known == name) {
            continue;
        }
        let Some(index) = names.iter().position(|known| known == name) else {
            return Err(RecordingError::Format {
                path: path.to_owned(),
                problem: format!("column \"{name}\" is not there; the file has: {}", listed(names)),
                help: format!("map a column that is there in place of \"{name}\", spelled as in the file"),
            });
        };
        found.push((name.clone(), index));
    }
    Ok(found)
}

/// Names in a message, however many a file has.
pub(super) fn listed(names: &[String]) -> String {
    const MOST: usize = 40;
    let mut shown: Vec<String> =
        names.iter().filter(|name| !name.is_empty()).take(MOST).map(|name| shortened(name)).collect();
    if names.len() > MOST {
        shown.push(format!("… ({} columns)", names.len()));
    }
    if shown.is_empty() { "no column with a name".into() } else { shown.join(", ") }
}

fn shortened(name: &str) -> String {
    if name.chars().count() <= 40 { name.to_owned() } else { name.chars().take(40).chain(['…']).collect() }
}
