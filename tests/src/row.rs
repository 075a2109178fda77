//! A row of a table of figures: what is required beside what was measured.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use comfy_table::{ContentArrangement, Table, presets};
use serde_json::{Value, json};

use crate::page;

/// Where a campaign's rows go besides the terminal.
#[derive(Args)]
pub struct Output {
    /// Also write the rows as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Also write the rows into their section of docs/figures.md.
    #[arg(long, conflicts_with = "only")]
    write: bool,
}

/// A campaign as `docs/figures.md` names it.
#[derive(Clone, Copy, Debug)]
pub struct Campaign {
    /// Section of the document.
    pub section: &'static str,
    /// Command that measures it.
    pub command: &'static str,
    /// What the campaign's size counts, and the size.
    pub size: (&'static str, u64),
}

/// Row of a table of figures: a requirement and what was measured.
#[derive(Clone, Debug)]
pub struct FigureRow {
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

impl FigureRow {
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
fn table(rows: &[FigureRow]) -> Table {
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
fn as_json(rows: &[FigureRow]) -> Vec<Value> {
    rows.iter()
        .map(|row| {
            json!({
                "what": row.what.trim(), "required": row.required, "measured": row.measured,
                "holds": row.holds, "numbers": row.numbers,
            })
        })
        .collect()
}

/// Prints the rows, writes them where that is wanted, and says how the program ends: a row that does not hold is a
/// failure, and so is an empty table, which shows nothing.
#[must_use]
pub fn conclude(rows: &[FigureRow], campaign: Campaign, output: &Output) -> ExitCode {
    let Campaign { section, command, size } = campaign;
    println!("{}", table(rows));
    if let Some(path) = &output.json {
        let text = format!("{:#}\n", json!({ size.0: size.1, "rows": as_json(rows) }));
        if let Err(error) = std::fs::write(path, text) {
            eprintln!("{}: {error}", path.display());
            return ExitCode::FAILURE;
        }
    }
    if output.write
        && !rows.is_empty()
        && let Err(error) = page::write(section, command, size, &page::table(rows))
    {
        eprintln!("{error}");
        return ExitCode::FAILURE;
    }
    if rows.is_empty() || rows.iter().any(|row| row.holds == Some(false)) {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
