//! `fuzz_minute`: every decoder on seeded inputs, a minute in all. Prints a line a target; ends with 1 on a crash, a hang or
//! memory beyond the bound.

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use fuzz_cases::TARGETS;
use system_tests::fuzz::watch::{Watch, forget_peak, peak, resident};
use system_tests::fuzz::{Until, keep, run};

/// Beyond what the process had before a target, bytes.
const MOST_MEMORY: u64 = 256 << 20;
const MIB: f64 = (1 << 20) as f64;

/// Runs every decoder on seeded inputs.
#[derive(Parser)]
#[command(after_help = "Examples:\n  cargo fuzz-minute\n  cargo fuzz-minute --only air --seconds 20 --seed 7")]
struct Arguments {
    /// For all targets together.
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Of the inputs.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only targets whose name contains this.
    #[arg(long)]
    only: Option<String>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let wanted = |name: &str| arguments.only.as_deref().is_none_or(|part| name.contains(part));
    let targets: Vec<_> = TARGETS.iter().filter(|target| wanted(target.name)).collect();
    if targets.is_empty() || !(0.0..=1e6).contains(&arguments.seconds) {
        let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("no such target, or no such time; there are {}", names.join(", "));
        return ExitCode::from(2);
    }
    let time = Duration::from_secs_f64(arguments.seconds / targets.len() as f64);
    let watch = Watch::start();
    let mut good = true;
    println!("{:16}{:>12}{:>10}{:>14}{:>16}", "target", "executions", "s", "slowest, ms", "memory, MiB");
    for target in targets {
        forget_peak();
        let before = resident();
        let report = match run(target, arguments.seed, Until::Time(time), &watch) {
            Ok(report) => report,
            Err(error) => {
                eprintln!("{}: its corpus in fuzz/corpus-seed cannot be read: {error}", target.name);
                return ExitCode::FAILURE;
            }
        };
        let peak = peak();
        println!(
            "{:16}{:12}{:10.1}{:14.1}{:>16}",
            target.name,
            report.executions,
            report.time.as_secs_f64(),
            report.slowest.as_secs_f64() * 1e3,
            peak.map_or_else(|| "unknown".into(), |peak| format!("{:.0}", peak as f64 / MIB)),
        );
        if let Some((input, problem)) = &report.crash {
            good = false;
            match keep(target.name, input) {
                Ok(path) => eprintln!("{}: {problem}\n    on {}", target.name, path.display()),
                Err(error) => eprintln!("{}: {problem}\n    on {input:02x?} ({error})", target.name),
            }
        }
        if let (Some(before), Some(peak)) = (before, peak)
            && peak.saturating_sub(before) > MOST_MEMORY
        {
            good = false;
            let more = (peak - before) as f64 / MIB;
            eprintln!("{}: {more:.0} MiB more than before, the bound is {:.0}", target.name, MOST_MEMORY as f64 / MIB);
        }
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
