//! `scram identify`

mod backbone;
pub mod capture;
mod motor;
pub mod potentiometer;
mod robot;

use clap::Subcommand;

use super::Done;

/// What `scram sim --robot` reads.
const ROBOT: &str = "robot.toml";

/// Find parameters from recordings
#[derive(Subcommand)]
pub enum Identify {
    Potentiometer(potentiometer::Potentiometer),
    Backbone(backbone::Backbone),
    Motor(motor::Motor),
    Robot(robot::RobotCommand),
}

impl Identify {
    pub fn run(&self) -> Done {
        match self {
            Self::Potentiometer(command) => command.run(),
            Self::Backbone(command) => command.run(),
            Self::Motor(command) => command.run(),
            Self::Robot(command) => command.run(),
        }
    }
}

/// Four digits.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let decimals = (3 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    if (1e-3..1e4).contains(&value.abs()) { format!("{value:.decimals$}") } else { format!("{value:.3e}") }
}
