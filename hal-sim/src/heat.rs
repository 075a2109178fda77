//! What the winding and friction turn into heat.

use effects::{Laws, States};

use crate::shaft::{Shaft, StepMeans};

/// Heat that no effect has felt yet.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Heat {
    /// From the winding, J.
    winding_j: f64,
    /// From friction, damping and drag, J.
    friction_j: f64,
}

impl Heat {
    /// Adds that of a step (s) of a shaft.
    #[inline]
    pub fn add(&mut self, shaft: &Shaft, means: &StepMeans, step: f64) {
        self.winding_j += shaft.resistance_ohm * means.current * means.current * step;
        self.friction_j += means.rubbing_w * step;
    }

    /// Warms what the effects remember by all of it, as losses that were even over a time (s), and begins anew.
    pub fn warm(&mut self, laws: &Laws, states: &mut States, time: f64) {
        laws.warm(states, self.winding_j / time, self.friction_j / time, time);
        *self = Self::default();
    }
}
