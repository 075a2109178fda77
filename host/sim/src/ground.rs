//! A robot with its body on the ground, and what is kept of its walk.

use control::{Actuation, Sample};
use hal_sim::body::plan::PlanError;
use hal_sim::body::{Plan as BodyPlan, Snapshot, Track, WalkingRobots};
use hal_sim::{Fault, Settings, Truth};
use robot_file::robot::Robot;

use super::blow_up::{BlowUp, blow_up};
use super::world::World;

/// Snapshots that are kept of a run at most, about 150 MB of a robot of four modules: a minute at 1 kHz. Of a longer run
/// every second one is kept, or every third, and so on.
const MOST_SNAPSHOTS: usize = 60_000;

/// A robot on the ground that keeps its track.
#[derive(Clone, Debug)]
pub struct OnGround {
    robot: WalkingRobots,
    walk: Walk,
    ticks: usize,
}

/// What is kept of a walk.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// Snapshots: every tick's, or where the run is long every so many ticks'.
    pub track: Track,
    /// Ticks from a snapshot to the next.
    pub every: usize,
    /// Mean of the modules' centres (m) and heading (rad, unwrapped) at every tick.
    pub poses: Vec<[f64; 3]>,
}

impl OnGround {
    /// The robot of a file, at rest in its nominal pose, for a run of so many seconds.
    ///
    /// # Errors
    /// The file has no body, or one that cannot be built or that the step cannot carry.
    pub fn new(robot: &Robot, seed: u64, settings: &Settings, seconds: f64) -> Result<Self, PlanError> {
        let plan = BodyPlan::new(robot)?;
        let robot = WalkingRobots::alone(robot, seed, settings)?;
        let every = ((seconds / robot.tick_s()) as usize).div_ceil(MOST_SNAPSHOTS).max(1);
        let track = Track { plan, snapshots: Vec::new(), energy_j: Vec::new() };
        let mut ground = Self { robot, walk: Walk { track, every, poses: Vec::new() }, ticks: 0 };
        ground.keep();
        Ok(ground)
    }

    /// Ends the run.
    ///
    /// # Errors
    /// It blew up.
    pub fn into_walk(self) -> Result<Walk, BlowUp> {
        if let Some(why) = blow_up(&self.walk.track) {
            return Err(why);
        }
        // A long run's last poses may have no snapshot.
        let lost = self.walk.poses.iter().position(|pose| !pose.iter().all(|value| value.is_finite()));
        match lost {
            Some(tick) => Err(BlowUp::NotFinite { time_s: tick as f64 * self.robot.tick_s() }),
            None => Ok(self.walk),
        }
    }

    /// Keeps what is at the current tick.
    fn keep(&mut self) {
        let snapshot = self.robot.snapshot(0);
        let [x, y, _] = snapshot.centroid();
        let heading = self.walk.poses.last().map_or(snapshot.heading(), |last| nearest(snapshot.heading(), last[2]));
        self.walk.poses.push([x, y, heading]);
        if self.ticks.is_multiple_of(self.walk.every) {
            self.walk.track.snapshots.push(Snapshot { time_s: self.robot.time_s(), ..snapshot });
            self.walk.track.energy_j.push(self.robot.energy_j(0));
        }
    }
}

/// The angle that differs from this one by whole turns and is nearest to another, rad.
fn nearest(angle: f64, to: f64) -> f64 {
    to + common::wrap(angle - to)
}

impl World for OnGround {
    fn tick_s(&self) -> f64 {
        self.robot.tick_s()
    }

    fn sample(&mut self) -> Sample {
        self.robot.sample(0)
    }

    fn truth(&self) -> Truth {
        self.robot.truth(0)
    }

    fn advance(&mut self, actuation: Actuation) {
        self.robot.advance(&[actuation]);
        self.ticks += 1;
        self.keep();
    }

    fn schedule(&mut self, fault: Fault, at_s: f64) {
        self.robot.schedule(0, fault, at_s);
    }
}

impl Walk {
    /// The pose at every row of a recording of this walk.
    #[must_use]
    pub fn poses_of_rows(&self) -> Vec<Option<[f64; 3]>> {
        // The pose after the last tick has no row.
        self.poses[..self.poses.len().saturating_sub(1)].iter().copied().map(Some).collect()
    }
}
