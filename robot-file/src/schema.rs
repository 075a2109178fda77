//! How the structs of [`crate::robot`] are read from a file. The `table!` macro makes a struct and its reader from one
//! list, so that a field's name, meaning and allowed range stand in one place; the same list makes the tables of
//! docs/robot-file.md.

use crate::error::Problem;
use crate::tree::{At, Entry, Table, Value};
use crate::unit;

/// What a field holds.
#[derive(Clone, Debug)]
pub enum Shape {
    /// `{ value, low, high, source }`, each of the three numbers from the first to the second bound.
    Quantity(f64, f64),
    /// A bare number between bounds.
    Number(f64, f64),
    /// Bare numbers between bounds.
    Numbers(f64, f64),
    /// String.
    Text,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A list of these words.
    Words(&'static [&'static str]),
    /// `[x, y]` pairs: the unit of either number, and what they must fulfil.
    Pairs([&'static str; 2], &'static str),
    /// A table with these fields.
    Table(Vec<Field>),
    /// Tables with these fields under numbers from 1.
    Numbered(Vec<Field>),
    /// A table whose `kind` says which fields it has.
    Kinds(Vec<(&'static str, Vec<Field>)>),
}

/// One key of a table.
#[derive(Clone, Debug)]
pub struct Field {
    /// The key.
    pub key: &'static str,
    /// What it means, for people.
    pub meaning: &'static str,
    /// It may be left out.
    pub optional: bool,
    /// What it holds.
    pub shape: Shape,
}

/// Collects what is wrong while a tree is read.
#[derive(Default)]
pub(crate) struct Reader {
    pub problems: Vec<Problem>,
}

/// A key in a table that is being read.
pub(crate) struct Place<'t> {
    pub table: &'t Table,
    pub path: &'t str,
    pub key: &'static str,
    pub meaning: &'static str,
}

impl<'t> Place<'t> {
    /// The dotted path of the key.
    pub fn field(&self) -> String {
        join(self.path, self.key)
    }

    pub fn entry(&self) -> Option<&'t Entry> {
        self.table.get(self.key)
    }
}

/// A dotted path one key longer.
pub(crate) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.into() } else { format!("{path}.{key}") }
}

/// Something that stands behind a key.
pub(crate) trait Part: Sized {
    /// What the schema says about it: an allowed range, or nothing.
    type Spec;
    /// It may be left out.
    const OPTIONAL: bool = false;
    /// What it holds.
    fn shape(spec: &Self::Spec) -> Shape;
    /// Reads it; `None` after saying why to the reader.
    fn read(reader: &mut Reader, place: &Place<'_>, spec: &Self::Spec) -> Option<Self>;
}

/// A struct that is read from a table; made by [`table!`].
pub(crate) trait TomlTable: Sized {
    /// Keys that the table may have.
    fn fields() -> Vec<Field>;
    /// Reads every key.
    fn read_fields(reader: &mut Reader, table: &Table, path: &str) -> Option<Self>;

    /// Reads every key and refuses what is none.
    fn read_table(reader: &mut Reader, table: &Table, path: &str) -> Option<Self> {
        let known: Vec<_> = Self::fields().iter().map(|field| field.key).collect();
        reader.refuse_unknown(table, path, &known);
        Self::read_fields(reader, table, path)
    }

    /// The same for a table whose `kind` has been read.
    fn read_kind(reader: &mut Reader, table: &Table, path: &str) -> Option<Self> {
        let mut known = vec!["kind"];
        known.extend(Self::fields().iter().map(|field| field.key));
        reader.refuse_unknown(table, path, &known);
        Self::read_fields(reader, table, path)
    }
}

impl Reader {
    /// Notes what is wrong.
    pub fn wrong(&mut self, at: &At, field: impl Into<String>, message: impl Into<String>, help: Option<String>) {
        let mut problem = at.problem(field, message);
        problem.help = help;
        self.problems.push(problem);
    }

    pub fn wrong_type(&mut self, place: &Place<'_>, entry: &Entry, expected: &str) {
        let message = format!("expected {expected}, found {}", entry.value.what());
        self.wrong(&entry.value_at, place.field(), message, None);
    }

    /// The entry, or a note that it is missing.
    pub fn need<'t>(&mut self, place: &Place<'t>, kind: &str, how: String) -> Option<&'t Entry> {
        let entry = place.entry();
        if entry.is_none() {
            let table = if place.path.is_empty() { "the file".into() } else { format!("table [{}]", place.path) };
            let meaning = place.meaning.trim_end_matches('.');
            let message = format!("{kind} is missing in {table}");
            self.wrong(&place.table.at, place.field(), message, Some(format!("add {how} ({meaning})")));
        }
        entry
    }

    /// The table behind a key, or a note that it is missing.
    pub fn need_table<'t>(&mut self, place: &Place<'t>) -> Option<&'t Table> {
        let entry = self.need(place, "table", format!("[{}]", place.field()))?;
        match &entry.value {
            Value::Table(table) => Some(table),
            _ => {
                self.wrong_type(place, entry, "a table");
                None
            }
        }
    }

    /// Notes every key that is not among the known ones.
    pub fn refuse_unknown(&mut self, table: &Table, path: &str, known: &[&str]) {
        for (key, entry) in &table.entries {
            if known.contains(&key.as_str()) {
                continue;
            }
            let (message, help) = if path == "effects" { unknown_effect(key, known) } else { unknown_key(key, known) };
            self.wrong(&entry.key, join(path, key), message, Some(help));
        }
    }

    /// A finite number within bounds, or a note of what is wrong with it.
    pub fn number(
        &mut self,
        at: &At,
        field: String,
        value: &Value,
        (low, high): (f64, f64),
        unit: &str,
    ) -> Option<f64> {
        let Value::Number(number) = *value else {
            let expected = if unit == "1" { "a number".into() } else { format!("a number in {unit}") };
            self.wrong(at, field, format!("expected {expected}, found {}", value.what()), None);
            return None;
        };
        let allowed = unit::range(low, high, unit);
        if !number.is_finite() {
            let message = format!("{number} is not a finite number, allowed are {allowed}");
            self.wrong(at, field, message, None);
            return None;
        }
        if number < low || number > high {
            let message = format!("{} is outside the allowed {allowed}", unit::number(number));
            let help = unit::guess(number, low, high, unit);
            self.wrong(at, field, message, help);
            return None;
        }
        Some(number)
    }
}

fn unknown_effect(key: &str, known: &[&str]) -> (String, String) {
    if effects::PLANNED.contains(&key) {
        let message = "this effect has a name but is not modelled yet".into();
        return (message, format!("remove the table; modelled are {}", known.join(", ")));
    }
    let near = nearest(key, known).map_or(String::new(), |near| format!("did you mean `{near}`? "));
    ("unknown effect".into(), format!("{near}allowed are {}", known.join(", ")))
}

fn unknown_key(key: &str, known: &[&str]) -> (String, String) {
    let near = nearest(key, known).map_or(String::new(), |near| format!("did you mean `{near}`? "));
    ("unknown field".into(), format!("{near}allowed are {}", known.join(", ")))
}

/// The known word that was probably meant: one that the word begins (a unit left out), or the one with the fewest changes.
pub(crate) fn nearest<'w>(word: &str, known: &[&'w str]) -> Option<&'w str> {
    if let Some(longer) = known.iter().find(|candidate| candidate.starts_with(&format!("{word}_"))) {
        return Some(longer);
    }
    let scored = known.iter().map(|&candidate| (distance(word, candidate), candidate));
    scored.min().filter(|&(distance, candidate)| distance * 3 <= candidate.len().max(3)).map(|(_, candidate)| candidate)
}

/// Edit distance (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// Reads a table behind a key. A table with nothing but optional keys may be missing.
pub(crate) fn read_as_table<T: TomlTable>(reader: &mut Reader, place: &Place<'_>) -> Option<T> {
    let path = place.field();
    if place.entry().is_none() && T::fields().iter().all(|field| field.optional) {
        let empty = Table { at: place.table.at.clone(), entries: Default::default() };
        return T::read_table(reader, &empty, &path);
    }
    let table = reader.need_table(place)?;
    T::read_table(reader, table, &path)
}

/// Makes a struct and its reader: `field: Type = spec`, where the spec is the allowed range of a quantity or number.
macro_rules! table {
    (
        $(#[doc = $doc:literal])*
        $(#[derive($($derive:ident),*)])?
        pub struct $name:ident {
            $( $(#[doc = $meaning:literal])* $field:ident : $type:ty $(= $spec:expr)?, )*
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize $($(, $derive)*)?)]
        pub struct $name {
            $( $(#[doc = $meaning])* pub $field: $type, )*
        }

        impl $crate::schema::TomlTable for $name {
            fn fields() -> Vec<$crate::schema::Field> {
                vec![$( $crate::schema::Field {
                    key: stringify!($field),
                    meaning: concat!($($meaning),*).trim_ascii(),
                    optional: <$type as $crate::schema::Part>::OPTIONAL,
                    shape: <$type as $crate::schema::Part>::shape(&table!(@spec $($spec)?)),
                }, )*]
            }

            fn read_fields(
                reader: &mut $crate::schema::Reader,
                table: &$crate::tree::Table,
                path: &str,
            ) -> Option<Self> {
                $( let $field = {
                    let meaning = concat!($($meaning),*).trim_ascii();
                    let place = $crate::schema::Place { table, path, key: stringify!($field), meaning };
                    <$type as $crate::schema::Part>::read(reader, &place, &table!(@spec $($spec)?))
                }; )*
                Some(Self { $( $field: $field?, )* })
            }
        }

        impl $crate::schema::Part for $name {
            type Spec = ();

            fn shape((): &()) -> $crate::schema::Shape {
                $crate::schema::Shape::Table(<Self as $crate::schema::TomlTable>::fields())
            }

            fn read(
                reader: &mut $crate::schema::Reader,
                place: &$crate::schema::Place<'_>,
                (): &(),
            ) -> Option<Self> {
                $crate::schema::read_as_table(reader, place)
            }
        }
    };
    (@spec) => { () };
    (@spec $spec:expr) => { $spec };
}
pub(crate) use table;
