//! Changing a robot file by program and leaving the rest as the person wrote it: comments, order, spelling.
//!
//! Every edit is checked by reading the result as a [`Robot`]; an edit that would make no robot is refused and leaves the
//! document as it was. [`Document::save`] replaces the file as a whole or not at all.

use std::fs;
use std::io::Write;
use std::path::Path;

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use crate::error::{Problem, RobotFileError};
use crate::robot::{Correction, Quantity, Robot};
use crate::unit;
use common::atomic::write_atomically;

/// A robot file that is being edited.
#[derive(Clone, Debug)]
pub struct Document {
    document: DocumentMut,
    name: String,
}

impl Document {
    /// Reads a robot file.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn load(path: &Path) -> Result<Self, RobotFileError> {
        Robot::load(path)?;
        let name = path.display().to_string();
        let text = fs::read_to_string(path).map_err(|error| failed(&name, format!("cannot be read: {error}")))?;
        Self::parse(&text, &name)
    }

    /// From the text of a robot file; the name is for messages, and a `base` is looked for beside it.
    ///
    /// # Errors
    /// As [`Robot::parse`].
    pub fn parse(text: &str, file_name: &str) -> Result<Self, RobotFileError> {
        Robot::parse(text, file_name)?;
        let document = text.parse().map_err(|error| failed(file_name, format!("not valid TOML: {error}")))?;
        Ok(Self { document, name: file_name.into() })
    }

    /// The robot that the document describes.
    ///
    /// # Errors
    /// Only when a base file changed since the last edit.
    pub fn robot(&self) -> Result<Robot, RobotFileError> {
        Robot::parse(&self.document.to_string(), &self.name)
    }

    /// Sets a quantity by its path, e.g. `motor.resistance_ohm`; one that the file inherits from its base is written here.
    ///
    /// # Errors
    /// The path or a number is not allowed.
    pub fn set(&mut self, path: &str, quantity: &Quantity) -> Result<(), RobotFileError> {
        self.set_all(&[(path, quantity.clone())])
    }

    /// Sets several quantities at once: what must hold between them, as between `[eccentric]` and `[load]`, is checked when
    /// all are set.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_all(&mut self, quantities: &[(&str, Quantity)]) -> Result<(), RobotFileError> {
        self.edit(|document| {
            for (path, quantity) in quantities {
                let (parent, key) = path.rsplit_once('.').unwrap_or(("", path));
                let table = table_at(document, parent)?;
                match table.get_mut(key).and_then(Item::as_table_like_mut) {
                    Some(existing) => {
                        for (key, new) in parts(quantity) {
                            write_value(existing, key, new);
                        }
                    }
                    None => {
                        table.insert(key, Item::Value(inline(quantity)));
                    }
                }
            }
            Some(())
        })
    }

    /// Adds an `[effects.NAME]` table, or replaces the one that is there, with all of its quantities.
    ///
    /// # Errors
    /// The effect or a key is unknown or missing, a number is not allowed, or `coulomb_friction` and
    /// `stribeck_friction` would stand together.
    pub fn set_effect(&mut self, name: &str, quantities: &[(&str, Quantity)]) -> Result<(), RobotFileError> {
        self.edit(|document| {
            let mut table = Table::new();
            for (key, quantity) in quantities {
                table.insert(key, Item::Value(inline(quantity)));
            }
            replace_table(document, "effects", name, table)
        })
    }

    /// Removes a table or key by its path, e.g. `effects.coulomb_friction`; one that comes from the base goes on the
    /// list that the file removes from it.
    ///
    /// # Errors
    /// There is nothing at the path, or the robot needs it.
    pub fn remove(&mut self, path: &str) -> Result<(), RobotFileError> {
        self.edit(|document| {
            let (parent, key) = path.rsplit_once('.').unwrap_or(("", path));
            let here = find(document, parent).is_some_and(|table| table.remove(key).is_some());
            let below = document.contains_key("base");
            if below {
                let list = document.entry("remove").or_insert_with(|| Item::Value(Value::Array(Array::new())));
                list.as_array_mut()?.push(path);
            }
            (here || below).then_some(())
        })
        .or_else(|error| self.remove_here(path).map_err(|_| error))
    }

    /// Removes what only this file has, where the base has nothing to remove.
    fn remove_here(&mut self, path: &str) -> Result<(), RobotFileError> {
        self.edit(|document| {
            let (parent, key) = path.rsplit_once('.').unwrap_or(("", path));
            find(document, parent)?.remove(key).map(|_| ())
        })
    }

    /// Writes `[sensor.correction]`.
    ///
    /// # Errors
    /// The sensor is no potentiometer, or a number is not allowed.
    pub fn set_correction(&mut self, correction: &Correction) -> Result<(), RobotFileError> {
        self.write_correction("sensor", correction)
    }

    /// Writes `[sensor.second.correction]`.
    ///
    /// # Errors
    /// There is no second sensor, or a number is not allowed.
    pub fn set_second_correction(&mut self, correction: &Correction) -> Result<(), RobotFileError> {
        self.write_correction("sensor.second", correction)
    }

    fn write_correction(&mut self, path: &str, correction: &Correction) -> Result<(), RobotFileError> {
        self.edit(|document| {
            let list = |numbers: &[f64]| Item::Value(Value::Array(numbers.iter().map(|&one| number(one)).collect()));
            let mut table = Table::new();
            table.insert("zero_deg", Item::Value(number(correction.zero_deg)));
            table.insert("deg_per_code", Item::Value(number(correction.deg_per_code)));
            table.insert("cos_deg", list(&correction.cos_deg));
            table.insert("sin_deg", list(&correction.sin_deg));
            table.insert("blind_from_deg", Item::Value(number(correction.blind_from_deg)));
            table.insert("blind_to_deg", Item::Value(number(correction.blind_to_deg)));
            table.insert("residual_deg", Item::Value(number(correction.residual_deg)));
            table.insert("source", Item::Value(correction.source.as_str().into()));
            replace_table(document, path, "correction", table)
        })
    }

    /// Sets the robot's name and the line about it.
    ///
    /// # Errors
    /// One of them is empty.
    pub fn set_name(&mut self, name: &str, summary: &str) -> Result<(), RobotFileError> {
        self.edit(|document| {
            write_value(document.as_table_mut(), "name", name.into());
            write_value(document.as_table_mut(), "summary", summary.into());
            Some(())
        })
    }

    /// The text of the file, as it would be saved into its own directory.
    #[must_use]
    pub fn text(&self) -> String {
        self.document.to_string()
    }

    /// Writes the file as a whole or not at all: a temporary file in the same directory, then a rename. Saved into
    /// another directory, a `base` is named by its full path.
    ///
    /// # Errors
    /// The file cannot be written, or the base cannot be found from there.
    pub fn save(&self, path: &Path) -> Result<(), RobotFileError> {
        let name = path.display().to_string();
        let text = self.text_for(path)?;
        Robot::parse(&text, &name)?;
        write_atomically::<std::io::Error>(path, |file| file.write_all(text.as_bytes()))
            .map_err(|error| failed(&name, format!("cannot be written: {error}")))
    }

    fn text_for(&self, path: &Path) -> Result<String, RobotFileError> {
        let Some(base) = self.document.get("base").and_then(Item::as_str) else { return Ok(self.document.to_string()) };
        let here = Path::new(&self.name).parent().unwrap_or(Path::new(""));
        if path.parent() == Some(here) {
            return Ok(self.document.to_string());
        }
        let base = fs::canonicalize(here.join(base))
            .map_err(|error| failed(&self.name, format!("the base {base} cannot be found: {error}")))?;
        let mut moved = self.document.clone();
        write_value(moved.as_table_mut(), "base", base.display().to_string().into());
        Ok(moved.to_string())
    }

    /// Does an edit on a copy and takes it over when the result is a robot. `None` from the edit: the path leads nowhere.
    fn edit(&mut self, change: impl FnOnce(&mut DocumentMut) -> Option<()>) -> Result<(), RobotFileError> {
        let mut changed = self.document.clone();
        if change(&mut changed).is_none() {
            return Err(failed(&self.name, "there is no such table or field to change".into()));
        }
        Robot::parse(&changed.to_string(), &self.name)?;
        self.document = changed;
        Ok(())
    }
}

impl std::fmt::Display for Document {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.document.fmt(f)
    }
}

fn failed(name: &str, message: String) -> RobotFileError {
    RobotFileError::new(vec![Problem::without_text(name, message, None)])
}

/// The table at a dotted path.
fn find<'d>(document: &'d mut DocumentMut, path: &str) -> Option<&'d mut dyn TableLike> {
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for key in path.split('.').filter(|key| !key.is_empty()) {
        table = table.get_mut(key)?.as_table_like_mut()?;
    }
    Some(table)
}

/// The table at a dotted path, made where it is missing.
fn table_at<'d>(document: &'d mut DocumentMut, path: &str) -> Option<&'d mut dyn TableLike> {
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for key in path.split('.').filter(|key| !key.is_empty()) {
        if !table.contains_key(key) {
            let mut made = Table::new();
            made.set_implicit(true);
            table.insert(key, Item::Table(made));
        }
        table = table.get_mut(key)?.as_table_like_mut()?;
    }
    Some(table)
}

/// Puts a table under a parent, in the place of an older one and with its comments.
fn replace_table(document: &mut DocumentMut, parent: &str, key: &str, mut new: Table) -> Option<()> {
    let parent = table_at(document, parent)?;
    match parent.get_mut(key) {
        Some(Item::Table(old)) => {
            *new.decor_mut() = old.decor().clone();
            new.set_position(old.position());
            *old = new;
        }
        _ => {
            new.decor_mut().set_prefix("\n");
            parent.insert(key, Item::Table(new));
        }
    }
    Some(())
}

/// Replaces a value and keeps the comments around it.
fn write_value(table: &mut dyn TableLike, key: &str, mut new: Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            *new.decor_mut() = old.decor().clone();
            *old = new;
        }
        None => {
            table.insert(key, Item::Value(new));
        }
    }
}

fn parts(quantity: &Quantity) -> [(&'static str, Value); 4] {
    [
        ("value", number(quantity.value)),
        ("low", number(quantity.low)),
        ("high", number(quantity.high)),
        ("source", quantity.source.as_str().into()),
    ]
}

fn inline(quantity: &Quantity) -> Value {
    let mut table = InlineTable::new();
    for (key, value) in parts(quantity) {
        table.insert(key, value);
    }
    Value::InlineTable(table)
}

/// A number as a person writes it, nine digits long: no measured number has more.
fn number(value: f64) -> Value {
    let digits = |value: f64| format!("{value:.8e}").parse().unwrap_or(value);
    let mut text = unit::exact(digits(value));
    if !text.contains(['.', 'e', 'n']) {
        text.push_str(".0");
    }
    text.parse().unwrap_or_else(|_| Value::from(value))
}
