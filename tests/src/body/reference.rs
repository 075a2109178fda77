//! The robot and the conditions that are compared: the default robot file, the thesis's angles and frequencies.
//!
//! Frequencies here are MuJoCo's: counter-clockwise positive, seen from above. The thesis counts them the other way.

use std::f64::consts::TAU;

use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings, Speeds, Track};
use rayon::prelude::*;
use robot_file::Robot;

/// The thesis's backbone angles, degrees.
pub const ALPHAS_DEG: [f64; 4] = [0.0, 60.0, 90.0, 120.0];
/// The thesis's frequencies, Hz.
pub const FREQUENCIES_HZ: [f64; 6] = [-8.0, -7.0, -6.0, 6.0, 7.0, 8.0];
/// The reference's servo, N·m/rad and N·m·s/rad: what `scram export mjcf` writes.
const SERVO: [f64; 2] = [0.08, 2.5e-4];
/// Snapshots between 1 s and 2 s, so that the heading is unwrapped without doubt. Every step that is tried goes into it.
const PIECES: usize = 20;

/// An angle of the backbones and a frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// α, degrees.
    pub alpha_deg: f64,
    /// Counter-clockwise positive, Hz.
    pub frequency_hz: f64,
}

impl Condition {
    /// The condition whose speeds are this one's mirror image on a robot that is alike on the left and on the right.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self { alpha_deg: 180.0 - self.alpha_deg, frequency_hz: -self.frequency_hz }
    }
}

/// The 24 conditions, the frequencies of an angle together.
#[must_use]
pub fn conditions() -> Vec<Condition> {
    let at = |alpha_deg| FREQUENCIES_HZ.map(|frequency_hz| Condition { alpha_deg, frequency_hz });
    ALPHAS_DEG.into_iter().flat_map(at).collect()
}

/// The robot file's body at another angle.
///
/// # Panics
/// When the robot file has no body: there is nothing to measure then.
#[must_use]
pub fn plan(robot: &Robot, alpha_deg: f64) -> Plan {
    let mut robot = robot.clone();
    if let Some(backbone) = &mut robot.backbone {
        backbone.alpha_deg.value = alpha_deg;
        backbone.roll_deg = None;
    }
    Plan::new(&robot).unwrap_or_else(|error| panic!("{error}"))
}

/// The actuator and a passive module on one backbone.
#[must_use]
pub fn pair(robot: &Robot, alpha_deg: f64) -> Plan {
    let mut plan = plan(robot, alpha_deg);
    let passive = plan.modules[plan.modules.len() - 1];
    plan.modules.truncate(1);
    plan.modules.push(passive);
    plan.backbones.truncate(1);
    plan
}

/// The reference's servo at a frequency, Hz, counter-clockwise positive.
#[must_use]
pub fn servo(frequency_hz: f64) -> Drive {
    Drive::Servo { speed: TAU * frequency_hz, stiffness: SERVO[0], damping: SERVO[1] }
}

/// Bodies of conditions, with their drives.
///
/// # Panics
/// When the bodies cannot be advanced at that step.
#[must_use]
pub fn ensemble(robot: &Robot, conditions: &[Condition], settings: Settings) -> (Ensemble, Vec<Drive>) {
    let plans: Vec<Plan> = conditions.iter().map(|condition| plan(robot, condition.alpha_deg)).collect();
    let drives = conditions.iter().map(|condition| servo(condition.frequency_hz)).collect();
    (Ensemble::new(&plans, settings).unwrap_or_else(|error| panic!("{error}")), drives)
}

/// Mean speeds over t = 1 … 2 s of bodies that have just been made.
#[must_use]
pub fn speeds_of(mut bodies: Ensemble, drives: &[Drive]) -> Vec<[f64; 3]> {
    let second = (1.0 / bodies.step_s()).round() as usize;
    let track = |plan: &Plan| Track { plan: plan.clone(), snapshots: Vec::new(), energy_j: Vec::new() };
    let mut tracks: Vec<Track> = bodies.plans().iter().map(track).collect();
    bodies.advance(second, drives);
    for piece in 0..=PIECES {
        for (i, track) in tracks.iter_mut().enumerate() {
            track.snapshots.push(bodies.snapshot(i));
        }
        if piece < PIECES {
            bodies.advance(second / PIECES, drives);
        }
    }
    let none = Speeds { longitudinal: f64::NAN, lateral: f64::NAN, yaw: f64::NAN };
    let speeds = |track: &Track| track.speeds(1.0, 2.0).unwrap_or(none);
    tracks.iter().map(speeds).map(|speeds| [speeds.longitudinal, speeds.lateral, speeds.yaw]).collect()
}

/// The speeds of conditions (m/s, m/s, rad/s), shared out evenly among so many threads.
///
/// # Panics
/// When the bodies cannot be advanced at that step, or no threads can be had.
#[must_use]
pub fn speeds(robot: &Robot, conditions: &[Condition], settings: Settings, threads: usize) -> Vec<[f64; 3]> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap_or_else(|error| panic!("{error}"));
    let share = conditions.len().div_ceil(threads);
    let one = |some: &[Condition]| {
        let (bodies, drives) = ensemble(robot, some, settings);
        speeds_of(bodies, &drives)
    };
    pool.install(|| conditions.par_chunks(share).flat_map_iter(one).collect())
}

/// Double precision at a step, s.
#[must_use]
pub fn at_step(step_s: f64) -> Settings {
    Settings { step_s, precision: Precision::Double }
}
