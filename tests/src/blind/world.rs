//! The truth's integrator: classical Runge–Kutta on the mechanics at about 16 µs, staggered with an implicit,
//! L-stable step of the winding's current (L/R is some 10 µs and a diode's knee is stiffer still).
//!
//! Mechanics sees the current of the middle of a step, the winding sees a speed that changes as it did in the last
//! step: second order although the winding is stiff.

use super::laws::{Battery, Bridge, Bristle, COPPER_PER_KELVIN, Gravity, Heating, Ripple, TwoInertias};
use super::rig::Rig;

/// Everything that moves the shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// The specimen's own numbers.
    pub rig: Rig,
    /// Friction.
    pub bristle: Option<Bristle>,
    /// A second friction, for a hidden one beside a known one.
    pub second_bristle: Option<Bristle>,
    /// Gravity.
    pub gravity: Option<Gravity>,
    /// The bridge; `None` is ideal.
    pub bridge: Option<Bridge>,
    /// The cell; `None` is a stiff bench supply.
    pub battery: Option<Battery>,
    /// Ripple of the teeth.
    pub ripple: Option<Ripple>,
    /// Drag with the square of the speed, N·m·s²/rad².
    pub quadratic_drag: f64,
    /// Warm winding.
    pub heating: Option<Heating>,
    /// Play or a soft shaft.
    pub two: Option<TwoInertias>,
    /// First-order lag of the sensor, s; 0 for none.
    pub sensor_lag_s: f64,
}

/// Number of mechanical states.
const N: usize = 10;
/// Places in the state vector.
const ANGLE: usize = 0;
const SPEED: usize = 1;
const BRISTLE: usize = 2;
const BRISTLE_2: usize = 3;
const LOAD_ANGLE: usize = 4;
const LOAD_SPEED: usize = 5;
const PAIR: usize = 6; // two places
const WARMTH: usize = 8;
const LAGGED: usize = 9;

/// The truth at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    mechanics: [f64; N],
    /// Acceleration of the rotor over the last step, rad/s².
    acceleration: f64,
    /// Winding current, A.
    pub current: f64,
}

/// What the bridge is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// −1 … 1.
    pub duty: f64,
    /// Whether the bridge drives at all.
    pub enable: bool,
}

impl World {
    /// A linear motor with an ideal bridge.
    #[must_use]
    pub fn linear(rig: Rig) -> Self {
        Self {
            rig,
            bristle: None,
            second_bristle: None,
            gravity: None,
            bridge: None,
            battery: None,
            ripple: None,
            quadratic_drag: 0.0,
            heating: None,
            two: None,
            sensor_lag_s: 0.0,
        }
    }

    /// At rest, cold, charged, at an angle.
    #[must_use]
    pub fn rest(&self, angle: f64) -> State {
        let mut mechanics = [0.0; N];
        mechanics[ANGLE] = angle;
        mechanics[LOAD_ANGLE] = angle;
        mechanics[LAGGED] = angle;
        State { mechanics, acceleration: 0.0, current: 0.0 }
    }

    /// What the sensor's axis shows before its own errors, rad: the load's angle behind play, lagged where it lags.
    #[must_use]
    pub fn shown_angle(&self, state: &State) -> f64 {
        if self.sensor_lag_s > 0.0 { state.mechanics[LAGGED] } else { self.shaft_angle(state) }
    }

    /// Angle of the shaft that carries the sensor, rad.
    #[must_use]
    pub fn shaft_angle(&self, state: &State) -> f64 {
        state.mechanics[if self.two.is_some() { LOAD_ANGLE } else { ANGLE }]
    }

    /// Its speed, rad/s.
    #[must_use]
    pub fn shaft_speed(&self, state: &State) -> f64 {
        state.mechanics[if self.two.is_some() { LOAD_SPEED } else { SPEED }]
    }

    /// Advances by `seconds` with the drive held, in steps no longer than `longest`; after a jump of the drive the
    /// first 60 µs, in which the current follows, are cut into steps a sixth as long.
    pub fn hold(&self, state: &mut State, drive: Drive, jumped: bool, seconds: f64, longest: f64) {
        let steps = |seconds: f64, longest: f64| ((seconds / longest).ceil() as usize).max(1);
        let first = if jumped { seconds.min(60e-6) } else { 0.0 };
        if first > 0.0 {
            self.advance(state, drive, first, steps(first, longest / 6.0));
        }
        if seconds > first {
            self.advance(state, drive, seconds - first, steps(seconds - first, longest));
        }
    }

    /// Advances by `seconds` in `steps` equal steps with the drive held.
    pub fn advance(&self, state: &mut State, drive: Drive, seconds: f64, steps: usize) {
        let h = seconds / steps as f64;
        for _ in 0..steps {
            // From here to the middle, and from there to the end, whose speed is known by then.
            self.wind(state, drive, 0.5 * h, 0.0);
            self.turn(state, drive, h);
            self.wind(state, drive, 0.5 * h, -0.5 * h);
        }
    }

    /// The winding over `h`; the speed is known `-from` after the beginning.
    fn wind(&self, state: &mut State, drive: Drive, h: f64, from: f64) {
        let rig = &self.rig;
        let warm = self.heating.map_or(1.0, |_| 1.0 + COPPER_PER_KELVIN * state.mechanics[WARMTH]);
        let resistance = rig.resistance_ohm * warm;
        let emf = rig.torque_constant * (state.mechanics[SPEED] + state.acceleration * from);
        let emf_rate = rig.torque_constant * state.acceleration;
        if !drive.enable {
            // Diodes hand the winding's energy to the supply until the current ends, and it stays ended.
            let push = -(rig.rail_v + emf * state.current.signum()).max(0.0);
            let decay = (-h * resistance / rig.inductance_h).exp();
            let left = push / resistance + (state.current.abs() - push / resistance) * decay;
            state.current = left.max(0.0).copysign(state.current);
            return;
        }
        let (relaxed, series) = self.battery.map_or((0.0, 0.0), |battery| {
            (state.mechanics[PAIR] + state.mechanics[PAIR + 1], battery.series_ohm * drive.duty * drive.duty)
        });
        let net = drive.duty * (rig.rail_v - relaxed) - emf;
        let resistance = resistance + series;
        match &self.bridge {
            None => {
                // Exact for a net voltage that changes linearly: the current follows it a time constant behind.
                let behind = emf_rate * rig.inductance_h / resistance;
                let (start, end) = ((net + behind) / resistance, (net - emf_rate * h + behind) / resistance);
                state.current = end + (state.current - start) * (-h * resistance / rig.inductance_h).exp();
            }
            Some(bridge) => {
                // SDIRK2 with γ = 1 − 1/√2 (Alexander 1977): L-stable, second order.
                let gamma = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
                let slope = |i: f64, t: f64| {
                    (net - emf_rate * t - resistance * i - bridge.drop(i, drive.duty)) / rig.inductance_h
                };
                let first = implicit(state.current, gamma * h, &|i| slope(i, gamma * h));
                let base = state.current + (1.0 - gamma) * (first - state.current) / gamma;
                state.current = implicit(base, gamma * h, &|i| slope(i, h));
            }
        }
    }

    /// Mechanics, battery and warmth over `h` with the current held: classical Runge–Kutta.
    fn turn(&self, state: &mut State, drive: Drive, h: f64) {
        let current = state.current;
        let y = state.mechanics;
        let k1 = self.rates(&y, current, drive);
        let k2 = self.rates(&moved(&y, &k1, 0.5 * h), current, drive);
        let k3 = self.rates(&moved(&y, &k2, 0.5 * h), current, drive);
        let k4 = self.rates(&moved(&y, &k3, h), current, drive);
        for (n, value) in state.mechanics.iter_mut().enumerate() {
            *value += h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]);
        }
        state.acceleration = (state.mechanics[SPEED] - y[SPEED]) / h;
    }

    /// Time derivatives of the mechanics.
    fn rates(&self, y: &[f64; N], current: f64, drive: Drive) -> [f64; N] {
        let rig = &self.rig;
        let (angle, speed) = (y[ANGLE], y[SPEED]);
        let mut rate = [0.0; N];
        let motor = rig.torque_constant * current;
        let mut torque = motor - rig.viscous * speed - self.quadratic_drag * speed * speed.abs();
        if let Some(gravity) = &self.gravity {
            torque += gravity.torque(angle);
        }
        if let Some(ripple) = &self.ripple {
            torque += ripple.torque_nm * (ripple.per_turn * angle + ripple.phase).sin();
        }
        for (place, bristle) in [(BRISTLE, &self.bristle), (BRISTLE_2, &self.second_bristle)] {
            if let Some(bristle) = bristle {
                let (friction, bend) = bristle.torque(y[place], speed, motor, angle, rig.inertia_kg_m2);
                torque -= friction;
                rate[place] = bend;
            }
        }
        rate[ANGLE] = speed;
        match &self.two {
            None => rate[SPEED] = torque / rig.inertia_kg_m2,
            Some(two) => {
                let load_drag = two.load_drag_share * rig.viscous;
                let through = two.torque(angle - y[LOAD_ANGLE], speed - y[LOAD_SPEED]);
                rate[SPEED] = (torque + load_drag * speed - through) / (rig.inertia_kg_m2 * (1.0 - two.load_share));
                rate[LOAD_ANGLE] = y[LOAD_SPEED];
                rate[LOAD_SPEED] = (through - load_drag * y[LOAD_SPEED]) / (rig.inertia_kg_m2 * two.load_share);
            }
        }
        if let Some(battery) = &self.battery {
            let drawn = if drive.enable { drive.duty * current } else { 0.0 };
            for pair in 0..2 {
                rate[PAIR + pair] = (battery.pair_ohm[pair] * drawn - y[PAIR + pair]) / battery.pair_s[pair];
            }
        }
        if let Some(heating) = &self.heating {
            let watt = current * current * rig.resistance_ohm * (1.0 + COPPER_PER_KELVIN * y[WARMTH]);
            rate[WARMTH] = (heating.kelvin_per_watt * watt - y[WARMTH]) / heating.time_s;
        }
        if self.sensor_lag_s > 0.0 {
            let shaft = if self.two.is_some() { y[LOAD_ANGLE] } else { angle };
            rate[LAGGED] = (shaft - y[LAGGED]) / self.sensor_lag_s;
        }
        rate
    }
}

/// `y + h·k`.
fn moved(y: &[f64; N], k: &[f64; N], h: f64) -> [f64; N] {
    let mut to = *y;
    for (value, rate) in to.iter_mut().zip(k) {
        *value += h * rate;
    }
    to
}

/// Solves `x = base + h·slope(x)` for a slope that falls with x: Newton inside a bracket that bisection keeps.
fn implicit(base: f64, h: f64, slope: &impl Fn(f64) -> f64) -> f64 {
    let error = |x: f64| x - base - h * slope(x);
    // The error rises at least as fast as x itself, so the root is no farther than the error is large.
    let start = error(base);
    let (mut low, mut high) = if start > 0.0 { (base - start, base) } else { (base, base - start) };
    let mut x = base;
    for _ in 0..60 {
        let e = error(x);
        if e > 0.0 {
            high = x;
        } else {
            low = x;
        }
        if e.abs() < 1e-10 || high - low < 1e-11 {
            break;
        }
        let step = 1e-7;
        let rise = (error(x + step) - e) / step;
        let newton = x - e / rise;
        x = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    x
}
