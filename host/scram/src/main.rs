//! The `scram` command: simulate, design, identify and diagnose a miniature robot with one actuator.
//!
//! Exit codes: 0 done, 1 it could not be done, 2 wrong usage.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
