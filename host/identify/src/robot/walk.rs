//! Mean speeds of bodies under conditions.

use common::conventions::omega_from_frequency;
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings, Track};
use rayon::prelude::*;

use super::RobotError;

/// How conditions are run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Speeds are those between these times, s.
    pub from_s: f64,
    /// See `from_s`.
    pub to_s: f64,
    /// Integration step, s.
    pub step_s: f64,
}

/// Between two looks at the heading, s.
const LOOK_S: f64 = 0.05;
/// Bodies side by side: the lanes of a register in single precision.
const TOGETHER: usize = 8;

impl Run {
    /// Of speeds between two times, s, in steps of `step_s`.
    ///
    /// # Errors
    /// The times are not two from 0 on with at least one look at the heading between them.
    pub fn new(window_s: (f64, f64), step_s: f64) -> Result<Self, RobotError> {
        let (from_s, to_s) = window_s;
        let run = Self { from_s, to_s, step_s };
        if from_s >= 0.0 && to_s.is_finite() && run.looks() >= 1.0 {
            return Ok(run);
        }
        Err(RobotError::Window { from_s, to_s, least_s: LOOK_S })
    }

    /// Looks at the heading after the first one.
    fn looks(&self) -> f64 {
        ((self.to_s - self.from_s) / LOOK_S).round()
    }
}

/// Longitudinal and lateral speed, mm/s, and yaw, °/s, of every body under every condition (f in Hz, positive clockwise; α in degrees);
/// none for a body of which a run blew up or cannot be stepped.
#[must_use]
pub fn speeds(plans: &[Option<Plan>], conditions: &[(f64, f64)], run: Run) -> Vec<Option<Vec<[f64; 3]>>> {
    let trials: Vec<(Plan, f64)> = plans
        .iter()
        .flatten()
        .flat_map(|plan| conditions.iter().map(|(f, alpha)| (rolled(plan, *alpha), omega_from_frequency(*f))))
        .collect();
    let all: Vec<Option<[f64; 3]>> = trials.par_chunks(TOGETHER).flat_map_iter(|some| together(some, run)).collect();
    let mut each = all.chunks(conditions.len().max(1));
    plans
        .iter()
        .map(|plan| plan.as_ref().and(each.next()).and_then(|speeds| speeds.iter().copied().collect()))
        .collect()
}

/// Backbone b rolled by b·α, as α of a robot file.
#[must_use]
pub fn rolled(plan: &Plan, alpha_deg: f64) -> Plan {
    let mut plan = plan.clone();
    for (b, backbone) in plan.backbones.iter_mut().enumerate() {
        backbone.roll = (b + 1) as f64 * alpha_deg.to_radians();
    }
    plan
}

fn together(trials: &[(Plan, f64)], run: Run) -> Vec<Option<[f64; 3]>> {
    let plans: Vec<Plan> = trials.iter().map(|(plan, _)| plan.clone()).collect();
    let settings = Settings { step_s: run.step_s, precision: Precision::Single };
    let Ok(mut bodies) = Ensemble::new(&plans, settings) else {
        // One that cannot be stepped must not take the others with it.
        return if trials.len() == 1 {
            vec![None]
        } else {
            trials.iter().flat_map(|one| together(std::slice::from_ref(one), run)).collect()
        };
    };
    let drive = |(plan, speed): &(Plan, f64)| match plan.eccentric.and_then(|eccentric| eccentric.servo) {
        Some([stiffness, damping]) => Drive::Servo { speed: *speed, stiffness, damping },
        None => Drive::Phase { speed: *speed },
    };
    let drives: Vec<Drive> = trials.iter().map(drive).collect();
    let mut tracks: Vec<Track> =
        plans.into_iter().map(|plan| Track { plan, snapshots: Vec::new(), energy_j: Vec::new() }).collect();
    let steps = |seconds: f64| (seconds / run.step_s).round() as usize;
    let looks = run.looks() as usize;
    bodies.advance(steps(run.from_s), &drives);
    for look in 0..=looks {
        if look > 0 {
            bodies.advance(steps(LOOK_S), &drives);
        }
        for (body, track) in tracks.iter_mut().enumerate() {
            track.snapshots.push(bodies.snapshot(body));
        }
    }
    tracks.iter().map(mean).collect()
}

fn mean(track: &Track) -> Option<[f64; 3]> {
    let times = track.snapshots.first()?.time_s..track.snapshots.last()?.time_s;
    let speeds = track.speeds(times.start, times.end)?;
    let all = [1e3 * speeds.longitudinal, 1e3 * speeds.lateral, speeds.yaw.to_degrees()];
    all.iter().all(|speed| speed.is_finite()).then_some(all)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_shaft_that_is_held_softly_walks_otherwise_and_one_that_is_held_stiffly_as_one_that_turns_evenly() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let plan = Plan::new(&robot_file::Robot::load(&file).unwrap()).unwrap();
        let held = |servo: Option<[f64; 2]>| {
            let mut plan = plan.clone();
            plan.eccentric.as_mut().unwrap().servo = servo;
            Some(plan)
        };
        let plans = [held(None), held(Some([2.0, 5e-3])), held(Some([0.08, 2.5e-4]))];
        let run = Run { from_s: 0.3, to_s: 0.8, step_s: 1e-4 };
        let found = speeds(&plans, &[(8.0, 60.0), (-8.0, 90.0)], run);
        let [even, stiff, soft] = [0, 1, 2].map(|k| found[k].clone().expect("it walks").concat());
        let largest = even.iter().fold(0.0_f64, |largest, speed| largest.max(speed.abs()));
        let off = |other: &[f64]| even.iter().zip(other).map(|(a, b)| (a - b).abs() / largest).fold(0.0, f64::max);
        assert!(off(&stiff) < 0.01 && off(&soft) > 0.02, "{} {}", off(&stiff), off(&soft));
    }
}
