//! Which column of a foreign file holds what, in which unit: from words of a command line, or from a TOML file.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::goal::PositionControl;
use super::units::{Quantity, Unit, positive};
use crate::RecordingError;

/// A mapping that cannot be understood or is not complete.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
#[error("{problem}")]
#[diagnostic(help("{help}"))]
pub struct MappingError {
    /// What is wrong.
    pub problem: String,
    /// Advice: what to write instead.
    pub help: String,
}

impl MappingError {
    fn new(problem: impl Into<String>, help: impl Into<String>) -> Self {
        Self { problem: problem.into(), help: help.into() }
    }
}

/// A column that is read: its value is `unit · (±number + offset)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Name in the file's header.
    pub(super) column: String,
    /// The sensor is mounted the other way round.
    pub(super) reversed: bool,
    pub(super) unit: Unit,
    /// Added in the column's unit, after the sign.
    pub(super) offset: f64,
}

impl Source {
    /// A cell's number in the recording's unit.
    pub(super) fn value(&self, number: f64) -> f64 {
        let number = if self.reversed { -number } else { number };
        self.unit.value(number + self.offset)
    }

    /// Name, sign, unit and offset, as the command line has them.
    fn words(&self) -> String {
        let sign = if self.reversed { "-" } else { "" };
        let unit = if self.unit.name.is_empty() { String::new() } else { format!(":{}", self.unit) };
        let offset = if self.offset == 0.0 { String::new() } else { format!("{:+}", self.offset) };
        format!("{sign}{}{unit}{offset}", self.column)
    }
}

/// Which column holds what, and what no column holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mapping {
    /// A column for each quantity that has one.
    pub columns: BTreeMap<Quantity, Source>,
    /// Rows a second, where no column holds the time.
    pub rate_hz: Option<f64>,
    /// Supply of the bridge, V, where no column holds it and it does not change.
    pub supply_v: Option<f64>,
    /// The servo's control law, where a goal position is mapped and no duty.
    pub control: PositionControl,
}

impl fmt::Display for Mapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words().join(", "))
    }
}

impl Mapping {
    /// Takes in `QUANTITY=[-]COLUMN[:UNIT[±OFFSET]]`, e.g. `angle=-Pos:deg+90`, instead of what was mapped to the quantity.
    ///
    /// # Errors
    /// The words are not of this form, or there is no such quantity or unit.
    pub fn map(&mut self, words: &str) -> Result<(), MappingError> {
        let Some((name, rest)) = words.split_once('=') else {
            return Err(MappingError::new(
                format!("`{words}` maps nothing"),
                "say QUANTITY=COLUMN:UNIT, e.g. angle=Pos:deg",
            ));
        };
        let quantity = quantity(name.trim())?;
        let (column, unit) = match rest.rsplit_once(':') {
            Some((column, unit)) => (column, unit.trim()),
            None => (rest, ""),
        };
        if unit.is_empty() && quantity != Quantity::Enable {
            return Err(MappingError::new(
                format!("`{words}` has no unit"),
                format!("say {name}={column}:UNIT; units of `{name}` are {}", quantity.units()),
            ));
        }
        let (unit, offset) = unit_and_offset(quantity, unit).ok_or_else(|| unknown_unit(quantity, unit))?;
        self.columns.insert(quantity, source(column, unit, offset)?);
        Ok(())
    }

    /// Reads a mapping file.
    ///
    /// # Errors
    /// The file cannot be read, or is no mapping.
    pub fn load(path: &Path) -> Result<Self, RecordingError> {
        let text = std::fs::read_to_string(path).map_err(|e| RecordingError::io(path, e))?;
        Self::from_toml(&text).map_err(|(line, error)| RecordingError::Format {
            path: path.to_owned(),
            problem: format!("line {line}: {}", error.problem),
            help: error.help,
        })
    }

    /// A mapping from the text of a file; an error comes with its line.
    fn from_toml(text: &str) -> Result<Self, (usize, MappingError)> {
        let line = |at: usize| text[..at.min(text.len())].matches('\n').count() + 1;
        let file: File = toml::from_str(text).map_err(|error| {
            let at = line(error.span().map_or(0, |span| span.start));
            (at, MappingError::new(error.message().trim_end().replace('\n', "; "), HELP))
        })?;
        let mut mapping = Self {
            rate_hz: file.rate_hz,
            supply_v: file.supply_v,
            control: PositionControl {
                gain: file.p_gain,
                full_scale_rad: file.p_full_scale_rad,
                most_duty: file.p_max_duty,
            },
            ..Self::default()
        };
        for (name, entry) in file.columns {
            let at = line(name.span().start);
            let read = quantity(name.get_ref()).and_then(|quantity| Ok((quantity, entry.source(quantity)?)));
            let (quantity, source) = read.map_err(|error| (at, error))?;
            mapping.columns.insert(quantity, source);
        }
        Ok(mapping)
    }

    /// Fails unless its numbers can be what they are called.
    ///
    /// # Errors
    /// A rate, a supply or a gain that is not above zero.
    pub fn check(&self) -> Result<(), MappingError> {
        let numbers = [
            (self.rate_hz, "the rate", "Hz"),
            (self.supply_v, "the supply", "V"),
            (self.control.gain, "the P gain", ""),
            (self.control.full_scale_rad, "the P gain's full scale", "rad"),
            (self.control.most_duty, "the largest duty", ""),
        ];
        for (number, name, unit) in numbers {
            if let Some(number) = number
                && !positive(number)
            {
                return Err(MappingError::new(
                    format!("{name} is {number} {unit}").trim_end().to_owned(),
                    "it is a finite number above 0",
                ));
            }
        }
        if let Some(most) = self.control.most_duty
            && most > 1.0
        {
            return Err(MappingError::new(format!("the largest duty is {most}"), "it is a share of 1, e.g. 0.9625"));
        }
        Ok(())
    }

    /// Puts what another mapping says in place of what this one says.
    #[must_use]
    pub fn overridden_by(mut self, other: &Self) -> Self {
        self.columns.extend(other.columns.iter().map(|(quantity, source)| (*quantity, source.clone())));
        self.rate_hz = other.rate_hz.or(self.rate_hz);
        self.supply_v = other.supply_v.or(self.supply_v);
        self.control = self.control.overridden_by(&other.control);
        self
    }

    /// Names of the columns that are read.
    pub(super) fn wanted(&self) -> Vec<String> {
        self.columns.values().map(|source| source.column.clone()).collect()
    }

    pub(super) fn has(&self, quantity: Quantity) -> bool {
        self.columns.contains_key(&quantity)
    }

    /// What is mapped, as the command line has it.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        let columns = self.columns.iter().map(|(quantity, source)| format!("{}={}", quantity.name(), source.words()));
        let constants =
            [self.rate_hz.map(|hz| format!("rate {hz} Hz")), self.supply_v.map(|volts| format!("supply {volts} V"))];
        let control = self.has(Quantity::Goal).then(|| self.control.words());
        columns.chain(constants.into_iter().flatten()).chain(control).collect()
    }
}

const HELP: &str = "a mapping has [columns] with e.g. angle = { column = \"Pos\", unit = \"deg\" }, and above it, where \
                    needed, rate_hz, supply_v, p_gain, p_full_scale_rad, p_max_duty; docs/import.md describes it";

/// The text of a mapping file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    rate_hz: Option<f64>,
    supply_v: Option<f64>,
    p_gain: Option<f64>,
    p_full_scale_rad: Option<f64>,
    p_max_duty: Option<f64>,
    #[serde(default)]
    columns: BTreeMap<Spanned<String>, Entry>,
}

/// A column in a mapping file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    column: String,
    unit: Option<String>,
    full_scale: Option<f64>,
    counts_per_turn: Option<f64>,
    #[serde(default)]
    offset: f64,
}

impl Entry {
    fn source(self, quantity: Quantity) -> Result<Source, MappingError> {
        let name = quantity.name();
        let scale = |key: &str, number: f64, unit: Option<Unit>| {
            unit.ok_or_else(|| {
                MappingError::new(format!("`{name}`: {key} is {number}"), "it is a finite number above 0")
            })
        };
        let unit = match (self.unit.as_deref(), self.full_scale, self.counts_per_turn) {
            (None, Some(number), None) if quantity == Quantity::Duty => {
                scale("full_scale", number, Unit::full_scale(number))?
            }
            (None | Some("counts"), None, Some(number)) if quantity.is_angle() => {
                scale("counts_per_turn", number, Unit::counts(number))?
            }
            (Some(unit), None, None) => Unit::of(quantity, unit).ok_or_else(|| unknown_unit(quantity, unit))?,
            (None, None, None) if quantity == Quantity::Enable => Unit { name: String::new(), factor: 1.0, shift: 0.0 },
            (None, None, None) => {
                return Err(MappingError::new(
                    format!("`{name}` has no unit"),
                    format!("add unit = \"…\"; units of `{name}` are {}", quantity.units()),
                ));
            }
            _ => {
                return Err(MappingError::new(
                    format!("`{name}`: unit, full_scale and counts_per_turn do not go together so"),
                    "an entry has one of unit, full_scale (of `duty`) and counts_per_turn (of `angle` and `goal`)",
                ));
            }
        };
        if !self.offset.is_finite() {
            return Err(MappingError::new(format!("`{name}`: offset is {}", self.offset), "it is a finite number"));
        }
        source(&self.column, unit, self.offset)
    }
}

fn quantity(name: &str) -> Result<Quantity, MappingError> {
    Quantity::of(name).map_err(|(problem, help)| MappingError { problem, help })
}

fn source(column: &str, unit: Unit, offset: f64) -> Result<Source, MappingError> {
    let column = column.trim();
    let (reversed, column) = match column.strip_prefix('-') {
        Some(rest) => (true, rest.trim()),
        None => (false, column),
    };
    if column.is_empty() {
        return Err(MappingError::new("a column has no name", "name it as the file's header does, e.g. angle=Pos:deg"));
    }
    Ok(Source { column: column.to_owned(), reversed, unit, offset })
}

fn unknown_unit(quantity: Quantity, unit: &str) -> MappingError {
    let name = quantity.name();
    MappingError::new(format!("`{name}` is not in `{unit}`"), format!("units of `{name}` are {}", quantity.units()))
}

/// A unit with an offset behind it: `deg`, `deg+90`, `counts/4096-2048`, `1e-3`.
fn unit_and_offset(quantity: Quantity, text: &str) -> Option<(Unit, f64)> {
    if let Some(unit) = Unit::of(quantity, text) {
        return Some((unit, 0.0));
    }
    // From the right, for an exponent has a sign, too.
    text.rmatch_indices(['+', '-']).find_map(|(at, _)| {
        let unit = Unit::of(quantity, text[..at].trim_end())?;
        let offset: f64 = text[at..].parse().ok()?;
        offset.is_finite().then_some((unit, offset))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mapped(words: &str) -> Source {
        let mut mapping = Mapping::default();
        mapping.map(words).unwrap_or_else(|e| panic!("{words}: {e}"));
        mapping.columns.into_values().next().unwrap()
    }

    fn refused(words: &str) -> String {
        let error = Mapping::default().map(words).expect_err(words);
        format!("{}; {}", error.problem, error.help)
    }

    #[test]
    fn sign_unit_and_offset_are_taken_from_the_words() {
        let source = mapped("angle=-Pos:deg+90");
        assert_eq!((source.column.as_str(), source.reversed, source.offset), ("Pos", true, 90.0));
        assert!((source.value(45.0) - 45f64.to_radians()).abs() < 1e-15, "−45 + 90");
        let source = mapped("angle=Shaft pos (enc): A:counts/4096-2048");
        assert_eq!(source.column, "Shaft pos (enc): A");
        assert_eq!(source.value(2048.0), 0.0);
        assert!((mapped("duty=PWM:500-1500").value(1750.0) - 0.5).abs() < 1e-15, "a servo pulse in µs");
        assert_eq!(mapped("duty=u:1e-3").value(5e-4), 0.5);
        assert_eq!(mapped("duty=u:1e-3-1e-3").value(1.5e-3), 0.5);
        assert_eq!(mapped("enable=Torque").value(1.0), 1.0);
    }

    #[test]
    fn words_say_again_what_was_said() {
        for words in ["angle=-Pos:deg+90", "duty=PWM:255", "enable=On", "goal=G:counts/4096-2048", "time=t:ms"] {
            let mut mapping = Mapping::default();
            mapping.map(words).unwrap();
            assert_eq!(mapping.words()[0], words);
        }
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_advice() {
        let cases = [
            ("angle", "maps nothing"),
            ("angel=Pos:deg", "there is no quantity `angel`; the quantities are time, angle"),
            ("angle=Pos", "has no unit; say angle=Pos:UNIT; units of `angle` are rad, deg"),
            ("angle=Pos:ms", "`angle` is not in `ms`; units of `angle` are rad"),
            ("angle=:deg", "a column has no name"),
            ("angle=-:deg", "a column has no name"),
            ("angle=Pos:deg+x", "`angle` is not in `deg+x`"),
            ("duty=PWM:0", "`duty` is not in `0`"),
            ("supply_current=I:A", "a recording has no column for the supply's current"),
        ];
        for (words, says) in cases {
            let message = refused(words);
            assert!(message.contains(says), "{words}: `{message}` does not say `{says}`");
        }
    }

    #[test]
    fn a_file_says_the_same_as_words() {
        let file = "rate_hz = 100\nsupply_v = 12\n[columns]\nangle = { column = \"-Pos\", unit = \"deg\", offset = 90 }\n\
                    duty = { column = \"PWM\", full_scale = 255 }\ngoal = { column = \"G\", counts_per_turn = 4096 }\n";
        let mut words = Mapping { rate_hz: Some(100.0), supply_v: Some(12.0), ..Mapping::default() };
        for map in ["angle=-Pos:deg+90", "duty=PWM:255", "goal=G:counts/4096"] {
            words.map(map).unwrap();
        }
        assert_eq!(Mapping::from_toml(file).unwrap(), words);
    }

    #[test]
    fn a_wrong_file_is_refused_with_its_line() {
        let cases = [
            ("[columns]\nangle = { column = \"P\", unit = \"ms\" }\n", 2, "`angle` is not in `ms`"),
            ("[columns]\n\nangel = { column = \"P\", unit = \"deg\" }\n", 3, "there is no quantity `angel`"),
            ("[columns]\nangle = { column = \"P\" }\n", 2, "`angle` has no unit"),
            ("[columns]\nangle = { column = \"P\", full_scale = 255 }\n", 2, "do not go together"),
            ("[columns]\nduty = { column = \"P\", full_scale = 0 }\n", 2, "full_scale is 0"),
            ("[columns]\nduty = { column = \"P\", fullscale = 255 }\n", 2, "unknown field `fullscale`"),
            ("rate = 3\n", 1, "unknown field `rate`"),
        ];
        for (text, line, says) in cases {
            let (at, error) = Mapping::from_toml(text).expect_err(text);
            assert_eq!(at, line, "{text}");
            assert!(error.problem.contains(says), "`{}` does not say `{says}`", error.problem);
        }
    }

    #[test]
    fn the_later_mapping_wins() {
        let mut file = Mapping { rate_hz: Some(100.0), supply_v: Some(12.0), ..Mapping::default() };
        file.map("angle=A:deg").unwrap();
        file.map("duty=D:255").unwrap();
        let mut words = Mapping { supply_v: Some(7.0), ..Mapping::default() };
        words.map("angle=B:rad").unwrap();
        let both = file.overridden_by(&words);
        assert_eq!(both.words(), ["angle=B:rad", "duty=D:255", "rate 100 Hz", "supply 7 V"]);
    }

    #[test]
    fn numbers_that_cannot_be_are_refused() {
        for mapping in [
            Mapping { rate_hz: Some(0.0), ..Mapping::default() },
            Mapping { supply_v: Some(f64::NAN), ..Mapping::default() },
            Mapping { control: PositionControl { gain: Some(-1.0), ..Default::default() }, ..Mapping::default() },
            Mapping { control: PositionControl { most_duty: Some(1.5), ..Default::default() }, ..Mapping::default() },
        ] {
            mapping.check().expect_err("must be refused");
        }
    }
}
