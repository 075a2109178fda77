//! What stands behind a key: quantities, numbers, lists, texts, words.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use crate::robot::Quantity;
use crate::schema::{Part, Place, Reader, Shape, TomlTable, join, nearest};
use crate::tree::{Entry, Value};
use crate::unit;

impl Part for Quantity {
    type Spec = RangeInclusive<f64>;

    fn shape(spec: &Self::Spec) -> Shape {
        Shape::Quantity(*spec.start(), *spec.end())
    }

    fn read(reader: &mut Reader, place: &Place<'_>, spec: &Self::Spec) -> Option<Self> {
        let unit = unit::of(place.key);
        let allowed = unit::range(*spec.start(), *spec.end(), unit);
        let how = format!("`{} = {{ value = …, low = …, high = …, source = \"…\" }}` within {allowed}", place.key);
        let entry = reader.need(place, "field", how)?;
        read_quantity(reader, &place.field(), entry, (*spec.start(), *spec.end()), unit)
    }
}

/// The keys of a quantity.
const QUANTITY_KEYS: [&str; 4] = ["value", "low", "high", "source"];

fn read_quantity(reader: &mut Reader, field: &str, entry: &Entry, bounds: (f64, f64), unit: &str) -> Option<Quantity> {
    let Value::Table(table) = &entry.value else {
        let message = format!("expected {{ value, low, high, source }}, found {}", entry.value.what());
        let help = match entry.value {
            Value::Number(number) => {
                format!(
                    "write {{ value = {number}, low = …, high = …, source = \"…\" }}: a number has its spread and source"
                )
            }
            _ => "a number has its spread and source".into(),
        };
        reader.wrong(&entry.value_at, field, message, Some(help));
        return None;
    };
    reader.refuse_unknown(table, field, &QUANTITY_KEYS);
    let mut numbers = [None; 3];
    for (slot, key) in numbers.iter_mut().zip(QUANTITY_KEYS) {
        let place = Place { table, path: field, key, meaning: "value and the ends of its plausible range" };
        if let Some(entry) = reader.need(&place, "field", format!("`{key} = …`")) {
            *slot = reader.number(&entry.value_at, place.field(), &entry.value, bounds, unit);
        }
    }
    let place = Place { table, path: field, key: "source", meaning: "data sheet, paper, measurement or estimate" };
    let source = String::read(reader, &place, &())?;
    let [Some(value), Some(low), Some(high)] = numbers else { return None };
    if !(low <= value && value <= high) {
        let show = unit::number;
        let message = format!(
            "low ≤ value ≤ high is required, found low {}, value {}, high {}",
            show(low),
            show(value),
            show(high)
        );
        reader.wrong(&entry.value_at, field, message, None);
        return None;
    }
    Some(Quantity { value, low, high, source })
}

impl Part for f64 {
    type Spec = RangeInclusive<f64>;

    fn shape(spec: &Self::Spec) -> Shape {
        Shape::Number(*spec.start(), *spec.end())
    }

    fn read(reader: &mut Reader, place: &Place<'_>, spec: &Self::Spec) -> Option<Self> {
        let entry = reader.need(place, "field", format!("`{} = …`", place.key))?;
        let bounds = (*spec.start(), *spec.end());
        reader.number(&entry.value_at, place.field(), &entry.value, bounds, unit::of(place.key))
    }
}

impl Part for Vec<f64> {
    type Spec = RangeInclusive<f64>;

    fn shape(spec: &Self::Spec) -> Shape {
        Shape::Numbers(*spec.start(), *spec.end())
    }

    fn read(reader: &mut Reader, place: &Place<'_>, spec: &Self::Spec) -> Option<Self> {
        let entry = reader.need(place, "field", format!("`{} = […]`", place.key))?;
        let Value::Array(items) = &entry.value else {
            reader.wrong_type(place, entry, "an array of numbers");
            return None;
        };
        let bounds = (*spec.start(), *spec.end());
        let read: Vec<_> = items
            .iter()
            .map(|(at, item)| reader.number(at, place.field(), item, bounds, unit::of(place.key)))
            .collect();
        read.into_iter().collect()
    }
}

/// What a list of pairs holds.
pub(crate) struct Pairs {
    /// Allowed range of the first and of the second number of a pair.
    pub bounds: [RangeInclusive<f64>; 2],
    /// Their units.
    pub units: [&'static str; 2],
    /// What the pairs must fulfil, for people.
    pub rule: &'static str,
}

impl Part for Vec<[f64; 2]> {
    type Spec = Pairs;

    fn shape(spec: &Pairs) -> Shape {
        Shape::Pairs(spec.units, spec.rule)
    }

    fn read(reader: &mut Reader, place: &Place<'_>, spec: &Self::Spec) -> Option<Self> {
        let entry = reader.need(place, "field", format!("`{} = [[…, …], …]`", place.key))?;
        let Value::Array(items) = &entry.value else {
            reader.wrong_type(place, entry, "an array of pairs");
            return None;
        };
        let mut pairs = Vec::with_capacity(items.len());
        for (at, item) in items {
            let Value::Array(pair) = item else {
                let message = format!("expected a pair of numbers, found {}", item.what());
                reader.wrong(at, place.field(), message, None);
                return None;
            };
            let [(first_at, first), (second_at, second)] = pair.as_slice() else {
                reader.wrong(at, place.field(), format!("expected 2 numbers, found {}", pair.len()), None);
                return None;
            };
            let bounds = |index: usize| (*spec.bounds[index].start(), *spec.bounds[index].end());
            let first = reader.number(first_at, place.field(), first, bounds(0), spec.units[0]);
            let second = reader.number(second_at, place.field(), second, bounds(1), spec.units[1]);
            pairs.push([first?, second?]);
        }
        Some(pairs)
    }
}

impl Part for String {
    type Spec = ();

    fn shape((): &()) -> Shape {
        Shape::Text
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        let entry = reader.need(place, "field", format!("`{} = \"…\"`", place.key))?;
        match &entry.value {
            Value::Text(text) if !text.trim().is_empty() => Some(text.clone()),
            Value::Text(_) => {
                reader.wrong(&entry.value_at, place.field(), "must not be empty", None);
                None
            }
            _ => {
                reader.wrong_type(place, entry, "a text");
                None
            }
        }
    }
}

/// A list of a few words: what one of them is called, and what the list is.
pub(crate) fn read_words<T: Copy>(
    reader: &mut Reader,
    place: &Place<'_>,
    (one, list): (&str, &str),
    words: &[(&'static str, T)],
) -> Option<Vec<T>> {
    let names: Vec<_> = words.iter().map(|(name, _)| *name).collect();
    let quoted: Vec<_> = names.iter().map(|name| format!("\"{name}\"")).collect();
    let entry = reader.need(place, "field", format!("`{} = [{}, …]`", place.key, quoted.join(", ")))?;
    let Value::Array(items) = &entry.value else {
        reader.wrong_type(place, entry, list);
        return None;
    };
    let mut found = Vec::with_capacity(items.len());
    for (at, item) in items {
        let Value::Text(text) = item else {
            reader.wrong(at, place.field(), format!("expected a {one}, found {}", item.what()), None);
            return None;
        };
        let Some((_, word)) = words.iter().find(|(name, _)| name == text) else {
            let near = nearest(text, &names).map_or(String::new(), |near| format!("did you mean `{near}`? "));
            let help = Some(format!("{near}allowed are {}", names.join(", ")));
            reader.wrong(at, place.field(), format!("unknown {one} `{text}`"), help);
            return None;
        };
        found.push(*word);
    }
    Some(found)
}

/// A table of tables whose keys are numbers, from 1.
impl<T: TomlTable> Part for BTreeMap<usize, T> {
    type Spec = ();
    const OPTIONAL: bool = true;

    fn shape((): &()) -> Shape {
        Shape::Numbered(T::fields())
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        if place.entry().is_none() {
            return Some(Self::new());
        }
        let mut read = Some(Self::new());
        for (key, entry) in &reader.need_table(place)?.entries {
            let field = join(&place.field(), key);
            let number = key.parse().ok().filter(|number: &usize| *number > 0 && number.to_string() == *key);
            let one = match (number, &entry.value) {
                (None, _) => {
                    let help = Some(format!("write [{}.N], N being 1 for the first", place.field()));
                    reader.wrong(&entry.key, field, "is no number", help);
                    None
                }
                (
                    Some(_),
                    value @ (Value::Array(_) | Value::Number(_) | Value::Text(_) | Value::Boolean(_) | Value::Other(_)),
                ) => {
                    let message = format!("expected a table, found {}", value.what());
                    reader.wrong(&entry.value_at, field, message, None);
                    None
                }
                (Some(number), Value::Table(table)) => T::read_table(reader, table, &field).map(|one| (number, one)),
            };
            // All are read before any is missed: every mistake is told at once.
            read = read.zip(one).map(|(mut read, (number, one))| {
                read.insert(number, one);
                read
            });
        }
        read
    }
}

/// One of a few words.
pub(crate) fn read_word<T: Copy>(reader: &mut Reader, place: &Place<'_>, words: &[(&'static str, T)]) -> Option<T> {
    let names: Vec<_> = words.iter().map(|(name, _)| *name).collect();
    let allowed = format!("allowed are {}", names.join(", "));
    let entry = reader.need(place, "field", format!("`{} = \"…\"`, {allowed}", place.key))?;
    let Value::Text(text) = &entry.value else {
        reader.wrong_type(place, entry, "a text");
        return None;
    };
    let found = words.iter().find(|(name, _)| name == text).map(|(_, word)| *word);
    if found.is_none() {
        let near = nearest(text, &names).map_or(String::new(), |near| format!("did you mean `{near}`? "));
        let help = Some(format!("{near}{allowed}"));
        reader.wrong(&entry.value_at, place.field(), format!("unknown {} `{text}`", place.key), help);
    }
    found
}

impl<T: Part> Part for Option<T> {
    type Spec = T::Spec;
    const OPTIONAL: bool = true;

    fn shape(spec: &Self::Spec) -> Shape {
        T::shape(spec)
    }

    fn read(reader: &mut Reader, place: &Place<'_>, spec: &Self::Spec) -> Option<Self> {
        if place.entry().is_none() { Some(None) } else { T::read(reader, place, spec).map(Some) }
    }
}

impl<T: Part> Part for Box<T> {
    type Spec = T::Spec;

    fn shape(spec: &Self::Spec) -> Shape {
        T::shape(spec)
    }

    fn read(reader: &mut Reader, place: &Place<'_>, spec: &Self::Spec) -> Option<Self> {
        T::read(reader, place, spec).map(Box::new)
    }
}
