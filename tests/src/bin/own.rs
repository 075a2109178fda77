//! Recordings of `scram sim`, diagnosed with the file that they were simulated from.
//!
//! `cargo own-recordings` runs 60 sets with nothing missing, 20 of the robot on the ground, 30 with one listed effect taken out of the
//! file, 10 of these on the ground, and 30 that no diagnosis can tell until the experiment that it designs is run. Exit code 0: every
//! bar is reached, 1: one is missed or it could not be done, 2: wrong usage.

use std::process::ExitCode;

use clap::Parser;
use system_tests::own::{Outcome, PairOutcome, Set, examine, examine_pair, sets, walks};
use system_tests::seeds;

/// Diagnose the simulator's own recordings with their own file.
#[derive(Parser)]
#[command(after_help = "Examples:
  cargo own-recordings                    every set, as the long campaign has them
  cargo own-recordings --release-seeds    the same on seeds from the operating system's entropy, printed first
  cargo own-recordings --nothing 12 --walks 2 --missing 2 --missing-walks 1 --pairs 2 --show-missing    what every change must pass

Exit codes: 0 every bar is reached, 1 one is missed or it could not be done, 2 wrong usage.")]
struct Arguments {
    /// Sets with the simulator's own file
    #[arg(long, default_value_t = 60)]
    nothing: usize,
    /// Sets of the robot on the ground with its own file
    #[arg(long, default_value_t = 20)]
    walks: usize,
    /// Sets with one effect taken out of the file
    #[arg(long, default_value_t = 30)]
    missing: usize,
    /// Sets of the robot on the ground with one effect taken out of the file
    #[arg(long, default_value_t = 10)]
    missing_walks: usize,
    /// Sets of steady runs that cannot tell one effect from others, and the experiment that can
    #[arg(long, default_value_t = 30)]
    pairs: usize,
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
    let examined = |sets: Vec<Set>| -> Vec<Outcome> {
        sets.into_iter()
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
    let nothing = examined(sets(arguments.nothing, seed, false));
    bar("nothing is missing", &nothing, Some(nothing.len() * 2 / 60));
    let on_ground = examined(walks(arguments.walks, seed, false));
    bar("nothing is missing on the ground", &on_ground, Some(0));
    let missing = examined(sets(arguments.missing, seed, true));
    bar("an effect is missing", &missing, (!arguments.show_missing).then_some(missing.len() * 3 / 30));
    let missing = examined(walks(arguments.missing_walks, seed, true));
    bar("an effect is missing on the ground", &missing, (!arguments.show_missing).then_some(missing.len() * 3 / 30));
    if arguments.pairs > 0 {
        let outcomes: Vec<PairOutcome> = (0..arguments.pairs as u64)
            .map(|i| seed + i)
            .filter(|seed| arguments.only.is_empty() || arguments.only.contains(seed))
            .map(|seed| {
                let outcome = examine_pair(seed);
                println!("{}", outcome.line());
                outcome
            })
            .collect();
        reached &= pairs_bar(&outcomes);
    }
    if reached { ExitCode::SUCCESS } else { ExitCode::from(1) }
}

/// At most one single name in thirty, and twenty-six that the experiment separates.
fn pairs_bar(outcomes: &[PairOutcome]) -> bool {
    let count = |pick: fn(&PairOutcome) -> bool| outcomes.iter().filter(|outcome| pick(outcome)).count();
    let (sets, single) = (outcomes.len(), count(|one| one.single));
    let (proposed, separated) = (count(|one| one.proposed), count(|one| one.separated));
    let (least, most) = (sets - sets * 4 / 30, sets / 30);
    let passed = single <= most && separated >= least;
    println!(
        "{} what steady runs cannot tell: {single} single names (bar: at most {most}), {proposed} of {sets} with an experiment, \
         {separated} separated by it (bar: {least})",
        if passed { "ok  " } else { "MISS" },
    );
    passed
}
