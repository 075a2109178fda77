//! What is known about a run beside its samples.

use std::path::Path;

use control::State;
use serde::{Deserialize, Serialize};

use super::RecordingError;
use super::import::ImportRecord;

/// The contents of `RUN.toml` beside `RUN.csv`, or of the metadata record in an MCAP file. Every key is optional.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metadata {
    /// Name of the robot (the `name` in its robot file) that was recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// What drove the run, e.g. `chirp`; runs of one kind are alike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excitation: Option<String>,
    /// For people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub notes: Option<String>,
    /// Air temperature, °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// What the robot stood on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
    /// Tilt of the shaft's axis from the vertical, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tilt_deg: Option<f64>,
    /// Seed of a simulated run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// The controller's state before the first sample, e.g. `Idle` or, of a robot that has just started, `Fault`. Not
    /// known where recording began in the middle of a run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_state: Option<State>,
    /// Of a recording that [`crate::import`] made: from what, how, and what was left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub import: Option<ImportRecord>,
}

impl Metadata {
    /// What to do about metadata that are not understood.
    pub(super) const HELP: &str =
        "allowed keys: robot, excitation, notes, temperature_c, surface, tilt_deg, seed, start_state, import";

    /// Whether nothing is known.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Reads `RUN.toml` beside a recording; empty where there is none.
    pub(super) fn beside(recording: &Path) -> Result<Self, RecordingError> {
        let path = recording.with_extension("toml");
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(e) => return Err(RecordingError::io(&path, e)),
        };
        toml::from_str(&text).map_err(|e| {
            let line = e.span().map_or(0, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            RecordingError::Format {
                path: path.clone(),
                problem: format!("line {line}: {}", e.message()),
                help: Self::HELP.into(),
            }
        })
    }

    /// As the text of a `RUN.toml`.
    pub(super) fn to_toml(&self, path: &Path) -> Result<String, RecordingError> {
        toml::to_string(self).map_err(|e| RecordingError::Format {
            path: path.to_owned(),
            problem: format!("the metadata cannot be written as TOML: {e}"),
            help: "seeds above 2^63 − 1 do not fit into TOML".into(),
        })
    }
}
