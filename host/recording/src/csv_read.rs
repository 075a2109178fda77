//! Reads the CSV exchange format, row by row.

use std::path::Path;

use csv::{ByteRecord, ReaderBuilder};

use super::builder::{Builder, Layout, UNREAD, Values};
use super::error::RowNumber;
use super::{Loaded, Metadata, Place, ReadOptions, RecordingError, progress};

/// Reads a file and `RUN.toml` beside it.
pub(super) fn read(path: &Path, options: &ReadOptions) -> Result<Loaded, RecordingError> {
    let metadata = Metadata::beside(path)?;
    let file = progress::open(path, options.progress).map_err(|e| RecordingError::io(path, e))?;
    // Flexible: a row that is too short is our error to explain.
    let mut reader = ReaderBuilder::new().flexible(true).buffer_capacity(1 << 16).from_reader(file);
    let layout = layout(path, reader.byte_headers().map_err(|e| csv_error(path, e))?)?;

    let mut builder = Builder::new(path, &layout, options.limit, options.window).judging_units(options.as_written);
    let mut record = ByteRecord::new();
    while reader.read_byte_record(&mut record).map_err(|e| csv_error(path, e))? {
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != layout.columns.len() {
            let mut next = ByteRecord::new();
            let last = !reader.read_byte_record(&mut next).map_err(|e| csv_error(path, e))?;
            return Err(wrong_length(path, line, record.len(), layout.columns.len(), last));
        }
        let mut values = Values::default();
        for ((cell, column), name) in record.iter().zip(&layout.columns).zip(&layout.names) {
            if let Some(column) = column {
                values.set(*column, number(path, line, name, cell)?);
            }
        }
        builder.push(RowNumber::Line(line), &values)?;
    }
    let (recording, kept) = builder.finish()?;

    let mut notes = Vec::new();
    let ignored = layout.ignored();
    if !ignored.is_empty() {
        notes.push(format!("{UNREAD}{}", ignored.join(", ")));
    }
    notes.extend(kept.notes());
    Ok(Loaded { recording, metadata, kept, notes })
}

fn layout(path: &Path, header: &ByteRecord) -> Result<Layout, RecordingError> {
    if header.is_empty() || (header.len() == 1 && header[0].trim_ascii().is_empty()) {
        return Err(RecordingError::Empty { path: path.to_owned() });
    }
    let mut names = Vec::with_capacity(header.len());
    for (index, cell) in header.iter().enumerate() {
        let name = std::str::from_utf8(cell).map_err(|_| not_utf8(path, 1, &format!("{}", index + 1)))?;
        // Spreadsheets put a byte order mark in front.
        names.push(name.trim_start_matches('\u{feff}').trim().to_owned());
    }
    if names.len() == 1 && names[0].contains([';', '\t']) {
        return Err(RecordingError::Format {
            path: path.to_owned(),
            problem: "line 1: the cells are not separated by commas".into(),
            help: "write the file with `,` between cells and `.` in numbers".into(),
        });
    }
    Layout::of(path, names)
}

/// A cell as a number; `None` when it is empty.
fn number(path: &Path, line: u64, column: &str, cell: &[u8]) -> Result<Option<f64>, RecordingError> {
    let cell = cell.trim_ascii();
    if cell.is_empty() {
        return Ok(None);
    }
    let text = std::str::from_utf8(cell).map_err(|_| not_utf8(path, line, column))?;
    let value = number_or_flag(text).ok_or_else(|| RecordingError::Cell {
        place: Place { path: path.to_owned(), row: RowNumber::Line(line) },
        column: column.to_owned(),
        problem: format!("`{}` is not a number", text.chars().take(40).collect::<String>()),
        help: "numbers are written as 0.25 or 2.5e-1; an empty cell is a missing value".into(),
    })?;
    Ok(Some(value))
}

/// The number in a cell. A truth value is 1 or 0, as in MCAP: data frames write columns of them as words.
pub(super) fn number_or_flag(cell: &str) -> Option<f64> {
    match cell {
        "true" | "True" | "TRUE" => Some(1.0),
        "false" | "False" | "FALSE" => Some(0.0),
        number => number.parse().ok(),
    }
}

pub(super) fn not_utf8(path: &Path, line: u64, column: &str) -> RecordingError {
    RecordingError::Cell {
        place: Place { path: path.to_owned(), row: RowNumber::Line(line) },
        column: column.to_owned(),
        problem: "these bytes are not UTF-8 text".into(),
        help: "save the file as CSV in UTF-8 (not UTF-16, not a spreadsheet)".into(),
    }
}

pub(super) fn wrong_length(path: &Path, line: u64, cells: usize, columns: usize, last: bool) -> RecordingError {
    let place = Place { path: path.to_owned(), row: RowNumber::Line(line) };
    if last && cells < columns {
        return RecordingError::RowNumber {
            place,
            problem: format!("the last line ends after {cells} of {columns} cells: the file was cut off"),
            help: "delete the last line".into(),
        };
    }
    RecordingError::RowNumber {
        place,
        problem: format!("{cells} cells, the header has {columns}"),
        help: "every line has one cell a column; leave a missing value empty but keep its comma".into(),
    }
}

fn csv_error(path: &Path, error: csv::Error) -> RecordingError {
    let text = error.to_string();
    match error.into_kind() {
        csv::ErrorKind::Io(source) => RecordingError::io(path, source),
        _ => RecordingError::Format {
            path: path.to_owned(),
            problem: text,
            help: "docs/recordings.md describes the format".into(),
        },
    }
}
