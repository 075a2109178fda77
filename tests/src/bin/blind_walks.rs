//! `blind-walks`: effects hidden in how robots walk, to be found by name.
//!
//! Exit code 0: every bar is reached, 1: one is missed or it could not be done, 2: wrong usage.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use diagnose::walk::{WalkOptions, diagnose_walk};
use sweep::Measured;
use system_tests::body::multibody::Multibody;
use system_tests::body::peer::Peer;
use system_tests::journal::Journal;
use system_tests::row::{Campaign, Output, conclude};
use system_tests::walks::truth::FIRST_JUDGED;
use system_tests::walks::visible::shows;
use system_tests::walks::{Outcome, Truth, make, robot_file, rows, table, truths};

/// Diagnose walks that MuJoCo made, with an effect hidden or none, and count.
#[derive(Parser)]
#[command(after_help = "Examples:
  cargo blind-walks                                       all robots, as the long campaign has them
  cargo blind-walks --first 1 --effects 4 --nothing 0 --outside 0 --only 4   what every change must pass
  cargo blind-walks --make                                only make the tables that are missing: a minute each with MuJoCo")]
struct Arguments {
    /// Robots with an effect of the catalogue
    #[arg(long, default_value_t = 30)]
    effects: u64,
    /// Robots whose file lacks nothing
    #[arg(long, default_value_t = 15)]
    nothing: u64,
    /// Robots with something that the catalogue has not
    #[arg(long, default_value_t = 8)]
    outside: u64,
    /// First robot's number; those below 1000 were looked at
    #[arg(long, default_value_t = FIRST_JUDGED)]
    first: u64,
    /// Only robots of this number; repeatable
    #[arg(long, value_name = "NUMBER")]
    only: Vec<u64>,
    /// Only make the tables that are missing, by MuJoCo's multibody
    #[arg(long)]
    make: bool,
    /// Only tell how much of each effect shows
    #[arg(long)]
    shows: bool,
    /// Write every outcome into this file as it comes, and take from it those that are there
    #[arg(long)]
    journal: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let chosen = |truth: &Truth| arguments.only.is_empty() || arguments.only.contains(&truth.number);
    let mut truths = truths(arguments.first, arguments.effects, arguments.nothing, arguments.outside);
    truths.retain(chosen);
    if arguments.shows {
        tell_what_shows(&truths);
        return ExitCode::SUCCESS;
    }
    let done = if arguments.make { make_all(&truths).map(|()| Vec::new()) } else { diagnose_all(&arguments, &truths) };
    match done {
        Ok(_) if arguments.make => ExitCode::SUCCESS,
        Ok(outcomes) => {
            let campaign =
                Campaign { section: "walks", command: "cargo blind-walks", size: ("robots", outcomes.len() as u64) };
            conclude(&rows(&outcomes), campaign, &arguments.output)
        }
        Err(words) => {
            eprintln!("error: {words}");
            ExitCode::from(1)
        }
    }
}

fn tell_what_shows(truths: &[Truth]) {
    for (truth, shows) in truths.iter().filter_map(|truth| Some((truth, shows(truth)?))) {
        println!("{} {:?}: {shows:.1}", truth.number, truth.hidden);
    }
}

fn make_all(truths: &[Truth]) -> Result<(), String> {
    let peer = Peer::find().map_err(|error| error.to_string())?;
    let multibody = Multibody::build(&peer).map_err(|error| error.to_string())?;
    for truth in truths.iter().filter(|truth| !table(truth.number).exists()) {
        let start = Instant::now();
        make(&peer, &multibody, truth).map_err(|error| error.to_string())?;
        println!("{} {:?}: {:.0} s", truth.number, truth.hidden, start.elapsed().as_secs_f64());
    }
    Ok(())
}

fn diagnose_all(arguments: &Arguments, truths: &[Truth]) -> Result<Vec<Outcome>, String> {
    let mut journal = arguments.journal.as_deref().map(Journal::<Outcome>::open).transpose()?;
    let mut outcomes = Vec::new();
    for truth in truths {
        let known = journal.iter().flat_map(|journal| &journal.before).find(|one| one.number == truth.number).cloned();
        let outcome = match known {
            Some(outcome) => outcome,
            None => {
                let outcome = diagnose_one(truth)?;
                journal.as_mut().map_or(Ok(()), |journal| journal.add(&outcome))?;
                outcome
            }
        };
        println!("{}", outcome.line());
        outcomes.push(outcome);
    }
    Ok(outcomes)
}

fn diagnose_one(truth: &Truth) -> Result<Outcome, String> {
    let measured = Measured::read(&table(truth.number)).map_err(|error| error.to_string())?;
    let start = Instant::now();
    let found = diagnose_walk(&robot_file(), &measured, &WalkOptions::default())
        .map_err(|error| format!("robot {}: {error}", truth.number))?;
    Ok(Outcome::new(truth, &found, start.elapsed().as_secs_f64()))
}
