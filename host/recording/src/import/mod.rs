//! Recordings of other people's rigs: a mapping says which column of a foreign file holds what, and in which unit.
//!
//! [`import`] reads a table (`delimited.rs`: CSV; `matlab.rs`; `bam.rs`: the logs of BAM), `convert.rs` makes a [`Recording`](crate::Recording) of
//! it, and `checks.rs` looks for units that cannot be meant. Nothing is lost silently: what was left out is in
//! [`ImportRecord`], which the recording's metadata keep, and in the notes. See `docs/import.md`.

mod bam;
mod checks;
mod convert;
mod delimited;
mod goal;
mod mapping;
mod matlab;
mod table;
mod units;

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Loaded, Metadata, ReadOptions, RecordingError};
use convert::Converted;
use table::{Table, listed};

pub use goal::PositionControl;
pub use mapping::{Mapping, MappingError, Source};
pub use units::{Quantity, Unit};

/// What was imported from where, for the metadata of a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImportRecord {
    /// Path of the foreign file, as given.
    pub source: String,
    /// The mapping, as on the command line, e.g. `angle=Pos:deg`.
    pub mapping: Vec<String>,
    /// Rows in the foreign file.
    pub rows: u64,
    /// Rows that became samples.
    pub samples: u64,
    /// What became of the other rows and of cells without a value, in words.
    #[serde(default)]
    pub left_out: Vec<String>,
    /// Columns of the foreign file that are not mapped.
    #[serde(default)]
    pub not_mapped: Vec<String>,
}

/// An imported recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The recording, its metadata with the [`ImportRecord`], and what was left out.
    pub loaded: Loaded,
    /// What looks wrong, but may be meant.
    pub warnings: Vec<String>,
}

/// Reads a file of another rig.
///
/// # Errors
/// The file cannot be read, a mapped column is not there, a value is none that a rig measures, or the time does not increase.
pub fn import(path: &Path, mapping: &Mapping, options: &ReadOptions) -> Result<Imported, RecordingError> {
    read(path, mapping, options).map_err(|error| match error {
        // The advice for recordings names their columns.
        RecordingError::Empty { path } => RecordingError::Format {
            path,
            problem: "the file is empty".into(),
            help: "was the logger stopped before its first row? Record the run again".into(),
        },
        other => other,
    })
}

/// By the kind of file.
fn read(path: &Path, mapping: &Mapping, options: &ReadOptions) -> Result<Imported, RecordingError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "csv" | "tsv" | "txt" | "dat" => {
            let table = delimited::read(path, &mapping.wanted(), options.progress)?;
            finish(&table, mapping, options, Metadata::default(), Vec::new())
        }
        "mat" => {
            let table = matlab::read(path, &mapping.wanted())?;
            finish(&table, mapping, options, Metadata::default(), Vec::new())
        }
        "json" => {
            let log = bam::Log::load(path)?;
            let (mapping, notes) = log.complete(mapping)?;
            finish(&log.table(&mapping.wanted())?, &mapping, options, log.metadata(), notes)
        }
        _ => Err(RecordingError::Format {
            path: path.to_owned(),
            problem:
                "files that are imported end with .csv, .tsv, .txt or .dat (tables of text), .mat or .json (logs of BAM)"
                    .into(),
            help: "rename the file if it is one of them, or save its table as CSV".into(),
        }),
    }
}

/// From a table to a recording.
fn finish(
    table: &Table,
    mapping: &Mapping,
    options: &ReadOptions,
    metadata: Metadata,
    mut notes: Vec<String>,
) -> Result<Imported, RecordingError> {
    let Converted { recording, kept, left_out, mut warnings } = convert::convert(table, mapping, options)?;
    warnings.extend(checks::look(&recording, table, mapping));
    let record = ImportRecord {
        source: table.path.display().to_string(),
        mapping: mapping.words(),
        rows: table.rows.len() as u64,
        samples: kept.rows,
        left_out,
        not_mapped: table.unread(),
    };
    notes.extend(record.left_out.iter().cloned());
    if !record.not_mapped.is_empty() {
        notes.push(format!("columns that are not mapped: {}", listed(&record.not_mapped)));
    }
    notes.extend(kept.notes());
    let metadata = Metadata { import: Some(record), ..metadata };
    Ok(Imported { loaded: Loaded { recording, metadata, kept, notes }, warnings })
}
