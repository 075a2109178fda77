//! `link`: the campaigns behind the project's figures on the link. Prints one table; ends with 1 if a row does not hold.

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use system_tests::figures::run::DesignedRobot;
use system_tests::link::{CAMPAIGNS, Options};
use system_tests::row::{Campaign, Output, conclude};

/// Runs the campaigns behind the figures on the link and prints what is required beside what was measured.
#[derive(Parser)]
#[command(after_help = "Examples:\n  cargo link-figures\n  cargo link-figures --runs 1500 --only faults\n  \
                        cargo link-figures --only faults --fault \"dongle reboots\" --seed 3")]
struct Arguments {
    /// Runs of the fault campaign; the other campaigns are as large in proportion.
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    runs: u64,
    /// Only campaigns whose name contains this.
    #[arg(long)]
    only: Option<String>,
    /// Of the fault campaign: only faults whose name contains this.
    #[arg(long, conflicts_with = "write")]
    fault: Option<String>,
    /// Of the fault campaign: only this seed, as a message names it.
    #[arg(long, conflicts_with = "write")]
    seed: Option<u64>,
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
    let options = Options { runs: arguments.runs, seed: arguments.seed, fault: arguments.fault.clone() };
    let mut rows = Vec::new();
    for (name, campaign) in CAMPAIGNS.iter().filter(|(name, _)| wanted(name)) {
        let start = Instant::now();
        rows.extend(campaign(&bench, &options));
        eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    let campaign = Campaign { section: "link", command: "cargo link-figures", size: ("runs", arguments.runs) };
    conclude(&rows, campaign, &arguments.output)
}
