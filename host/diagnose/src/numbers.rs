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
    /// Of the converter's nonlinearity, [`super::converter::ConverterError`].
    OfConverter(usize),
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
}

impl Free {
    /// A positive number of the motor, within a factor of its start, with a prior in factors e.
    #[must_use]
    pub fn of_motor(number: Number, words: &'static str, start: f64, factor: f64, prior: f64) -> Self {
        let (low, high) = (start / factor, start * factor);
        Self { number, words, scale: Scale::Log, start, low, high, prior, step: difference_step(Scale::Log) }
    }

    /// A number of an effect, from one of its starting points.
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
        }
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

fn difference_step(scale: Scale) -> f64 {
    match scale {
        Scale::Log => 2e-3,
        Scale::Linear(_) => 2e-2,
    }
}
