//! The simulator built for the default instruction set, which finds out what the machine has when it runs, beside one built
//! for this very machine.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::json;

use super::PeerSetup;
use super::peer::root;
use crate::row::FigureRow;

/// Runs of each build, in turns; the fastest counts.
const REPEATS: usize = 7;
/// How much slower the default build may be.
const SLOWER: f64 = 0.1;
/// What the example times, in the order that it prints.
const CASES: [&str; 3] = ["one robot, f64", "a batch of 24, f64", "a batch of 24, f32"];

/// Runs the campaign; one row of the table per requirement.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    match (built(&bench.out, "default", ""), built(&bench.out, "native", "-Ctarget-cpu=native")) {
        (Ok(usual), Ok(native)) => compared(&usual, &native),
        (Err(message), _) | (_, Err(message)) => {
            vec![FigureRow::new(WHAT, REQUIRED, message, false, json!(null))]
        }
    }
}

const WHAT: &str = "steps per second when built for the default instruction set, over built for this machine's";
const REQUIRED: &str = "0.9 or more";

fn compared(usual: &Path, native: &Path) -> Vec<FigureRow> {
    let mut best = [[0.0_f64; 3]; 2];
    for _ in 0..REPEATS {
        for (best, program) in best.iter_mut().zip([usual, native]) {
            for (best, rate) in best.iter_mut().zip(rates(program)) {
                *best = best.max(rate);
            }
        }
    }
    let row = |case: usize| {
        let ratio = best[0][case] / best[1][case];
        FigureRow::new(
            &format!("{WHAT}: {}", CASES[case]),
            REQUIRED,
            format!("{ratio:.3}: {:.0} to {:.0}", best[0][case], best[1][case]),
            ratio >= 1.0 - SLOWER,
            json!({ "ratio": ratio, "steps_per_s": best[0][case], "steps_per_s_native": best[1][case] }),
        )
    };
    (0..CASES.len()).map(row).collect()
}

/// Builds the example with flags of its own; nothing else is built with them.
fn built(out: &Path, name: &str, flags: &str) -> Result<PathBuf, String> {
    let target = out.join(name);
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(root())
        .args(["build", "--locked", "--package", "hal-sim", "--example", "body_rate", "--target-dir"])
        .arg(&target)
        .env("RUSTFLAGS", flags)
        .output()
        .map_err(|error| format!("cargo: {error}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(said.lines().find(|line| line.starts_with("error")).unwrap_or("the build failed").to_owned());
    }
    Ok(target.join("debug/examples/body_rate"))
}

/// What the example prints; zeros where it fails.
fn rates(program: &Path) -> [f64; 3] {
    let output = Command::new(program).current_dir(root()).output();
    let text = output.map_or_else(|_| String::new(), |output| String::from_utf8_lossy(&output.stdout).into_owned());
    let mut words = text.split_whitespace().map(|word| word.parse().unwrap_or(0.0));
    [0; 3].map(|_| words.next().unwrap_or(0.0))
}
