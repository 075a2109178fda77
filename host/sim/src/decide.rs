//! Who decides in a closed loop.

use std::convert::Infallible;

use control::{Actuation, Command, Controller, Gait, Parameters, Refusal, Sample, Telemetry};

/// A controller in this process or on a chip.
pub trait Decide {
    /// Why it can fail to decide: the link to a chip.
    type Error;

    /// What it knows about the robot.
    fn parameters(&self) -> &Parameters;

    /// What it believes since the last tick.
    fn telemetry(&self) -> Telemetry;

    /// Takes a command; the inner result is the controller's answer.
    ///
    /// # Errors
    /// The controller cannot be reached.
    fn command(&mut self, command: Command, time_us: u64) -> Result<Result<(), Refusal>, Self::Error>;

    /// Keeps a gait, to be played on [`Command::Gait`]; the inner result is the controller's answer.
    ///
    /// # Errors
    /// The controller cannot be reached.
    fn keep_gait(&mut self, gait: &Gait) -> Result<Result<(), Refusal>, Self::Error>;

    /// One control period.
    ///
    /// # Errors
    /// The controller cannot be reached.
    fn tick(&mut self, sample: &Sample) -> Result<Actuation, Self::Error>;
}

impl Decide for Controller {
    type Error = Infallible;

    fn parameters(&self) -> &Parameters {
        self.parameters()
    }

    fn telemetry(&self) -> Telemetry {
        self.telemetry()
    }

    fn command(&mut self, command: Command, time_us: u64) -> Result<Result<(), Refusal>, Infallible> {
        Ok(self.command(command, time_us))
    }

    fn keep_gait(&mut self, gait: &Gait) -> Result<Result<(), Refusal>, Infallible> {
        Ok(self.keep_gait(gait))
    }

    fn tick(&mut self, sample: &Sample) -> Result<Actuation, Infallible> {
        Ok(self.tick(sample))
    }
}
