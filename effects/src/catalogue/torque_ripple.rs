//! `torque_ripple`: a torque that repeats so many times a turn.
//!
//! `τ = torque·cos(order·θ − phase)`: the slots of the motor's iron (gear ratio × the least common multiple of slots and
//! poles), its commutation, the mesh of a gear (teeth), each seen from the output shaft (cogging and commutation ripple: J.
//! Holtz, L. Springob, IEEE Trans. Industrial Electronics 43, 1996). A fit moves the two components, in which the law is
//! linear, and starts from several orders; it does not move the order itself. An order that is no whole number, as behind
//! gears of an odd ratio, has a phase only as long as the turns are counted.

use crate::effect::Effect;
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// One order of a torque over the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueRipple {
    /// Periods a turn of the shaft, 1.
    pub order: f64,
    /// Amplitude, N·m.
    pub torque_nm: f64,
    /// Phase of the cosine at order·θ, rad.
    pub phase_rad: f64,
}

/// Orders from which fits begin: below the first, it is gravity.
const ORDERS: std::ops::RangeInclusive<u32> = 2..=16;
/// The greatest order that a fit begins from.
const HIGHEST: f64 = 2001.0;

impl Effect for TorqueRipple {
    type State = ();

    const SPEC: Spec = Spec {
        name: "torque_ripple",
        summary: "A torque that repeats with the shaft angle: cogging, commutation, gear mesh.",
        title: "torque ripple",
        clause: "a torque that repeats many times a turn",
        law: "τ = torque·cos(order·θ − phase)",
        source: "J. Holtz, L. Springob, IEEE Trans. Industrial Electronics 43, 1996 (identification of torque ripple)",
        parameters: &[
            Parameter::new(
                "order_per_turn",
                "Periods a turn of the shaft: gear ratio × slots, commutations or teeth.",
                0.5,
                10000.0,
            ),
            Parameter::new("torque_nm", "Amplitude.", 0.0, 10.0),
            Parameter::new("phase_deg", "Phase: the torque is greatest where order·θ is this.", -360.0, 360.0),
        ],
        acts: Acts::Shaft,
        shows_in: Coordinate::Angle,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "sensor_nonlinearity",
                when: "one speed",
                experiment: "turn at two constant speeds, slow and fast: the torque's ripple shrinks with speed, the sensor's \
                             error does not",
            },
            Confusion {
                with: "friction_patch",
                when: "the shaft turns one way only",
                experiment: "turn slowly through the whole turn, both ways: a patch brakes both ways, a ripple pushes one way \
                             where it brakes the other",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { order: values[0], torque_nm: values[1], phase_rad: values[2] }
    }

    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let (unit, most) = (0.01 * sizes.torque_nm, sizes.torque_nm);
        let component = |name| FitNumber::linear(name, "the torque ripple", unit, 0.0, [-most, most]);
        let order = FitNumber::linear("ripple_order", "the ripple's order", 1.0, 2.0, [1.0, HIGHEST]);
        // The rotor itself, and the commutation of three slots.
        let gears = [1.0, 3.0, 6.0].map(|times| (times * sizes.gear_ratio).round().clamp(2.0, HIGHEST));
        let mut starts: Vec<f64> = ORDERS.map(f64::from).chain(gears).collect();
        starts.sort_by(f64::total_cmp);
        starts.dedup();
        vec![FitNumber { starts, ..order }, component("ripple_cos"), component("ripple_sin")]
    }

    /// The order is a choice and not moved: what a step of a fit adds to a whole one is not seen, and one that a file has
    /// stays.
    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        let (order, cos, sin) = (numbers[0], numbers[1], numbers[2]);
        if (order - values[0]).abs() >= 0.5 {
            values[0] = order.round();
        }
        values[1] = cos.hypot(sin);
        values[2] = sin.atan2(cos);
    }

    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        let (sin, cos) = values[2].sin_cos();
        numbers.copy_from_slice(&[values[0], values[1] * cos, values[1] * sin]);
    }

    fn fit_ranges(values: &[f64], half_ranges: &[f64], numbers: &mut [f64]) {
        numbers.fill(half_ranges[1].max(values[1] * half_ranges[2]).max(0.2 * values[1]));
        numbers[0] = half_ranges[0];
    }

    fn largest_torque(&self) -> f64 {
        self.torque_nm
    }

    #[inline]
    fn torque(&self, angle: f64) -> f64 {
        self.torque_nm * (self.order * angle - self.phase_rad).cos()
    }
}
