//! Tables and numbers for people.

use comfy_table::{Cell, CellAlignment, LineStyle, Table, TableStyle};

/// A rule above, below, and under the header.
const STYLE: TableStyle = TableStyle::new()
    .top_border(LineStyle::none().fill('─').junction('─'))
    .header_separator(LineStyle::none().fill('─').junction('─'))
    .bottom_border(LineStyle::none().fill('─').junction('─'));

/// A table of two columns, what and value.
pub fn facts<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    let mut table = Table::new();
    table.load_style(STYLE);
    for (what, value) in rows {
        table.add_row([what.to_owned(), value]);
    }
    table.to_string()
}

/// A table with a header; all columns but the first are right-aligned.
pub fn columns(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(STYLE).set_header(header);
    for row in rows {
        table.add_row(row.into_iter().enumerate().map(|(index, text)| {
            let alignment = if index == 0 { CellAlignment::Left } else { CellAlignment::Right };
            Cell::new(text).set_alignment(alignment)
        }));
    }
    table.to_string()
}

/// A number with a unit, or a dash.
pub fn or_dash(value: Option<f64>, decimals: usize, unit: &str) -> String {
    value.map_or_else(|| "–".to_owned(), |v| with_unit(v, decimals, unit))
}

/// A number with a unit.
pub fn with_unit(value: f64, decimals: usize, unit: &str) -> String {
    let space = if unit.is_empty() || unit == "°" { "" } else { " " };
    // Rounding to zero must not leave a sign behind.
    let text = format!("{value:.decimals$}");
    let zero = text.strip_prefix('-').filter(|rest| rest.chars().all(|c| c == '0' || c == '.'));
    format!("{}{space}{unit}", zero.unwrap_or(&text))
}
