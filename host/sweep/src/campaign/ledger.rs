//! The rows of a campaign: made anywhere, kept in one place.

use std::path::{Path, PathBuf};

use super::{Campaign, Run, SweepError, Swept, Target, path_cells, path_header};
use crate::journal::{Journal, Rows, claim};

/// A run's row of the table, as text, and of the table of paths.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Number of the run, from 1.
    pub number: usize,
    /// Cells after the number.
    pub cells: Vec<String>,
    /// Cells of its path.
    pub path: Vec<String>,
}

/// The tables of a campaign on their way.
#[derive(Debug)]
pub struct Ledger {
    table: Journal,
    rows: Rows,
    paths: Option<(Journal, Rows)>,
    resumed: usize,
}

impl Campaign {
    /// Opens or begins the tables of a campaign, with the rows that are there already.
    ///
    /// # Errors
    /// The directory holds another sweep, or a table cannot be read or written.
    pub fn open(&self, target: &Target<'_>) -> Result<Ledger, SweepError> {
        let name = |end: &str| format!("{}{end}.csv", target.stem);
        let (table, paths) = (name(""), name("_paths"));
        claim(target.directory, target.stem, &self.about(), &[&table, &paths], target.fresh)?;
        let total = self.design.runs();
        let journal = |name: &Path, header: &[String]| Journal::open(&target.directory.join(name), header, total);
        let (table, mut rows) = journal(Path::new(&table), &self.header())?;
        let paths =
            target.paths.then(|| journal(Path::new(&paths), &path_header(self.settings.seconds))).transpose()?;
        if let Some((_, there)) = &paths {
            rows.retain(|number, _| there.contains_key(number));
        }
        Ok(Ledger { table, resumed: rows.len(), rows, paths })
    }

    /// The runs that a ledger lacks, from 0, those of a group to be made side by side.
    ///
    /// # Errors
    /// A robot cannot be made.
    pub fn pending(&self, ledger: &Ledger) -> Result<Vec<Vec<usize>>, SweepError> {
        self.groups((0..self.design.runs()).filter(|run| !ledger.rows.contains_key(&(run + 1))))
    }

    /// All runs, from 0, those of a group to be made side by side.
    ///
    /// # Errors
    /// A robot cannot be made.
    pub fn all(&self) -> Result<Vec<Vec<usize>>, SweepError> {
        self.groups(0..self.design.runs())
    }

    /// Makes a group of runs.
    ///
    /// # Errors
    /// A run cannot be made.
    pub fn rows(&self, runs: &[usize]) -> Result<Vec<Row>, SweepError> {
        let made = self.group(runs)?;
        let row = |(run, outcome): &(usize, _)| Row {
            number: run + 1,
            cells: self.cells(*run, outcome),
            path: path_cells(&outcome.path),
        };
        Ok(made.iter().map(row).collect())
    }

    /// Writes the tables sorted and reads what is in them.
    ///
    /// # Errors
    /// A table cannot be written.
    pub fn finish(self, ledger: Ledger) -> Result<Swept, SweepError> {
        let Ledger { table, rows, paths, resumed } = ledger;
        let paths = match paths {
            Some((journal, there)) => Some((journal.finish(&there)?, there)),
            None => None,
        };
        let file = table.finish(&rows)?;
        let runs: Vec<Run> =
            (0..self.design.runs()).map(|run| self.read(run, &rows, paths.as_ref().map(|(_, rows)| rows))).collect();
        let paths_file: Option<PathBuf> = paths.map(|(file, _)| file);
        Ok(Swept { design: self.design, runs, resumed, file, paths_file })
    }
}

impl Ledger {
    /// Rows that are there.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Of them, those that were there when it was opened.
    #[must_use]
    pub fn resumed(&self) -> usize {
        self.resumed
    }

    /// Keeps rows: the path before its row, for a row without a path is made again, and a path without a row is not looked at.
    ///
    /// # Errors
    /// They cannot be written; what was there before stays whole.
    pub fn book(&mut self, rows: Vec<Row>) -> Result<(), SweepError> {
        if let Some((journal, there)) = &mut self.paths {
            let new: Vec<_> = rows.iter().map(|row| (row.number, row.path.clone())).collect();
            journal.append(&new)?;
            there.extend(new);
        }
        let new: Vec<_> = rows.into_iter().map(|row| (row.number, row.cells)).collect();
        self.table.append(&new)?;
        self.rows.extend(new);
        Ok(())
    }
}
