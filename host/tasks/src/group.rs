//! Robots that are advanced side by side, whatever turns their eccentrics.

use common::conventions::omega_from_frequency;
use control::{Controller, Parameters, State};
use hal_sim::body::{Drive, Ensemble, Plan, Snapshot, Walker, WalkingRobots, ensemble};
use hal_sim::random::{Source, Stream};
use robot_file::gait::GaitStep;
use simulation::{DriveCommand, REFRESH_S};
use sweep::Variant;

use super::definition::{Definition, DriveKind};
use super::error::TaskError;
use super::shaft::RampedShaft;
use super::task::Pose;

/// Time between two snapshots of a recorded episode, s: what the 3D page draws.
const RECORDED_S: f64 = 0.005;

/// What every robot of some environments shares.
#[derive(Clone, Debug)]
pub(crate) struct Common {
    pub definition: Definition,
    /// Of the file's robot: what the firmware knows, whichever robot is drawn. None with an exact drive.
    parameters: Option<Parameters>,
    /// Whether the seed draws what belongs to a robot and not to a run, too.
    specimens: bool,
}

impl Common {
    /// Checks that there is a controller that takes every action, where one drives.
    pub fn new(definition: Definition, nominal: &Variant, specimens: bool) -> Result<Self, TaskError> {
        let mut common = Self { definition, parameters: None, specimens };
        if common.definition.drive == DriveKind::Motor {
            let parameters = robot_file::design::parameters(&nominal.robot)
                .map_err(|error| TaskError::Controller(error.to_string()))?;
            for action in common.definition.actions() {
                let command = DriveCommand::from(action);
                let refused = controller(&parameters)?.command(command.to_control(), 0).err();
                if let Some(refusal) = refused {
                    let why = simulation::said(command, refusal, &parameters.limits);
                    return Err(TaskError::Refused { action, why });
                }
            }
            common.parameters = Some(parameters);
            common.check_tick(nominal)?;
        }
        Ok(common)
    }

    fn check_tick(&self, nominal: &Variant) -> Result<(), TaskError> {
        let tick_s = tick_s(nominal);
        for (field, longer, shorter) in
            [("interval_s", self.definition.interval_s, tick_s), ("step_s", tick_s, self.definition.step_s)]
        {
            let ratio = longer / shorter;
            if (ratio - ratio.round()).abs() > 1e-6 * ratio || ratio < 0.5 {
                let problem = format!("{longer} s are no whole number of {shorter} s");
                let help = format!(
                    "with a motor, ticks of {tick_s} s lie between an action and the next, and steps in a tick"
                );
                return Err(TaskError::definition(field, problem, help));
            }
        }
        Ok(())
    }

    fn walker(&self, variant: &Variant, plan: Plan, seed: u64) -> Result<Walker, TaskError> {
        let steps_per_tick = (tick_s(variant) / self.definition.step_s).round().max(1.0) as usize;
        let specimen = Some(if self.specimens { seed } else { 0 });
        let parts = hal_sim::Settings { steps_per_tick, specimen, ..hal_sim::Settings::default() };
        let mut walker = Walker::new(&variant.robot, seed, &parts)?;
        walker.plan = plan;
        Ok(walker)
    }
}

fn tick_s(variant: &Variant) -> f64 {
    variant.robot.controller.as_ref().map_or(1e-3, |controller| controller.tick_s.value)
}

fn controller(parameters: &Parameters) -> Result<Controller, TaskError> {
    Controller::new(parameters).map_err(|error| TaskError::Controller(error.to_string()))
}

/// Takes a robot's number, its snapshot and the time since the one before, s.
pub(crate) type Keep<'a> = dyn FnMut(usize, Snapshot, f64) + 'a;

/// Robots on their way.
#[derive(Debug)]
pub(crate) enum Group {
    Exact { bodies: Ensemble, shafts: Vec<RampedShaft>, drives: Vec<Drive> },
    Motor { robots: Box<WalkingRobots>, controllers: Vec<Controller> },
}

impl Group {
    /// So many of the same.
    pub fn new(common: &Common, nominal: &Variant, count: usize) -> Result<Self, TaskError> {
        let Definition { step_s, precision, .. } = common.definition;
        let plan = common.plan(nominal);
        Ok(match &common.parameters {
            None => {
                let bodies = Ensemble::new(&vec![plan; count], ensemble::Settings { step_s, precision })?;
                Self::Exact { bodies, shafts: vec![RampedShaft::new(&nominal.robot, 0.0); count], drives: vec![] }
            }
            Some(parameters) => {
                let walker = || common.walker(nominal, plan.clone(), 0);
                let walkers = (0..count).map(|_| walker()).collect::<Result<_, _>>()?;
                let robots = Box::new(WalkingRobots::new(walkers, precision)?);
                let controllers = (0..count).map(|_| controller(parameters)).collect::<Result<_, _>>()?;
                Self::Motor { robots, controllers }
            }
        })
    }

    /// Sets a new robot in the place of robot `i`, at rest.
    pub fn replace(
        &mut self,
        i: usize,
        common: &Common,
        variant: &Variant,
        seed: u64,
        at: Pose,
    ) -> Result<(), TaskError> {
        let plan = common.plan(variant);
        match self {
            Self::Exact { bodies, shafts, .. } => {
                bodies.replace(i, plan)?;
                let angle = Stream::new(seed, Source::StartAngle).uniform(-std::f64::consts::PI, std::f64::consts::PI);
                shafts[i] = RampedShaft::new(&variant.robot, angle);
                let displacement = bodies.snapshot(i).displacement_to([at.x, at.y], at.heading);
                let carried = bodies.coordinates(i).carried(at.heading, displacement);
                bodies.put(i, &carried);
            }
            Self::Motor { robots, controllers } => {
                robots.replace(i, common.walker(variant, plan, seed)?)?;
                let displacement = robots.snapshot(i).displacement_to([at.x, at.y], at.heading);
                robots.carry(i, at.heading, displacement);
                if let Some(parameters) = &common.parameters {
                    controllers[i] = controller(parameters)?;
                }
            }
        }
        Ok(())
    }

    /// Advances every robot by the definition's interval, each by its action. Where `keep` is there it is told of every robot's
    /// snapshot every 5 ms or so.
    pub fn advance(&mut self, definition: &Definition, actions: &[GaitStep], mut keep: Option<&mut Keep<'_>>) {
        let unit_s = match self {
            Self::Exact { .. } => definition.step_s,
            Self::Motor { robots, .. } => robots.tick_s(),
        };
        let total = (definition.interval_s / unit_s).round().max(1.0) as usize;
        let portion = if keep.is_some() { (RECORDED_S / unit_s).round().max(1.0) as usize } else { total };
        let mut done = 0;
        while done < total {
            let count = portion.min(total - done);
            match self {
                Self::Exact { bodies, shafts, drives } => turn(bodies, shafts, drives, actions, count),
                Self::Motor { robots, controllers } => drive(robots, controllers, actions, done..done + count),
            }
            done += count;
            if let Some(keep) = &mut keep {
                (0..actions.len()).for_each(|i| keep(i, self.snapshot(i), count as f64 * unit_s));
            }
        }
    }

    pub fn snapshot(&self, i: usize) -> Snapshot {
        match self {
            Self::Exact { bodies, shafts, .. } => {
                let mut snapshot = bodies.snapshot(i);
                if let Some(rotor) = &mut snapshot.rotor {
                    rotor.angle = shafts[i].angle();
                }
                snapshot
            }
            Self::Motor { robots, .. } => robots.snapshot(i),
        }
    }

    /// Of the shaft, rad.
    pub fn shaft_angle(&self, i: usize) -> f64 {
        match self {
            Self::Exact { shafts, .. } => shafts[i].angle(),
            Self::Motor { robots, .. } => robots.truth(i).angle,
        }
    }

    /// What stopped robot `i`, in words.
    pub fn fault(&self, i: usize) -> Option<String> {
        let Self::Motor { controllers, .. } = self else { return None };
        controllers[i].telemetry().fault.map(|fault| recording::fault(fault).0.to_owned())
    }
}

impl Common {
    /// A robot's body, among the task's walls.
    pub fn plan(&self, variant: &Variant) -> Plan {
        let walls = self.definition.task.maze().map(super::maze::Maze::walls).unwrap_or_default();
        Plan { walls, ..variant.plan.clone() }
    }
}

fn turn(
    bodies: &mut Ensemble,
    shafts: &mut [RampedShaft],
    drives: &mut Vec<Drive>,
    actions: &[GaitStep],
    steps: usize,
) {
    let step_s = bodies.step_s();
    let omega = |action: &GaitStep| match action {
        GaitStep::Frequency(hz) => omega_from_frequency(*hz),
        GaitStep::Oscillation(_) => unreachable!("the definition was checked: there is a motor for it"),
    };
    for _ in 0..steps {
        drives.clear();
        drives.extend(shafts.iter_mut().zip(actions).map(|(shaft, action)| shaft.advance(omega(action), step_s)));
        bodies.advance(1, drives);
    }
}

/// A command comes with the action, and again as often as a console repeats it.
fn drive(
    robots: &mut WalkingRobots,
    controllers: &mut [Controller],
    actions: &[GaitStep],
    ticks: std::ops::Range<usize>,
) {
    let refresh = (REFRESH_S / robots.tick_s()).round().max(1.0) as usize;
    let mut actuations = Vec::with_capacity(actions.len());
    for tick in ticks {
        actuations.clear();
        for (i, controller) in controllers.iter_mut().enumerate() {
            let sample = robots.sample(i);
            if tick.is_multiple_of(refresh) && controller.telemetry().state != State::Fault {
                // Every action was taken once; a later refusal is a fault, which the telemetry shows.
                let _ = controller.command(DriveCommand::from(actions[i]).to_control(), sample.time_us);
            }
            actuations.push(controller.tick(&sample));
        }
        robots.advance(&actuations);
    }
}
