//! `scram learn`

mod maze;
mod straight;
mod terrain;
mod turn;

use std::path::Path;

use ::learn::Settings;
use clap::Subcommand;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use miette::Report;
use robot_file::edit::Document;
use sweep::VariantBuilder;

use super::{Common, Done};

/// Learn how to walk by trial, on the simulated robot
#[derive(Subcommand)]
pub enum Learn {
    Turn(turn::TurnCommand),
    Straight(straight::StraightCommand),
    Maze(maze::MazeCommand),
    Terrain(terrain::TerrainCommand),
}

impl Learn {
    pub fn run(&self) -> Done {
        match self {
            Self::Turn(command) => command.run(),
            Self::Straight(command) => command.run(),
            Self::Maze(command) => command.run(),
            Self::Terrain(command) => command.run(),
        }
    }
}

/// The learning file; without one the defaults.
fn settings(file: Option<&Path>) -> Result<Settings, Report> {
    Ok(file.map_or_else(|| Ok(Settings::default()), Settings::load)?)
}

/// The robot file, from which robots are drawn.
fn robot(common: &Common) -> Result<VariantBuilder, Report> {
    let document = Document::load(&common.robot)?;
    let robot = document.robot()?;
    Ok(VariantBuilder::new(document, robot)?)
}

fn bar(length: usize, done: usize) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length as u64), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    bar.set_position(done as u64);
    bar
}
