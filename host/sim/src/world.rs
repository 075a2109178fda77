//! What a controller is closed with: a shaft on a bench, or a robot on the ground.

use control::{Actuation, Sample};
use hal_sim::{Fault, SimulatedRobot, Truth};

/// A simulated robot as its controller meets it, one control period at a time.
pub trait World {
    /// Control period, s; constant during a run.
    fn tick_s(&self) -> f64;

    /// The conversions of the current tick.
    fn sample(&mut self) -> Sample;

    /// What really is with motor, supply and sensor, at the current tick.
    fn truth(&self) -> Truth;

    /// One control period with the bridge as told.
    fn advance(&mut self, actuation: Actuation);

    /// Breaks something from a time (s since the start) on.
    fn schedule(&mut self, fault: Fault, at_s: f64);
}

impl World for SimulatedRobot {
    fn tick_s(&self) -> f64 {
        self.tick_s()
    }

    fn sample(&mut self) -> Sample {
        self.sample()
    }

    fn truth(&self) -> Truth {
        self.truth()
    }

    fn advance(&mut self, actuation: Actuation) {
        self.advance(actuation);
    }

    fn schedule(&mut self, fault: Fault, at_s: f64) {
        self.schedule(fault, at_s);
    }
}
