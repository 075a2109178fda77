//! Outcomes of a campaign as they come, a line each, so that it goes on where it was interrupted.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A file of outcomes.
pub struct Journal<T> {
    file: File,
    /// What was in it before.
    pub before: Vec<T>,
}

impl<T: Serialize + DeserializeOwned> Journal<T> {
    /// Opens or makes one. A last line that was cut off is no outcome.
    ///
    /// # Errors
    /// What the system says, with the path; or that a line before the last is no outcome, with its number.
    pub fn open(path: &Path) -> Result<Self, String> {
        let says = |error: std::io::Error| format!("{}: {error}", path.display());
        let file = OpenOptions::new().read(true).append(true).create(true).open(path).map_err(says)?;
        let lines: Vec<String> = BufReader::new(&file).lines().collect::<Result<_, _>>().map_err(says)?;
        let mut before = Vec::new();
        for (number, line) in lines.iter().enumerate() {
            match serde_json::from_str(line) {
                Ok(outcome) => before.push(outcome),
                Err(_) if number + 1 == lines.len() => {
                    // What follows begins on its own line.
                    writeln!(&file).map_err(says)?;
                }
                Err(_) if line.is_empty() => {}
                Err(error) => {
                    return Err(format!("{}, line {}: {error}; move the file away", path.display(), number + 1));
                }
            }
        }
        Ok(Self { file, before })
    }

    /// Adds one.
    ///
    /// # Errors
    /// What the system says.
    pub fn add(&mut self, outcome: &T) -> Result<(), String> {
        let line = serde_json::to_string(outcome).map_err(|error| error.to_string())?;
        writeln!(self.file, "{line}").map_err(|error| format!("the journal: {error}"))
    }
}
