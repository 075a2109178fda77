//! Poles and margins of the loop broken at the motor's input: the current estimator of the reliable zone with the gain.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DMatrix};

/// Margins of a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Factor by which the loop gain may rise; infinite where it may rise without bound.
    pub gain_up: f64,
    /// Factor (below 1) to which it may fall; 0 where it may fall to nothing.
    pub gain_down: f64,
    /// Phase margin, rad.
    pub phase: f64,
    /// Time by which the loop may be later, s.
    pub delay: f64,
    /// Crossover frequency that the delay margin belongs to, Hz.
    pub crossover_hz: f64,
    /// Smallest distance of the loop from −1.
    pub modulus: f64,
}

/// A discrete single-input, single-output system.
#[derive(Clone, Debug)]
pub struct System {
    /// State matrix.
    pub a: DMatrix<f64>,
    /// Input column.
    pub b: DMatrix<f64>,
    /// Output row.
    pub c: DMatrix<f64>,
    /// Feed-through.
    pub d: f64,
}

impl System {
    /// Response at `z`.
    #[must_use]
    pub fn response(&self, z: Complex<f64>) -> Option<Complex<f64>> {
        let n = self.a.nrows();
        let complex = |m: &DMatrix<f64>| m.map(|value| Complex::new(value, 0.0));
        let resolvent = DMatrix::from_diagonal_element(n, n, z) - complex(&self.a);
        let state = resolvent.lu().solve(&complex(&self.b))?;
        Some((complex(&self.c) * state)[(0, 0)] + self.d)
    }
}

/// Margins of `loop_gain(z)` (negative feedback) sampled with a period (s), on a logarithmic grid up to Nyquist.
#[must_use]
pub fn margins(loop_gain: impl Fn(Complex<f64>) -> Option<Complex<f64>>, period: f64) -> Margins {
    const POINTS: usize = 4000;
    let nyquist = 0.5 / period;
    let mut found = Margins {
        gain_up: f64::INFINITY,
        gain_down: 0.0,
        phase: PI,
        delay: f64::INFINITY,
        crossover_hz: 0.0,
        modulus: f64::INFINITY,
    };
    let mut last: Option<(f64, Complex<f64>)> = None;
    for index in 0..=POINTS {
        let frequency = nyquist * 1e-5f64.powf(1.0 - index as f64 / POINTS as f64);
        let Some(value) = loop_gain(Complex::from_polar(1.0, TAU * frequency * period)) else { continue };
        found.modulus = found.modulus.min((value + 1.0).norm());
        if let Some((before, previous)) = last {
            phase_crossing(&mut found, previous, value);
            gain_crossing(&mut found, (before, previous), (frequency, value));
        }
        last = Some((frequency, value));
    }
    found
}

/// The negative real axis between two points: where gain alone would reach −1.
fn phase_crossing(found: &mut Margins, a: Complex<f64>, b: Complex<f64>) {
    if a.im * b.im > 0.0 || a.im == b.im {
        return;
    }
    let share = a.im / (a.im - b.im);
    let real = a.re + share * (b.re - a.re);
    if real >= 0.0 {
        return;
    }
    let factor = -1.0 / real;
    if factor > 1.0 {
        found.gain_up = found.gain_up.min(factor);
    } else {
        found.gain_down = found.gain_down.max(factor);
    }
}

/// The unit circle between two points: where phase alone would reach −1.
fn gain_crossing(found: &mut Margins, (fa, a): (f64, Complex<f64>), (fb, b): (f64, Complex<f64>)) {
    let (ga, gb) = (a.norm().ln(), b.norm().ln());
    if ga * gb > 0.0 || ga == gb {
        return;
    }
    let share = ga / (ga - gb);
    let frequency = fa + share * (fb - fa);
    let crossing = a + (b - a) * share;
    // Distance to −1 in both directions; a delay only turns clockwise.
    let turn = (crossing.arg() + PI).rem_euclid(TAU);
    found.phase = found.phase.min(turn.min(TAU - turn));
    let delay = turn / (TAU * frequency);
    if delay < found.delay {
        found.delay = delay;
        found.crossover_hz = frequency;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_integrator_has_its_textbook_margins() {
        // L = k T/(z − 1): |L| = kT/(2 sin(ωT/2)); it reaches −1 at Nyquist with gain 2/(kT).
        let (k, period) = (20.0f64, 1e-2);
        let margins = margins(|z| Some(Complex::new(k * period, 0.0) / (z - 1.0)), period);
        let crossover = 2.0 / period * (0.5 * k * period).asin();
        let phase = PI / 2.0 - 0.5 * crossover * period;
        assert!((margins.crossover_hz - crossover / TAU).abs() < 1e-2 * margins.crossover_hz, "{margins:?}");
        assert!((margins.phase - phase).abs() < 1e-2, "{margins:?} against {phase}");
        assert!((margins.delay - phase / crossover).abs() < 1e-3, "{margins:?}");
    }

    #[test]
    fn a_double_lag_with_delay_has_a_gain_margin() {
        // L = k z⁻¹ /(z − 1) with T = 1: reaches −1 at k = 1 (poles z² − z + k on the unit circle).
        let margins = margins(|z| Some(0.25 / (z * (z - 1.0))), 1.0);
        assert!((margins.gain_up - 4.0).abs() < 0.02, "{margins:?}");
    }
}
