//! Recordings: any bytes as a file, through every way of reading one.

use std::path::Path;

use recording::{ReadOptions, entries, events, load_with};

use crate::bytes::Bytes;
use crate::mcap;
use crate::scratch::Scratch;

/// The fewest that are kept, so that thinning happens.
const LIMIT: usize = 2000;
/// More things than bytes are not in a file.
const MOST_PER_BYTE: usize = 2;

/// An MCAP file: the bytes themselves, if they begin as one does, or else what they tell `mcap::file` to make.
pub fn recording_mcap(data: &[u8]) {
    let scratch = Scratch::new();
    let made = if data.starts_with(mcap::MAGIC) { data.to_vec() } else { mcap::file(Bytes::new(data)) };
    read(&scratch.file("run.mcap", &made), made.len());
}

/// A CSV file; behind a zero byte, the `RUN.toml` beside it.
pub fn recording_csv(data: &[u8]) {
    let scratch = Scratch::new();
    let mut parts = data.splitn(2, |byte| *byte == 0);
    let table = parts.next().unwrap_or_default();
    if let Some(metadata) = parts.next() {
        scratch.file("RUN.toml", metadata);
    }
    read(&scratch.file("run.csv", table), data.len());
}

fn read(path: &Path, length: usize) {
    for robot in [None, Some("one".to_owned())] {
        let options = ReadOptions { limit: LIMIT, robot, ..ReadOptions::default() };
        match load_with(path, &options) {
            Ok(loaded) => {
                assert!(loaded.recording.len() <= LIMIT, "{} samples are held", loaded.recording.len());
                assert!(loaded.recording.t_s.iter().all(|t_s| t_s.is_finite()));
            }
            Err(error) => told(error),
        }
        let mut count = 0;
        match entries(path, options.robot.as_deref(), &mut |_| count += 1) {
            Ok(()) => assert!(count <= MOST_PER_BYTE * length, "{count} entries in {length} bytes"),
            Err(error) => told(error),
        }
    }
    match events(path) {
        Ok(events) => assert!(events.len() <= MOST_PER_BYTE * length, "{} events in {length} bytes", events.len()),
        Err(error) => told(error),
    }
}

/// As a person sees it.
fn told(error: impl miette::Diagnostic + Send + Sync + 'static) {
    assert!(!error.to_string().is_empty());
    assert!(!format!("{:?}", miette::Report::new(error)).is_empty());
}
