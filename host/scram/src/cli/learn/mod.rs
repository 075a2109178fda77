//! `scram learn`

mod design;
mod maze;
mod straight;
mod terrain;
mod turn;

use std::path::{Path, PathBuf};

use ::learn::gait::End;
use ::learn::{Direction, Settings};
use clap::{Args, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use miette::{IntoDiagnostic, Report, WrapErr};
use robot_file::edit::Document;
use serde::de::DeserializeOwned;
use sweep::VariantBuilder;

use super::run_directory::LEARNED;
use super::{Common, Done, print};

/// Learn how to walk by trial, on the simulated robot
#[derive(Subcommand)]
pub enum Learn {
    Turn(turn::TurnCommand),
    Straight(straight::StraightCommand),
    Maze(maze::MazeCommand),
    Terrain(terrain::TerrainCommand),
    Design(design::DesignCommand),
}

impl Learn {
    pub fn run(&self) -> Done {
        match self {
            Self::Turn(command) => command.run(),
            Self::Straight(command) => command.run(),
            Self::Maze(command) => command.run(),
            Self::Terrain(command) => command.run(),
            Self::Design(command) => command.run(),
        }
    }
}

/// The learning file as it is written beside what came of it.
const SETTINGS: &str = "learn.toml";

/// What all of these commands can be told.
#[derive(Args)]
struct Options {
    /// The learning file
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Threads; all cores without
    #[arg(long, value_name = "COUNT")]
    threads: Option<usize>,
    #[command(flatten)]
    common: Common,
    /// Write over what is in --out already
    #[arg(long)]
    overwrite: bool,
}

impl Options {
    /// A directory of its own for what a command makes of the learning file.
    fn fill(&self, make: impl FnOnce(&Path) -> Result<(), Report>) -> Done {
        LEARNED.fill(&self.common.out, self.overwrite, make)?;
        Ok(())
    }

    /// The learning file; without one the defaults.
    fn settings(&self) -> Result<Settings, Report> {
        Ok(self.settings.as_deref().map_or_else(|| Ok(Settings::default()), Settings::load)?)
    }

    /// The robot file, from which robots are drawn.
    fn robot(&self) -> Result<VariantBuilder, Report> {
        let document = Document::load(&self.common.robot)?;
        let robot = document.robot()?;
        Ok(VariantBuilder::new(document, robot)?)
    }
}

/// Which way to turn, as it is typed.
#[derive(Clone, Copy, ValueEnum)]
enum Way {
    Left,
    Right,
}

impl From<Way> for Direction {
    fn from(way: Way) -> Self {
        match way {
            Way::Left => Self::Left,
            Way::Right => Self::Right,
        }
    }
}

/// How what takes long begins: anew, or where it was stopped.
#[derive(Args)]
struct Begin {
    /// Which way to turn: left is counter-clockwise seen from above
    #[arg(long, required_unless_present = "resume", conflicts_with = "resume")]
    direction: Option<Way>,
    /// Go on in the directory of a run that was stopped
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "settings"])]
    resume: Option<PathBuf>,
}

impl Begin {
    fn direction(&self) -> Direction {
        self.direction.map_or(Direction::Left, Direction::from)
    }
}

/// Reads what a command that was stopped has left.
fn read<T: DeserializeOwned>(path: &Path, is_none: &str) -> Result<T, Report> {
    let text = std::fs::read_to_string(path).into_diagnostic().wrap_err_with(|| path.display().to_string())?;
    let problem = || format!("{}: {is_none}", path.display());
    serde_json::from_str(&text).into_diagnostic().wrap_err_with(problem)
}

/// Says which files were written.
fn written(out: &Path, names: &[&str]) {
    let files: Vec<String> = names.iter().map(|name| out.join(name).display().to_string()).collect();
    print(&format!("written: {}", files.join(", ")));
}

/// For a table, of the ends of robots' ways and how long those took that arrived, s: how many of all arrived, the median of their times, and how
/// many stood, were stopped and ran out of time.
fn ended(ways: impl Iterator<Item = (End, Option<f64>)>) -> [String; 5] {
    let (ends, times): (Vec<End>, Vec<Option<f64>>) = ways.unzip();
    let count = |end: End| ends.iter().filter(|one| **one == end).count().to_string();
    let median = common::statistics::quantile(&mut times.into_iter().flatten().collect::<Vec<_>>(), 0.5);
    [
        format!("{} of {}", count(End::Arrived), ends.len()),
        median.map_or_else(|| "–".to_owned(), |seconds| format!("{seconds:.0}")),
        count(End::Stood),
        count(End::Stopped),
        count(End::OutOfTime),
    ]
}

fn bar(length: usize, done: usize) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length as u64), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    bar.set_position(done as u64);
    bar
}
