//! What a controller was told and said in a run, written beside its samples for `scram replay`.

use std::path::Path;

use control::{Command, Gait};

use super::{ExtraColumn, Recording, RecordingError, Stated};

/// What a recording needs beside its columns to be decided again, bit for bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunLog {
    /// `time_us`, `battery_adc`, and `angle_code` of a digital sensor; one value a sample.
    pub numbers: Vec<ExtraColumn>,
    /// After every tick; one a sample, or none at all.
    pub stated: Vec<Stated>,
    /// What the controller was told, in this order.
    pub commands: Vec<LoggedCommand>,
}

/// A command and the tick before which it was given.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedCommand {
    /// Index of the sample.
    pub row: usize,
    /// As a person types it.
    pub text: String,
    /// What the controller was told, with the time of that sample; `None` where a file has the text only.
    pub command: Option<Command>,
    /// The command before, told again to keep it fresh.
    pub repeat: bool,
    /// Instead of a command: the gait that the controller was to keep.
    pub gait: Option<Gait>,
}

impl RunLog {
    /// Fails unless it has one value a sample, and commands at samples.
    pub(super) fn check(&self, path: &Path, recording: &Recording) -> Result<(), RecordingError> {
        let n = recording.len();
        let even = self.numbers.iter().all(|column| column.values.len() == n)
            && (self.stated.is_empty() || self.stated.len() == n)
            && self.commands.is_sorted_by_key(|command| command.row)
            && self.commands.last().is_none_or(|command| command.row < n);
        if even {
            return Ok(());
        }
        Err(RecordingError::Format {
            path: path.to_owned(),
            problem: format!("not written: the log does not fit the {n} samples"),
            help: "give it one value a sample, and orders in the order of their samples".into(),
        })
    }

    /// The commands before a sample; `from` is the index of the first that was not given yet, and moves on.
    pub(super) fn commands_before(&self, row: usize, from: &mut usize) -> &[LoggedCommand] {
        let rest = self.commands.get(*from..).unwrap_or_default();
        let count = rest.iter().take_while(|command| command.row <= row).count();
        *from += count;
        &rest[..count]
    }
}
