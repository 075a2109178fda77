//! `body_figures`: what is behind the project's figures on the body. Prints one table; ends with 1 if a row does not hold.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use system_tests::body::{CAMPAIGNS, PeerSetup, SLOW};
use system_tests::row::{Campaign, Output, conclude};

/// Measures the figures on the body, beside MuJoCo where it is there, and prints what is required beside what was measured.
///
/// Frequencies are counter-clockwise positive, as MuJoCo's. Timings want an idle machine. Without MuJoCo (`.ci/tools` makes
/// target/mujoco-venv; SCRAM_MUJOCO_PYTHON names another Python that has it) what needs it is skipped and says so; with
/// SCRAM_ALL_PEERS=1 that is a failure.
#[derive(Parser)]
#[command(after_help = "Examples:\n  cargo body-figures\n  cargo body-figures --quick\n  \
                        cargo body-figures --only speeds --only mirror")]
struct Arguments {
    /// Only campaigns whose name contains this; may be given several times.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    #[arg(long, help = left_out())]
    quick: bool,
    #[command(flatten)]
    output: Output,
    /// Directory for plots, tables and what is kept for the next time.
    #[arg(long, value_name = "DIR", default_value = "target/body-figures")]
    out: PathBuf,
}

/// What `--quick` does.
fn left_out() -> String {
    format!("Without the campaigns that take minutes or time what an idle machine alone does well: {}", SLOW.join(", "))
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let here = |name: &&str| !(arguments.quick && SLOW.contains(name));
    let names: Vec<&str> = CAMPAIGNS.iter().map(|(name, _)| *name).filter(here).collect();
    if let Some(part) = arguments.only.iter().find(|part| !names.iter().any(|name| name.contains(part.as_str()))) {
        eprintln!("no campaign `{part}`: there are {}", names.join(", "));
        return ExitCode::from(2);
    }
    let asked =
        |name: &str| arguments.only.is_empty() || arguments.only.iter().any(|part| name.contains(part.as_str()));
    let bench = PeerSetup::new(arguments.out);
    let (mut rows, mut ran) = (Vec::new(), 0);
    for (name, campaign) in CAMPAIGNS.iter().filter(|(name, _)| names.contains(name) && asked(name)) {
        let start = Instant::now();
        rows.extend(campaign(&bench));
        ran += 1;
        eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    let command = if arguments.quick { "cargo body-figures --quick" } else { "cargo body-figures" };
    let campaign = Campaign { section: "body", command, size: ("campaigns", ran) };
    conclude(&rows, campaign, &arguments.output)
}
