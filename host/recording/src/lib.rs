//! A recording in memory: one run of a rig, columns of equal length. Reading and writing live in the submodules.
//!
//! Column names, units and meaning are those of the exchange format: see `docs/recordings.md`. [`load`] reads a CSV or MCAP
//! file, [`write_mcap`] and [`write_csv`] write one, [`SessionRecorder`] writes while a session lasts, and [`mod@import`] reads files
//! of other rigs by a mapping of their columns.
//!
//! ```
//! use recording::{AngleReading, Drive, Recording, load, write_mcap};
//!
//! let directory = tempfile::tempdir()?;
//! let path = directory.path().join("run.mcap");
//! let run = Recording {
//!     t_s: vec![0.0, 0.001, 0.002],
//!     enable: vec![true; 3],
//!     drive: Drive::Duty(vec![0.5; 3]),
//!     angle: AngleReading::Angle(vec![Some(0.0), None, Some(0.02)]),
//!     ..Recording::default()
//! };
//! write_mcap(&path, &run)?;
//! assert_eq!(load(&path)?.angle, run.angle);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It does not interpret a recording: the crates `diagnose` and `simulation` do.
//! * It draws nothing and prints nothing: [`Progress`] is told how far a file is read.
//! * It does not read files larger than memory whole: blocks of samples are dropped and [`Kept`] says which share is left.

mod builder;
mod columns;
mod csv_read;
mod csv_write;
mod entries;
mod error;
pub mod import;
mod mcap_chunks;
mod mcap_others;
mod mcap_read;
mod mcap_scene;
mod mcap_stream;
mod mcap_write;
mod metadata;
mod plausible;
mod progress;
mod rig;
mod rows;
mod run;
mod run_log;
mod scene;
mod schema;
mod sink;
mod stream;
mod telemetry;
mod window;
mod words;

use std::path::{Path, PathBuf};

pub use builder::Kept;
pub use columns::Cells;
pub use csv_write::{write_csv, write_csv_run, write_csv_with};
pub use entries::{Entry, FullRow, entries, entries_with, events};
pub use error::{Left, Place, RecordingError, RowNumber, does_not_fit, is_disk_full};
pub use mcap_others::Others;
pub use mcap_write::{write_mcap, write_mcap_with};
pub use metadata::Metadata;
pub use progress::Progress;
pub use rig::{mean_supply_v, require_same_rig, supply_problem};
pub use rows::standard_names as column_names;
pub use run::Run;
pub use run_log::{LoggedCommand, RunLog};
pub use scene::{Form, Scene, SceneFoot, SceneFrame, ScenePose, SceneState, Shape, WORLD};
pub use stream::{RobotChannel, SessionRecorder};
pub use telemetry::{
    LinkQuality, MeasuredPose, Outcome, ParameterValue, RecordedEvent, SessionEvent, Stated, TelemetryRow,
};
pub use window::Window;
pub use words::fault;

/// Samples of one run, one vector per column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Where it was read from, for messages; empty for a run made in memory.
    pub path: PathBuf,
    /// Seconds, strictly increasing.
    pub t_s: Vec<f64>,
    /// `true` while the bridge drives. All true where the file has no such column.
    pub enable: Vec<bool>,
    /// How the motor was driven.
    pub drive: Drive,
    /// What the angle sensor said.
    pub angle: AngleReading,
    /// Raw ADC code of the second angle sensor; `None` for a missing cell. Empty when there is no column.
    pub adc_second: Vec<Option<u16>>,
    /// Bridge supply, V, where measured (NaN-free; empty when there is no column).
    pub supply_v: Vec<f64>,
    /// Motor current, A, where measured; `None` for a missing cell. Empty when there is no column.
    pub current_a: Vec<Option<f64>>,
    /// Temperature, °C, where measured. Empty when there is no column.
    pub temperature_c: Vec<Option<f64>>,
    /// Pose over the ground: mean of the modules' centres x and y, m, and heading, rad, counter-clockwise, not wrapped. Empty where
    /// one of the three columns is missing.
    pub pose: Vec<Option<[f64; 3]>>,
}

/// The drive column.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// Commanded bridge duty, −1 … 1.
    Duty(Vec<f64>),
    /// Voltage at the motor's terminals, V.
    Voltage(Vec<f64>),
}

impl Default for Drive {
    fn default() -> Self {
        Self::Duty(Vec::new())
    }
}

/// The angle column; `None` where the cell is empty (in the blind arc).
#[derive(Clone, Debug, PartialEq)]
pub enum AngleReading {
    /// Shaft angle, rad, wrapped or not.
    Angle(Vec<Option<f64>>),
    /// Raw ADC code.
    Adc(Vec<Option<u16>>),
}

impl Default for AngleReading {
    fn default() -> Self {
        Self::Angle(Vec::new())
    }
}

impl Recording {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Fails where there are fewer samples than a use needs.
    ///
    /// # Errors
    /// [`RecordingError::TooShort`].
    pub fn require_samples(&self, needed: usize) -> Result<(), RecordingError> {
        if self.len() < needed {
            return Err(RecordingError::TooShort { path: self.path.clone(), samples: self.len(), needed });
        }
        Ok(())
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }
}

/// Samples held at most when nothing else is asked for: 75 MB, and a quarter of an hour at 1 kHz.
pub const DEFAULT_LIMIT: usize = 1_000_000;

/// A column beside the standard ones, e.g. the truth of a simulation. One value a sample; `None` is an empty cell.
#[derive(Clone, Debug, PartialEq)]
pub struct ExtraColumn {
    /// Its name, with the unit at the end.
    pub name: String,
    /// Its values.
    pub values: Vec<Option<f64>>,
}

/// Options of [`load_with`].
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Samples held at most; a longer recording is thinned by dropping whole blocks (see [`Kept`]).
    pub limit: usize,
    /// Who watches the reading.
    pub progress: Option<Progress>,
    /// What is read; the whole run where nothing is said.
    pub window: Window,
    /// Which robot, by its name in the file; needed where a session has several.
    pub robot: Option<String>,
    /// Values that no rig measures are taken as they are written, instead of refused as in another unit: for whoever compares
    /// the recording with its rig and can tell which unit.
    pub as_written: bool,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { limit: DEFAULT_LIMIT, progress: None, window: Window::default(), robot: None, as_written: false }
    }
}

/// A recording as read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The samples.
    pub recording: Recording,
    /// What `RUN.toml` or the MCAP file says about the run.
    pub metadata: Metadata,
    /// How much of the file is in memory.
    pub kept: Kept,
    /// What a person should know: columns that were ignored, blocks that were dropped, a file without its end.
    pub notes: Vec<String>,
}

/// Reads a CSV or MCAP recording, told apart by the file name's extension.
///
/// # Errors
/// The file cannot be read, is not in the exchange format, or holds values that no rig measures.
pub fn load(path: &Path) -> Result<Recording, RecordingError> {
    load_with(path, &ReadOptions::default()).map(|loaded| loaded.recording)
}

/// [`load`] with options, metadata and notes.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, options: &ReadOptions) -> Result<Loaded, RecordingError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "csv" => csv_read::read(path, options),
        "mcap" => mcap_read::read(path, options),
        _ => Err(RecordingError::UnknownKind { path: path.to_owned() }),
    }
}

/// Reads a CSV recording, whatever its name.
///
/// # Errors
/// As [`load`].
pub fn read_csv(path: &Path) -> Result<Recording, RecordingError> {
    csv_read::read(path, &ReadOptions::default()).map(|loaded| loaded.recording)
}

/// Reads an MCAP recording, whatever its name.
///
/// # Errors
/// As [`load`].
pub fn read_mcap(path: &Path) -> Result<Recording, RecordingError> {
    mcap_read::read(path, &ReadOptions::default()).map(|loaded| loaded.recording)
}
