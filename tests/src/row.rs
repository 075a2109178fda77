//! A row of a table of figures: what is required beside what was measured.

use std::path::Path;
use std::process::ExitCode;

use comfy_table::{ContentArrangement, Table, presets};
use serde_json::{Value, json};

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was tried.
    pub what: String,
    /// What is required; empty for a row that only informs.
    pub required: String,
    /// What was measured.
    pub measured: String,
    /// Whether it holds; `None` for a row that only informs.
    pub holds: Option<bool>,
    /// The measured numbers, for machines.
    pub numbers: Value,
}

impl Row {
    /// A row with a requirement.
    #[must_use]
    pub fn new(what: &str, required: &str, measured: String, holds: bool, numbers: Value) -> Self {
        Self { what: what.into(), required: required.into(), measured, holds: Some(holds), numbers }
    }

    /// A row that stands beside another for comparison.
    #[must_use]
    pub fn beside(what: &str, measured: String, numbers: Value) -> Self {
        Self { what: what.into(), required: String::new(), measured, holds: None, numbers }
    }
}

/// The rows for people.
fn table(rows: &[Row]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY).set_content_arrangement(ContentArrangement::Dynamic).set_width(140);
    table.set_header(["what", "required", "measured", "holds"]);
    for row in rows {
        let holds = match row.holds {
            Some(true) => "yes",
            Some(false) => "NO",
            None => "",
        };
        table.add_row([row.what.as_str(), &row.required, &row.measured, holds]);
    }
    table
}

/// The rows for machines.
fn as_json(rows: &[Row]) -> Vec<Value> {
    rows.iter()
        .map(|row| {
            json!({
                "what": row.what.trim(), "required": row.required, "measured": row.measured,
                "holds": row.holds, "numbers": row.numbers,
            })
        })
        .collect()
}

/// Prints the rows, writes them as JSON where that is wanted, and says how the program ends: a row that does not hold is a
/// failure, and so is an empty table, which shows nothing. `size` is how large the campaign was, with its name.
#[must_use]
pub fn conclude(rows: &[Row], size: (&str, u64), file: Option<&Path>) -> ExitCode {
    println!("{}", table(rows));
    if let Some(path) = file {
        let text = format!("{:#}\n", json!({ size.0: size.1, "rows": as_json(rows) }));
        if let Err(error) = std::fs::write(path, text) {
            eprintln!("{}: {error}", path.display());
            return ExitCode::FAILURE;
        }
    }
    if rows.is_empty() || rows.iter().any(|row| row.holds == Some(false)) {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
