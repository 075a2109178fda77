//! The shaft: winding, gearbox with friction, gravity. Everything between the bridge's output and the angle.
//!
//! Quantities are referred to the output shaft, SI units, radians, counter-clockwise positive.
//!
//! * Winding, thesis (4.1): `L di/dt = v − R i − K ω`. `L/R` is about 10 µs, so the current is advanced by its closed
//!   form for a speed that is linear in time over the step, and the torque uses its mean over the step: the electrical
//!   time constant never forces the step.
//! * Bridge: an H-bridge with slow decay, averaged over a PWM period. Where its transistors and diodes take `drop_v` against
//!   the current, no current flows while `|v − K ω| < drop_v`, and `slope_ohm` adds to the winding's resistance.
//! * Shaft, thesis (4.2) with friction, the torques of effects `τ_e(θ)` and what else pulls at it from outside:
//!   `J dω/dt = K i − b ω − g(ω, load)·s + τ_e(θ) + τ`.
//! * Friction: Dahl's bristle (P. R. Dahl, "A solid friction model", 1968) in normalised form,
//!   `ds/dt = (ω/δ)(1 − s·sign ω)`, `|s| ≤ 1`, with `g` the level it slides at and `δ` the presliding length. One bristle
//!   carries all friction.
//!
//! The laws of friction, of the bridge's drop and of torques are the effects' ([`effects::Laws`]).
//!
//! The integrator is the implicit midpoint rule in what can be stiff (back-EMF, viscous damping, the bristle's spring)
//! and explicit in gravity: second order where the motion is smooth. Where the step is too long for the bristle's spring
//! the rule turns into backward Euler, so that a stop is a stop and no chatter; at the default robot's step that share
//! is below 1e-5. The bristle costs one Newton correction in an ordinary step; only a reversal that jumps over the
//! bristle's whole length within a step takes more.

use effects::Laws;

/// What the bridge does to the winding during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Terminals {
    /// The bridge drives: mean voltage over a PWM period before its own drop, V.
    Driven {
        /// duty × supply, V.
        voltage: f64,
    },
    /// All switches off: the current dies within microseconds and the shaft coasts.
    Open,
}

/// Parameters of the shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaft {
    /// Winding resistance R, Ω.
    pub resistance_ohm: f64,
    /// Winding inductance L, H.
    pub inductance_h: f64,
    /// K = Kt = Ke, N·m/A = V·s/rad.
    pub torque_constant: f64,
    /// Rotor, gears and load, kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous damping b, N·m·s/rad.
    pub viscous: f64,
    /// What acts beyond the linear motor.
    pub laws: Laws,
}

/// State of the shaft. A plain value.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ShaftState {
    /// Angle, rad, not wrapped.
    pub angle: f64,
    /// Speed, rad/s.
    pub speed: f64,
    /// Winding current, A.
    pub current: f64,
    /// Normalised bristle deflection, −1 … 1.
    pub bristle: f64,
}

/// What happened during one step, for energy books and sensors.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct StepMeans {
    /// Mean current, A.
    pub current: f64,
    /// Mean speed, rad/s.
    pub speed: f64,
    /// Mean friction torque (opposes motion when positive with positive speed), N·m.
    pub friction_nm: f64,
    /// Mean torque of the effects that depend on the angle, gravity among them, N·m.
    pub effects_nm: f64,
}

/// A shaft with the constants of one step length worked out.
#[derive(Clone, Copy, Debug)]
pub struct Stepper {
    shaft: Shaft,
    step: f64,
    driven: Winding,
    /// Of the bridge at zero current, V.
    drop_v: f64,
    has_friction: bool,
    /// δ, rad; one where there is no friction.
    presliding: f64,
    /// Reciprocal of the presliding length, 1/rad.
    per_presliding: f64,
    /// 1/(R + slope), A/V.
    conductance: f64,
    /// h²/(4 δ J), 1/(N·m): times a level of friction, (Ωh/2)² of the bristle's spring.
    stiffness: f64,
}

/// Response of the winding's current over one step to its excess over the settled current at the start, and to a
/// settled current that changes linearly by `Δ` over the step (back-EMF of a shaft that accelerates evenly).
#[derive(Clone, Copy, Debug)]
struct Winding {
    /// exp(−h/τ): what is left of the excess at the end.
    decay: f64,
    /// (τ/h)(1 − exp(−h/τ)): mean of the excess over the step; `1 −` this is the share of `Δ` reached at the end.
    mean_share: f64,
    /// Share of `Δ` in the mean: ½ − (τ/h)(1 − mean_share).
    ramp_mean: f64,
}

impl Winding {
    /// No inductance, or a bridge whose diodes end the current at once: the current is always the settled one.
    const SETTLED: Self = Self { decay: 0.0, mean_share: 0.0, ramp_mean: 0.5 };

    fn new(tau: f64, step: f64) -> Self {
        if tau <= 0.0 {
            return Self::SETTLED;
        }
        let ratio = step / tau;
        // −expm1 keeps the digits where the step is short against τ.
        let mean_share = -(-ratio).exp_m1() / ratio;
        let ramp_mean =
            if ratio < 1e-3 { ratio / 6.0 - ratio * ratio / 24.0 } else { 0.5 - (1.0 - mean_share) / ratio };
        Self { decay: (-ratio).exp(), mean_share, ramp_mean }
    }
}

impl Shaft {
    /// Works out what only depends on the step length (s).
    #[must_use]
    pub fn stepper(&self, step: f64) -> Stepper {
        let bridge = self.laws.bridge();
        let tau = self.inductance_h / (self.resistance_ohm + bridge.slope_ohm);
        let presliding = self.laws.presliding().unwrap_or(1.0);
        Stepper {
            shaft: *self,
            step,
            driven: Winding::new(tau, step),
            drop_v: bridge.drop_v,
            has_friction: self.laws.presliding().is_some(),
            presliding,
            per_presliding: 1.0 / presliding,
            conductance: 1.0 / (self.resistance_ohm + bridge.slope_ohm),
            stiffness: 0.25 * step * step / (presliding * self.inertia_kg_m2),
        }
    }

    /// Current once the winding has settled at a speed, A, and its slope against speed, A·s/rad.
    #[must_use]
    pub fn settled_current(&self, voltage: f64, speed: f64) -> (f64, f64) {
        let bridge = self.laws.bridge();
        self.settled(voltage, speed, bridge.drop_v, 1.0 / (self.resistance_ohm + bridge.slope_ohm))
    }

    #[inline]
    fn settled(&self, voltage: f64, speed: f64, drop_v: f64, conductance: f64) -> (f64, f64) {
        let net = voltage - self.torque_constant * speed;
        let excess = net.abs() - drop_v;
        if excess <= 0.0 {
            (0.0, 0.0)
        } else {
            (excess.copysign(net) * conductance, -self.torque_constant * conductance)
        }
    }
}

/// The bristle after sliding by `travel` (rad) in one direction: Dahl's law in closed form; and its slope, 1/rad.
#[inline]
fn slide(bristle: f64, travel: f64, per_presliding: f64) -> (f64, f64) {
    let toward = 1f64.copysign(travel);
    let left = (toward - bristle) * (-travel.abs() * per_presliding).exp();
    (toward - left, left.abs() * per_presliding)
}

impl Stepper {
    /// The parameters.
    #[must_use]
    pub fn shaft(&self) -> &Shaft {
        &self.shaft
    }

    /// The step, s.
    #[must_use]
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Advances by one step with nothing at the shaft but its own load.
    #[inline]
    pub fn advance(&self, state: &mut ShaftState, terminals: Terminals) -> StepMeans {
        self.advance_under(state, terminals, 0.0)
    }

    /// Advances by one step under a torque (N·m) on the output shaft from outside, constant over the step. The teeth
    /// carry it as they carry gravity's.
    #[inline]
    pub fn advance_under(&self, state: &mut ShaftState, terminals: Terminals, torque: f64) -> StepMeans {
        let shaft = &self.shaft;
        let (settled, slope, winding) = match terminals {
            Terminals::Driven { voltage } => {
                let (settled, slope) = shaft.settled(voltage, state.speed, self.drop_v, self.conductance);
                (settled, slope, self.driven)
            }
            Terminals::Open => (0.0, 0.0, Winding::SETTLED),
        };
        let mean_at_start_speed = settled + (state.current - settled) * winding.mean_share;
        let own = shaft.laws.torque(state.angle + 0.5 * self.step * state.speed);
        let outside = own + torque;
        let motor_at_start = shaft.torque_constant * mean_at_start_speed;
        let level_at_start =
            if self.has_friction { shaft.laws.friction_level(state.speed, motor_at_start - outside) } else { 0.0 };

        // Speed and friction count at the share `implicit` of the step: ½ is the midpoint rule, 1 backward Euler.
        let implicit = self.implicit_share(level_at_start);
        let mean_slope = slope * winding.ramp_mean / implicit;
        let motor_slope = shaft.torque_constant * mean_slope;
        let gain = implicit * self.step / shaft.inertia_kg_m2;
        let scale = gain / (1.0 + gain * (shaft.viscous - motor_slope));
        let free = state.speed + scale * (motor_at_start - shaft.viscous * state.speed + outside);
        let (speed, friction) = if self.has_friction {
            let transmitted = |speed: f64| motor_at_start + motor_slope * (speed - state.speed) - outside;
            self.with_friction(state.bristle, free, scale, implicit * self.step, level_at_start, transmitted)
        } else {
            (free, 0.0)
        };

        let gained = (speed - state.speed) / implicit;
        let travel = self.step * speed;
        if self.has_friction {
            state.bristle = slide(state.bristle, travel, self.per_presliding).0;
        }
        state.current =
            settled + (state.current - settled) * winding.decay + slope * gained * (1.0 - winding.mean_share);
        state.angle += travel;
        state.speed += gained;
        StepMeans {
            current: mean_at_start_speed + slope * winding.ramp_mean * gained,
            speed,
            friction_nm: friction,
            effects_nm: own,
        }
    }

    /// ½ for a bristle that the step resolves, towards 1 for one that it does not: with Ω² = g/(δ J) of the spring at
    /// rest and q = (Ωh/2)², `½ + ½ q²/(1 + q²)`. The departure from ½ falls with h⁴ and leaves the order alone.
    #[inline]
    fn implicit_share(&self, level: f64) -> f64 {
        let q = self.stiffness * level;
        let square = (q * q).min(1e12);
        0.5 + 0.5 * square / (1.0 + square)
    }

    /// The speed ω that solves `ω = free − scale·g·s(time·ω)`, s being the bristle after that travel, and the friction
    /// torque there. The right side falls with ω, so there is one solution; it lies within `scale·g` of `free`.
    #[inline]
    fn with_friction(
        &self,
        bristle: f64,
        free: f64,
        scale: f64,
        time: f64,
        level_at_start: f64,
        transmitted: impl Fn(f64) -> f64,
    ) -> (f64, f64) {
        let mut guess = free - scale * level_at_start * bristle;
        let level = self.shaft.laws.friction_level(guess, transmitted(guess));
        let (mut low, mut high) = (free - scale * level, free + scale * level);
        // Not `clamp`: a fit may try parameters that are NaN, and must see NaN come back instead of a panic.
        guess = guess.max(low).min(high);
        // The bristle's law bends over its length: within a tenth of it the tangent is as good as the rule itself.
        let close = 0.1 * self.presliding;
        for _ in 0..MAX_CORRECTIONS {
            let (now, now_slope) = slide(bristle, time * guess, self.per_presliding);
            let excess = guess - free + scale * level * now;
            if excess > 0.0 {
                high = guess;
            } else {
                low = guess;
            }
            let slope = level * now_slope * time;
            let newton = guess - excess / (1.0 + scale * slope);
            if time * (newton - guess).abs() <= close {
                return (newton, level * now + slope * (newton - guess));
            }
            guess = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        }
        let torque = level * slide(bristle, time * guess, self.per_presliding).0;
        (free - scale * torque, torque)
    }
}

/// Bisection alone narrows the bracket by 2⁶⁰; an ordinary step needs one correction.
const MAX_CORRECTIONS: usize = 60;
