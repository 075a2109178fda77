//! Files of other rigs: any bytes as a table of text, a `.mat` file, a log of BAM, or the mapping that reads them.
//!
//! The first byte is the kind of file, the second which columns are mapped; the rest is the file.

use recording::import::{Mapping, import as read};
use recording::{ReadOptions, Recording, Window, load, write_csv};

use crate::bytes::Bytes;
use crate::scratch::Scratch;

/// What reads a table whose columns are called `t`, `a`, `u` and `v`.
const WORDS: [[&str; 2]; 4] = [
    ["angle=a:deg", "speed=a:rpm"],
    ["duty=u:255", "voltage=u:mV"],
    ["supply=v:V", "goal=v:counts/4096-2048"],
    ["current=v:mA", "enable=v"],
];

/// A file of another rig: what is imported is a recording, written and read again as the same.
pub fn import(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let (kind, mapped) = (bytes.u8(), bytes.u8());
    let rest = data.get(2..).unwrap_or_default();
    let scratch = Scratch::new();
    let name = ["rig.csv", "rig.mat", "rig.json", "rig.toml"][usize::from(kind % 4)];
    let path = scratch.file(name, rest);
    if name == "rig.toml" {
        if let Err(error) = Mapping::load(&path) {
            told(error);
        }
        return;
    }
    let window = Window { from_s: (mapped & 0x40 != 0).then_some(0.002), to_s: (mapped & 0x80 != 0).then_some(0.008) };
    let options = ReadOptions { window, ..ReadOptions::default() };
    // A log says itself what its columns are.
    let mapping = if name == "rig.json" { Mapping::default() } else { mapping(mapped) };
    match read(&path, &mapping, &options) {
        Ok(imported) => {
            let recording = imported.loaded.recording;
            assert!(recording.len() <= rest.len(), "{} samples in {} bytes", recording.len(), rest.len());
            let again = scratch.file("again.csv", b"");
            write_csv(&again, &recording).expect("what is imported is written");
            let read = load(&again).expect("what was written is read");
            assert_eq!(Recording { path: recording.path.clone(), ..read }, recording);
        }
        Err(error) => told(error),
    }
}

fn mapping(bits: u8) -> Mapping {
    let mut mapping = Mapping { rate_hz: (bits & 0x20 != 0).then_some(1000.0), ..Mapping::default() };
    mapping.control.gain = Some(32.0);
    if bits & 0x20 == 0 {
        mapping.map("time=t:ms").expect("words");
    }
    for (place, [one, other]) in WORDS.into_iter().enumerate() {
        // The first two are always needed.
        if place < 2 || bits & 0x10 != 0 {
            mapping.map(if bits & (1 << place) == 0 { one } else { other }).expect("words");
        }
    }
    mapping
}

/// As a person sees it.
fn told(error: recording::RecordingError) {
    assert!(!error.to_string().is_empty());
    assert!(!format!("{:?}", miette::Report::new(error)).is_empty());
}
