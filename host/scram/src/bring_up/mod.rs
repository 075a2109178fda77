//! Bringing a board up: the steps of `firmware/UNVERIFIED.md` one by one, on a robot through its dongle or on a simulated
//! board, and a report.
//!
//! A [`Step`] commands and measures over the link, and asks an [`Operator`] for what takes hands or an oscilloscope: a person at
//! a board, nobody, or a [`simulated`] person who reads the simulated board's pins. What nobody looked at is not checked, never
//! passed.

pub mod operator;
pub mod report;
pub mod rig;
pub mod simulated;
pub mod step;
mod steps;
mod traffic;

use std::time::Duration;

use control::{Parameters, protocol};
use robot_file::Robot;
use robot_file::angle_code::AdcCurve;
use robot_file::design::{DesignError, design};
use robot_file::robot::Sensor;

pub use operator::{Absent, Act, Answers, Observation, Operator, Seen};
pub use report::Report;
pub use step::{Check, Checked, Chip, Step, StepResult};
pub use steps::all as steps;

use link::{LinkError, RobotId};
use rig::{AnySession, Rig};

/// Where a board is brought up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// On a real board, with an operator.
    Bench,
    /// On the simulated robot.
    Simulated,
}

/// What is done, how long and how often.
#[derive(Clone, Debug)]
pub struct Options {
    /// The board's chip.
    pub chip: Chip,
    /// Numbers of the steps; all of them where it is empty.
    pub only: Vec<u16>,
    /// How long the long traffic takes, which several steps look at.
    pub length: Duration,
    /// How often a step is repeated that wants it often.
    pub repeats: u32,
    /// Real board or simulation.
    pub place: Place,
    /// The converter of the robot file.
    pub curve: Option<AdcCurve>,
    /// What the robot's firmware was built with: the bounds that it must keep.
    pub parameters: Parameters,
}

impl Options {
    /// What `firmware/UNVERIFIED.md` asks for.
    ///
    /// # Errors
    /// No controller can be designed for the robot.
    pub fn on_bench(robot: &Robot, chip: Chip) -> Result<Self, DesignError> {
        let curve = match &robot.sensor {
            Sensor::Potentiometer(sensor) => Some(AdcCurve::new(&sensor.adc)),
            Sensor::Ideal | Sensor::Encoder(_) => None,
        };
        let (only, length, repeats) = (Vec::new(), Duration::from_secs(3600), 50);
        let parameters = design(robot)?.parameters;
        Ok(Self { chip, only, length, repeats, place: Place::Bench, curve, parameters })
    }

    /// The same, shortened: for tests.
    ///
    /// # Errors
    /// As [`Options::on_bench`].
    pub fn simulated(robot: &Robot, chip: Chip) -> Result<Self, DesignError> {
        let (length, repeats, place) = (Duration::from_secs(20), 3, Place::Simulated);
        Ok(Self { length, repeats, place, ..Self::on_bench(robot, chip)? })
    }

    fn wants(&self, step: &Step) -> bool {
        self.only.is_empty() || self.only.contains(&step.number)
    }
}

/// Walks the steps with a robot that was found. Where the line breaks, what was not reached is not checked.
pub fn walk(session: AnySession, robot: RobotId, operator: &mut dyn Operator, options: &Options) -> Report {
    let steps = steps().filter(|step| options.wants(step));
    let mut rig = Rig::new(session, robot, operator, options);
    let (name, address) = {
        let robot = rig.session.robot(robot);
        (robot.name().to_owned(), link::address(&robot.address()))
    };
    let injectable = rig.status().is_some_and(|status| status.injectable);
    let mut broken: Option<LinkError> = None;
    let mut done = Vec::new();
    for step in steps {
        let mut checks = Vec::new();
        if broken.is_none() {
            (checks, broken) = rig.walk(step);
        }
        if let Some(error) = &broken {
            let (what, found) = ("the rest".to_owned(), error.to_string());
            checks.push(Check { what, found, expected: String::new(), verdict: StepResult::NotChecked });
        }
        let checked = Checked::new(step, checks);
        rig.ended(&checked);
        done.push(checked);
    }
    let count = |verdict| done.iter().filter(|step: &&Checked| step.verdict == verdict).count();
    Report {
        robot: name,
        address,
        chip: options.chip,
        simulated: options.place == Place::Simulated,
        injectable,
        program: env!("CARGO_PKG_VERSION"),
        messages: format!("{:08x}", protocol::VERSION),
        passed: count(StepResult::Passed),
        failed: count(StepResult::Failed),
        not_checked: count(StepResult::NotChecked),
        steps: done,
    }
}
