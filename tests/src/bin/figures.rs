//! `figures`: the campaign behind the project's figures on control. Prints one table; ends with 1 if a row does not hold.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use comfy_table::{ContentArrangement, Table, presets};
use serde_json::json;
use system_tests::figures::run::Bench;
use system_tests::figures::{CAMPAIGNS, Row};

/// Runs the campaigns behind the figures on control and prints what is required beside what was measured.
#[derive(Parser)]
#[command(after_help = "Example: cargo run -p system-tests --bin figures -- --seeds 20 --only oscillation")]
struct Arguments {
    /// Seeds of every campaign.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    seeds: u64,
    /// Only campaigns whose name contains this: speed, calibrated, ceiling, oscillation, mismatch, comparison, faults.
    #[arg(long)]
    only: Option<String>,
    /// Also write the rows as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let wanted = |name: &str| arguments.only.as_deref().is_none_or(|part| name.contains(part));
    if !CAMPAIGNS.iter().any(|(name, _)| wanted(name)) {
        let names: Vec<_> = CAMPAIGNS.iter().map(|(name, _)| *name).collect();
        eprintln!("no campaign `{}`: there are {}", arguments.only.unwrap_or_default(), names.join(", "));
        return ExitCode::from(2);
    }
    let bench = Bench::new();
    let mut rows = Vec::new();
    for (name, campaign) in CAMPAIGNS.iter().filter(|(name, _)| wanted(name)) {
        let start = Instant::now();
        rows.extend(campaign(&bench, arguments.seeds));
        eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    println!("{}", table(&rows));
    if let Some(path) = &arguments.json
        && let Err(error) = std::fs::write(path, format!("{:#}\n", as_json(&rows, arguments.seeds)))
    {
        eprintln!("{}: {error}", path.display());
        return ExitCode::FAILURE;
    }
    if rows.iter().any(|row| row.holds == Some(false)) { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

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

fn as_json(rows: &[Row], seeds: u64) -> serde_json::Value {
    let rows: Vec<_> = rows
        .iter()
        .map(|row| {
            json!({
                "what": row.what.trim(), "required": row.required, "measured": row.measured,
                "holds": row.holds, "numbers": row.numbers,
            })
        })
        .collect();
    json!({ "seeds": seeds, "rows": rows })
}
