//! What the file of an effect implements: its law, at the places of the chain where it acts.

use std::fmt::Debug;

use crate::fit::{FitNumber, Sizes};
use crate::spec::Spec;

/// Voltage that a bridge takes against the current.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct BridgeDrop {
    /// Drop at zero current, V.
    pub drop_v: f64,
    /// Rise of the drop with current, Ω.
    pub slope_ohm: f64,
}

/// An effect: its parameters, SI units and radians, as a value.
///
/// Every place of the chain where a law may act is a method with a neutral default; an effect implements those where it
/// acts. Where several effects act in one place they add up, or follow one another in the order of the catalogue.
pub trait Effect: Copy + Debug + PartialEq + Sized + 'static {
    /// What it carries from step to step; `()` for nothing.
    type State: Copy + Debug + PartialEq + Default + 'static;

    /// What is known about it.
    const SPEC: Spec;

    /// From values in the order of [`Spec::parameters`], SI units and radians.
    fn from_values(values: &[f64]) -> Self;

    // How a fit moves it.

    /// The numbers that a fit moves; each sets the parameter of the same place unless [`Self::values_of_fit`] says otherwise.
    /// None by default: recordings of the shaft do not show what acts at the feet or in the ground. Every other effect
    /// has some.
    #[must_use]
    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        Vec::new()
    }

    /// Puts the fit's numbers into the values, in the order of [`Spec::parameters`]. Values that no number sets stay.
    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        values[..numbers.len()].copy_from_slice(numbers);
    }

    /// The fit's numbers of values.
    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        let count = numbers.len();
        numbers.copy_from_slice(&values[..count]);
    }

    /// Half the plausible range of each of the fit's numbers, from that of the values.
    fn fit_ranges(_values: &[f64], half_ranges: &[f64], numbers: &mut [f64]) {
        let count = numbers.len();
        numbers.copy_from_slice(&half_ranges[..count]);
    }

    /// The largest torque that it puts on the shaft by itself, N·m, where that may exceed the motor's.
    #[must_use]
    fn largest_torque(&self) -> f64 {
        0.0
    }

    // On the way from the command to the shaft.

    /// The duty that arrives, −1 … 1, of one that is commanded.
    #[inline]
    #[must_use]
    fn duty(&self, duty: f64) -> f64 {
        duty
    }

    /// Voltage that the bridge takes.
    #[inline]
    #[must_use]
    fn bridge(&self) -> BridgeDrop {
        BridgeDrop::default()
    }

    /// Resistance of the bridge's supply that acts at once, Ω.
    #[inline]
    #[must_use]
    fn supply_resistance(&self) -> f64 {
        0.0
    }

    /// By how much the supply has fallen slowly, V.
    #[inline]
    #[must_use]
    fn supply_fallen(&self, _state: &Self::State) -> f64 {
        0.0
    }

    /// Advances what the supply remembers, by a mean bridge current (A) over a time (s).
    #[inline]
    fn draw(&self, _state: &mut Self::State, _bridge_a: f64, _time: f64) {}

    // On the shaft.

    /// Level at which friction slides, N·m, at a speed (rad/s) with a torque (N·m) through the teeth.
    #[inline]
    #[must_use]
    fn friction_level(&self, _speed: f64, _transmitted_nm: f64) -> f64 {
        0.0
    }

    /// Presliding length of the bristle that carries its friction, rad; `None` for an effect without friction.
    #[inline]
    #[must_use]
    fn presliding(&self) -> Option<f64> {
        None
    }

    /// Torque on the shaft at an angle (rad), N·m, counter-clockwise positive.
    #[inline]
    #[must_use]
    fn torque(&self, _angle: f64) -> f64 {
        0.0
    }

    // Between the shaft and the reading.

    /// Error of the reading at a shaft angle (rad), rad.
    #[inline]
    #[must_use]
    fn reading_error(&self, _angle: f64) -> f64 {
        0.0
    }

    /// Age of the reading, s.
    #[inline]
    #[must_use]
    fn reading_age(&self) -> f64 {
        0.0
    }

    // At the feet and in the ground.

    /// Factor on the coefficient of friction of a foot that slides at `speed` (m/s) under `load` (N).
    #[inline]
    #[must_use]
    fn foot_friction(&self, _speed: f64, _load: f64) -> f64 {
        1.0
    }

    /// Whether [`Self::foot_friction`] is anything but one.
    #[must_use]
    fn varies_foot_friction(&self) -> bool {
        false
    }

    /// A foot's friction across its module as a share of that along it.
    #[inline]
    #[must_use]
    fn lateral_share(&self) -> f64 {
        1.0
    }

    /// Direction of gravity, a unit vector in the ground's frame, of one on level ground.
    #[inline]
    #[must_use]
    fn down(&self, down: [f64; 3]) -> [f64; 3] {
        down
    }
}
