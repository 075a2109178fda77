//! The tables of docs/robot-file.md, made from the same list as the reader.

use std::fmt::Write;

use crate::robot::Robot;
use crate::schema::{Field, Shape, TomlTable};
use crate::unit;

/// Every table and key with its unit, allowed range and meaning, as Markdown.
#[must_use]
pub fn markdown() -> String {
    let mut text = String::new();
    write_table(&mut text, "", "The file itself.", false, &Robot::fields());
    text
}

fn write_table(text: &mut String, path: &str, meaning: &str, optional: bool, fields: &[Field]) {
    let title = if path.is_empty() { "Top of the file".into() } else { format!("`[{path}]`") };
    let optional = if optional { " May be left out." } else { "" };
    // Writing into a String cannot fail.
    let _ = write!(text, "### {title}\n\n{meaning}{optional}\n");
    write_fields(text, path, fields);
}

fn write_fields(text: &mut String, path: &str, fields: &[Field]) {
    let rows: Vec<_> = fields.iter().filter_map(row).collect();
    if !rows.is_empty() {
        let _ = write!(text, "\n| key | unit | allowed | meaning |\n|---|---|---|---|\n{}", rows.concat());
    }
    text.push('\n');
    for field in fields {
        let inner = if path.is_empty() { field.key.to_owned() } else { format!("{path}.{}", field.key) };
        match &field.shape {
            Shape::Table(fields) => write_table(text, &inner, field.meaning, field.optional, fields),
            Shape::Numbered(fields) => {
                write_table(text, &format!("{inner}.N"), field.meaning, field.optional, fields);
            }
            Shape::Kinds(kinds) => write_kinds(text, &inner, field, kinds),
            _ => {}
        }
    }
}

fn write_kinds(text: &mut String, path: &str, field: &Field, kinds: &[(&'static str, Vec<Field>)]) {
    let names: Vec<_> = kinds.iter().map(|(name, _)| format!("`\"{name}\"`")).collect();
    let _ = write!(text, "### `[{path}]`\n\n{} `kind` is one of {}.\n\n", field.meaning, names.join(", "));
    for (name, fields) in kinds {
        if !fields.is_empty() {
            let _ = writeln!(text, "With `kind = \"{name}\"`:");
            write_fields(text, path, fields);
        }
    }
}

/// A row of the table; `None` for what has a table of its own.
fn row(field: &Field) -> Option<String> {
    let listed = |words: &[&str]| words.iter().map(|word| format!("`\"{word}\"`")).collect::<Vec<_>>().join(", ");
    let unit = unit::of(field.key).to_owned();
    let (unit, allowed) = match &field.shape {
        Shape::Quantity(low, high) => (unit, unit::range(*low, *high, "1")),
        Shape::Number(low, high) => (unit, format!("bare number, {}", unit::range(*low, *high, "1"))),
        Shape::Numbers(low, high) => (unit, format!("list of bare numbers, {}", unit::range(*low, *high, "1"))),
        Shape::Text => (String::new(), "text".into()),
        Shape::Word(words) => (String::new(), listed(words)),
        Shape::Words(words) => (String::new(), format!("list of {}", listed(words))),
        Shape::Pairs(units, what) => (units.join(", "), format!("list of pairs: {what}")),
        Shape::Table(_) | Shape::Numbered(_) | Shape::Kinds(_) => return None,
    };
    // A bar would end the cell.
    let meaning = field.meaning.replace('|', "\\|");
    let optional = if field.optional { " (may be left out)" } else { "" };
    Some(format!("| `{}`{optional} | {unit} | {allowed} | {meaning} |\n", field.key))
}
