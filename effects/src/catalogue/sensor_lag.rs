//! `sensor_lag`: the reading follows the shaft with a first-order lag.
//!
//! `dy/dt = (θ − y)/T`: an encoder's own filter, a capacitor behind a wiper (in the angle: a filter that counts the turns).
//! Over a step of even speed in closed form (transfer function `1/(1 + Ts)`: K. Åström, R. Murray, "Feedback Systems", 2008,
//! section 2.3).

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A lag of the reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorLag {
    /// Time constant T, s.
    pub time_s: f64,
}

impl Effect for SensorLag {
    /// How far the reading is behind, rad.
    type State = f64;

    const SPEC: Spec = Spec {
        name: "sensor_lag",
        summary: "The reading follows the shaft with a first-order lag.",
        title: "sensor lag",
        clause: "a reading that follows the shaft slowly",
        law: "dy/dt = (θ − y)/T",
        source: "K. Åström, R. Murray, \"Feedback Systems\", 2008, 2.3 (first-order low-pass filter)",
        parameters: &[Parameter::new("time_s", "Time constant.", 0.0, 1.0)],
        acts: Acts::Sensor,
        shows_in: Coordinate::Time,
        candidate: true,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "sensor_delay",
            when: "the lag is below some 5 ms",
            experiment: "reverse the drive as fast as the shaft follows, at several frequencies: a late reading shows every \
                         corner, later; one that lags rounds it off",
        }],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { time_s: values[0] }
    }

    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        let lag = FitNumber::linear("lag_s", "the sensor's lag", 1e-3, 3e-3, [0.0, 0.2]);
        vec![FitNumber { starts: vec![3e-3, 15e-3], ..lag }]
    }

    fn follows(&self) -> bool {
        true
    }

    #[inline]
    fn follow(&self, behind: &mut f64, moved: f64, step: f64) -> f64 {
        let before = *behind;
        let ratio = step / self.time_s;
        // What is left of a distance, and the mean of that over the step: −expm1 keeps the digits of short steps.
        *behind = if self.time_s > 0.0 { before * (-ratio).exp() - moved * (-ratio).exp_m1() / ratio } else { 0.0 };
        moved + before - *behind
    }

    #[inline]
    fn behind(&self, behind: &f64) -> f64 {
        *behind
    }

    fn settle(&self, behind: &mut f64, speed: f64, _dragging: f64) {
        *behind = speed * self.time_s;
    }
}
