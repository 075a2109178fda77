//! A run from columns in memory, checked as the rows of a file are.

use std::path::Path;

use super::builder::{Builder, Layout, Values};
use super::error::RowNumber;
use super::{ExtraColumn, Metadata, RecordingError, Run, Window};

impl Run {
    /// Of columns by their names in the exchange format, NaN for an empty cell; others are kept as they are. Messages call the run by
    /// `name`, and count rows from 1.
    ///
    /// # Errors
    /// Columns are missing, differ in length, or hold values that no rig measures.
    pub fn of_columns(
        name: &Path,
        columns: Vec<(String, Vec<f64>)>,
        metadata: Metadata,
    ) -> Result<Self, RecordingError> {
        let layout = Layout::of(name, columns.iter().map(|(name, _)| name.clone()).collect())?;
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        if let Some((other, values)) = columns.iter().find(|(_, values)| values.len() != rows) {
            return Err(RecordingError::Format {
                path: name.to_owned(),
                problem: format!("`{}` has {rows} values, `{other}` {}", columns[0].0, values.len()),
                help: "give every column one value a sample, NaN where nothing was measured".into(),
            });
        }
        let mut builder = Builder::new(name, &layout, usize::MAX, Window::default());
        for row in 0..rows {
            let mut values = Values::default();
            for (column, (_, cells)) in layout.columns.iter().zip(&columns) {
                if let Some(column) = column {
                    values.set(*column, number(cells[row]));
                }
            }
            builder.push(RowNumber::Entry(row as u64 + 1), &values)?;
        }
        let (recording, _) = builder.finish()?;
        let further = columns.into_iter().zip(&layout.columns).filter(|(_, standard)| standard.is_none());
        let extra =
            further.map(|((name, values), _)| ExtraColumn { name, values: values.into_iter().map(number).collect() });
        Ok(Self { recording, extra: extra.collect(), metadata, ..Self::default() })
    }
}

fn number(cell: f64) -> Option<f64> {
    (!cell.is_nan()).then_some(cell)
}
