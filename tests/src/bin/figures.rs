//! `figures`: the campaign behind the project's figures on control. Prints one table; ends with 1 if a row does not hold.

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use system_tests::figures::CAMPAIGNS;
use system_tests::figures::run::DesignedRobot;
use system_tests::row::{Campaign, Output, conclude};

/// Runs the campaigns behind the figures on control and prints what is required beside what was measured.
#[derive(Parser)]
#[command(after_help = "Example: cargo run -p system-tests --bin figures -- --seeds 20 --only oscillation")]
struct Arguments {
    /// Seeds of every campaign.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    seeds: u64,
    /// Only campaigns whose name contains this: speed, calibrated, ceiling, oscillation, mismatch, comparison, faults, two-sensors.
    #[arg(long)]
    only: Option<String>,
    #[command(flatten)]
    output: Output,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let wanted = |name: &str| arguments.only.as_deref().is_none_or(|part| name.contains(part));
    if !CAMPAIGNS.iter().any(|(name, _)| wanted(name)) {
        let names: Vec<_> = CAMPAIGNS.iter().map(|(name, _)| *name).collect();
        eprintln!("no campaign `{}`: there are {}", arguments.only.unwrap_or_default(), names.join(", "));
        return ExitCode::from(2);
    }
    let bench = DesignedRobot::new();
    let mut rows = Vec::new();
    for (name, campaign) in CAMPAIGNS.iter().filter(|(name, _)| wanted(name)) {
        let start = Instant::now();
        rows.extend(campaign(&bench, arguments.seeds));
        eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    let campaign = Campaign { section: "control", command: "cargo figures", size: ("seeds", arguments.seeds) };
    conclude(&rows, campaign, &arguments.output)
}
