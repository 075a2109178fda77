//! Writes the CSV exchange format. Numbers are the shortest text that reads back as the same f64.

use std::io::Write;
use std::path::Path;

use super::rows::{self, Cell};
use description::atomic::write_atomically;

use super::{ExtraColumn, Metadata, Recording, RecordingError};

/// Writes a recording; the file is whole or not there.
///
/// # Errors
/// The file system refuses, or the recording's columns differ in length.
pub fn write_csv(path: &Path, recording: &Recording) -> Result<(), RecordingError> {
    write_csv_with(path, recording, &[], &Metadata::default())
}

/// [`write_csv`] with further columns, and `RUN.toml` beside it where there is metadata.
///
/// # Errors
/// As [`write_csv`].
pub fn write_csv_with(
    path: &Path,
    recording: &Recording,
    extra: &[ExtraColumn],
    metadata: &Metadata,
) -> Result<(), RecordingError> {
    rows::check_rectangular(path, recording, extra)?;
    let io = |e| RecordingError::io(path, e);
    if !metadata.is_empty() {
        let text = metadata.to_toml(path)?;
        let beside = path.with_extension("toml");
        write_atomically::<std::io::Error>(&beside, |w| w.write_all(text.as_bytes()))
            .map_err(|e| RecordingError::io(&beside, e))?;
    }
    write_atomically::<std::io::Error>(path, |w| {
        let mut names = rows::standard_names(recording);
        names.extend(extra.iter().map(|column| column.name.as_str()));
        writeln!(w, "{}", names.join(","))?;
        let mut cells = Vec::new();
        for row in 0..recording.len() {
            rows::standard_cells(recording, row, &mut cells);
            cells.extend(extra.iter().map(|column| Cell::from(column.values[row])));
            for (index, cell) in cells.iter().enumerate() {
                if index > 0 {
                    w.write_all(b",")?;
                }
                match cell {
                    Cell::Empty => {}
                    Cell::Number(value) => write!(w, "{value}")?,
                    Cell::Whole(value) => write!(w, "{value}")?,
                }
            }
            w.write_all(b"\n")?;
        }
        Ok(())
    })
    .map_err(io)
}
