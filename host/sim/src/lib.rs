//! The firmware's decisions on the simulated robot: both advance in virtual time, one control period at a time.
//!
//! ```
//! use std::path::Path;
//!
//! use hal_sim::Settings;
//! use simulation::{Drive, Plan, metrics, run};
//!
//! let robot = robot_file::Robot::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml")))?;
//! let plan = Plan { drive: Drive::parse("freq:7")?, seconds: 2.0, faults: Vec::new() };
//! let trace = run(&robot, 1, &Settings::default(), &plan)?;
//! let frequency = metrics(&trace).mean_frequency_hz.expect("it turns");
//! assert!((frequency - 7.0).abs() < 0.05);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It simulates no radio and none of the tasks around the controller: `testbed` does.
//! * It draws nothing: the crate `plot` does.
//! * It takes no wall-clock time into account: the same robot file, seed and [`Plan`] give the same bits.

mod blow_up;
mod clamped_metrics;
mod decide;
mod drive;
mod export;
mod faults;
mod ground;
mod metrics;
mod scene;
mod simulate;
mod strokes;
mod track_csv;
mod tracking;
mod walk_metrics;
mod world;

use control::parameters::Limits;
use control::{Actuation, Command, Controller, Field, Gait, Parameters, Refusal, Sample, State, Telemetry};
use hal_sim::body::plan::PlanError;
use hal_sim::{Settings, SimulatedRobot, Truth};
use robot_file::robot::Robot;

use common::conventions::{degrees, frequency_from_omega};

pub use blow_up::{BlowUp, blow_up};
pub use clamped_metrics::{ClampedMetrics, clamped_metrics};
pub use decide::Decide;
pub use drive::{Drive, DriveCommand, DriveError, Step};
pub use export::{extra_columns, recording, run_log};
pub use faults::{Break, ExpectedReaction, FaultError, Scheduled};
pub use ground::{OnGround, Walk};
pub use metrics::{FaultReport, Metrics, metrics, metrics_of};
pub use scene::{SCENE_RATE_HZ, scene};
pub use simulate::{LONGEST_S, Place, Ran, USUAL_S, simulate};
pub use strokes::{RUNAWAY_DEG, Strokes};
pub use track_csv::track_csv;
pub use tracking::{ComparedFigure, Comparison, compare, tracking_figures, tracking_gain};
pub use walk_metrics::{WalkMetrics, mean_speeds, walk_metrics};
pub use world::World;

/// A console repeats its command this often, s: well within the age at which the supervisor gives up.
pub const REFRESH_S: f64 = 0.05;

/// Drive, length and faults of a run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The commands and their times.
    pub drive: Drive,
    /// Length of the run, s.
    pub seconds: f64,
    /// What breaks, and when.
    pub faults: Vec<Scheduled>,
}

/// One control period: what was measured, decided, believed and true. The actuation holds from this tick to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Time since the start, s.
    pub time_s: f64,
    /// What the robot measured.
    pub sample: Sample,
    /// What the bridge is told until the next tick.
    pub actuation: Actuation,
    /// Telemetry of the controller: its estimate and state.
    pub telemetry: Telemetry,
    /// True state of the simulated robot.
    pub truth: Truth,
}

/// Command of the drive, as it was given.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenCommand {
    /// Time since the start, s.
    pub at_s: f64,
    /// Index of the tick before which it was given.
    pub tick: usize,
    /// The command.
    pub command: DriveCommand,
    /// Why the controller refused it.
    pub refusal: Option<String>,
}

/// What the controller was told before a tick, with the time of that tick's sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeliveredCommand {
    /// Index of the tick.
    pub tick: usize,
    /// The command.
    pub command: DriveCommand,
    /// The command before, repeated.
    pub repeat: bool,
}

/// Everything that a run recorded.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Control period, s.
    pub tick_s: f64,
    /// One entry per control period.
    pub ticks: Vec<Tick>,
    /// Commands of the drive, with refusals.
    pub commands: Vec<GivenCommand>,
    /// Everything that reached the controller, in this order.
    pub told: Vec<DeliveredCommand>,
    /// Gaits that it has kept, each with the tick before whose commands it was sent.
    pub kept: Vec<(usize, Gait)>,
    /// What was broken.
    pub faults: Vec<Scheduled>,
    /// What the controller knows about the robot.
    pub parameters: Parameters,
}

/// Why there is no run.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SimError {
    /// The controller cannot be designed from this robot file.
    #[error("no controller for this robot: {0}")]
    #[diagnostic(help(
        "every number that a design needs is in [controller]; a rig without that can only be diagnosed"
    ))]
    Design(robot_file::design::DesignError),
    /// The design made parameters that the controller refuses.
    #[error("the controller refuses its parameters: {0}")]
    #[diagnostic(help("a number in [controller] is out of its range"))]
    Parameters(control::ParameterError),
    /// The body cannot be built.
    #[error("no body for this robot: {0}")]
    #[diagnostic(help(
        "the body is described in [body], [backbone], [eccentric], [feet] and [ground], see docs/robot-file.md"
    ))]
    Body(PlanError),
    /// The body's state diverged.
    #[error("the run {0}")]
    #[diagnostic(help(
        "[backbone] of the robot file is too soft to carry the robot, or [backbone] or [feet] stiffer than the step can \
         carry: it is a tenth of controller.tick_s"
    ))]
    BlowUp(#[from] BlowUp),
    /// The robot does not do what it is told first.
    #[error("the robot refuses `{command}`: {why}")]
    #[diagnostic(help(
        "the limits are in [controller] of the robot file, and in what its supply and its motor can do"
    ))]
    Refused {
        /// The command, as it was typed.
        command: String,
        /// The controller's words.
        why: String,
    },
    /// Whoever wanted the run wants it no more.
    #[error("the run was stopped")]
    Stopped,
}

/// Designs the controller of a robot file and runs it on the simulated robot, on a bench: the shaft without a body.
///
/// # Errors
/// There is no controller for this robot.
pub fn run(robot: &Robot, seed: u64, settings: &Settings, plan: &Plan) -> Result<Trace, SimError> {
    run_designed_from(robot, robot, seed, settings, plan)
}

/// Designs the controller from one robot file and runs it on the robot of another, on a bench.
///
/// # Errors
/// There is no controller for `designed_from`.
pub fn run_designed_from(
    designed_from: &Robot,
    robot: &Robot,
    seed: u64,
    settings: &Settings,
    plan: &Plan,
) -> Result<Trace, SimError> {
    Ok(closed_loop(SimulatedRobot::with(robot, seed, settings), controller(designed_from)?, plan))
}

/// Designs the controller of a robot file: the firmware's own, at rest.
///
/// # Errors
/// The robot has none, or its design is refused.
pub fn controller(robot: &Robot) -> Result<Controller, SimError> {
    let parameters = robot_file::design::parameters(robot).map_err(SimError::Design)?;
    Controller::new(&parameters).map_err(SimError::Parameters)
}

/// Runs a controller on a simulated robot.
#[must_use]
pub fn closed_loop(robot: SimulatedRobot, mut controller: Controller, plan: &Plan) -> Trace {
    let Ok(trace) = closed_loop_with(robot, &mut controller, plan);
    trace
}

/// Runs whoever decides on a simulated robot.
///
/// # Errors
/// The decider cannot be reached.
pub fn closed_loop_with<D: Decide>(mut robot: SimulatedRobot, decider: &mut D, plan: &Plan) -> Result<Trace, D::Error> {
    closed_loop_in(&mut robot, decider, plan)
}

/// Runs whoever decides in any world.
///
/// # Errors
/// The decider cannot be reached.
pub fn closed_loop_in<W: World, D: Decide>(robot: &mut W, decider: &mut D, plan: &Plan) -> Result<Trace, D::Error> {
    let tick_s = robot.tick_s();
    let limits = decider.parameters().limits;
    let count = (plan.seconds / tick_s).round().max(1.0) as usize;
    let refresh = (REFRESH_S / tick_s).round().max(1.0) as usize;
    let mut ticks = Vec::with_capacity(count);
    let mut commands: Vec<GivenCommand> = Vec::new();
    let mut told: Vec<DeliveredCommand> = Vec::new();
    // The first gait of the drive is the one that the robot has stored: only with its bridge off it takes another.
    let mut kept: Vec<(usize, Gait)> = Vec::new();
    if let Some(gait) = plan.drive.steps.iter().find_map(|step| step.command.gait()) {
        keep_gait(decider, &mut kept, 0, gait)?;
    }
    let mut steps = plan.drive.steps.iter().peekable();
    let mut current: Option<DriveCommand> = None;
    for fault in &plan.faults {
        if let Break::Robot(part) = fault.what {
            robot.schedule(part, fault.at_s);
        }
    }
    let link_lost_s =
        plan.faults.iter().filter(|f| f.what == Break::Link).map(|f| f.at_s).fold(f64::INFINITY, f64::min);

    for index in 0..count {
        let time_s = index as f64 * tick_s;
        let linked = time_s < link_lost_s;
        let sample = robot.sample();
        // Half a tick of slack: a command at 0.3 s comes before the tick at 0.3 s, whatever the rounding.
        while let Some(step) = steps.next_if(|step| step.at_s <= time_s + 0.5 * tick_s) {
            let refusal = if linked {
                told.push(DeliveredCommand { tick: index, command: step.command, repeat: false });
                let refusal = match step.command.gait() {
                    Some(gait) => keep_gait(decider, &mut kept, index, gait)?,
                    None => None,
                };
                refusal
                    .map_or_else(|| decider.command(step.command.to_control(), sample.time_us), |why| Ok(Err(why)))?
                    .err()
                    .map(|refusal| said(step.command, refusal, &limits))
            } else {
                Some("the link is lost".to_owned())
            };
            commands.push(GivenCommand { at_s: time_s, tick: index, command: step.command, refusal });
            current = Some(step.command);
        }
        if linked && index % refresh == 0 {
            let command = refresh_command(decider, current, sample.time_us)?;
            told.extend(command.map(|command| DeliveredCommand { tick: index, command, repeat: true }));
        }
        let actuation = decider.tick(&sample)?;
        ticks.push(Tick { time_s, sample, actuation, telemetry: decider.telemetry(), truth: robot.truth() });
        robot.advance(actuation);
    }
    Ok(Trace { tick_s, ticks, commands, told, kept, faults: plan.faults.clone(), parameters: *decider.parameters() })
}

/// Sends a gait, unless it was the last that was kept; why it is refused.
fn keep_gait<D: Decide>(
    decider: &mut D,
    kept: &mut Vec<(usize, Gait)>,
    tick: usize,
    gait: Gait,
) -> Result<Option<Refusal>, D::Error> {
    if kept.last().is_some_and(|(_, last)| *last == gait) {
        return Ok(None);
    }
    let refusal = decider.keep_gait(&gait)?.err();
    if refusal.is_none() {
        kept.push((tick, gait));
    }
    Ok(refusal)
}

/// A refusal in the units in which the command was typed.
#[must_use]
pub fn said(command: DriveCommand, refusal: Refusal, limits: &Limits) -> String {
    match (command, refusal) {
        (DriveCommand::Freq { .. }, Refusal::OutOfRange { .. }) => {
            let hertz = |omega: f32| frequency_from_omega(f64::from(omega)).abs();
            // The refusal names what was checked first, `omega` or its magnitude, and not both ends of what is allowed.
            let (low, high) = (hertz(limits.least_speed), hertz(limits.speed));
            format!("the frequency must be from {low:.2} to {high:.2} Hz in either direction")
        }
        (DriveCommand::Gait(gait), Refusal::OutOfRange { name: Field::GaitSpeed, value, low, high }) => {
            let hertz = |omega: f32| frequency_from_omega(f64::from(omega)).abs();
            let (value, low, high) = (hertz(value), hertz(low), hertz(high));
            let name = gait.name();
            format!("the frequencies of the gait {name} must be from {low:.2} to {high:.2} Hz, not {value:.2} Hz")
        }
        (
            DriveCommand::Oscillate { .. } | DriveCommand::Position { .. } | DriveCommand::Gait(_),
            Refusal::OutOfRange {
                name: name @ (Field::From | Field::To | Field::Span | Field::Angle),
                value,
                low,
                high,
            },
        ) => {
            let deg = |rad: f32| degrees(f64::from(rad));
            format!("`{name}` must be from {:.0}° to {:.0}°, not {:.1}°", deg(low), deg(high), deg(value))
        }
        (_, other) => other.to_string(),
    }
}

/// Repeats the present command, and says which. A gait that has come to its end is not begun again. A refusal is not news: it was said when the command was given, or a fault has
/// come since.
fn refresh_command<D: Decide>(
    decider: &mut D,
    command: Option<DriveCommand>,
    time_us: u64,
) -> Result<Option<DriveCommand>, D::Error> {
    let Some(command) = command else { return Ok(None) };
    let state = decider.telemetry().state;
    let ended = command.gait().is_some() && state == State::Coast;
    if command.to_control() == Command::ClearFault || state == State::Fault || ended {
        return Ok(None);
    }
    let _ = decider.command(command.to_control(), time_us)?;
    Ok(Some(command))
}

impl Trace {
    /// The ticks of every command: `(command, first tick, one past the last)`.
    #[must_use]
    pub fn segments(&self) -> Vec<(DriveCommand, usize, usize)> {
        let starts = self.commands.iter().map(|given| given.tick);
        let ends = starts.clone().skip(1).chain([self.ticks.len()]);
        let segments = self.commands.iter().zip(starts.zip(ends)).map(|(given, (from, to))| (given.command, from, to));
        segments.filter(|(_, from, to)| from < to).collect()
    }
}
