//! Writes the CSV exchange format. Numbers are the shortest text that reads back as the same f64.

use std::io::Write;
use std::path::Path;

use super::rows::{self, Cell};
use common::atomic::write_atomically;

use super::{ExtraColumn, Metadata, Recording, RecordingError, RunLog};

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
    write_csv_run(path, recording, extra, &RunLog::default(), metadata)
}

/// [`write_csv_with`] and what the controller was told and said: columns `state`, `fault`, `tracking`, where a sensor of two
/// failed `failed_sensor`, and `order` with what
/// was commanded before a tick, as a person types it.
///
/// # Errors
/// As [`write_csv`], and the log does not fit the samples.
pub fn write_csv_run(
    path: &Path,
    recording: &Recording,
    extra: &[ExtraColumn],
    log: &RunLog,
    metadata: &Metadata,
) -> Result<(), RecordingError> {
    rows::check_rectangular(path, recording, extra)?;
    log.check(path, recording)?;
    if !metadata.is_empty() {
        let text = metadata.to_toml(path)?;
        let beside = path.with_extension("toml");
        write_atomically::<std::io::Error>(&beside, |w| w.write_all(text.as_bytes()))
            .map_err(|e| RecordingError::io(&beside, e))?;
    }
    write_atomically::<std::io::Error>(path, |w| write(w, recording, extra, log))
        .map_err(|e| RecordingError::io(path, e))
}

fn write(w: &mut impl Write, recording: &Recording, extra: &[ExtraColumn], log: &RunLog) -> std::io::Result<()> {
    let mut names = rows::standard_names(recording);
    names.extend(log.numbers.iter().chain(extra).map(|column| column.name.as_str()));
    names.extend(if log.stated.is_empty() { &[][..] } else { &["state", "fault", "tracking"] });
    let has_failed = log.stated.iter().any(|stated| stated.failed_sensor.is_some());
    names.extend(has_failed.then_some("failed_sensor"));
    names.extend((!log.commands.is_empty()).then_some("order"));
    writeln!(w, "{}", names.join(","))?;
    let (mut cells, mut given) = (Vec::new(), 0);
    for row in 0..recording.len() {
        rows::standard_cells(recording, row, &mut cells);
        cells.extend(log.numbers.iter().chain(extra).map(|column| Cell::from(column.values[row])));
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
        if let Some(now) = log.stated.get(row) {
            let fault = now.fault.map_or_else(String::new, |fault| format!("{fault:?}"));
            write!(w, ",{:?},{fault},{}", now.state, u8::from(now.tracking))?;
            if has_failed {
                let failed = now.failed_sensor.map_or_else(String::new, |sensor| format!("{sensor:?}"));
                write!(w, ",{failed}")?;
            }
        }
        if !log.commands.is_empty() {
            let commands: Vec<&str> = log.commands_before(row, &mut given).iter().map(|o| o.text.as_str()).collect();
            write!(w, ",{}", commands.join("; "))?;
        }
        w.write_all(b"\n")?;
    }
    Ok(())
}
