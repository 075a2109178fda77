//! What a fit moves: the motor's four numbers and those of effects.

use effects::{FitNumber, Scale};

/// Names a number that a fit moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// R, Ω.
    Resistance,
    /// K, N·m/A.
    TorqueConstant,
    /// J of rotor and load, kg·m².
    Inertia,
    /// b, N·m·s/rad.
    Viscous,
    /// L/R of the winding, s. Some microseconds are all that it is in the readings, where they also are what a rig does not keep of its
    /// times: it is fitted so that neither tells the scale of torques, and not reported.
    WindingTime,
    /// Of the converter's nonlinearity, [`super::converter::ConverterError`].
    OfConverter(usize),
    /// A term of the curve that a misfit is looked at with, [`super::probe::Probe`].
    OfCurve(usize),
    /// Of every effect whose fit has a number of this name ([`FitNumber::name`]).
    OfEffect(&'static str),
}

/// A number that a fit moves, SI units and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Free {
    /// Which.
    pub number: Number,
    /// For people, with its article.
    pub words: &'static str,
    /// How it is moved.
    pub scale: Scale,
    /// Where the fit begins.
    pub start: f64,
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Standard deviation of the weak prior about `start`, in the fit's own coordinate; infinite for none.
    pub prior: f64,
    /// Step of the finite difference, in the fit's own coordinate.
    pub step: f64,
    /// The power of the resistance that it follows where nothing but the scale of torques changes, which angle and drive do not
    /// show: −1 for a torque, 1 for another resistance.
    pub follows_scale: f64,
}

impl Free {
    /// A positive number of the motor, within a factor of its start, with a prior in factors e.
    #[must_use]
    pub fn of_motor(number: Number, words: &'static str, start: f64, factor: f64, prior: f64) -> Self {
        let (low, high) = (start / factor, start * factor);
        Self {
            number,
            words,
            scale: Scale::Log,
            start,
            low,
            high,
            prior,
            step: difference_step(Scale::Log),
            follows_scale: 0.0,
        }
    }

    /// A number of an effect, from one of its starting points; `follows_scale` is to be filled in.
    #[must_use]
    pub fn of_effect(one: &FitNumber, start: usize) -> Self {
        Self {
            number: Number::OfEffect(one.name),
            words: one.words,
            scale: one.scale,
            start: one.starts[start % one.starts.len()],
            low: one.low,
            high: one.high,
            prior: one.prior,
            step: one.step.unwrap_or(difference_step(one.scale)),
            follows_scale: 0.0,
        }
    }

    /// A term of a curve, of which nothing is known but that it is not many times its own size; of torques or not.
    #[must_use]
    pub fn of_curve(term: usize, of_torques: bool) -> Self {
        Self {
            number: Number::OfCurve(term),
            words: "a term of a curve",
            scale: Scale::Linear(1.0),
            start: 0.0,
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
            prior: OF_CURVE.0,
            step: OF_CURVE.1,
            follows_scale: if of_torques { -1.0 } else { 0.0 },
        }
    }

    /// Its coordinate after a step, where the resistance makes one of this many factors e. Along the scale of torques the step is as
    /// curved as that is, so that it may be long.
    #[must_use]
    pub fn stepped(&self, coordinate: f64, step: f64, resistance: f64) -> f64 {
        let with_scale = if self.scale == Scale::Log { 0.0 } else { self.follows_scale * resistance };
        if with_scale == 0.0 { coordinate + step } else { (coordinate * (1.0 - with_scale) + step) * with_scale.exp() }
    }

    /// How its coordinate changes with the logarithm of the resistance where nothing but the scale of torques does.
    #[must_use]
    pub fn along_scale(&self, coordinate: f64) -> f64 {
        if self.scale == Scale::Log { self.follows_scale } else { self.follows_scale * coordinate }
    }

    /// The fit's coordinate of a number.
    #[must_use]
    pub fn coordinate(&self, number: f64) -> f64 {
        match self.scale {
            Scale::Log => number.ln(),
            Scale::Linear(unit) => number / unit,
        }
    }

    /// The number at a coordinate.
    #[must_use]
    pub fn number(&self, coordinate: f64) -> f64 {
        match self.scale {
            Scale::Log => coordinate.exp(),
            Scale::Linear(unit) => coordinate * unit,
        }
    }

    /// How far a coordinate is from where fits begin, in standard deviations of the prior about it; 0 where there is none.
    #[must_use]
    pub fn off_prior(&self, coordinate: f64) -> f64 {
        (coordinate - self.coordinate(self.start)) / self.prior
    }

    /// Whether the effect that it belongs to is absent where it and those like it are 0: it says how large the effect is.
    #[must_use]
    pub fn is_size(&self) -> bool {
        matches!(self.scale, Scale::Linear(_)) && self.low <= 0.0 && self.high > 0.0
    }

    /// Whether its bounds leave no room.
    #[must_use]
    pub fn held(&self) -> bool {
        self.low >= self.high
    }

    /// The finite difference at a coordinate: away from the upper bound.
    #[must_use]
    pub fn difference(&self, coordinate: f64) -> f64 {
        if coordinate + self.step > self.coordinate(self.high) { -self.step } else { self.step }
    }
}

/// Standard deviation and finite difference of a curve's terms, in their own sizes.
const OF_CURVE: (f64, f64) = (10.0, 0.05);

/// So short that what it bends does not look like knowledge of a direction that the readings leave open.
fn difference_step(scale: Scale) -> f64 {
    match scale {
        Scale::Log => 2e-4,
        Scale::Linear(_) => 2e-3,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_step_along_the_scale_of_torques_stays_on_it() {
        let torque = Free {
            scale: Scale::Linear(1e-5),
            follows_scale: -1.0,
            ..Free::of_motor(Number::Viscous, "the viscous damping", 2e-5, 5.0, 1.0)
        };
        // The resistance three times as large, and the tangent of torque times resistance that stays.
        let (at, resistance) = (2.0, 3f64.ln());
        let to = torque.stepped(at, -at * resistance, resistance);
        assert!((to * 3.0 / at - 1.0).abs() < 1e-12, "{to}");
        // Without the resistance a step is what it is.
        assert!((torque.stepped(at, 0.5, 0.0) - 2.5).abs() < 1e-12);
    }
}
