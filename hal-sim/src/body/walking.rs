//! Robots with motor and body: the shaft turns the eccentric, and the body that it shakes pulls at the shaft.
//!
//! [`SimulatedRobot`] and [`Ensemble`] advance in turns, a step each (serial staggered coupling with a predictor of second
//! order: Farhat and Lesoinne 2000). The shaft takes its step with everything that turns on it (`motor.rotor_inertia_kg_m2`
//! and `load.inertia_kg_m2`) under the torque that the body's motion will ask for in the step's middle, carried on linearly
//! from the last two; then the body takes the same step with the shaft's motion in it prescribed. What comes back of a
//! change of the shaft's acceleration is about a tenth of it; up to a third the prediction is stable, whatever the step.
//!
//! * The shaft's angle 0 has the eccentric ahead, on the +x side of its module.
//! * The eccentric's inertia about the shaft counts once, in the shaft: [`Ensemble::load_torque`] leaves out what the
//!   shaft's own acceleration takes. `load.inertia_kg_m2` should therefore be that of `[eccentric]`.
//! * Gravity pulls at the eccentric through the body, which leans as it walks and where the ground slopes. The torque of
//!   `[effects.gravity_tilt]` says the same of a bare shaft on a bench and counts for that alone.
//! * The motor's rotor turns `gear_ratio` times as fast as the shaft and the same way round (planetary gears); its
//!   angular momentum acts on the module.

use control::{Actuation, Sample};
use effects::{Effect, GravityTilt};
use robot_file::Robot;
use robot_file::robot::Motor;

use super::drive::Drive;
use super::ensemble::{self, Ensemble, Precision};
use super::plan::{Plan, PlanError};
use super::snapshot::Snapshot;
use crate::faults::Fault;
use crate::robot::{Period, Settings, SimulatedRobot, Truth};

/// A robot up to its feet, before it is set on the ground.
#[derive(Clone, Debug)]
pub struct Walker {
    /// Its body. May be changed, for an experiment that no robot file says.
    pub plan: Plan,
    robot: SimulatedRobot,
    rotor_inertia: f64,
}

impl Walker {
    /// The robot of a file at its nominal parameters; what the seed draws, see [`SimulatedRobot::new`].
    ///
    /// # Errors
    /// The file has no body, or one that cannot be built.
    pub fn new(robot: &Robot, seed: u64, settings: &Settings) -> Result<Self, PlanError> {
        let plan = Plan::new(robot)?;
        let mut level = robot.clone();
        level.effects.remove(GravityTilt::SPEC.name);
        Ok(Self {
            plan,
            robot: SimulatedRobot::with(&level, seed, settings),
            rotor_inertia: rotor_inertia(&robot.motor),
        })
    }
}

/// Angular momentum of a motor's rotor over the speed of its output shaft, kg·m²: n²·J of the rotor is known there, and its angular
/// momentum is n·J·ω.
#[must_use]
pub fn rotor_inertia(motor: &Motor) -> f64 {
    motor.rotor_inertia_kg_m2.value / motor.gear_ratio.value
}

/// Robots whose bodies have one shape, advanced side by side. A value: deterministic from the seeds, cloned and sent to
/// threads freely; what a robot does depends neither on the others nor on how many there are.
#[derive(Clone, Debug)]
pub struct WalkingRobots {
    robots: Vec<SimulatedRobot>,
    rotor_inertia: Vec<f64>,
    bodies: Ensemble,
    /// What the shafts do in the bodies' next step.
    drives: Vec<Drive>,
    /// The bodies' torque on the shafts in the middles of the last step and of the one before, N·m.
    load_torques: Vec<[f64; 2]>,
    periods: Vec<Period>,
}

/// Robots that are advanced side by side have one control period and one step.
fn same_timing<'a>(robots: impl IntoIterator<Item = &'a SimulatedRobot>) -> Result<(), PlanError> {
    let mut timings = robots.into_iter().map(|robot| (robot.tick_s(), robot.steps_per_tick()));
    let Some(first) = timings.next() else { return Ok(()) };
    let Some(other) = timings.find(|other| *other != first) else { return Ok(()) };
    let step = |(tick_s, steps): (f64, usize)| tick_s / steps as f64;
    let what = format!(
        "robots that are advanced side by side need one control period and one step, not {} s in steps of {} s and {} s in \
         steps of {} s",
        first.0,
        step(first),
        other.0,
        step(other)
    );
    Err(PlanError::Field { field: "controller.tick_s", what })
}

impl WalkingRobots {
    /// Sets robots on the ground, at rest in their nominal poses, the eccentrics where the shafts start.
    ///
    /// # Errors
    /// There is none, their bodies differ in shape or their control periods or steps in length, or the step cannot carry a
    /// body.
    pub fn new(walkers: Vec<Walker>, precision: Precision) -> Result<Self, PlanError> {
        let Some(first) = walkers.first() else {
            let what = "a group needs at least one robot".to_owned();
            return Err(PlanError::Field { field: "body", what });
        };
        let (tick_s, steps) = (first.robot.tick_s(), first.robot.steps_per_tick());
        same_timing(walkers.iter().map(|walker| &walker.robot))?;
        let plans: Vec<Plan> = walkers.iter().map(|walker| walker.plan.clone()).collect();
        // The bodies' step is the shafts': it divides the control period.
        let mut bodies = Ensemble::new(&plans, ensemble::Settings { step_s: tick_s / steps as f64, precision })?;
        for (i, walker) in walkers.iter().enumerate() {
            let mut coordinates = bodies.coordinates(i);
            coordinates.rotor_angle = walker.robot.truth().angle;
            bodies.put(i, &coordinates);
        }
        let (rotor_inertia, robots) = walkers.into_iter().map(|walker| (walker.rotor_inertia, walker.robot)).unzip();
        let load_torques = vec![[0.0; 2]; plans.len()];
        Ok(Self { robots, rotor_inertia, bodies, drives: Vec::new(), load_torques, periods: Vec::new() })
    }

    /// A robot alone on the ground, from its file.
    ///
    /// # Errors
    /// The file has no body, or one that cannot be built or that the step cannot carry.
    pub fn alone(robot: &Robot, seed: u64, settings: &Settings) -> Result<Self, PlanError> {
        Self::new(vec![Walker::new(robot, seed, settings)?], Precision::Double)
    }

    /// How many robots.
    #[must_use]
    pub fn len(&self) -> usize {
        self.robots.len()
    }

    /// Whether there is none: never.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.robots.is_empty()
    }

    /// The conversions of the current tick of robot `i`, see [`SimulatedRobot::sample`].
    pub fn sample(&mut self, i: usize) -> Sample {
        self.robots[i].sample()
    }

    /// One control period of every robot with its bridge as told.
    ///
    /// # Panics
    /// If there are not as many actuations as robots.
    pub fn advance(&mut self, actuations: &[Actuation]) {
        assert_eq!(actuations.len(), self.robots.len(), "an actuation for each robot");
        self.periods.clear();
        let begun = self.robots.iter_mut().zip(actuations).map(|(robot, actuation)| robot.begin_period(*actuation));
        self.periods.extend(begun);
        for _ in 0..self.robots[0].steps_per_tick() {
            self.step();
        }
        for robot in &mut self.robots {
            robot.end_period();
        }
    }

    /// A step of every shaft, then of every body.
    fn step(&mut self) {
        self.drives.clear();
        for (i, robot) in self.robots.iter_mut().enumerate() {
            let [last, before] = self.load_torques[i];
            let motion = robot.step(self.periods[i], before - 2.0 * last);
            self.drives.push(Drive::Motor {
                angle: motion.angle,
                speed: motion.speed,
                acceleration: motion.acceleration,
                rotor_inertia: self.rotor_inertia[i],
            });
        }
        self.bodies.advance(1, &self.drives);
        for (i, torques) in self.load_torques.iter_mut().enumerate() {
            *torques = [self.bodies.load_torque(i), torques[0]];
        }
    }

    /// What really is with motor, supply and sensor of robot `i`, at the current tick.
    #[must_use]
    pub fn truth(&self, i: usize) -> Truth {
        self.robots[i].truth()
    }

    /// What really is with the body of robot `i`, at the current tick.
    #[must_use]
    pub fn snapshot(&self, i: usize) -> Snapshot {
        self.bodies.snapshot(i)
    }

    /// Puts the body of robot `i` somewhere else on the ground: turned by `turn` (rad, counter-clockwise) about the world's origin, then
    /// moved by `displacement` (m).
    pub fn carry(&mut self, i: usize, turn: f64, displacement: [f64; 2]) {
        let carried = self.bodies.coordinates(i).carried(turn, displacement);
        self.bodies.put(i, &carried);
    }

    /// Sets another robot in the place of robot `i`, at rest in its nominal pose. What the others do does not change in a bit.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn replace(&mut self, i: usize, walker: Walker) -> Result<(), PlanError> {
        same_timing([&self.robots[0], &walker.robot])?;
        self.bodies.replace(i, walker.plan)?;
        let mut coordinates = self.bodies.coordinates(i);
        coordinates.rotor_angle = walker.robot.truth().angle;
        self.bodies.put(i, &coordinates);
        (self.robots[i], self.rotor_inertia[i]) = (walker.robot, walker.rotor_inertia);
        self.load_torques[i] = [0.0; 2];
        Ok(())
    }

    /// Torque that the shaft of robot `i` gives its eccentric for the body's motion, N·m, see [`Ensemble::load_torque`].
    #[must_use]
    pub fn load_torque(&self, i: usize) -> f64 {
        self.bodies.load_torque(i)
    }

    /// Energy that the bridge of robot `i` has taken from its supply since the start, J.
    #[must_use]
    pub fn energy_j(&self, i: usize) -> f64 {
        self.robots[i].energy_j()
    }

    /// Breaks something of robot `i` from now on, see [`SimulatedRobot::inject`].
    pub fn inject(&mut self, i: usize, fault: Fault) {
        self.robots[i].inject(fault);
    }

    /// Mends everything of robot `i` but a collapsed rail.
    pub fn mend(&mut self, i: usize) {
        self.robots[i].mend();
    }

    /// Breaks something of robot `i` from a time (s since the start) on.
    pub fn schedule(&mut self, i: usize, fault: Fault, at_s: f64) {
        self.robots[i].schedule(fault, at_s);
    }

    /// Time since the start, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.robots[0].time_s()
    }

    /// Control period, s.
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        self.robots[0].tick_s()
    }
}
