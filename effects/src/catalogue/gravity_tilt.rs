//! `gravity_tilt`: gravity on an unbalanced mass whose axis is not vertical.
//!
//! `τ = −torque·sin(θ − direction)`, torque being `m g r sin(tilt)`. A fit moves the two components, in which the law is
//! linear.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// A torque that depends on the shaft angle, once a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityTilt {
    /// m g r sin(tilt), N·m.
    pub torque_nm: f64,
    /// The shaft angle at which the mass hangs at rest, rad.
    pub direction_rad: f64,
}

impl Effect for GravityTilt {
    type State = ();

    const SPEC: Spec = Spec {
        name: "gravity_tilt",
        summary: "Gravity on the eccentric.",
        title: "gravity on a tilted axis",
        clause: "a torque that depends on the shaft angle, once a turn",
        law: "τ = −torque·sin(θ − direction)",
        source: "a pendulum on a tilted axis",
        parameters: &[
            Parameter::new("torque_nm", "m g r sin(tilt).", 0.0, 10.0),
            Parameter::new("direction_deg", "Shaft angle at which the mass hangs.", -360.0, 360.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Angle,
        candidate: true,
        contains: &[],
        mistaken_for: &[Confusion {
            with: "sensor_nonlinearity",
            when: "one speed",
            experiment: "turn at two constant speeds, slow and fast: gravity's ripple shrinks with speed, the sensor's error \
                         does not",
        }],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { torque_nm: values[0], direction_rad: values[1] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let (unit, most) = (0.01 * sizes.torque_nm, 2.0 * sizes.torque_nm);
        vec![
            FitNumber::linear("gravity_cos", "the gravity torque", unit, 0.0, [-most, most]),
            FitNumber::linear("gravity_sin", "the gravity torque", unit, 0.0, [-most, most]),
        ]
    }

    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        let (cos, sin) = (numbers[0], numbers[1]);
        values[0] = cos.hypot(sin);
        values[1] = sin.atan2(cos);
    }

    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        let (sin, cos) = values[1].sin_cos();
        numbers.copy_from_slice(&[values[0] * cos, values[0] * sin]);
    }

    fn fit_ranges(values: &[f64], half_ranges: &[f64], numbers: &mut [f64]) {
        numbers.fill(half_ranges[0].max(values[0] * half_ranges[1]).max(0.2 * values[0]));
    }

    fn largest_torque(&self) -> f64 {
        self.torque_nm
    }

    #[inline]
    fn torque(&self, angle: f64) -> f64 {
        if self.torque_nm == 0.0 { 0.0 } else { -self.torque_nm * (angle - self.direction_rad).sin() }
    }
}
