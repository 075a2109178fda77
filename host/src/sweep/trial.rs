//! Runs of a few robots side by side, and what is measured of them.

use std::f64::consts::TAU;

use control::{Controller, Parameters, State};
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Snapshot, Track, Walker, WalkingRobots, ensemble};
use hal_sim::random::{Source, Stream};

use super::measure::{Measures, measure};
use super::variant::Variant;
use crate::edge::{frequency_from_omega, omega_from_frequency};
use crate::sim::{Order, REFRESH_S, blow_up};

/// Time between two snapshots, s: some fourteen a turn.
pub const INTERVAL_S: f64 = 0.01;
/// Robots that are advanced side by side: as many as single-precision lanes.
pub const SIDE_BY_SIDE: usize = 8;
/// Points of a path that are kept.
pub const PATH_POINTS: usize = 201;

/// What turns the eccentric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveKind {
    /// The firmware's controller with the simulated motor, sensor and battery; the seed draws start angle, charge, sensor
    /// error and noise.
    Motor,
    /// A shaft that turns at exactly the frequency, whatever torque that takes. The seed draws the start angle and the
    /// phases of a phase error of one and of two periods a turn.
    Ideal {
        /// Root mean square of the phase error, rad.
        phase_noise: f64,
    },
    /// The same from angle 0 and with no phase error: no seed in it.
    Exact,
}

/// How runs are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunSettings {
    /// What turns the eccentric.
    pub drive: DriveKind,
    /// Length of a run, s; speeds are those of its second half.
    pub seconds: f64,
    /// s.
    pub step_s: f64,
    /// With how many digits the bodies are advanced.
    pub precision: Precision,
}

/// A run.
#[derive(Clone, Copy, Debug)]
pub struct Trial<'a> {
    /// Of what.
    pub variant: &'a Variant,
    /// What the robot's controller knows, where a motor drives.
    pub parameters: Option<&'a Parameters>,
    /// Hz, positive clockwise.
    pub f_hz: f64,
    /// Of what is random in it.
    pub seed: u64,
}

/// What came out of a run.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Outcome {
    /// What was measured.
    pub measures: Measures,
    /// What a person should know; empty for an ordinary run.
    pub note: String,
    /// The centroid from the start on at [`PATH_POINTS`] even times, mm; empty where the run blew up.
    pub path: Vec<[f64; 2]>,
}

/// Why there is no run.
#[derive(Debug, Clone, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum TrialError {
    /// No body.
    #[error("{0}")]
    #[diagnostic(help("choose other values, or a shorter --step"))]
    Body(String),
    /// The robot's controller refuses.
    #[error("axis `f`: {f_hz} Hz: {why}")]
    #[diagnostic(help("the limits are in [controller.limits] of the robot file; --drive ideal has none"))]
    Refused {
        /// Hz.
        f_hz: f64,
        /// The controller's words.
        why: String,
    },
}

/// What must be equal for robots to be advanced side by side: segments of every backbone, and which module is clamped.
#[must_use]
pub fn shape(plan: &Plan) -> (Vec<usize>, Option<usize>, bool) {
    let segments = plan.backbones.iter().map(|backbone| backbone.segments).collect();
    (segments, plan.clamped, plan.eccentric.is_some())
}

/// Whether the robot's controller takes the frequency of a run.
///
/// # Errors
/// It does not.
pub fn check(trial: &Trial<'_>) -> Result<(), TrialError> {
    let Some(parameters) = trial.parameters else { return Ok(()) };
    let mut controller = Controller::new(parameters).map_err(|error| TrialError::Body(error.to_string()))?;
    command(&mut controller, trial.f_hz, 0)
}

fn command(controller: &mut Controller, f_hz: f64, time_us: u64) -> Result<(), TrialError> {
    let order = Order::Freq { hz: f_hz };
    let refused = |refusal| TrialError::Refused { f_hz, why: crate::sim::said(order, refusal) };
    controller.command(order.command(), time_us).map_err(refused)
}

/// Runs robots of one shape.
///
/// # Errors
/// The step cannot carry a body, or a controller refuses.
pub fn simulate(trials: &[Trial<'_>], settings: &RunSettings) -> Result<Vec<Outcome>, TrialError> {
    let mut group = Group::new(trials, settings)?;
    let count = (settings.seconds / INTERVAL_S).round() as usize;
    let mut tracks: Vec<Track> = trials
        .iter()
        .map(|trial| Track {
            plan: trial.variant.plan.clone(),
            snapshots: Vec::with_capacity(count + 1),
            energy_j: vec![],
        })
        .collect();
    let mut angles = vec![Vec::with_capacity(count + 1); trials.len()];
    for index in 0..=count {
        if index > 0 {
            group.advance();
        }
        for (i, (track, angles)) in tracks.iter_mut().zip(&mut angles).enumerate() {
            track.snapshots.push(group.snapshot(i));
            track.energy_j.extend(group.energy_j(i));
            angles.push(group.angle(i));
        }
    }
    let ends = tracks.iter().zip(&angles).enumerate();
    Ok(ends
        .map(|(i, (track, angles))| outcome(track, angles, settings.seconds, group.fault(i), trials[i].f_hz))
        .collect())
}

fn outcome(track: &Track, angles: &[f64], seconds: f64, fault: Option<String>, f_hz: f64) -> Outcome {
    if let Some(why) = blow_up(track) {
        return Outcome { note: why.to_string(), ..Outcome::default() };
    }
    let mut measures = measure(track, 0.5 * seconds, seconds);
    let middle = angles.len() / 2;
    let turned = angles[angles.len() - 1] - angles[middle];
    // A group's interval is whole ticks or steps: near INTERVAL_S, not always equal.
    let time = track.snapshots[angles.len() - 1].time_s - track.snapshots[middle].time_s;
    measures.mean_f_hz = Some(frequency_from_omega(turned / time)).filter(|f| f.is_finite());
    let held = measures.mean_f_hz.is_some_and(|f| (f - f_hz).abs() <= 0.02 * f_hz.abs());
    let note = match fault {
        Some(fault) => fault,
        None if !held => "the shaft does not hold the frequency".into(),
        None => String::new(),
    };
    let last = track.snapshots.len() - 1;
    let at = |k: usize| track.snapshots[(k * last) / (PATH_POINTS - 1)].centroid();
    let start = at(0);
    let path = (0..PATH_POINTS).map(|k| [at(k)[0] - start[0], at(k)[1] - start[1]].map(|m| 1e3 * m)).collect();
    Outcome { measures: measures.rounded(), note, path }
}

/// Robots on their way.
enum Group {
    Motor(MotorGroup),
    Ideal(IdealGroup),
}

impl Group {
    fn new(trials: &[Trial<'_>], settings: &RunSettings) -> Result<Self, TrialError> {
        Ok(match settings.drive {
            DriveKind::Motor => Self::Motor(MotorGroup::new(trials, settings)?),
            DriveKind::Ideal { phase_noise } => Self::Ideal(IdealGroup::new(trials, settings, Some(phase_noise))?),
            DriveKind::Exact => Self::Ideal(IdealGroup::new(trials, settings, None)?),
        })
    }

    /// By the whole ticks or steps nearest to [`INTERVAL_S`].
    fn advance(&mut self) {
        match self {
            Self::Motor(group) => group.advance(),
            Self::Ideal(group) => group.advance(),
        }
    }

    fn snapshot(&self, i: usize) -> Snapshot {
        match self {
            Self::Motor(group) => group.robots.snapshot(i),
            Self::Ideal(group) => group.bodies.snapshot(i),
        }
    }

    fn energy_j(&self, i: usize) -> Option<f64> {
        match self {
            Self::Motor(group) => Some(group.robots.energy_j(i)),
            Self::Ideal(_) => None,
        }
    }

    /// Of the shaft, rad.
    fn angle(&self, i: usize) -> f64 {
        match self {
            Self::Motor(group) => group.robots.truth(i).angle,
            Self::Ideal(group) => group.phases[i].at(group.time_s).0,
        }
    }

    fn fault(&self, i: usize) -> Option<String> {
        let Self::Motor(group) = self else { return None };
        let telemetry = group.controllers[i].telemetry();
        telemetry.fault.map(|fault| format!("the robot stopped: {}", crate::link::fault(fault).0))
    }
}

struct MotorGroup {
    robots: WalkingRobots,
    controllers: Vec<Controller>,
    orders: Vec<Order>,
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
            let parts = hal_sim::Settings { steps_per_tick, ..hal_sim::Settings::default() };
            let mut walker = Walker::new(&trial.variant.robot, trial.seed, &parts).map_err(|e| body(&e))?;
            walker.plan = trial.variant.plan.clone();
            walkers.push(walker);
            let Some(parameters) = trial.parameters else { return Err(TrialError::Body("no controller".into())) };
            controllers.push(Controller::new(parameters).map_err(|e| body(&e))?);
        }
        let mut robots = WalkingRobots::new(walkers, settings.precision).map_err(|e| body(&e))?;
        let orders: Vec<Order> = trials.iter().map(|trial| Order::Freq { hz: trial.f_hz }).collect();
        for (i, controller) in controllers.iter_mut().enumerate() {
            let time_us = robots.sample(i).time_us;
            command(controller, trials[i].f_hz, time_us)?;
        }
        let tick_s = robots.tick_s();
        Ok(Self {
            robots,
            controllers,
            orders,
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
                    let _ = controller.command(self.orders[i].command(), sample.time_us);
                }
                actuations.push(controller.tick(&sample));
            }
            self.robots.advance(&actuations);
            self.tick += 1;
        }
    }
}

/// Angle of a shaft over time: `start + ω t + error`, the error two sines, of one and two periods a turn.
struct Phase {
    omega: f64,
    start: f64,
    /// Amplitude (rad) and phase (rad) of each.
    errors: [(f64, f64); 2],
}

impl Phase {
    fn new(trial: &Trial<'_>, noise: Option<f64>) -> Self {
        let omega = omega_from_frequency(trial.f_hz);
        let Some(noise) = noise else { return Self { omega, start: 0.0, errors: [(0.0, 0.0); 2] } };
        let start = Stream::new(trial.seed, Source::StartAngle).uniform(-0.5 * TAU, 0.5 * TAU);
        let mut draws = Stream::new(trial.seed, Source::Noise);
        // Two sines of an amplitude have it as their root mean square together.
        let errors = [(noise, draws.uniform(0.0, TAU)), (noise, draws.uniform(0.0, TAU))];
        Self { omega, start, errors }
    }

    /// Angle, speed and acceleration.
    fn at(&self, time_s: f64) -> (f64, f64, f64) {
        let mut motion = (self.start + self.omega * time_s, self.omega, 0.0);
        for (order, (amplitude, phase)) in self.errors.iter().enumerate() {
            let rate = (order + 1) as f64 * self.omega;
            let (sin, cos) = (rate * time_s + phase).sin_cos();
            motion.0 += amplitude * sin;
            motion.1 += amplitude * rate * cos;
            motion.2 -= amplitude * rate * rate * sin;
        }
        motion
    }
}

struct IdealGroup {
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
                Drive::Motor { angle, speed, acceleration, spin_inertia: 0.0 }
            }));
            self.bodies.advance(1, &drives);
            self.step += 1;
        }
        self.time_s = self.step as f64 * self.step_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frequency_is_over_the_time_that_passed() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robot.toml");
        let plan = Plan::new(&description::Robot::load(&file).unwrap()).unwrap();
        let still = Ensemble::new(std::slice::from_ref(&plan), ensemble::Settings::default()).unwrap().snapshot(0);
        // Seven ticks of 1.5 ms instead of 10 ms.
        let times = (0..100).map(|k| 0.0105 * f64::from(k));
        let angles: Vec<f64> = times.clone().map(|time_s| omega_from_frequency(7.0) * time_s).collect();
        let snapshots = times.map(|time_s| Snapshot { time_s, ..still.clone() }).collect();
        let outcome = outcome(&Track { plan, snapshots, energy_j: vec![] }, &angles, 1.0, None, 7.0);
        assert!((outcome.measures.mean_f_hz.unwrap() - 7.0).abs() < 1e-6, "{outcome:?}");
        assert_eq!(outcome.note, "");
    }

    #[test]
    fn the_phase_error_has_the_stated_size_and_its_own_derivatives() {
        let mut draws = Stream::new(3, Source::Noise);
        let amplitude = 0.05;
        let phase = Phase {
            omega: -44.0,
            start: 0.3,
            errors: [(amplitude, draws.uniform(0.0, TAU)), (amplitude, draws.uniform(0.0, TAU))],
        };
        let h = 1e-6;
        for k in 0..50 {
            let t = 0.013 * f64::from(k);
            let (angle, speed, acceleration) = phase.at(t);
            let (before, after) = (phase.at(t - h), phase.at(t + h));
            assert!((speed - (after.0 - before.0) / (2.0 * h)).abs() < 1e-5);
            assert!((acceleration - (after.1 - before.1) / (2.0 * h)).abs() < 1e-2);
            assert!((angle - 0.3 + 44.0 * t).abs() <= 2.0 * amplitude);
        }
        let turns = 7.0 * TAU / 44.0;
        let error = |k: i32| phase.at(turns * f64::from(k) / 10_000.0).0 - 0.3 + 44.0 * turns * f64::from(k) / 10_000.0;
        let mean_square = (0..10_000).map(|k| error(k).powi(2)).sum::<f64>() / 1e4;
        assert!((mean_square.sqrt() - amplitude).abs() < 1e-3 * amplitude, "two sines of an amplitude have it as RMS");
    }
}
