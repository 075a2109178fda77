//! How far healthy use stays from the limit on the winding's heat, on motors as they vary.

use std::f32::consts::TAU;

use control::{Command, Controller, State, Stroke};
use hal_sim::{Settings, SimulatedRobot};
use rayon::prelude::*;
use serde_json::json;

use crate::figures::run::{DesignedRobot, worst};
use crate::row::FigureRow;

/// A script: its name, and the command at a tick.
type Script = (&'static str, fn(u64) -> Command);

/// The hottest of the thesis's experiments: it oscillates to turn on the spot (chapter 5), and holds up to 8 Hz.
const SCRIPTS: [Script; 4] = [
    ("8 Hz", |_| Command::Speed { omega: TAU * 8.0 }),
    ("±8 Hz, turned round every second", |tick| Command::Speed {
        omega: if tick / 1000 % 2 == 0 { TAU * 8.0 } else { -TAU * 8.0 },
    }),
    ("−100 … 100°, full voltage", |_| swing(Stroke::BangBang)),
    ("−100 … 100°, proportional", |_| swing(Stroke::Proportional)),
];

fn swing(style: Stroke) -> Command {
    let reach = 100.0 / 360.0 * TAU;
    Command::Oscillate { from: -reach, to: reach, style }
}

/// A campaign of so many runs drives for ten minutes each; a smaller one for less, but longer than ten time constants.
const WHOLE: u64 = 10_000;
const LEAST_S: u64 = 40;
const MOST_S: u64 = 600;

/// The rows: one a script.
#[must_use]
pub fn rows(bench: &DesignedRobot, runs: u64) -> Vec<FigureRow> {
    let seconds = if runs >= WHOLE { MOST_S } else { LEAST_S };
    let limit = f64::from(bench.parameters.supervisor.overheated.limit);
    SCRIPTS
        .iter()
        .map(|(name, command)| {
            let seeds: Vec<u64> = (0..8).collect();
            let heats: Vec<f64> = seeds.into_par_iter().map(|seed| hottest(bench, *command, seed, seconds)).collect();
            let heat = worst(heats);
            FigureRow::new(
                &format!("healthy for {seconds} s: {name}"),
                "no fault; a tenth below the limit on heat",
                format!("heat at most {heat:.2} of {limit:.2}: margin {:.0} %", 100.0 * (limit / heat - 1.0)),
                heat < 0.9 * limit,
                json!({ "heat": heat, "limit": limit, "seconds": seconds }),
            )
        })
        .collect()
}

/// The largest heat in the winding, from the simulated current; infinite where the robot stopped.
fn hottest(bench: &DesignedRobot, command: fn(u64) -> Command, seed: u64, seconds: u64) -> f64 {
    let mut robot = SimulatedRobot::with(&bench.robot, seed, &Settings { charge: Some(1.0), ..Settings::default() });
    let mut controller = Controller::new(&bench.parameters).expect("sound parameters");
    let p = &bench.parameters.motor;
    let (mut heat, mut most) = (0.0f64, 0.0f64);
    for tick in 0..1000 * seconds {
        let sample = robot.sample();
        let _ = controller.command(command(tick), sample.time_us);
        robot.advance(controller.tick(&sample));
        if controller.state() == State::Fault {
            eprintln!("heat, seed {seed}: {:?} after {tick} ms", controller.telemetry().fault);
            return f64::INFINITY;
        }
        let ratio = robot.truth().current / f64::from(p.continuous_current);
        heat += 1e-3 / f64::from(p.thermal_time_constant) * (ratio * ratio - heat);
        most = most.max(heat);
    }
    most
}
