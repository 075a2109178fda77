//! Recordings of `scram sim`, diagnosed with the file that they were simulated from.
//!
//! `cargo own-recordings` runs 60 sets with nothing missing and 30 with one listed effect taken out of the file. Exit code 0:
//! every bar is reached, 1: one is missed or it could not be done, 2: wrong usage.

use std::process::ExitCode;

use clap::Parser;
use system_tests::own::{Outcome, examine, sets};
use system_tests::seeds;

/// Diagnose the simulator's own recordings with their own file.
#[derive(Parser)]
#[command(after_help = "Examples:
  cargo own-recordings                    every set, as the long campaign has them
  cargo own-recordings --release-seeds    the same on seeds from the operating system's entropy, printed first
  cargo own-recordings --nothing 12 --missing 2 --show-missing    what every change must pass

Exit codes: 0 every bar is reached, 1 one is missed or it could not be done, 2 wrong usage.")]
struct Arguments {
    /// Sets with the simulator's own file
    #[arg(long, default_value_t = 60)]
    nothing: usize,
    /// Sets with one effect taken out of the file
    #[arg(long, default_value_t = 30)]
    missing: usize,
    /// Of the sets with one effect taken out, judge only that none gets a false name, and just show how many are right:
    /// the bar of three in thirty leaves no room for a miss in fewer than ten sets
    #[arg(long)]
    show_missing: bool,
    /// First seed; those below 1000 were used for tuning
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Of these sets, only those with this seed, to look at one again; repeatable
    #[arg(long, value_name = "SEED")]
    only: Vec<u64>,
    /// Draw seeds that nobody has seen, and print them
    #[arg(long, conflicts_with = "seed")]
    release_seeds: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let seed = match arguments.release_seeds.then(seeds::fresh).transpose() {
        Ok(fresh) => fresh.unwrap_or(arguments.seed),
        Err(error) => {
            eprintln!("error: the operating system has no entropy: {error}");
            return ExitCode::from(1);
        }
    };
    println!("seeds from {seed}");
    let examined = |count: usize, missing: bool| -> Vec<Outcome> {
        sets(count, seed, missing)
            .into_iter()
            .filter(|set| arguments.only.is_empty() || arguments.only.contains(&set.seed))
            .map(|set| {
                let outcome = examine(set);
                println!("{}", outcome.line());
                outcome
            })
            .collect()
    };
    let mut reached = true;
    let mut bar = |what: &str, outcomes: &[Outcome], allowed: Option<usize>| {
        let right = outcomes.iter().filter(|outcome| outcome.right()).count();
        let wrong = outcomes.iter().filter(|outcome| outcome.false_name()).count();
        let passed = allowed.is_none_or(|allowed| right + allowed >= outcomes.len()) && wrong == 0;
        let needed =
            allowed.map_or("shown, not judged".to_owned(), |allowed| format!("bar: {}", outcomes.len() - allowed));
        println!(
            "{} {what}: {right} of {} right ({needed}), {} of them alone, {wrong} under a false name (bar: 0)",
            if passed { "ok  " } else { "MISS" },
            outcomes.len(),
            outcomes.iter().filter(|outcome| outcome.alone()).count(),
        );
        reached &= passed;
    };
    let nothing = examined(arguments.nothing, false);
    bar("nothing is missing", &nothing, Some(nothing.len() * 2 / 60));
    let missing = examined(arguments.missing, true);
    bar("an effect is missing", &missing, (!arguments.show_missing).then_some(missing.len() * 3 / 30));
    if reached { ExitCode::SUCCESS } else { ExitCode::from(1) }
}
