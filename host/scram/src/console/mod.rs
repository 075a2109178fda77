//! The command console: what was typed becomes commands, what the robots tell becomes something to look at, and everything
//! is recorded. The same on a dongle's serial port and on a simulation: it cannot tell them apart.
//!
//! [`engine`] is the console without a screen, [`model`] what there is to show, [`screen`] shows it.

mod command;
mod complete;
mod context;
pub mod engine;
pub mod model;
mod policy;
mod poses;
mod program;
mod reports;
mod requests;
pub mod runner;
pub mod screen;
mod session_log;

pub use complete::{Candidate, Completion};
pub use engine::Engine;
pub use poses::{PoseDatagram, Poses};
pub use requests::{CommandOutcome, parameter_line};

/// Every command: how it is typed, and what it does.
pub use command::HELP;

/// Says what is wrong with a line, without doing anything.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(line: &str) -> Result<(), String> {
    command::parse(line).map(drop)
}

/// [`check`] of a line that comes from elsewhere than this terminal: it may not read files here, nor end the console.
///
/// # Errors
/// The first thing that is wrong, or not for there.
pub fn check_remote(line: &str) -> Result<(), String> {
    let refused = command::parse(line)?.into_iter().find_map(|command| match command {
        command::ConsoleCommand::Script(_) => Some("`script` reads a file: start it where the console runs"),
        command::ConsoleCommand::Gait(_) => Some("`gait` reads a file: start it where the console runs"),
        command::ConsoleCommand::Policy(_) => Some("`policy` reads a file: start it where the console runs"),
        command::ConsoleCommand::Quit => Some("`quit` ends the console: do that where it runs"),
        _ => None,
    });
    refused.map_or(Ok(()), |why| Err(why.to_owned()))
}
