//! The TOML text as a tree in which every node knows its file and place, with the `base` file beneath it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use crate::error::Problem;

/// Where a node stands.
#[derive(Clone, Debug)]
pub(crate) struct At {
    pub file: Arc<File>,
    pub span: Range<usize>,
}

impl At {
    pub fn problem(&self, field: impl Into<String>, message: impl Into<String>) -> Problem {
        Problem::new(&self.file.name, &self.file.text, self.span.clone(), field.into(), message.into())
    }
}

/// A file that was read.
#[derive(Debug)]
pub(crate) struct File {
    pub name: String,
    pub text: Arc<str>,
}

/// A key with its value.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub key: At,
    pub value_at: At,
    pub value: Value,
}

/// TOML value with its place in the file.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Table(Table),
    Array(Vec<(At, Value)>),
    Number(f64),
    Text(String),
    Boolean(bool),
    /// A date, or a number that is none: no field is one. What it is called.
    Other(&'static str),
}

impl Value {
    /// What it is, for messages.
    pub fn what(&self) -> &'static str {
        match self {
            Self::Table(_) => "a table",
            Self::Array(_) => "an array",
            Self::Number(_) => "a number",
            Self::Text(_) => "a text",
            Self::Boolean(_) => "a boolean",
            Self::Other(what) => what,
        }
    }
}

/// TOML table with its place in the file.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    /// Its header, or its braces.
    pub at: At,
    pub entries: BTreeMap<String, Entry>,
}

impl Table {
    pub fn get(&self, key: &str) -> Option<&Entry> {
        self.entries.get(key)
    }

    /// The entry at a dotted path.
    pub fn find(&self, path: &str) -> Option<&Entry> {
        let (first, rest) = path.split_once('.').map_or((path, None), |(first, rest)| (first, Some(rest)));
        let entry = self.get(first)?;
        match (rest, &entry.value) {
            (None, _) => Some(entry),
            (Some(rest), Value::Table(table)) => table.find(rest),
            _ => None,
        }
    }

    /// Takes out what is at a dotted path; `false` when there is nothing.
    fn remove(&mut self, path: &str) -> bool {
        match path.split_once('.') {
            None => self.entries.remove(path).is_some(),
            Some((first, rest)) => match self.entries.get_mut(first).map(|entry| &mut entry.value) {
                Some(Value::Table(table)) => table.remove(rest),
                _ => false,
            },
        }
    }

    /// Lays another file's table over this one: tables are merged, quantities and everything else replaced as a whole.
    fn overlay(&mut self, over: Table) {
        self.at = over.at;
        for (key, entry) in over.entries {
            match (self.entries.get_mut(&key), entry) {
                (
                    Some(Entry { key: key_at, value_at, value: Value::Table(below) }),
                    Entry { key, value_at: new_at, value: Value::Table(above) },
                ) if below.get("value").is_none() => {
                    *key_at = key;
                    *value_at = new_at;
                    below.overlay(above);
                }
                (_, entry) => {
                    self.entries.insert(key, entry);
                }
            }
        }
    }
}

/// Bases of bases: more than this is a mistake.
const MOST_BASES: usize = 8;

/// Reads the text and every base beneath it. `Err` when the text is no TOML or a base is missing.
pub(crate) fn grow(text: &str, name: &str) -> Result<Table, Vec<Problem>> {
    grow_on(text, name, 0)
}

/// Reads the text as it stands: `base` and `remove` are keys like any other.
pub(crate) fn read(text: &str, name: &str) -> Result<Table, Vec<Problem>> {
    let file = Arc::new(File { name: name.into(), text: text.into() });
    let (parsed, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        let problem = |error: &toml::de::Error| {
            let at = At { file: file.clone(), span: clip(error.span().unwrap_or(0..0), text) };
            at.problem("", format!("not valid TOML: {}", error.message().replace('\n', ", ")))
        };
        return Err(errors.iter().map(problem).collect());
    }
    Ok(convert_table(parsed.get_ref(), &file, 0..0))
}

fn grow_on(text: &str, name: &str, depth: usize) -> Result<Table, Vec<Problem>> {
    let mut table = read(text, name)?;
    let removed = take_removed(&mut table)?;
    let Some(base) = table.entries.remove("base") else {
        return match removed.first() {
            Some((at, _)) => Err(vec![at.problem("remove", "there is no `base` to remove anything from")]),
            None => Ok(table),
        };
    };
    let Value::Text(base_name) = &base.value else {
        let message = format!("expected the base file's path as a text, found {}", base.value.what());
        return Err(vec![base.value_at.problem("base", message)]);
    };
    if depth == MOST_BASES {
        return Err(vec![
            base.value_at.problem("base", "more than 8 files stand on each other; does one stand on itself?"),
        ]);
    }
    let path = Path::new(name).parent().unwrap_or(Path::new("")).join(base_name);
    let base_text = std::fs::read_to_string(&path).map_err(|error| {
        vec![base.value_at.problem(
            "base",
            format!("cannot read {} ({error}); the path starts at this file's directory", path.display()),
        )]
    })?;
    let mut whole = grow_on(&base_text, &path.display().to_string(), depth + 1)?;
    let mut problems = Vec::new();
    for (at, path) in removed {
        if !whole.remove(&path) {
            problems.push(at.problem("remove", format!("the base has no `{path}`")));
        }
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    whole.overlay(table);
    Ok(whole)
}

fn take_removed(table: &mut Table) -> Result<Vec<(At, String)>, Vec<Problem>> {
    let Some(entry) = table.entries.remove("remove") else { return Ok(Vec::new()) };
    let wrong = |at: &At, found: &Value| {
        vec![at.problem("remove", format!("expected paths like [\"supply.battery\"], found {}", found.what()))]
    };
    let Value::Array(items) = entry.value else { return Err(wrong(&entry.value_at, &entry.value)) };
    items
        .into_iter()
        .map(|(at, item)| match item {
            Value::Text(path) => Ok((at, path)),
            other => Err(wrong(&at, &other)),
        })
        .collect()
}

fn clip(span: Range<usize>, text: &str) -> Range<usize> {
    let floor = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    floor(span.start)..floor(span.end).max(floor(span.start))
}

fn convert_table(table: &DeTable<'_>, file: &Arc<File>, span: Range<usize>) -> Table {
    let entries = table
        .iter()
        .map(|(key, value)| {
            let key_at = At { file: file.clone(), span: key.span() };
            let value_at = At { file: file.clone(), span: value.span() };
            let converted = convert(value.get_ref(), file, value.span());
            (key.get_ref().to_string(), Entry { key: key_at, value_at, value: converted })
        })
        .collect();
    Table { at: At { file: file.clone(), span }, entries }
}

fn convert(value: &DeValue<'_>, file: &Arc<File>, span: Range<usize>) -> Value {
    match value {
        DeValue::Table(table) => Value::Table(convert_table(table, file, span)),
        DeValue::Array(items) => Value::Array(
            items
                .iter()
                .map(|item| (At { file: file.clone(), span: item.span() }, convert(item.get_ref(), file, item.span())))
                .collect(),
        ),
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
            .map_or(Value::Other("an integer beyond 64 bits"), |integer| Value::Number(integer as f64)),
        DeValue::Float(float) => float.as_str().parse().map_or(Value::Other("an unreadable number"), Value::Number),
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Boolean(flag) => Value::Boolean(*flag),
        DeValue::Datetime(_) => Value::Other("a date"),
    }
}
