//! The truth's integrator: classical Runge–Kutta on the mechanics at about 16 µs, staggered with an implicit,
//! L-stable step of the winding's current (L/R is some 10 µs and a diode's knee is stiffer still).
//!
//! Mechanics sees the current of the middle of a step, the winding sees a speed that changes as it did in the last
//! step: second order although the winding is stiff.

use super::laws::{
    Battery, Bias, Bridge, Bristle, COPPER_PER_KELVIN, CommandDrop, Deadband, Discharge, Drag, Gravity, Grease,
    Heating, Loss, Ripple, TwoInertias,
};
use super::rig::Rig;

/// Everything that moves the shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// The specimen's own numbers.
    pub rig: Rig,
    /// Frictions beside each other, [`BRISTLES`] at most.
    pub bristles: Vec<Bristle>,
    /// How long the frictions that remember the load do so, s.
    pub load_memory_s: f64,
    /// Gravity.
    pub gravity: Option<Gravity>,
    /// A constant torque.
    pub bias: Option<Bias>,
    /// Ripple of the teeth.
    pub ripple: Option<Ripple>,
    /// Drags by powers of the speed.
    pub drags: Vec<Drag>,
    /// What the damping loses as it works.
    pub grease: Option<Grease>,
    /// Play or a soft shaft.
    pub two: Option<TwoInertias>,
    /// The bridge by the phases of its period; `None` loses nothing.
    pub bridge: Option<Bridge>,
    /// What else is lost against the current.
    pub losses: Vec<Loss>,
    /// What is lost of the commanded voltage whichever way the current flows.
    pub command_drop: Option<CommandDrop>,
    /// Duties that do nothing.
    pub deadband: Option<Deadband>,
    /// The cell; `None` is a stiff bench supply.
    pub battery: Option<Battery>,
    /// How the supply falls with its charge.
    pub discharge: Option<Discharge>,
    /// Warm winding.
    pub heating: Option<Heating>,
    /// How late the bridge follows its command.
    pub latency: Option<Latency>,
    /// A lag of the sensor.
    pub lag: Option<Lag>,
    /// A belt between shaft and sensor: by this share of its way it creeps back at the stall torque.
    pub belt_creep: f64,
}

/// How a sensor follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag {
    /// In all, s.
    pub time_s: f64,
    /// By two poles of half of it each instead of one.
    pub second_order: bool,
}

/// How late a command arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latency {
    /// s.
    pub time_s: f64,
    /// Standard deviation, as a share of it.
    pub jitter: f64,
}

/// Most frictions.
pub const BRISTLES: usize = 4;
/// Number of mechanical states.
const N: usize = 18;
/// Places in the state vector.
const ANGLE: usize = 0;
const SPEED: usize = 1;
const BRISTLE: usize = 2; // four places
const LOAD_ANGLE: usize = 6;
const LOAD_SPEED: usize = 7;
const PAIR: usize = 8; // two places
const WARMTH: usize = 10; // two places: winding and housing
const LAGGED: usize = 12; // two places: what is read, and what is before it
const CHARGE: usize = 14;
const GREASE: usize = 15;
const LOAD: usize = 16; // the torque that frictions remember
const CREPT: usize = 17;

/// The truth at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    mechanics: [f64; N],
    /// Since the start, s.
    time: f64,
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
            bristles: Vec::new(),
            load_memory_s: 1.0,
            gravity: None,
            bias: None,
            ripple: None,
            drags: Vec::new(),
            grease: None,
            two: None,
            bridge: None,
            losses: Vec::new(),
            command_drop: None,
            deadband: None,
            battery: None,
            discharge: None,
            heating: None,
            latency: None,
            lag: None,
            belt_creep: 0.0,
        }
    }

    /// At rest, cold, charged, at an angle.
    #[must_use]
    pub fn rest(&self, angle: f64) -> State {
        let mut mechanics = [0.0; N];
        mechanics[ANGLE] = angle;
        mechanics[LOAD_ANGLE] = angle;
        mechanics[LAGGED] = angle;
        mechanics[LAGGED + 1] = angle;
        State { mechanics, time: 0.0, acceleration: 0.0, current: 0.0 }
    }

    /// What the sensor's axis shows before its own errors, rad: the load's angle behind play, lagged where it lags, less
    /// what a belt has crept.
    #[must_use]
    pub fn shown_angle(&self, state: &State) -> f64 {
        let shown = if self.lag.is_some() { state.mechanics[LAGGED] } else { self.shaft_angle(state) };
        shown - state.mechanics[CREPT]
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

    /// Whether a bristle bends.
    #[must_use]
    pub fn has_friction(&self) -> bool {
        !self.bristles.is_empty()
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

    /// Warmth's share in the winding's resistance.
    fn warm(&self, y: &[f64; N]) -> f64 {
        self.heating.map_or(1.0, |_| 1.0 + COPPER_PER_KELVIN * (y[WARMTH] + y[WARMTH + 1]))
    }

    /// The winding over `h`; the speed is known `-from` after the beginning.
    fn wind(&self, state: &mut State, drive: Drive, h: f64, from: f64) {
        let rig = &self.rig;
        let resistance = rig.resistance_ohm * self.warm(&state.mechanics);
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
        let duty = self.deadband.map_or(drive.duty, |deadband| deadband.through(drive.duty));
        let (relaxed, series) = self.battery.map_or((0.0, 0.0), |battery| {
            (state.mechanics[PAIR] + state.mechanics[PAIR + 1], battery.series_ohm * duty * duty)
        });
        let fallen = self.discharge.map_or(0.0, |discharge| discharge.fallen(state.mechanics[CHARGE]));
        let asked = duty * (rig.rail_v - relaxed - fallen);
        let net = self.command_drop.map_or(asked, |drop| drop.through(asked, duty)) - emf;
        let resistance = resistance + series;
        if self.bridge.is_none() && self.losses.is_empty() {
            // Exact for a net voltage that changes linearly: the current follows it a time constant behind.
            let behind = emf_rate * rig.inductance_h / resistance;
            let (start, end) = ((net + behind) / resistance, (net - emf_rate * h + behind) / resistance);
            state.current = end + (state.current - start) * (-h * resistance / rig.inductance_h).exp();
            return;
        }
        // SDIRK2 with γ = 1 − 1/√2 (Alexander 1977): L-stable, second order.
        let gamma = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
        let drop = |i: f64| {
            let of_phases = self.bridge.map_or(0.0, |bridge| bridge.drop(i, duty));
            of_phases + self.losses.iter().map(|loss| loss.drop(i, duty)).sum::<f64>()
        };
        let slope = |i: f64, t: f64| (net - emf_rate * t - resistance * i - drop(i)) / rig.inductance_h;
        let first = implicit(state.current, gamma * h, &|i| slope(i, gamma * h));
        let base = state.current + (1.0 - gamma) * (first - state.current) / gamma;
        state.current = implicit(base, gamma * h, &|i| slope(i, h));
    }

    /// Mechanics, battery and warmth over `h` with the current held: classical Runge–Kutta.
    fn turn(&self, state: &mut State, drive: Drive, h: f64) {
        let (current, time) = (state.current, state.time);
        let y = state.mechanics;
        let k1 = self.rates(&y, current, drive, time);
        let k2 = self.rates(&moved(&y, &k1, 0.5 * h), current, drive, time + 0.5 * h);
        let k3 = self.rates(&moved(&y, &k2, 0.5 * h), current, drive, time + 0.5 * h);
        let k4 = self.rates(&moved(&y, &k3, h), current, drive, time + h);
        for (n, value) in state.mechanics.iter_mut().enumerate() {
            *value += h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]);
        }
        state.time += h;
        state.acceleration = (state.mechanics[SPEED] - y[SPEED]) / h;
    }

    /// Time derivatives of the mechanics and of what is as slow.
    fn rates(&self, y: &[f64; N], current: f64, drive: Drive, time: f64) -> [f64; N] {
        let mut rate = [0.0; N];
        self.move_shaft(y, current, time, &mut rate);
        self.wear_out(y, current, drive, &mut rate);
        self.follow(y, current, &mut rate);
        rate
    }

    /// Angles, speeds and bristles.
    fn move_shaft(&self, y: &[f64; N], current: f64, time: f64, rate: &mut [f64; N]) {
        let rig = &self.rig;
        let (angle, speed) = (y[ANGLE], y[SPEED]);
        let motor = rig.torque_constant * current;
        let viscous = rig.viscous * self.grease.map_or(1.0, |grease| grease.left(y[GREASE]));
        let mut against = viscous * speed + self.drags.iter().map(|drag| drag.torque(speed)).sum::<f64>();
        for (bristle, place) in self.bristles.iter().zip(BRISTLE..) {
            let load = if bristle.remembers_load { y[LOAD] } else { motor };
            let (friction, bend) = bristle.torque(y[place], speed, load, angle, rig.inertia_kg_m2);
            against += friction;
            rate[place] = bend;
        }
        let pulls = self.gravity.map_or(0.0, |gravity| gravity.torque(angle, speed))
            + self.bias.map_or(0.0, |bias| bias.torque(angle, time))
            + self.ripple.map_or(0.0, |ripple| ripple.torque(angle));
        let torque = motor + pulls - against;
        rate[ANGLE] = speed;
        match &self.two {
            None => rate[SPEED] = torque / rig.inertia_kg_m2,
            Some(two) => {
                let load_drag = two.load_drag_share * viscous;
                let through = two.torque(angle - y[LOAD_ANGLE], speed - y[LOAD_SPEED]);
                rate[SPEED] = (torque + load_drag * speed - through) / (rig.inertia_kg_m2 * (1.0 - two.load_share));
                rate[LOAD_ANGLE] = y[LOAD_SPEED];
                rate[LOAD_SPEED] = (through - load_drag * y[LOAD_SPEED]) / (rig.inertia_kg_m2 * two.load_share);
            }
        }
        if let Some(grease) = &self.grease {
            rate[GREASE] = (grease.thinning_per_w * against * speed - y[GREASE]) / grease.time_s;
        }
        rate[LOAD] = (motor.abs() - y[LOAD]) / self.load_memory_s;
    }

    /// Charge, cells and warmth.
    fn wear_out(&self, y: &[f64; N], current: f64, drive: Drive, rate: &mut [f64; N]) {
        let drawn = if drive.enable { drive.duty * current } else { 0.0 };
        rate[CHARGE] = drawn;
        if let Some(battery) = &self.battery {
            for pair in 0..2 {
                rate[PAIR + pair] = (battery.pair_ohm[pair] * drawn - y[PAIR + pair]) / battery.pair_s[pair];
            }
        }
        if let Some(heating) = &self.heating {
            let watt = current * current * self.rig.resistance_ohm * self.warm(y);
            rate[WARMTH] = (heating.kelvin_per_watt * watt - y[WARMTH]) / heating.time_s;
            rate[WARMTH + 1] = (heating.housing_kelvin_per_watt * watt - y[WARMTH + 1]) / heating.housing_s;
        }
    }

    /// What lies between the shaft and the sensor.
    fn follow(&self, y: &[f64; N], current: f64, rate: &mut [f64; N]) {
        let (shaft, speed) = if self.two.is_some() { (y[LOAD_ANGLE], y[LOAD_SPEED]) } else { (y[ANGLE], y[SPEED]) };
        match self.lag {
            None => {}
            Some(Lag { time_s, second_order: false }) => rate[LAGGED] = (shaft - y[LAGGED]) / time_s,
            Some(Lag { time_s, second_order: true }) => {
                rate[LAGGED + 1] = (shaft - y[LAGGED + 1]) / (0.5 * time_s);
                rate[LAGGED] = (y[LAGGED + 1] - y[LAGGED]) / (0.5 * time_s);
            }
        }
        if self.belt_creep != 0.0 {
            let share = self.rig.torque_constant * current / self.rig.stall_torque();
            rate[CREPT] = self.belt_creep * share * speed.abs();
        }
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
