//! Robots that are advanced side by side, whatever turns their eccentrics.

use control::{Controller, State};
use hal_sim::body::{Drive, Ensemble, Plan, Snapshot, Walker, WalkingRobots, ensemble};

use super::phase::Phase;
use super::{DriveKind, INTERVAL_S, RunSettings, Trial, TrialError};
use simulation::{DriveCommand, REFRESH_S};

/// Robots on their way.
pub(super) enum Group {
    Motor(MotorGroup),
    Ideal(IdealGroup),
}

impl Group {
    pub(super) fn new(trials: &[Trial<'_>], settings: &RunSettings) -> Result<Self, TrialError> {
        Ok(match settings.drive {
            DriveKind::Motor => Self::Motor(MotorGroup::new(trials, settings)?),
            DriveKind::Ideal { phase_noise } => Self::Ideal(IdealGroup::new(trials, settings, Some(phase_noise))?),
            DriveKind::Exact => Self::Ideal(IdealGroup::new(trials, settings, None)?),
        })
    }

    /// By the whole ticks or steps nearest to [`INTERVAL_S`].
    pub(super) fn advance(&mut self) {
        match self {
            Self::Motor(group) => group.advance(),
            Self::Ideal(group) => group.advance(),
        }
    }

    pub(super) fn snapshot(&self, i: usize) -> Snapshot {
        match self {
            Self::Motor(group) => group.robots.snapshot(i),
            Self::Ideal(group) => group.bodies.snapshot(i),
        }
    }

    pub(super) fn energy_j(&self, i: usize) -> Option<f64> {
        match self {
            Self::Motor(group) => Some(group.robots.energy_j(i)),
            Self::Ideal(_) => None,
        }
    }

    /// Of the shaft, rad.
    pub(super) fn angle(&self, i: usize) -> f64 {
        match self {
            Self::Motor(group) => group.robots.truth(i).angle,
            Self::Ideal(group) => group.phases[i].at(group.time_s).0,
        }
    }

    pub(super) fn fault(&self, i: usize) -> Option<String> {
        let Self::Motor(group) = self else { return None };
        let telemetry = group.controllers[i].telemetry();
        telemetry.fault.map(|fault| format!("the robot stopped: {}", recording::fault(fault).0))
    }
}

pub(super) struct MotorGroup {
    robots: WalkingRobots,
    controllers: Vec<Controller>,
    commands: Vec<DriveCommand>,
    tick: usize,
    ticks_per_interval: usize,
    refresh: usize,
}

impl MotorGroup {
    fn new(trials: &[Trial<'_>], settings: &RunSettings) -> Result<Self, TrialError> {
        let body = |error: &dyn std::fmt::Display| TrialError::Body(error.to_string());
        let mut walkers = Vec::with_capacity(trials.len());
        let mut controllers = Vec::with_capacity(trials.len());
        for trial in trials {
            let tick_s = trial.variant.robot.controller.as_ref().map_or(1e-3, |controller| controller.tick_s.value);
            let steps_per_tick = (tick_s / settings.step_s).round().max(1.0) as usize;
            let specimen = Some(trial.seeds.specimen);
            let parts = hal_sim::Settings { steps_per_tick, specimen, ..hal_sim::Settings::default() };
            let mut walker = Walker::new(&trial.variant.robot, trial.seeds.run, &parts).map_err(|e| body(&e))?;
            walker.plan = trial.variant.plan.clone();
            walkers.push(walker);
            let Some(parameters) = trial.parameters else { return Err(TrialError::Body("no controller".into())) };
            controllers.push(Controller::new(parameters).map_err(|e| body(&e))?);
        }
        let mut robots = WalkingRobots::new(walkers, settings.precision).map_err(|e| body(&e))?;
        let commands: Vec<DriveCommand> = trials.iter().map(Trial::command).collect();
        for (i, controller) in controllers.iter_mut().enumerate() {
            let time_us = robots.sample(i).time_us;
            trials[i].start(controller, time_us)?;
        }
        let tick_s = robots.tick_s();
        Ok(Self {
            robots,
            controllers,
            commands,
            tick: 0,
            ticks_per_interval: (INTERVAL_S / tick_s).round().max(1.0) as usize,
            refresh: (REFRESH_S / tick_s).round().max(1.0) as usize,
        })
    }

    fn advance(&mut self) {
        for _ in 0..self.ticks_per_interval {
            let repeat = self.tick.is_multiple_of(self.refresh);
            let mut actuations = Vec::with_capacity(self.controllers.len());
            for (i, controller) in self.controllers.iter_mut().enumerate() {
                let sample = self.robots.sample(i);
                if repeat && controller.telemetry().state != State::Fault {
                    // It was taken at the start; a later refusal is a fault, which the telemetry shows.
                    let _ = controller.command(self.commands[i].to_control(), sample.time_us);
                }
                actuations.push(controller.tick(&sample));
            }
            self.robots.advance(&actuations);
            self.tick += 1;
        }
    }
}

pub(super) struct IdealGroup {
    bodies: Ensemble,
    phases: Vec<Phase>,
    step_s: f64,
    steps_per_interval: usize,
    step: usize,
    time_s: f64,
}

impl IdealGroup {
    fn new(trials: &[Trial<'_>], settings: &RunSettings, noise: Option<f64>) -> Result<Self, TrialError> {
        let plans: Vec<Plan> = trials.iter().map(|trial| trial.variant.plan.clone()).collect();
        let step_s = settings.step_s;
        let bodies = Ensemble::new(&plans, ensemble::Settings { step_s, precision: settings.precision })
            .map_err(|error| TrialError::Body(error.to_string()))?;
        let phases = trials.iter().map(|trial| Phase::new(trial, noise)).collect();
        let steps_per_interval = (INTERVAL_S / step_s).round().max(1.0) as usize;
        Ok(Self { bodies, phases, step_s, steps_per_interval, step: 0, time_s: 0.0 })
    }

    fn advance(&mut self) {
        let mut drives = Vec::with_capacity(self.phases.len());
        for _ in 0..self.steps_per_interval {
            let middle = (self.step as f64 + 0.5) * self.step_s;
            drives.clear();
            drives.extend(self.phases.iter().map(|phase| {
                let (angle, speed, acceleration) = phase.at(middle);
                Drive::Motor { angle, speed, acceleration, rotor_inertia: 0.0 }
            }));
            self.bodies.advance(1, &drives);
            self.step += 1;
        }
        self.time_s = self.step as f64 * self.step_s;
    }
}
