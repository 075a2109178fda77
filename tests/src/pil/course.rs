//! A run of the simulated robot with a decider, and what is done to the samples and commands between them.

use control::{Actuation, AdcCode, Command, Controller, Gait, Parameters, Refusal, Sample, Telemetry};
use hal_sim::{Settings, SimulatedRobot};
use scram::hil::{HilError, Qemu, Remote};
use simulation::{Decide, Plan, closed_loop_with};

use super::bits::{Compared, Difference};

/// What is done at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disturbance {
    /// So many ticks are missed: no sample arrives, the bridge keeps its duty.
    Miss(u16),
    /// Another code of the wiper.
    Angle(u16),
    /// Another code of the battery.
    Battery(u16),
    /// Another time, µs.
    Time(u64),
    /// So much later than it was, µs.
    Late(i16),
    /// A command with its stamp, µs after the sample's time.
    Command(Command, i64),
}

/// Samples and commands for the controller on the chip.
#[derive(Clone, Debug)]
pub struct Course {
    /// What the controller knows.
    pub parameters: Parameters,
    /// Commands, faults and length.
    pub plan: Plan,
    /// Seed of the robot.
    pub seed: u64,
    /// What is done, by tick, in order.
    pub disturbances: Vec<(usize, Disturbance)>,
}

/// One tick that the chip ran.
#[derive(Clone, Copy, Debug)]
pub struct Ran {
    /// Number of the tick.
    pub tick: usize,
    /// Instructions.
    pub cost: u32,
    /// Ticks missed before it.
    pub missed: u16,
    /// What it told.
    pub telemetry: Telemetry,
}

/// What a run on the chip gave.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Every tick that ran.
    pub ticks: Vec<Ran>,
    /// Deepest stack, bytes.
    pub stack: u32,
    /// Against the host's controller.
    pub compared: Compared,
}

/// Runs a course on the chip, beside the host's own controller: each gets the same samples and commands.
///
/// # Errors
/// The link to the chip fails.
///
/// # Panics
/// When the host's controller refuses the parameters that the chip's has taken.
pub fn run(robot: &robot_file::Robot, course: &Course, chip: &mut Remote<Qemu>) -> Result<Outcome, HilError> {
    chip.restart(&course.parameters)?;
    let local = Controller::new(&course.parameters).unwrap_or_else(|error| panic!("{error}"));
    let robot = SimulatedRobot::with(robot, course.seed, &Settings::default());
    let mut both = Both {
        chip,
        local,
        disturbances: &course.disturbances,
        tick: 0,
        missing: 0,
        missed: 0,
        last: Actuation::OFF,
        outcome: Outcome::default(),
    };
    closed_loop_with(robot, &mut both, &course.plan)?;
    let mut outcome = both.outcome;
    outcome.stack = chip.ticks().stack;
    Ok(outcome)
}

/// The chip decides; the host's controller is asked the same.
struct Both<'a> {
    chip: &'a mut Remote<Qemu>,
    local: Controller,
    disturbances: &'a [(usize, Disturbance)],
    tick: usize,
    /// Ticks still to be missed, and those missed since the last.
    missing: u16,
    missed: u16,
    last: Actuation,
    outcome: Outcome,
}

impl Both<'_> {
    /// Does what is due to a sample; `false` where the tick is missed.
    fn disturb(&mut self, sample: &mut Sample) -> Result<bool, HilError> {
        while let Some(((at, what), rest)) = self.disturbances.split_first()
            && *at <= self.tick
        {
            self.disturbances = rest;
            match *what {
                Disturbance::Miss(ticks) => self.missing = ticks,
                Disturbance::Angle(code) => sample.angle = AdcCode(code),
                Disturbance::Battery(code) => sample.battery = AdcCode(code),
                Disturbance::Time(time_us) => sample.time_us = time_us,
                Disturbance::Late(us) => sample.time_us = sample.time_us.saturating_add_signed(i64::from(us)),
                Disturbance::Command(command, after_us) => {
                    let _ = self.command(command, sample.time_us.saturating_add_signed(after_us))?;
                }
            }
        }
        Ok(self.missing == 0)
    }
}

impl Decide for Both<'_> {
    type Error = HilError;

    fn parameters(&self) -> &Parameters {
        self.local.parameters()
    }

    fn telemetry(&self) -> Telemetry {
        self.chip.telemetry()
    }

    fn command(&mut self, command: Command, time_us: u64) -> Result<Result<(), Refusal>, HilError> {
        let theirs = self.chip.command(command, time_us)?;
        let ours = self.local.command(command, time_us);
        self.outcome.compared.answer(self.tick, &command, &ours, &theirs);
        Ok(theirs)
    }

    fn keep_gait(&mut self, gait: &Gait) -> Result<Result<(), Refusal>, HilError> {
        let theirs = self.chip.keep_gait(gait)?;
        let ours = self.local.keep_gait(gait);
        self.outcome.compared.answer(self.tick, &Command::Gait { id: gait.id() }, &ours, &theirs);
        Ok(theirs)
    }

    fn tick(&mut self, sample: &Sample) -> Result<Actuation, HilError> {
        let mut sample = *sample;
        if self.disturb(&mut sample)? {
            let theirs = self.chip.tick(&sample)?;
            let ours = self.local.tick(&sample);
            let telemetry = self.chip.telemetry();
            let difference = || Difference::Tick {
                tick: self.tick,
                sample,
                ours: (ours, self.local.telemetry()),
                theirs: (theirs, telemetry),
            };
            self.outcome.compared.tick(&(ours, self.local.telemetry()), &(theirs, telemetry), difference);
            let cost = self.chip.ticks().costs.last().copied().unwrap_or(0);
            self.outcome.ticks.push(Ran { tick: self.tick, cost, missed: self.missed, telemetry });
            self.missed = 0;
            self.last = theirs;
        } else {
            self.missing -= 1;
            self.missed += 1;
        }
        self.tick += 1;
        Ok(self.last)
    }
}
