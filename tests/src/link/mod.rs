//! The figures on the link that the project promises: campaigns on the bench, from the console's session to the motor, in
//! virtual time. `link` (the binary) prints them; smaller versions run as ordinary tests.

pub mod assessment;
pub mod attack;
pub mod campaign;
pub mod commands;
pub mod day;
pub mod fault;
pub mod mode;
pub mod rig;
pub mod run;
pub mod screen;
pub mod stop;

use crate::figures::run::DesignedRobot;
use crate::row::FigureRow;

/// Size of the campaigns.
#[derive(Clone, Debug)]
pub struct Options {
    /// Runs of the fault campaign; the others have a share of it that their rows tell.
    pub runs: u64,
    /// Only this seed of the fault campaign.
    pub seed: Option<u64>,
    /// Only faults whose name contains this.
    pub fault: Option<String>,
}

/// One campaign: its name, and what makes its rows.
pub type Campaign = (&'static str, fn(&DesignedRobot, &Options) -> Vec<FigureRow>);

/// Every campaign with its name for `--only`.
pub const CAMPAIGNS: [Campaign; 6] = [
    ("faults", campaign::rows),
    ("attacks", attack::rows),
    ("orders", commands::rows),
    ("stop", stop::rows),
    ("day", day::rows),
    ("screen", screen::rows),
];
