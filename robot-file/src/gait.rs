//! Files of learned gaits (`robots/gaits/NAME.toml`): reading with errors that name line and field, and writing. The format is in
//! docs/gaits.md.
//!
//! ```
//! use std::f32::consts::PI;
//!
//! use robot_file::gait::GaitFile;
//!
//! let text = "name = \"to-and-fro\"\ninterval_s = 0.04\nrepeat = true\nsteps_hz = [7, 7, -6.5]\n";
//! let file = GaitFile::parse(text, "to-and-fro.toml")?;
//! // Hz clockwise in the file, rad/s counter-clockwise in the robot: the speeds that occur, in the order of their frequencies.
//! let expected = [13.0 * PI, -14.0 * PI];
//! assert!(file.gait().speeds().iter().zip(expected).all(|(speed, expected)| (speed - expected).abs() < 1e-5));
//! assert_eq!(GaitFile::parse(&file.to_toml(), "again.toml")?, file);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use common::atomic::write_atomically;
use common::conventions::omega_from_frequency;
use control::Gait;
use control::gait::{LONGEST_INTERVAL_MS, LONGEST_NAME, MOST_SPEEDS, Name, SHORTEST_INTERVAL_MS};

use crate::error::{Problem, RobotFileError};
use crate::schema::{Place, Reader};
use crate::tree::{self, Table, Value};
use crate::unit;

/// Where the project's own gaits are.
const DIRECTORY: &str = "robots/gaits";
const KEYS: [&str; 5] = ["name", "interval_s", "repeat", "steps_hz", "made_by"];
/// Steps in a line of a written file.
const STEPS_IN_LINE: usize = 20;
/// What a number in s may miss a whole number of ms by, ms.
const UNEVEN_MS: f64 = 1e-6;

/// A gait as its file has it. Every one can be a [`Gait`]; whether a robot can play it the robot says.
#[derive(Clone, Debug, PartialEq)]
pub struct GaitFile {
    interval_s: f64,
    steps_hz: Vec<f64>,
    /// What made it: free texts, e.g. `robot`, `seed` and `command`.
    pub made_by: BTreeMap<String, String>,
    gait: Gait,
}

/// Why steps make no gait.
struct Wrong {
    field: &'static str,
    message: String,
}

impl GaitFile {
    /// A gait of frequencies (Hz, clockwise positive, at most [`MOST_SPEEDS`] different ones), each held for `interval_s` (s, whole
    /// milliseconds), of at most [`control::gait::MOST_STEPS`] steps; `repeat`: it begins again after the last. Its name has 1 to [`LONGEST_NAME`]
    /// letters, digits, `-`, `_` and `.`.
    ///
    /// # Errors
    /// What is wrong, naming the field that it would have in a file.
    pub fn new(name: &str, interval_s: f64, repeat: bool, steps_hz: &[f64]) -> Result<Self, RobotFileError> {
        Self::of(name, interval_s, repeat, steps_hz).map_err(|Wrong { field, message }| {
            RobotFileError::new(vec![Problem::without_text(name, format!("{field}: {message}"), None)])
        })
    }

    fn of(name: &str, interval_s: f64, repeat: bool, steps_hz: &[f64]) -> Result<Self, Wrong> {
        let wrong = |field, message| Wrong { field, message };
        let interval_ms = interval_ms(interval_s).map_err(|message| wrong("interval_s", message))?;
        let name = Name::new(name).ok_or_else(|| {
            wrong("name", format!("`{name}` is not 1 to {LONGEST_NAME} letters, digits, `-`, `_` and `.`"))
        })?;
        if let Some(hz) = steps_hz.iter().find(|hz| !hz.is_finite()) {
            return Err(wrong("steps_hz", format!("{hz} is not a finite number")));
        }
        let frequencies = frequencies(steps_hz);
        if frequencies.len() > MOST_SPEEDS {
            let message = format!("{} different frequencies, at most {MOST_SPEEDS} fit", frequencies.len());
            return Err(wrong("steps_hz", message));
        }
        let speeds: Vec<f32> = frequencies.iter().map(|hz| omega_from_frequency(*hz) as f32).collect();
        let index = |hz: &f64| frequencies.iter().position(|known| known == hz).unwrap_or_default() as u8;
        let indices: Vec<u8> = steps_hz.iter().map(index).collect();
        let gait = Gait::new(name, &speeds, &indices, interval_ms, repeat);
        let gait = gait.map_err(|refusal| wrong("steps_hz", refusal.to_string()))?;
        Ok(Self { interval_s, steps_hz: steps_hz.to_vec(), made_by: BTreeMap::new(), gait })
    }

    /// The file that a person means: a path, or the name of a gait in `robots/gaits`.
    #[must_use]
    pub fn path_of(name_or_path: &str) -> PathBuf {
        if name_or_path.ends_with(".toml") || name_or_path.contains(std::path::is_separator) {
            PathBuf::from(name_or_path)
        } else {
            Path::new(DIRECTORY).join(format!("{name_or_path}.toml"))
        }
    }

    /// Names of the gaits in `robots/gaits`, sorted.
    #[must_use]
    pub fn known() -> Vec<String> {
        let files = std::fs::read_dir(DIRECTORY).into_iter().flatten().flatten();
        let names =
            files.filter_map(|file| file.file_name().into_string().ok()?.strip_suffix(".toml").map(str::to_owned));
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or something in it is wrong: everything that is.
    pub fn load(path: &Path) -> Result<Self, RobotFileError> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| {
            let help = match Self::known().join(", ") {
                known if known.is_empty() => "name a gait's file".to_owned(),
                known => format!("name a gait's file, or one of {DIRECTORY}: {known}"),
            };
            RobotFileError::new(vec![Problem::without_text(&name, format!("cannot be read: {error}"), Some(help))])
        })?;
        Self::parse(&text, &name)
    }

    /// From the text of a file; its name is for messages.
    ///
    /// # Errors
    /// Everything that is wrong with it.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, RobotFileError> {
        let table = tree::read(text, file_name).map_err(RobotFileError::new)?;
        let mut reader = Reader::default();
        reader.refuse_unknown(&table, "", &KEYS);
        let read = Self::read(&mut reader, &table);
        match read {
            Some(file) if reader.problems.is_empty() => Ok(file),
            _ => Err(RobotFileError::new(reader.problems)),
        }
    }

    fn read(reader: &mut Reader, table: &Table) -> Option<Self> {
        let place = |key, meaning| Place { table, path: "", key, meaning };
        let name = text(reader, &place("name", "what people and robots call it"));
        let interval_s = interval(reader, &place("interval_s", "how long each step is held"));
        let repeat = flag(reader, &place("repeat", "whether it begins again after its last step"));
        let steps_hz = steps(reader, &place("steps_hz", "the frequency of each step, clockwise positive"));
        let made_by = made_by(reader, &place("made_by", "what made it, free texts"));
        match Self::of(&name?, interval_s?, repeat?, &steps_hz?) {
            Ok(file) => Some(Self { made_by: made_by?, ..file }),
            Err(Wrong { field, message }) => {
                let at = table.get(field).map_or(&table.at, |entry| &entry.value_at);
                reader.wrong(at, field, message, None);
                None
            }
        }
    }

    /// What the robot plays.
    #[must_use]
    pub fn gait(&self) -> &Gait {
        &self.gait
    }

    /// How long each step is held, s.
    #[must_use]
    pub fn interval_s(&self) -> f64 {
        self.interval_s
    }

    /// From its beginning to its end, s.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        self.interval_s * self.steps_hz.len() as f64
    }

    /// The frequency of each step, Hz, clockwise positive.
    #[must_use]
    pub fn steps_hz(&self) -> &[f64] {
        &self.steps_hz
    }

    /// As a file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let quoted = |text: &str| toml_edit::Value::from(text).to_string();
        let mut text = format!(
            "name = {}\ninterval_s = {}\nrepeat = {}\nsteps_hz = [\n",
            quoted(self.gait.name().as_str()),
            unit::exact(self.interval_s),
            self.gait.repeats()
        );
        for line in self.steps_hz.chunks(STEPS_IN_LINE) {
            let line: Vec<String> = line.iter().map(|hz| unit::exact(*hz)).collect();
            let _ = writeln!(text, "    {},", line.join(", "));
        }
        text.push_str("]\n");
        if !self.made_by.is_empty() {
            text.push_str("\n[made_by]\n");
            for (key, value) in &self.made_by {
                let _ = writeln!(text, "{} = {}", quoted(key), quoted(value));
            }
        }
        text
    }

    /// Writes it, whole or not at all.
    ///
    /// # Errors
    /// The file system says no.
    pub fn save(&self, path: &Path) -> Result<(), RobotFileError> {
        write_atomically(path, |file| file.write_all(self.to_toml().as_bytes())).map_err(|error: std::io::Error| {
            let message = format!("cannot be written: {error}");
            RobotFileError::new(vec![Problem::without_text(&path.display().to_string(), message, None)])
        })
    }
}

/// The different ones, from the lowest.
fn frequencies(steps_hz: &[f64]) -> Vec<f64> {
    let mut frequencies = steps_hz.to_vec();
    frequencies.sort_by(f64::total_cmp);
    // −0 is 0.
    frequencies.dedup_by(|a, b| a == b);
    frequencies
}

fn interval_ms(interval_s: f64) -> Result<u16, String> {
    let ms = interval_s * 1e3;
    let (low, high) = (f64::from(SHORTEST_INTERVAL_MS), f64::from(LONGEST_INTERVAL_MS));
    if !(low..=high).contains(&ms.round()) {
        return Err(format!("{interval_s} is outside the allowed {} … {} s", low * 1e-3, high * 1e-3));
    }
    if (ms - ms.round()).abs() > UNEVEN_MS {
        return Err(format!("{interval_s} s is not a whole number of milliseconds"));
    }
    Ok(ms.round() as u16)
}

fn text(reader: &mut Reader, place: &Place<'_>) -> Option<String> {
    let entry = reader.need(place, "field", format!("`{} = \"…\"`", place.key))?;
    let Value::Text(text) = &entry.value else {
        reader.wrong_type(place, entry, "a text");
        return None;
    };
    Some(text.clone())
}

fn interval(reader: &mut Reader, place: &Place<'_>) -> Option<f64> {
    let entry = reader.need(place, "field", format!("`{} = 0.04`", place.key))?;
    let Value::Number(seconds) = entry.value else {
        reader.wrong_type(place, entry, "a number in s");
        return None;
    };
    Some(seconds)
}

fn flag(reader: &mut Reader, place: &Place<'_>) -> Option<bool> {
    let entry = reader.need(place, "field", format!("`{} = true` or `false`", place.key))?;
    let Value::Boolean(flag) = entry.value else {
        reader.wrong_type(place, entry, "true or false");
        return None;
    };
    Some(flag)
}

fn steps(reader: &mut Reader, place: &Place<'_>) -> Option<Vec<f64>> {
    let entry = reader.need(place, "field", format!("`{} = [7, -7, …]`", place.key))?;
    let Value::Array(items) = &entry.value else {
        reader.wrong_type(place, entry, "frequencies in Hz, [7, -7, …]");
        return None;
    };
    let mut steps = Some(Vec::new());
    for (index, (at, item)) in items.iter().enumerate() {
        let step = match item {
            Value::Number(hz) => Some(*hz),
            other => {
                let message = format!("expected a number in Hz, found {}", other.what());
                reader.wrong(at, format!("{}[{index}]", place.key), message, None);
                None
            }
        };
        steps = steps.zip(step).map(|(mut steps, step)| {
            steps.push(step);
            steps
        });
    }
    steps
}

fn made_by(reader: &mut Reader, place: &Place<'_>) -> Option<BTreeMap<String, String>> {
    let Some(entry) = place.entry() else { return Some(BTreeMap::new()) };
    let Value::Table(table) = &entry.value else {
        reader.wrong_type(place, entry, "a table of texts");
        return None;
    };
    let mut texts = BTreeMap::new();
    for (key, entry) in &table.entries {
        if let Value::Text(text) = &entry.value {
            texts.insert(key.clone(), text.clone());
        } else {
            let message = format!("expected a text, found {}", entry.value.what());
            reader.wrong(&entry.value_at, crate::schema::join(place.key, key), message, None);
        }
    }
    Some(texts)
}
