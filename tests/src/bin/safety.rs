//! `safety`: the campaign behind the project's figures on safety. Prints one table; ends with 1 if a row does not hold.

use std::process::ExitCode;

use clap::Parser;
use system_tests::figures::run::DesignedRobot;
use system_tests::row::{Campaign, Output, conclude};
use system_tests::safety::{Options, rows};

/// Orders that change, every 1 ms to 1 s, while something is broken: prints what is required beside what was measured.
#[derive(Parser)]
#[command(
    after_help = "Examples:\n  cargo safety-figures\n  cargo safety-figures --runs 18 --only \"shaft blocked\" --seed 7"
)]
struct Arguments {
    /// Runs, over all kinds of trouble.
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    runs: u64,
    /// The first seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only kinds of trouble whose name contains this.
    #[arg(long)]
    only: Option<String>,
    #[command(flatten)]
    output: Output,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let options = Options { runs: arguments.runs, seed: arguments.seed, only: arguments.only };
    let campaign = Campaign { section: "safety", command: "cargo safety-figures", size: ("runs", arguments.runs) };
    conclude(&rows(&DesignedRobot::new(), &options), campaign, &arguments.output)
}
