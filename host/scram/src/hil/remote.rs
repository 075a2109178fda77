//! A decider on a chip.

use control::protocol::lockstep::Hello;
use control::{Actuation, Command, Gait, Parameters, Refusal, Sample, Telemetry};

use super::{Client, Counts, HilError, Transport};
use simulation::Decide;

/// What the ticks of a run took.
#[derive(Clone, Debug, Default)]
pub struct Ticks {
    /// Of each tick, in the unit of the target.
    pub costs: Vec<u32>,
    /// Deepest stack, bytes; 0 where it is not measured.
    pub stack: u32,
}

impl Ticks {
    /// Median and worst cost; `None` of no ticks.
    #[must_use]
    pub fn median_and_worst(&self) -> Option<(u32, u32)> {
        let mut sorted = self.costs.clone();
        sorted.sort_unstable();
        Some((*sorted.get(sorted.len() / 2)?, *sorted.last()?))
    }
}

/// A controller on a chip.
pub struct Remote<T> {
    client: Client<T>,
    parameters: Parameters,
    telemetry: Telemetry,
    ticks: Ticks,
}

impl<T: Transport> Remote<T> {
    /// Starts a new controller on the chip.
    ///
    /// # Errors
    /// As [`Client::start`].
    pub fn start(mut client: Client<T>, parameters: &Parameters) -> Result<Self, HilError> {
        client.start(parameters)?;
        Ok(Self { client, parameters: *parameters, telemetry: Telemetry::default(), ticks: Ticks::default() })
    }

    /// Starts over with another controller, over the same line.
    ///
    /// # Errors
    /// As [`Client::start`].
    pub fn restart(&mut self, parameters: &Parameters) -> Result<(), HilError> {
        self.client.start(parameters)?;
        self.parameters = *parameters;
        self.telemetry = Telemetry::default();
        self.ticks = Ticks::default();
        Ok(())
    }

    /// Who decides.
    #[must_use]
    pub fn hello(&self) -> Hello {
        self.client.hello()
    }

    /// What was noticed of the line.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.client.counts()
    }

    /// What the ticks since the start took.
    #[must_use]
    pub fn ticks(&self) -> &Ticks {
        &self.ticks
    }
}

impl<T: Transport> Decide for Remote<T> {
    type Error = HilError;

    fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    fn telemetry(&self) -> Telemetry {
        self.telemetry
    }

    fn command(&mut self, command: Command, time_us: u64) -> Result<Result<(), Refusal>, HilError> {
        self.client.command(command, time_us)
    }

    fn keep_gait(&mut self, gait: &Gait) -> Result<Result<(), Refusal>, HilError> {
        self.client.keep_gait(gait)
    }

    fn tick(&mut self, sample: &Sample) -> Result<Actuation, HilError> {
        let ticked = self.client.tick(sample)?;
        self.telemetry = ticked.telemetry;
        self.ticks.costs.push(ticked.cost);
        self.ticks.stack = ticked.stack;
        Ok(ticked.actuation)
    }
}
