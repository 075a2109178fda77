//! Simulated robots behind a simulated radio and dongle, in real time, for `scram console --sim` and `scram view --live`.

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::mpsc::Receiver;

use hal_sim::body::Snapshot;

use link::Keys;
use miette::{IntoDiagnostic, Report, WrapErr};
use robot_file::Robot;
use scram::console::PoseDatagram;
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
        let known = keys.pair(&name_of(robot, index), setup::address(index), setup::DONGLE)?;
        pairings.push(Some(known.pairing.clone()));
    }
    let simulation = Simulation::start(robot, Options { robots, pairings, ..options })
        .into_diagnostic()
        .wrap_err_with(|| format!("{} cannot be simulated", file.display()))?;
    Ok((simulation, keys))
}

/// What a robot of several is called.
fn name_of(robot: &Robot, index: usize) -> String {
    if index == 0 { robot.name.clone() } else { format!("{}-{}", robot.name, index + 1) }
}

/// Sends the poses of simulated robots by UDP, as motion capture would, from a thread that ends with the simulation.
///
/// # Errors
/// There is no socket to send from.
pub fn send_poses(robot: &Robot, bodies: Receiver<Vec<Snapshot>>, to: SocketAddr) -> std::io::Result<()> {
    let socket = UdpSocket::bind((to.ip(), 0))?;
    let robot = robot.clone();
    std::thread::Builder::new().name("poses".to_owned()).spawn(move || {
        for (index, body) in bodies.into_iter().flat_map(|bodies| bodies.into_iter().enumerate()) {
            let [x_m, y_m, _] = body.centroid();
            let (name, t_s) = (name_of(&robot, index), body.time_s);
            let pose = PoseDatagram { robot: Some(name), t_s, x_m, y_m, yaw_rad: body.heading() };
            // What does not arrive is missed by the console, which says so.
            let _ = serde_json::to_vec(&pose).map(|bytes| socket.send_to(&bytes, to));
        }
    })?;
    Ok(())
}
