//! Kalman filter on [θ, ω, i] (thesis 4.1–4.3) with the drag torque as a fourth state, on the exact discretisation of
//! the design, and with the measurement noise switched between the reliable zone and the blind arc.
//!
//! * The drag acts along −sign ω̂. When the direction changes, its column of the transition changes sign; the mean takes
//!   the change within the tick into account, a shaft that friction holds stays where it is.
//! * The current settles in 10 µs, so its error hangs on the speed's (`δi = −K/R δω`): the covariance is carried for
//!   [θ, ω, τ] only, which is exact to L/(R T), about 1 %.
//! * The measurement noise holds the linearity error of the potentiometer, far above the electrical noise.

use crate::angle::wrap;
use crate::drive;
use crate::parameters::{BlindArcHandling, Parameters, Transition, Tuning};
use crate::sample::Actuation;
use crate::scalar::{at_most, clamp, sign, square};
use crate::sensor::Reading;

/// Estimated state of shaft and winding after the last tick.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Estimate {
    /// θ, rad, −π … π.
    pub angle: f32,
    /// ω, shaft speed, rad/s, counter-clockwise positive.
    pub speed: f32,
    /// i at the end of the last tick, A.
    pub current: f32,
    /// Drag torque along −sign ω, N·m.
    pub drag: f32,
}

impl Estimate {
    /// Where the shaft was when the present reading was taken, rad.
    #[must_use]
    pub fn angle_of_reading(&self, parameters: &Parameters) -> f32 {
        wrap(self.angle - self.speed * parameters.estimator.reading_age)
    }
}

/// Covariance of [θ, ω, τ]: the upper triangle.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Covariance {
    /// θ, θ: rad².
    pub angle: f32,
    /// θ, ω: rad²/s.
    pub angle_speed: f32,
    /// θ, τ: rad·N·m.
    pub angle_drag: f32,
    /// ω, ω: rad²/s².
    pub speed: f32,
    /// ω, τ: rad/s·N·m.
    pub speed_drag: f32,
    /// τ, τ: (N·m)².
    pub drag: f32,
}

/// Result of the innovation gate for one reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GateOutcome {
    /// Used with the noise of the reliable zone.
    Accepted,
    /// The estimate lies in the blind arc: used with the noise of the arc, or not at all.
    Blind,
    /// Beyond the gate, or a code that cannot come from here.
    Rejected,
}

/// A reading with all that it depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The reading, as an angle of the shaft.
    pub reading: Reading,
    /// How far the wiper is behind the shaft, rad.
    pub lag: f32,
    /// The estimate lies in the sensor's blind arc.
    pub blind: bool,
    /// The reading is of this much later than its tick, s: its conversion's time less its age.
    pub offset: f32,
    /// Standard deviation outside the arc, rad.
    pub noise: f32,
}

/// Kalman filter on [θ, ω, i, τ] with innovation gating.
#[derive(Clone, Copy, Debug)]
pub struct Estimator {
    estimate: Estimate,
    covariance: Covariance,
    /// The direction that the drag's column is written for, +1 or −1.
    direction: f32,
    /// Rejections that have not been outweighed by acceptances, in parts of [`Self::WHOLE`].
    rejected: u16,
    /// How the current hangs on the speed, −A per rad/s.
    current_per_speed: f32,
}

/// Covariance of [θ, ω, τ] with the reading's angle.
struct Seen {
    angle: f32,
    speed: f32,
    drag: f32,
    /// Variance of the reading's angle itself, rad².
    of_reading: f32,
}

/// A time that is predicted in one step.
struct Span<'a> {
    transition: &'a Transition,
    /// Length of the span, control periods.
    ticks: f32,
    /// The same in s.
    seconds: f32,
}

/// Below this speed friction may hold the shaft, rad/s.
const REST_SPEED: f32 = 0.3;
/// Speed uncertainty of a shaft that friction is believed to hold, rad²/s².
const REST_VARIANCE: f32 = 0.25;
/// A spread of the angle beyond which nothing is known, rad².
const LOST_VARIANCE: f32 = 1.0;

/// How the current hangs on the speed, −A per rad/s.
fn current_per_speed(parameters: &Parameters) -> f32 {
    parameters.motor.torque_constant / parameters.motor.resistance
}

impl Estimator {
    /// At rest, angle unknown.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let estimate = Estimate { drag: parameters.motor.drag, ..Estimate::default() };
        let current_per_speed = current_per_speed(parameters);
        let covariance = Covariance::default();
        let mut filter = Self { estimate, covariance, direction: 1.0, rejected: 0, current_per_speed };
        filter.reset_covariance(parameters);
        filter
    }

    /// Goes on with other parameters: what is derived from them follows.
    pub fn retune(&mut self, parameters: &Parameters) {
        self.current_per_speed = current_per_speed(parameters);
    }

    /// Estimate after the last prediction or update.
    #[must_use]
    pub fn estimate(&self) -> Estimate {
        self.estimate
    }

    /// Covariance after the last prediction or update.
    #[must_use]
    pub fn covariance(&self) -> Covariance {
        self.covariance
    }

    /// So many samples were rejected that the estimate cannot be right.
    #[must_use]
    pub fn is_lost(&self, parameters: &Parameters) -> bool {
        // A covariance that is NaN is lost, too.
        let is_known = self.covariance.angle <= LOST_VARIANCE;
        self.rejected >= parameters.estimator.rejected_limit.saturating_mul(Self::WHOLE) || !is_known
    }

    /// Starts over from a shaft at rest with an unknown angle and the expected drag.
    pub fn restart(&mut self, parameters: &Parameters) {
        *self = Self::new(parameters);
    }

    /// Takes over an acquired angle (rad) and speed (rad/s).
    pub fn acquire(&mut self, parameters: &Parameters, angle: f32, speed: f32) {
        self.estimate.angle = wrap(angle);
        self.estimate.speed = speed;
        self.direction = if speed < 0.0 { -1.0 } else { 1.0 };
        self.rejected = 0;
        self.reset_covariance(parameters);
    }

    fn reset_covariance(&mut self, parameters: &Parameters) {
        let e = &parameters.estimator;
        self.covariance = Covariance {
            angle: square(e.initial_angle),
            speed: square(e.initial_speed),
            drag: square(e.initial_drag),
            ..Covariance::default()
        };
    }

    /// Some control periods under one actuation. All but the last are taken in one step, with the bridge's drop and the
    /// drag as they are at its beginning (the drag turns round with the shaft, see `reverse`): twenty missed periods must
    /// not cost twenty predictions.
    pub fn predict(&mut self, parameters: &Parameters, tuning: &Tuning, actuation: Actuation, ticks: u16) {
        let mut step = |transition: &Transition, ticks: u16| {
            let ticks = f32::from(ticks);
            let span = Span { transition, ticks, seconds: ticks * parameters.tick };
            self.advance(parameters, tuning, actuation, &span);
        };
        if ticks > 1 {
            let missed = ticks.saturating_sub(1);
            step(&parameters.transition.over(missed), missed);
        }
        if ticks > 0 {
            step(&parameters.transition, 1);
        }
    }

    fn advance(&mut self, parameters: &Parameters, tuning: &Tuning, actuation: Actuation, span: &Span<'_>) {
        let motor = &parameters.motor;
        let t = span.transition;
        let x = self.estimate;
        let supply = drive::supply(&parameters.bridge, actuation.duty, x.current);
        let v = drive::effective(&parameters.bridge, motor, actuation, x.speed, supply);
        let drag = if x.drag > 0.0 { x.drag } else { 0.0 };
        let direction = if x.speed.abs() > REST_SPEED {
            sign(x.speed)
        } else {
            let torque = self.current_per_speed * (v - motor.torque_constant * x.speed);
            if torque.abs() > drag {
                sign(torque)
            } else {
                self.hold(parameters, span, v);
                return;
            }
        };
        self.turn(direction);

        let load = if direction > 0.0 { x.drag } else { -x.drag };
        let mut angle = x.angle + t.angle_speed * x.speed + t.angle_current * x.current + t.angle_voltage * v
            - t.angle_torque * load;
        let mut speed =
            t.speed_speed * x.speed + t.speed_current * x.current + t.speed_voltage * v - t.speed_torque * load;
        let current =
            t.current_speed * x.speed + t.current_current * x.current + t.current_voltage * v - t.current_torque * load;
        if speed * x.speed < 0.0 && direction * x.speed > 0.0 {
            (angle, speed) = self.reverse(parameters, actuation, supply, drag, speed, span);
        }
        self.estimate = Estimate { angle: wrap(angle), speed, current, drag: x.drag };
        self.propagate_covariance(parameters, tuning, span);
    }

    /// The speed passes zero within the tick: the drag turns round with it, or holds the shaft.
    fn reverse(
        &self,
        p: &Parameters,
        actuation: Actuation,
        supply: f32,
        drag: f32,
        end_speed: f32,
        span: &Span<'_>,
    ) -> (f32, f32) {
        let x = &self.estimate;
        let before = clamp(x.speed / (x.speed - end_speed), 0.0, 1.0);
        let after = 1.0 - before;
        let v = drive::effective(&p.bridge, &p.motor, actuation, 0.0, supply);
        let torque = self.current_per_speed * v;
        let excess = torque.abs() - drag;
        let speed = if excess > 0.0 { sign(torque) * excess * after * span.transition.speed_torque } else { 0.0 };
        let travel = 0.5 * span.seconds * (before * x.speed + after * speed);
        (x.angle + travel, speed)
    }

    /// Friction holds the shaft.
    fn hold(&mut self, parameters: &Parameters, span: &Span<'_>, v: f32) {
        self.estimate.speed = 0.0;
        self.estimate.current = v / parameters.motor.resistance;
        let c = &mut self.covariance;
        c.angle += REST_VARIANCE * square(span.seconds);
        c.angle_speed = REST_VARIANCE * span.seconds;
        c.speed = REST_VARIANCE;
        c.angle_drag = 0.0;
        c.speed_drag = 0.0;
    }

    /// Writes the drag's column for a direction.
    fn turn(&mut self, direction: f32) {
        if self.direction * direction < 0.0 {
            self.covariance.angle_drag = -self.covariance.angle_drag;
            self.covariance.speed_drag = -self.covariance.speed_drag;
            self.direction = direction;
        }
    }

    /// `P ← F P Fᵀ + Q` with F = [1, a, g₁; 0, b, g₂; 0, 0, 1].
    fn propagate_covariance(&mut self, parameters: &Parameters, tuning: &Tuning, span: &Span<'_>) {
        let t = span.transition;
        let (a, b) = (t.angle_speed, t.speed_speed);
        let (g1, g2) =
            if self.direction > 0.0 { (-t.angle_torque, -t.speed_torque) } else { (t.angle_torque, t.speed_torque) };
        let c = self.covariance;
        let angle_drag = c.angle_drag + a * c.speed_drag + g1 * c.drag;
        let speed_drag = b * c.speed_drag + g2 * c.drag;
        let row = c.angle_speed + a * c.speed + g1 * c.speed_drag;
        let disturbance = span.ticks * square(tuning.speed);
        let half = 0.5 * span.seconds;
        let on_angle = disturbance * half;
        let next = Covariance {
            angle: c.angle + a * (c.angle_speed + row) + g1 * (c.angle_drag + angle_drag) + on_angle * half,
            angle_speed: b * row + g2 * angle_drag + on_angle,
            angle_drag,
            speed: b * (b * c.speed + g2 * c.speed_drag) + g2 * speed_drag + disturbance,
            speed_drag,
            drag: c.drag + span.ticks * square(tuning.drag),
        };
        // Bounds that only a filter without readings reaches: it must not overflow however long it dead-reckons.
        self.covariance = Covariance {
            angle: at_most(next.angle, 10.0),
            angle_speed: clamp(next.angle_speed, -1e3, 1e3),
            speed: at_most(next.speed, 1e4),
            drag: at_most(next.drag, square(parameters.motor.drag_limit)),
            ..next
        };
    }

    /// Takes in a reading of a time `offset` (s) after its tick.
    pub fn update(&mut self, parameters: &Parameters, tuning: &Tuning, reading: Reading, offset: f32) -> GateOutcome {
        let lag = parameters.sensor.lag(self.estimate.speed);
        let measured = Measured { reading, lag, blind: self.is_blind(parameters), offset, noise: tuning.reading };
        let gate = self.weigh(parameters, &measured);
        self.count(gate, Self::WHOLE)
    }

    /// What a reading says beyond the estimate, rad; `None` for a code that carries no angle.
    #[must_use]
    pub fn innovation(&self, measured: &Measured) -> Option<f32> {
        let Reading::Angle(angle) = measured.reading else { return None };
        let shaft = angle + measured.lag;
        Some(wrap(shaft - self.estimate.angle - self.estimate.speed * measured.offset))
    }

    /// Takes in a reading without counting its verdict.
    pub(crate) fn weigh(&mut self, parameters: &Parameters, measured: &Measured) -> GateOutcome {
        let handling = parameters.estimator.handling;
        let blind = measured.blind;
        let Some(innovation) = self.innovation(measured) else {
            // Codes of the ends carry no angle; far from the arc they contradict the estimate.
            return if blind { GateOutcome::Blind } else { GateOutcome::Rejected };
        };
        let noise = if blind { parameters.estimator.blind_reading } else { measured.noise };
        let seen = self.seen(parameters.estimator.reading_age);
        let innovation_variance = seen.of_reading + square(noise);
        let full = handling == BlindArcHandling::Full;
        if full && square(innovation) > square(parameters.estimator.gate) * innovation_variance {
            return if blind { GateOutcome::Blind } else { GateOutcome::Rejected };
        }
        self.correct(parameters, &seen, innovation, innovation_variance);
        if blind { GateOutcome::Blind } else { GateOutcome::Accepted }
    }

    /// Whether a reading comes from where the first sensor's cannot be believed.
    #[must_use]
    pub fn is_blind(&self, parameters: &Parameters) -> bool {
        let angle = self.estimate.angle_of_reading(parameters);
        parameters.estimator.handling == BlindArcHandling::Full && parameters.sensor.is_blind(angle)
    }

    /// How the state's error hangs on that of a reading of an age (s), `P Cᵀ` with C = [1, −age, 0].
    fn seen(&self, age: f32) -> Seen {
        let c = &self.covariance;
        let angle = c.angle - age * c.angle_speed;
        let speed = c.angle_speed - age * c.speed;
        Seen { angle, speed, drag: c.angle_drag - age * c.speed_drag, of_reading: positive(angle - age * speed) }
    }

    /// A whole rejected sample.
    pub(crate) const WHOLE: u16 = 4;

    /// Counts a verdict; a rejection by its weight, of which [`Self::WHOLE`] is a sample.
    pub(crate) fn count(&mut self, gate: GateOutcome, weight: u16) -> GateOutcome {
        self.rejected = match gate {
            GateOutcome::Accepted => self.rejected.saturating_sub(2 * Self::WHOLE),
            GateOutcome::Blind => self.rejected,
            GateOutcome::Rejected => self.rejected.saturating_add(weight),
        };
        gate
    }

    fn correct(&mut self, parameters: &Parameters, seen: &Seen, innovation: f32, innovation_variance: f32) {
        let motor = &parameters.motor;
        let c = self.covariance;
        let inverse = 1.0 / innovation_variance;
        let (k_angle, k_speed, k_drag) = (seen.angle * inverse, seen.speed * inverse, seen.drag * inverse);
        let x = &mut self.estimate;
        let speed_step = k_speed * innovation;
        x.angle = wrap(x.angle + k_angle * innovation);
        x.speed += speed_step;
        x.current -= self.current_per_speed * speed_step;
        x.drag = clamp(x.drag + k_drag * innovation, -0.25 * motor.drag_limit, motor.drag_limit);
        self.covariance = Covariance {
            angle: c.angle - k_angle * seen.angle,
            angle_speed: c.angle_speed - k_angle * seen.speed,
            angle_drag: c.angle_drag - k_angle * seen.drag,
            speed: positive(c.speed - k_speed * seen.speed),
            speed_drag: c.speed_drag - k_speed * seen.drag,
            drag: positive(c.drag - k_drag * seen.drag),
        };
    }
}

/// Rounding must not turn a variance negative.
fn positive(variance: f32) -> f32 {
    if variance > 0.0 { variance } else { 0.0 }
}
