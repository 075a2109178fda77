//! Files of learned gaits (`robots/gaits/NAME.toml`): reading with errors that name line and field, and writing. The format is in
//! docs/gaits.md.
//!
//! ```
//! use std::f32::consts::PI;
//!
//! use control::Motion;
//! use robot_file::gait::GaitFile;
//!
//! let text = "name = \"to-and-fro\"\ninterval_s = 0.04\nrepeat = true\nsteps_hz = [7, 7, -6.5]\n";
//! let file = GaitFile::parse(text, "to-and-fro.toml")?;
//! // Hz clockwise in the file, rad/s counter-clockwise in the robot: the speeds that occur, in the order of their frequencies.
//! let expected = [13.0 * PI, -14.0 * PI];
//! let near = |(motion, expected)| matches!(motion, Motion::Speed(speed) if f32::abs(speed - expected) < 1e-5);
//! assert!(file.gait().motions().zip(expected).all(near));
//! assert_eq!(GaitFile::parse(&file.to_toml(), "again.toml")?, file);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use common::atomic::write_atomically;
use common::conventions::{omega_from_frequency, radians};
use control::Gait;
use control::gait::{LONGEST_INTERVAL_MS, LONGEST_NAME, MOST_NUMBERS, Name, SHORTEST_INTERVAL_MS};

use crate::error::{Problem, RobotFileError};
use crate::schema::{Place, Reader};
use crate::tree::{self, At, Table, Value};
use crate::unit;

/// Where the project's own gaits are.
const DIRECTORY: &str = "robots/gaits";
const KEYS: [&str; 6] = ["name", "interval_s", "repeat", "steps_hz", "steps", "made_by"];
/// Steps in a line of a written file.
const STEPS_IN_LINE: usize = 20;
/// What a number in s may miss a whole number of ms by, ms.
const UNEVEN_MS: f64 = 1e-6;

/// What the shaft does for a step, in the units of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GaitStep {
    /// It turns at this frequency, Hz, clockwise positive.
    Frequency(f64),
    /// It swings from the first angle to the second and back, degrees counter-clockwise from the middle of the gap.
    Oscillation([f64; 2]),
}

impl From<f64> for GaitStep {
    fn from(hz: f64) -> Self {
        Self::Frequency(hz)
    }
}

impl std::fmt::Display for GaitStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Frequency(hz) => write!(f, "{hz} Hz"),
            Self::Oscillation([from, to]) => write!(f, "{from}°..{to}°"),
        }
    }
}

/// A gait as its file has it. Every one can be a [`Gait`]; whether a robot can play it the robot says.
#[derive(Clone, Debug, PartialEq)]
pub struct GaitFile {
    interval_s: f64,
    steps: Vec<GaitStep>,
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
    /// A gait of at most [`control::gait::MOST_STEPS`] steps, each held for `interval_s` (s, whole milliseconds); the different frequencies,
    /// and the different oscillations counted twice, are at most [`MOST_NUMBERS`]. `repeat`: it begins again after the last. Its name has 1
    /// to [`LONGEST_NAME`] letters, digits, `-`, `_` and `.`.
    ///
    /// # Errors
    /// What is wrong, naming the field that it would have in a file.
    pub fn new<S: Into<GaitStep> + Copy>(
        name: &str,
        interval_s: f64,
        repeat: bool,
        steps: &[S],
    ) -> Result<Self, RobotFileError> {
        let steps = steps.iter().map(|step| (*step).into()).collect();
        Self::of(name, interval_s, repeat, steps).map_err(|Wrong { field, message }| {
            RobotFileError::new(vec![Problem::without_text(name, format!("{field}: {message}"), None)])
        })
    }

    fn of(name: &str, interval_s: f64, repeat: bool, steps: Vec<GaitStep>) -> Result<Self, Wrong> {
        let wrong = |field, message| Wrong { field, message };
        let field = key_of(&steps);
        let interval_ms = interval_ms(interval_s).map_err(|message| wrong("interval_s", message))?;
        let name = Name::new(name).ok_or_else(|| {
            wrong("name", format!("`{name}` is not 1 to {LONGEST_NAME} letters, digits, `-`, `_` and `.`"))
        })?;
        let numbers = steps.iter().flat_map(|step| match step {
            GaitStep::Frequency(hz) => [*hz, 0.0],
            GaitStep::Oscillation(angles) => *angles,
        });
        if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
            return Err(wrong(field, format!("{number} is not a finite number")));
        }
        let (frequencies, oscillations) = motions(&steps);
        if frequencies.len() + 2 * oscillations.len() > MOST_NUMBERS {
            let swings = match oscillations.len() {
                0 => String::new(),
                count => format!(" and {count} oscillations, which count twice"),
            };
            let message = format!("{} different frequencies{swings}, at most {MOST_NUMBERS} fit", frequencies.len());
            return Err(wrong(field, message));
        }
        let index = |step: &GaitStep| match step {
            GaitStep::Frequency(hz) => frequencies.iter().position(|known| known == hz),
            GaitStep::Oscillation(angles) => {
                oscillations.iter().position(|known| known == angles).map(|place| frequencies.len() + place)
            }
        };
        let indices: Vec<u8> = steps.iter().map(|step| index(step).unwrap_or_default() as u8).collect();
        let speeds: Vec<f32> = frequencies.iter().map(|hz| omega_from_frequency(*hz) as f32).collect();
        let swings: Vec<[f32; 2]> = oscillations.iter().map(|angles| angles.map(|deg| radians(deg) as f32)).collect();
        let gait = Gait::new(name, &speeds, &swings, &indices, interval_ms, repeat);
        let gait = gait.map_err(|refusal| wrong(field, refusal.to_string()))?;
        Ok(Self { interval_s, steps, made_by: BTreeMap::new(), gait })
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

    /// Where the file that a person means may be, the likeliest first: [`Self::path_of`], and for a name also the `robots/gaits` beside the
    /// robot's file and in the folder above.
    #[must_use]
    pub fn places(name_or_path: &str, robot_file: Option<&Path>) -> Vec<PathBuf> {
        let given = Self::path_of(name_or_path);
        let is_name = given.starts_with(DIRECTORY) && given != Path::new(name_or_path);
        let folders = robot_file.into_iter().flat_map(|file| file.ancestors().skip(1).take(2));
        let beside: Vec<PathBuf> =
            folders.map(|folder| folder.join(&given)).filter(|place| is_name && *place != given).collect();
        std::iter::once(given).chain(beside).collect()
    }

    /// Names of the gaits in `robots/gaits`, sorted.
    #[must_use]
    pub fn known() -> Vec<String> {
        Self::known_in(Path::new(DIRECTORY))
    }

    /// Names of the gaits in a folder, sorted; none where there is no such folder.
    #[must_use]
    pub fn known_in(folder: &Path) -> Vec<String> {
        let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
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
        let of_frequencies = place("steps_hz", "the frequency of each step, clockwise positive");
        let of_both = place("steps", "the frequency or the oscillation of each step");
        let steps = match (of_both.entry(), of_frequencies.entry()) {
            (Some(entry), Some(_)) => {
                reader.wrong(
                    &entry.value_at,
                    "steps",
                    "there is `steps_hz`, too",
                    Some("leave one of them out".into()),
                );
                None
            }
            (Some(_), None) => items(reader, &of_both, "frequencies and oscillations, [{ hz = 7 }, …]", either),
            (None, _) => items(reader, &of_frequencies, "frequencies in Hz, [7, -7, …]", frequency),
        };
        let made_by = made_by(reader, &place("made_by", "what made it, free texts"));
        match Self::of(&name?, interval_s?, repeat?, steps?) {
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
        self.interval_s * self.steps.len() as f64
    }

    /// What the shaft does, step by step.
    #[must_use]
    pub fn steps(&self) -> &[GaitStep] {
        &self.steps
    }

    /// As a file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let quoted = |text: &str| toml_edit::Value::from(text).to_string();
        let key = key_of(&self.steps);
        let mut text = format!(
            "name = {}\ninterval_s = {}\nrepeat = {}\n{} = [\n",
            quoted(self.gait.name().as_str()),
            unit::exact(self.interval_s),
            self.gait.repeats(),
            key
        );
        let bare = key == "steps_hz";
        for line in self.steps.chunks(if bare { STEPS_IN_LINE } else { 1 }) {
            let written = |step: &GaitStep| match step {
                GaitStep::Frequency(hz) if bare => unit::exact(*hz),
                GaitStep::Frequency(hz) => format!("{{ hz = {} }}", unit::exact(*hz)),
                GaitStep::Oscillation([from, to]) => {
                    format!("{{ from_deg = {}, to_deg = {} }}", unit::exact(*from), unit::exact(*to))
                }
            };
            let line: Vec<String> = line.iter().map(written).collect();
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

/// The key under which a file has its steps.
fn key_of(steps: &[GaitStep]) -> &'static str {
    let all_turn = steps.iter().all(|step| matches!(step, GaitStep::Frequency(_)));
    if all_turn { "steps_hz" } else { "steps" }
}

/// The different frequencies, from the lowest, and the different oscillations in their order.
fn motions(steps: &[GaitStep]) -> (Vec<f64>, Vec<[f64; 2]>) {
    let (mut frequencies, mut oscillations) = (Vec::new(), Vec::new());
    for step in steps {
        match step {
            GaitStep::Frequency(hz) => frequencies.push(*hz),
            GaitStep::Oscillation(angles) if oscillations.contains(angles) => {}
            GaitStep::Oscillation(angles) => oscillations.push(*angles),
        }
    }
    frequencies.sort_by(f64::total_cmp);
    // −0 is 0.
    frequencies.dedup_by(|a, b| a == b);
    (frequencies, oscillations)
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

/// The steps behind a key, each read by `read`, which is told where it is.
fn items(
    reader: &mut Reader,
    place: &Place<'_>,
    expected: &str,
    read: fn(&mut Reader, (&At, &Value), &str) -> Option<GaitStep>,
) -> Option<Vec<GaitStep>> {
    let entry = reader.need(place, "field", format!("`{} = [7, -7, …]`", place.key))?;
    let Value::Array(items) = &entry.value else {
        reader.wrong_type(place, entry, expected);
        return None;
    };
    let mut item =
        |(index, (at, item)): (usize, &(At, Value))| read(reader, (at, item), &format!("{}[{index}]", place.key));
    // Each one, so that everything that is wrong is said.
    let steps: Vec<Option<GaitStep>> = items.iter().enumerate().map(&mut item).collect();
    steps.into_iter().collect()
}

fn frequency(reader: &mut Reader, (at, item): (&At, &Value), field: &str) -> Option<GaitStep> {
    let Value::Number(hz) = item else {
        reader.wrong(at, field, format!("expected a number in Hz, found {}", item.what()), None);
        return None;
    };
    Some(GaitStep::Frequency(*hz))
}

fn either(reader: &mut Reader, (at, item): (&At, &Value), field: &str) -> Option<GaitStep> {
    let number = |key: &str| match item {
        Value::Table(table) => table.get(key).and_then(|entry| match entry.value {
            Value::Number(number) => Some(number),
            _ => None,
        }),
        _ => None,
    };
    let keys = if let Value::Table(table) = item { table.entries.len() } else { 0 };
    match (number("hz"), number("from_deg"), number("to_deg"), keys) {
        (Some(hz), None, None, 1) => Some(GaitStep::Frequency(hz)),
        (None, Some(from), Some(to), 2) => Some(GaitStep::Oscillation([from, to])),
        _ => {
            let help = "give `{ hz = 7 }`, or `{ from_deg = -45, to_deg = 105 }`".to_owned();
            reader.wrong(at, field, "is neither a frequency nor an oscillation", Some(help));
            None
        }
    }
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
