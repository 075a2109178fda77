//! `scram identify`

mod backbone;
mod capture;
pub mod potentiometer;

use clap::Subcommand;

use super::Done;

/// What `scram sim --robot` reads.
const ROBOT: &str = "robot.toml";

/// Find parameters from recordings
#[derive(Subcommand)]
pub enum Identify {
    Potentiometer(potentiometer::Potentiometer),
    Backbone(backbone::Backbone),
}

impl Identify {
    pub fn run(&self) -> Done {
        match self {
            Self::Potentiometer(command) => command.run(),
            Self::Backbone(command) => command.run(),
        }
    }
}
