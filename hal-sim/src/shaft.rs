//! The shaft: winding, gearbox with friction, gravity. Everything between the bridge's output and the angle.
//!
//! Quantities are referred to the output shaft, SI units, radians, counter-clockwise positive.
//!
//! * Winding, thesis (4.1): `L di/dt = v − R i − K ω`. `L/R` is about 10 µs, so the current is advanced by its closed
//!   form for a speed that is linear in time over the step, and the torque uses its mean over the step: the electrical
//!   time constant never forces the step.
//! * Bridge: an H-bridge with slow decay, averaged over a PWM period. Where its transistors and diodes take `drop_v` against
//!   the current, no current flows while `|v − K ω| < drop_v`, and `slope_ohm` adds to the winding's resistance. Of a current
//!   below a loss's knee, that loss is one more resistance.
//! * Shaft, thesis (4.2) with friction, the torques of effects `τ_e(θ)` and what else pulls at it from outside:
//!   `J dω/dt = K i − b ω − g(ω, load)·s + τ_e(θ) + τ`.
//! * Friction: Dahl's bristle (P. R. Dahl, "A solid friction model", 1968) in normalised form,
//!   `ds/dt = (ω/δ)(1 − s·sign ω)`, `|s| ≤ 1`, with `g` the level it slides at and `δ` the presliding length. One bristle
//!   carries all friction. Where it slides higher one way than the other, `g·s` is `g·s + l·s²`: `g ± l` at the ends, and
//!   no jump between them.
//! * Drag beyond the viscous one, `c₂ ω|ω| + c₃ ω³`, by its tangent at the start of the step.
//! * A load behind a spring with play ([`effects::Coupling`]): angle and speed are the load's, where the sensor sits, and
//!   the motor is a twist ahead. Friction and drag act on the motor, the torques `τ_e` and `τ` on the load, and the viscous
//!   damping on both by its shares. See `Stepper::advance_coupled`.
//!
//! The laws of friction, of the bridge's drop and of torques are the effects' ([`effects::Laws`]).
//!
//! The integrator is the implicit midpoint rule in what can be stiff (back-EMF, viscous damping, the bristle's spring)
//! and explicit in gravity: second order where the motion is smooth. Where the step is too long for the bristle's spring
//! the rule turns into backward Euler, so that a stop is a stop and no chatter; at the default robot's step that share
//! is below 1e-5. The bristle costs one Newton correction in an ordinary step; only a reversal that jumps over the
//! bristle's whole length within a step takes more.

use effects::{BridgeDrop, Coupling, Drag, Laws, States};

/// What the bridge does to the winding during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Terminals {
    /// The bridge drives: mean voltage over a PWM period before its own drop, V.
    Driven {
        /// duty × supply, V.
        voltage: f64,
    },
    /// The same of a bridge that takes a part of its supply while it switches, beside its own drop.
    Switched {
        /// duty × supply, V.
        voltage: f64,
        /// What a current beyond its knee loses by switching, beside the bridge's own drop, V.
        switching_v: f64,
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
    /// How far the motor is ahead of a load behind a spring, rad; 0 on a rigid shaft.
    pub twist: f64,
    /// How much faster the motor is, rad/s; 0 on a rigid shaft.
    pub twist_rate: f64,
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
    /// Mean power that friction, damping and drag turn into heat, W.
    pub rubbing_w: f64,
    /// Mean torque from the motor to a load behind a spring, N·m; 0 on a rigid shaft.
    pub coupling_nm: f64,
}

/// A shaft with the constants of one step length worked out.
#[derive(Clone, Copy, Debug)]
pub struct Stepper {
    shaft: Shaft,
    /// What a call advances by, s.
    whole_step: f64,
    /// What the equations are solved over, s: the same, or a part of it for a load behind a spring.
    part: f64,
    /// Of what the motor turns by itself, kg·m².
    inertia: f64,
    /// Share of the viscous damping that acts on the motor, 1.
    drag_share: f64,
    coupled: Option<Coupled>,
    driven: Winding,
    bridge: BridgeDrop,
    /// The bridge takes a part of its supply or of its pulses.
    takes_of_supply: bool,
    has_friction: bool,
    /// Friction slides this much higher counter-clockwise, and lower clockwise, N·m.
    lean: f64,
    /// None where there is none.
    drag: Option<Drag>,
    /// Electrical time constant of the winding behind its bridge, s.
    tau: f64,
    /// δ, rad; one where there is no friction.
    presliding: f64,
    /// Reciprocal of the presliding length, 1/rad.
    per_presliding: f64,
    /// 1/(R + slope), A/V.
    conductance: f64,
    /// h²/(4 δ J), 1/(N·m): times a level of friction, (Ωh/2)² of the bristle's spring.
    stiffness: f64,
}

/// A load behind a spring, with the constants of one step length worked out.
#[derive(Clone, Copy, Debug)]
struct Coupled {
    law: Coupling,
    /// Parts that a step is cut into.
    parts: usize,
    /// Of the load, kg·m².
    inertia: f64,
    /// Of the spring, N·m·s/rad.
    damping: f64,
    /// Depth in the spring at which it is damped in full, rad; 0 without play.
    damped_depth: f64,
}

/// The winding and the level of friction at the start of a step.
#[derive(Clone, Copy, Debug)]
struct Begun {
    settled: f64,
    slope: f64,
    winding: Winding,
    mean_at_start_speed: f64,
    motor_at_start: f64,
    level: f64,
    /// Share of the step at which speed and friction count: ½ is the midpoint rule, 1 backward Euler.
    implicit: f64,
    motor_slope: f64,
    /// Speed per torque, mean over the step, rad/s/(N·m).
    scale: f64,
    /// Damping and drag at the start, N·m, and their slope, N·m·s/rad.
    resisting: f64,
    damping: f64,
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

/// Beyond this, 1 − exp(−x) is 1 in an `f64`.
const WHOLE: f64 = 38.0;
/// Up to this, 1 − exp(−x) would lose digits that −expm1(−x) keeps.
const SHORT: f64 = 0.5;

impl Winding {
    /// No inductance, or a bridge whose diodes end the current at once: the current is always the settled one.
    const SETTLED: Self = Self { decay: 0.0, mean_share: 0.0, ramp_mean: 0.5 };

    fn new(tau: f64, step: f64) -> Self {
        if tau <= 0.0 {
            return Self::SETTLED;
        }
        let ratio = step / tau;
        let decay = if ratio > WHOLE { 0.0 } else { (-ratio).exp() };
        let reached = if ratio > SHORT { 1.0 - decay } else { -(-ratio).exp_m1() };
        let mean_share = reached / ratio;
        let ramp_mean =
            if ratio < 1e-3 { ratio / 6.0 - ratio * ratio / 24.0 } else { 0.5 - (1.0 - mean_share) / ratio };
        Self { decay, mean_share, ramp_mean }
    }
}

/// Natural frequency of a spring times the part of a step within which it is followed, rad.
const FOLLOWED: f64 = 0.3;
/// Most parts that a step is cut into. A spring that is stiffer still stays stable, and damped as it should.
const MOST_PARTS: f64 = 64.0;
/// Depth in the teeth at which they are damped in full: rad, or as a share of the half gap where that is less: at their first touch
/// nothing jumps. How deep they are damped decides how long they go on bouncing, so it is less than what any blow reaches.
const DAMPED_DEPTH: f64 = 5e-4;
const DAMPED_SHARE: f64 = 0.1;

impl Coupled {
    fn new(law: Coupling, inertia: f64, step: f64) -> Self {
        let load = law.load_share * inertia;
        let reduced = load * (1.0 - law.load_share);
        let natural = (law.stiffness / reduced).sqrt();
        Self {
            law,
            // A NaN that a fit tries becomes one part, and comes back as NaN.
            parts: (step * natural / FOLLOWED).ceil().clamp(1.0, MOST_PARTS) as usize,
            inertia: load,
            damping: 2.0 * law.damping_ratio * reduced * natural,
            damped_depth: DAMPED_DEPTH.min(DAMPED_SHARE * law.half_gap),
        }
    }

    /// Into the spring by this much, rad: a dead zone over the play.
    #[inline]
    fn depth(&self, twist: f64) -> f64 {
        twist - twist.max(-self.law.half_gap).min(self.law.half_gap)
    }

    /// Mean torque to the load (N·m) where the twist goes from one to another (rad) within a time (s).
    ///
    /// The spring's part is its energy's change over the twist's change (discrete gradient: Gonzalez, J. Nonlinear Sci. 6,
    /// 1996), so that no step makes energy however long it is. Teeth push and do not pull: damping takes at most what the
    /// spring gives.
    ///
    /// Beside it, its slope against where the twist goes to, N·m/rad.
    #[inline]
    fn torque(&self, from: f64, to: f64, time: f64) -> (f64, f64) {
        let Coupling { stiffness, hardening, .. } = self.law;
        let damping = self.damping / time;
        // Of a mean of two depths (rad), and its slope against the second.
        let mean = |from: f64, to: f64| {
            let harder = 1.0 + 0.5 * hardening * (from * from + to * to);
            (0.5 * stiffness * harder * (from + to), 0.5 * stiffness * (harder + hardening * to * (from + to)))
        };
        if self.law.half_gap <= 0.0 {
            let (spring, slope) = mean(from, to);
            return (spring + damping * (to - from), slope + damping);
        }
        let (before, after) = (self.depth(from), self.depth(to));
        let turned = to - from;
        // Between two teeth that touch, the quotient of the differences is known without taking it.
        let (spring, slope) = if before * after > 0.0 || turned.abs() <= 1e-12 {
            let (spring, slope) = mean(before, after);
            (spring, if after == 0.0 { 0.0 } else { slope })
        } else {
            let energy = |depth: f64| 0.5 * stiffness * depth * depth * (1.0 + 0.5 * hardening * depth * depth);
            let spring = (energy(after) - energy(before)) / turned;
            (spring, (stiffness * after * (1.0 + hardening * after * after) - spring) / turned)
        };
        // The deeper end's: by the mean of both, teeth that leave faster might be braked less, and there could be more than one rate.
        let depth = before.abs().max(after.abs()) / self.damped_depth;
        let damper = damping * depth.min(1.0) * turned;
        if spring * damper < 0.0 && damper.abs() > spring.abs() {
            return (0.0, 0.0);
        }
        let grows = depth < 1.0 && after.abs() > before.abs();
        let deeper = if grows { turned * after.signum() / self.damped_depth } else { 0.0 };
        (spring + damper, slope + damping * (depth.min(1.0) + deeper))
    }
}

impl Shaft {
    /// Works out what does not change from step to step of a length (s).
    #[must_use]
    pub fn stepper(&self, step: f64) -> Stepper {
        let bridge = self.laws.bridge();
        let presliding = self.laws.presliding().unwrap_or(1.0);
        let drag = self.laws.drag();
        let mut stepper = Stepper {
            shaft: *self,
            whole_step: step,
            part: step,
            inertia: self.inertia_kg_m2,
            drag_share: self.laws.coupling().map_or(1.0, |law| 1.0 - law.load_drag_share),
            coupled: self.laws.coupling().map(|law| Coupled::new(law, self.inertia_kg_m2, step)),
            driven: Winding::SETTLED,
            bridge,
            tau: self.inductance_h / (self.resistance_ohm + bridge.slope_ohm),
            takes_of_supply: bridge.of_supply > 0.0 || bridge.of_command_v > 0.0,
            has_friction: self.laws.presliding().is_some(),
            lean: self.laws.friction_lean(),
            drag: (drag != Drag::default()).then_some(drag),
            presliding,
            per_presliding: 1.0 / presliding,
            conductance: 1.0 / (self.resistance_ohm + bridge.slope_ohm),
            stiffness: 0.0,
        };
        stepper.set_step(step);
        stepper
    }

    /// Current once the winding has settled at a speed, A, and its slope against speed, A·s/rad, behind a bridge that takes
    /// this much (V) by switching.
    #[must_use]
    pub fn settled_current(&self, voltage: f64, speed: f64, switching_v: f64) -> (f64, f64) {
        let bridge = self.laws.bridge();
        self.settled(voltage, speed, &bridge, switching_v, 1.0 / (self.resistance_ohm + bridge.slope_ohm))
    }

    #[inline]
    fn settled(&self, voltage: f64, speed: f64, bridge: &BridgeDrop, switching_v: f64, conductance: f64) -> (f64, f64) {
        let net = voltage - self.torque_constant * speed;
        let (current, slope) = bridge.current(net.abs(), switching_v, conductance);
        if slope == 0.0 { (0.0, 0.0) } else { (current.copysign(net), -self.torque_constant * slope) }
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
        self.whole_step
    }

    /// Goes on as warm as the effects of a cold shaft remember.
    pub fn warm(&mut self, cold: &Shaft, states: &States) {
        let Shaft { resistance_ohm, viscous, .. } = cold;
        self.shaft.resistance_ohm = resistance_ohm * cold.laws.resistance_factor(states);
        self.shaft.viscous = viscous * cold.laws.viscous_factor(states);
        self.tau = self.shaft.inductance_h / (self.shaft.resistance_ohm + self.bridge.slope_ohm);
        self.conductance = 1.0 / (self.shaft.resistance_ohm + self.bridge.slope_ohm);
        self.driven = Winding::new(self.tau, self.part);
    }

    /// Goes on with steps of another length (s).
    pub fn set_step(&mut self, step: f64) {
        let whole = self.shaft.inertia_kg_m2;
        (self.whole_step, self.part, self.inertia) = (step, step, whole);
        self.coupled = self.coupled.map(|coupled| Coupled::new(coupled.law, whole, step));
        if let Some(coupled) = &self.coupled {
            (self.part, self.inertia) = (step / coupled.parts as f64, whole - coupled.inertia);
        }
        self.driven = Winding::new(self.tau, self.part);
        self.stiffness = 0.25 * self.part * self.part / (self.presliding * self.inertia);
    }

    /// What a bridge that drives with a duty (−1 … 1) at a supply (V) does to the winding.
    #[inline]
    #[must_use]
    pub fn terminals(&self, duty: f64, supply_v: f64) -> Terminals {
        if !self.takes_of_supply {
            return Terminals::Driven { voltage: duty * supply_v };
        }
        let voltage = self.bridge.commanded(duty, supply_v);
        Terminals::Switched { voltage, switching_v: self.bridge.of_switched(duty) * supply_v }
    }

    /// Speed of the motor, rad/s: the shaft's, but for a load behind a spring.
    #[inline]
    #[must_use]
    pub fn motor_speed(&self, state: &ShaftState) -> f64 {
        if self.coupled.is_some() { state.speed + state.twist_rate } else { state.speed }
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
        if let Some(coupled) = &self.coupled {
            return self.advance_coupled(coupled, state, terminals, torque);
        }
        let own = self.shaft.laws.torque(state.angle + 0.5 * self.part * state.speed);
        let outside = own + torque;
        let begun = self.begin(state.angle, state.speed, state.current, terminals, outside);
        let (speed, friction) = self.solve(&begun, state.angle, state.speed, state.bristle, outside);
        let gained = (speed - state.speed) / begun.implicit;
        let travel = self.part * speed;
        let mut means = self.finish(&begun, state, speed, gained, friction);
        state.angle += travel;
        state.speed += gained;
        means.effects_nm = own;
        means
    }

    /// Winding, damping and friction at the start of a step of the motor, at its angle (rad), speed (rad/s) and current (A),
    /// under a torque (N·m) from outside.
    #[inline]
    fn begin(&self, angle: f64, start_speed: f64, current: f64, terminals: Terminals, outside: f64) -> Begun {
        let shaft = &self.shaft;
        let (settled, slope, winding) = match terminals {
            Terminals::Driven { voltage } => {
                let (settled, slope) = shaft.settled(voltage, start_speed, &self.bridge, 0.0, self.conductance);
                (settled, slope, self.driven)
            }
            Terminals::Switched { voltage, switching_v } => {
                let (settled, slope) = shaft.settled(voltage, start_speed, &self.bridge, switching_v, self.conductance);
                (settled, slope, self.driven)
            }
            Terminals::Open => (0.0, 0.0, Winding::SETTLED),
        };
        let mean_at_start_speed = settled + (current - settled) * winding.mean_share;
        let motor_at_start = shaft.torque_constant * mean_at_start_speed;
        let level = if self.has_friction {
            shaft.laws.friction_level(angle, start_speed, motor_at_start - outside)
        } else {
            0.0
        };

        // Speed and friction count at the share `implicit` of the step: ½ is the midpoint rule, 1 backward Euler.
        let implicit = self.implicit_share(level);
        let mean_slope = slope * winding.ramp_mean / implicit;
        let motor_slope = shaft.torque_constant * mean_slope;
        let gain = implicit * self.part / self.inertia;
        let viscous = self.drag_share * shaft.viscous;
        let (resisting, damping) = match &self.drag {
            None => (viscous * start_speed, viscous),
            Some(drag) => {
                let (torque, slope) = drag.torque(start_speed);
                (viscous * start_speed + torque, viscous + slope)
            }
        };
        let scale = gain / (1.0 + gain * (damping - motor_slope));
        Begun {
            settled,
            slope,
            winding,
            mean_at_start_speed,
            motor_at_start,
            level,
            implicit,
            motor_slope,
            scale,
            resisting,
            damping,
        }
    }

    /// The motor's speed at the share `implicit` of a step that it begins at an angle (rad), a speed (rad/s) and a bristle,
    /// under a torque (N·m) from outside; and its friction, N·m.
    #[inline]
    fn solve(&self, begun: &Begun, angle: f64, start_speed: f64, bristle: f64, outside: f64) -> (f64, f64) {
        let free = start_speed + begun.scale * (begun.motor_at_start - begun.resisting + outside);
        if !self.has_friction {
            return (free, 0.0);
        }
        let level = |speed: f64| {
            let transmitted = begun.motor_at_start + begun.motor_slope * (speed - start_speed) - outside;
            self.shaft.laws.friction_level(angle + 0.5 * self.part * speed, speed, transmitted)
        };
        self.with_friction(bristle, free, begun.scale, begun.implicit * self.part, begun.level, level)
    }

    /// The current and the bristle after a step at a motor's speed (rad/s) that has gained this much (rad/s) against a
    /// friction (N·m); what happened in it.
    #[inline]
    fn finish(&self, begun: &Begun, state: &mut ShaftState, speed: f64, gained: f64, friction: f64) -> StepMeans {
        let Begun { settled, slope, winding, .. } = begun;
        if self.has_friction {
            state.bristle = slide(state.bristle, self.part * speed, self.per_presliding).0;
        }
        state.current =
            settled + (state.current - settled) * winding.decay + slope * gained * (1.0 - winding.mean_share);
        let resisting = begun.resisting + begun.damping * gained * begun.implicit;
        StepMeans {
            current: begun.mean_at_start_speed + slope * winding.ramp_mean * gained,
            speed,
            friction_nm: friction,
            effects_nm: 0.0,
            rubbing_w: (resisting + friction) * speed,
            coupling_nm: 0.0,
        }
    }

    /// A step of a motor and of a load behind a spring with play, in parts that follow the spring.
    ///
    /// Over a part each of the two takes the midpoint rule under the spring's mean torque ([`Coupled::torque`]), which
    /// depends on where both end. The difference of their speeds has one solution, for the spring never falls with the
    /// twist: Newton inside a bracket.
    #[inline(never)]
    fn advance_coupled(
        &self,
        coupled: &Coupled,
        state: &mut ShaftState,
        terminals: Terminals,
        torque: f64,
    ) -> StepMeans {
        let mut sum = StepMeans::default();
        for _ in 0..coupled.parts {
            let one = self.advance_part(coupled, state, terminals, torque);
            for (sum, one) in [
                (&mut sum.current, one.current),
                (&mut sum.speed, one.speed),
                (&mut sum.friction_nm, one.friction_nm),
                (&mut sum.effects_nm, one.effects_nm),
                (&mut sum.rubbing_w, one.rubbing_w),
                (&mut sum.coupling_nm, one.coupling_nm),
            ] {
                *sum += one / coupled.parts as f64;
            }
        }
        sum
    }

    fn advance_part(&self, coupled: &Coupled, state: &mut ShaftState, terminals: Terminals, torque: f64) -> StepMeans {
        let step = self.part;
        let own = self.shaft.laws.torque(state.angle + 0.5 * step * state.speed);
        let outside = own + torque;
        let (motor_angle, motor_speed) = (state.angle + state.twist, state.speed + state.twist_rate);
        let mut rate = state.twist_rate;
        let (mut passed, mut slope) = coupled.torque(state.twist, state.twist + step * rate, step);
        let begun = self.begin(motor_angle, motor_speed, state.current, terminals, -passed);
        let load_drag = coupled.law.load_drag_share * self.shaft.viscous;
        let gain = 0.5 * step / coupled.inertia;
        let damped = 1.0 + gain * load_drag;
        let per_torque = gain / damped;
        let speeds = |passed: f64| {
            let (motor, friction) = self.solve(&begun, motor_angle, motor_speed, state.bristle, -passed);
            (motor, friction, state.speed / damped + per_torque * (outside + passed))
        };
        // The excess of a rate over what its torque leaves rises at least as fast as the rate: the root is no farther than
        // the excess.
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        // The last rates tried below and above the root. No step goes back to them: across a touch, from each of two the slope may point
        // to the other.
        let mut tried = [f64::NAN; 2];
        let mut found = speeds(passed);
        for _ in 0..MAX_CORRECTIONS {
            let excess = rate - (found.0 - found.2);
            if excess.is_nan() || excess.abs() <= PRECISE * (1.0 + rate.abs()) {
                break;
            }
            tried[usize::from(excess > 0.0)] = rate;
            if excess > 0.0 {
                (low, high) = (low.max(rate - excess), rate);
            } else {
                (low, high) = (rate, high.min(rate - excess));
            }
            let newton = rate - excess / (1.0 + slope.max(0.0) * step * (begun.scale + per_torque));
            // Within the play the root is the bracket's end itself.
            let is_new = (low..=high).contains(&newton) && !tried.contains(&newton);
            rate = if is_new { newton } else { 0.5 * (low + high) };
            let before = passed;
            (passed, slope) = coupled.torque(state.twist, state.twist + step * rate, step);
            // Within the play nothing is passed whatever the rate.
            if passed != before {
                found = speeds(passed);
            }
        }
        let (motor, friction, load) = found;
        let gained = (motor - motor_speed) / begun.implicit;
        let mut means = self.finish(&begun, state, motor, gained, friction);
        means.rubbing_w += load_drag * load * load;
        state.twist += step * (motor - load);
        state.angle += step * load;
        state.speed += 2.0 * (load - state.speed);
        state.twist_rate = motor_speed + gained - state.speed;
        (means.speed, means.effects_nm, means.coupling_nm) = (load, own, passed);
        means
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
        level: impl Fn(f64) -> f64,
    ) -> (f64, f64) {
        let mut guess = free - self.friction(scale, level_at_start, bristle);
        let level = level(guess);
        let most = scale * (level + self.lean.abs());
        let (mut low, mut high) = (free - most, free + most);
        // Not `clamp`: a fit may try parameters that are NaN, and must see NaN come back instead of a panic.
        guess = guess.max(low).min(high);
        // The bristle's law bends over its length: within a tenth of it the tangent is as good as the rule itself.
        let close = 0.1 * self.presliding;
        for _ in 0..MAX_CORRECTIONS {
            let (now, now_slope) = slide(bristle, time * guess, self.per_presliding);
            let excess = guess - free + self.friction(scale, level, now);
            if excess > 0.0 {
                high = guess;
            } else {
                low = guess;
            }
            let slope = self.stiffness(level, now) * now_slope * time;
            let newton = guess - excess / (1.0 + scale * slope);
            if time * (newton - guess).abs() <= close {
                return (newton, self.friction(1.0, level, now) + slope * (newton - guess));
            }
            guess = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        }
        let torque = self.friction(1.0, level, slide(bristle, time * guess, self.per_presliding).0);
        (free - scale * torque, torque)
    }

    /// Torque of a bristle at a level (N·m), times a factor.
    #[inline]
    fn friction(&self, factor: f64, level: f64, bristle: f64) -> f64 {
        if self.lean == 0.0 { factor * level * bristle } else { factor * (level + self.lean * bristle) * bristle }
    }

    /// Its slope against the bristle. Where friction leans, it softens towards the end of its weaker direction; there the
    /// slope is left at none, which only costs corrections.
    #[inline]
    fn stiffness(&self, level: f64, bristle: f64) -> f64 {
        if self.lean == 0.0 { level } else { (level + 2.0 * self.lean * bristle).max(0.0) }
    }
}

/// Bisection alone narrows the bracket by 2⁶⁰; an ordinary step needs one correction.
const MAX_CORRECTIONS: usize = 60;
/// A rate of twist is known to this share of itself, or in rad/s.
const PRECISE: f64 = 1e-11;
