//! A run from columns in memory, checked as the rows of a file are.

use std::path::Path;

use super::builder::{Builder, Layout, Values};
use super::error::RowNumber;
use super::run::{Beside, is_told};
use super::{ExtraColumn, Metadata, RecordingError, Run, Window};

/// A column in memory.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// NaN is an empty cell.
    Numbers(Vec<f64>),
    /// An empty word is an empty cell.
    Words(Vec<String>),
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(cells) => cells.len(),
            Self::Words(cells) => cells.len(),
        }
    }

    fn number(&self, row: usize) -> Option<f64> {
        match self {
            Self::Numbers(cells) => cells.get(row).copied().filter(|cell| !cell.is_nan()),
            Self::Words(_) => None,
        }
    }

    /// As a file would spell it: a word, or of a number whether it is one.
    fn word(&self, row: usize) -> Option<&str> {
        match self {
            Self::Numbers(_) => self.number(row).map(|cell| if cell == 1.0 { "1" } else { "0" }),
            Self::Words(cells) => cells.get(row).map(String::as_str).filter(|cell| !cell.is_empty()),
        }
    }
}

impl Run {
    /// Of columns by their names in the exchange format; others are kept where they are numbers, as of a file. Messages call the run by
    /// `name`, and count rows from 1.
    ///
    /// # Errors
    /// Columns are missing, differ in length, or hold words or values that no rig measures.
    pub fn of_columns(name: &Path, columns: Vec<(String, Cells)>, metadata: Metadata) -> Result<Self, RecordingError> {
        let layout = Layout::of(name, columns.iter().map(|(name, _)| name.clone()).collect())?;
        let rows = columns.first().map_or(0, |(_, cells)| cells.len());
        let wrong = |problem, help: &str| RecordingError::Format { path: name.to_owned(), problem, help: help.into() };
        if let Some((other, cells)) = columns.iter().find(|(_, cells)| cells.len() != rows) {
            let problem = format!("`{}` has {rows} values, `{other}` {}", columns[0].0, cells.len());
            return Err(wrong(problem, "give every column one value a sample, NaN where nothing was measured"));
        }
        let is_wordy =
            |(standard, (_, cells)): &(&Option<_>, &(_, Cells))| standard.is_some() && matches!(cells, Cells::Words(_));
        if let Some((_, (column, _))) = layout.columns.iter().zip(&columns).find(is_wordy) {
            let problem = format!("column `{column}`: it has words, and numbers are expected");
            return Err(wrong(problem, "make numbers of them, NaN where nothing was measured"));
        }
        let mut builder = Builder::new(name, &layout, usize::MAX, Window::default());
        let mut beside = Beside::of(rows);
        for row in 0..rows {
            let mut values = Values::default();
            for (column, (_, cells)) in layout.columns.iter().zip(&columns) {
                if let Some(column) = column {
                    values.set(*column, cells.number(row));
                }
            }
            builder.push(RowNumber::Entry(row as u64 + 1), &values)?;
            beside.row = row;
            beside.told(&|name| columns.iter().find(|(column, _)| column == name)?.1.word(row));
        }
        let (recording, _) = builder.finish()?;
        let mut run = Self { recording, metadata, ..Self::default() };
        for ((name, cells), standard) in columns.into_iter().zip(&layout.columns) {
            match cells {
                _ if standard.is_some() || is_told(&name) => {}
                Cells::Words(_) => beside.words.push(name),
                Cells::Numbers(cells) => beside.columns.push(ExtraColumn {
                    name,
                    values: cells.into_iter().map(|cell| (!cell.is_nan()).then_some(cell)).collect(),
                }),
            }
        }
        beside.give(&mut run);
        Ok(run)
    }
}
