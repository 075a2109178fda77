//! Builds, checks, flashes and measures the firmware. People reach it through the aliases in `.cargo/config.toml`.

mod budget;
mod cargo;
mod chip;
mod esp32_check;
mod flash;
mod heap;
mod images;
mod injection;
mod no_panic;
mod overrides;
mod project;
mod sections;
mod toolchain;

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use miette::Result;

use crate::chip::{BINARIES, Chip};
use crate::project::Project;

/// Builds, checks, flashes and measures the firmware.
#[derive(Parser)]
#[command(name = "xtask", arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Task,
    /// Refuse to change firmware/Cargo.lock
    #[arg(long, global = true)]
    locked: bool,
}

#[derive(Subcommand)]
enum Task {
    /// Build the firmware, write flashable images, and hold their sizes against firmware/budgets.toml
    Images {
        /// The board's chip
        #[arg(long, default_value = "esp32c3")]
        chip: Chip,
        /// Only this binary; otherwise all three
        #[arg(long, value_parser = BINARIES)]
        bin: Option<String>,
    },
    /// Build one binary, write it to the board at the USB port, and show what it prints
    Flash(Flash),
    /// Type- and borrow-check the ESP32's firmware; with Espressif's toolchain, build and link it
    CheckEsp32,
    /// Lint the firmware for the ESP32-C3 and the emulated processor with clippy, warnings denied
    Clippy,
    /// Build the program for the emulated processor; the last line printed is the ELF's path
    BuildPil,
    /// Link `control` alone for the chips' instruction set; a panic that can be reached does not link
    NoPanic {
        /// Put a panic in, and fail unless it is found
        #[arg(long)]
        planted: bool,
    },
}

#[derive(Args)]
struct Flash {
    /// Which program
    #[arg(value_parser = BINARIES)]
    binary: String,
    /// The board's chip
    #[arg(default_value = "esp32c3")]
    chip: Chip,
    /// Serial port of the board; otherwise espflash looks for it
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// The robot breaks itself on request: for `scram bring-up`, and for nothing else
    #[arg(long)]
    inject: bool,
}

fn main() -> ExitCode {
    // Messages are not folded: a path or a number broken over two lines cannot be searched for.
    let _ = miette::set_hook(Box::new(|_| {
        Box::new(miette::MietteHandlerOpts::new().wrap_lines(false).break_words(false).build())
    }));
    match run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(report) => {
            eprintln!("{report:?}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> Result<()> {
    let project = Project::find(cli.locked)?;
    match &cli.command {
        Task::Images { chip, bin } => images::run(&project, *chip, bin.as_deref()),
        Task::Flash(flash) => flash::run(&project, flash.chip, &flash.binary, flash.port.as_deref(), flash.inject),
        Task::CheckEsp32 => esp32_check::run(&project),
        Task::Clippy => cargo::clippy(&project),
        Task::BuildPil => {
            println!("{}", cargo::pil(&project)?.display());
            Ok(())
        }
        Task::NoPanic { planted } => no_panic::run(&project, *planted),
    }
}
