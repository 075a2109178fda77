//! Simulated robots behind a simulated radio and dongle, in real time, for `scram console --sim` and `scram view --live`.

use std::path::Path;

use link::Keys;
use miette::{IntoDiagnostic, Report, WrapErr};
use robot_file::Robot;
use testbed::realtime::{Options, Simulation};
use testbed::setup;

/// Starts so many robots of a file, paired with new keys; the rest is as `options` say.
///
/// # Errors
/// The file makes no robots to simulate.
pub fn simulate(robot: &Robot, file: &Path, robots: usize, options: Options) -> Result<(Simulation, Keys), Report> {
    let mut keys = Keys::generate()?;
    let mut pairings = Vec::new();
    for index in 0..robots {
        let name = if index == 0 { robot.name.clone() } else { format!("{}-{}", robot.name, index + 1) };
        let known = keys.pair(&name, setup::address(index), setup::DONGLE)?;
        pairings.push(Some(known.pairing.clone()));
    }
    let simulation = Simulation::start(robot, Options { robots, pairings, ..options })
        .into_diagnostic()
        .wrap_err_with(|| format!("{} cannot be simulated", file.display()))?;
    Ok((simulation, keys))
}
