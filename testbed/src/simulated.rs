//! What a robot's firmware drives: its motor alone on a bench, or the robot with its body on the ground.

use control::{Actuation, Sample};
use hal_sim::body::{Snapshot, WalkingRobots};
use hal_sim::{Fault, SimulatedRobot, Truth};

/// A simulated robot. Boxed: either is large.
#[derive(Clone, Debug)]
pub enum Simulated {
    /// Motor, bridge, sensor.
    Bench(Box<SimulatedRobot>),
    /// The same with the body that the eccentric shakes; a group of one.
    Ground(Box<WalkingRobots>),
}

impl From<SimulatedRobot> for Simulated {
    fn from(robot: SimulatedRobot) -> Self {
        Self::Bench(Box::new(robot))
    }
}

impl Simulated {
    /// Control period, s.
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        match self {
            Self::Bench(robot) => robot.tick_s(),
            Self::Ground(robot) => robot.tick_s(),
        }
    }

    /// The conversions of the current tick, see [`SimulatedRobot::sample`].
    pub fn sample(&mut self) -> Sample {
        match self {
            Self::Bench(robot) => robot.sample(),
            Self::Ground(robot) => robot.sample(0),
        }
    }

    /// One control period with the bridge as told.
    pub fn advance(&mut self, actuation: Actuation) {
        match self {
            Self::Bench(robot) => robot.advance(actuation),
            Self::Ground(robot) => robot.advance(&[actuation]),
        }
    }

    /// What really is with motor, supply and sensor.
    #[must_use]
    pub fn truth(&self) -> Truth {
        match self {
            Self::Bench(robot) => robot.truth(),
            Self::Ground(robot) => robot.truth(0),
        }
    }

    /// What really is with the body; none on a bench.
    #[must_use]
    pub fn snapshot(&self) -> Option<Snapshot> {
        match self {
            Self::Bench(_) => None,
            Self::Ground(robot) => Some(Snapshot { time_s: robot.time_s(), ..robot.snapshot(0) }),
        }
    }

    /// Breaks something from now on.
    pub fn inject(&mut self, fault: Fault) {
        match self {
            Self::Bench(robot) => robot.inject(fault),
            Self::Ground(robot) => robot.inject(0, fault),
        }
    }

    /// Mends everything but a collapsed rail.
    pub fn mend(&mut self) {
        match self {
            Self::Bench(robot) => robot.mend(),
            Self::Ground(robot) => robot.mend(0),
        }
    }
}
