//! Swings between two angles, thesis section 4.2: the direction switches at two bounds.
//!
//! Bang-bang drives fully and begins to brake a predicted stopping distance before the bound. The prediction counts on a
//! share of the full braking torque, so that the deceleration can be corrected on the way. Angles are unwrapped
//! from the estimate, which dead-reckons through the blind arc: the potentiometer is never asked here.

use crate::angle::Unwrapped;
use crate::command::Stroke;
use crate::drive::reach;
use crate::estimator::Estimate;
use crate::parameters::Parameters;
use crate::scalar::{clamp, sign, square};

/// Swings the shaft between two angles, turning the drive round at each.
#[derive(Clone, Copy, Debug)]
pub struct Oscillator {
    from: f32,
    to: f32,
    style: Stroke,
    angle: Unwrapped,
    /// +1 toward `to`, −1 toward `from`.
    heading: f32,
    braking: bool,
}

impl Oscillator {
    /// Swings between `from` and `to` (rad, `from < to`), starting in the direction in which the shaft turns.
    #[must_use]
    pub fn new(from: f32, to: f32, style: Stroke, estimate: &Estimate) -> Self {
        let heading = if estimate.speed < 0.0 { -1.0 } else { 1.0 };
        let angle = Unwrapped::near(estimate.angle, 0.5 * (from + to));
        Self { from, to, style, angle, heading, braking: false }
    }

    /// Finds the turn nearest to the stroke again, after the angle was acquired anew.
    pub fn reset_phase(&mut self, estimate: &Estimate) {
        *self = Self::new(self.from, self.to, self.style, estimate);
    }

    /// Whether it swings between exactly these two angles, rad.
    #[must_use]
    pub fn is_between(&self, from: f32, to: f32) -> bool {
        self.from.to_bits() == from.to_bits() && self.to.to_bits() == to.to_bits()
    }

    /// The bound that it heads for, rad.
    #[must_use]
    pub fn bound(&self) -> f32 {
        if self.heading > 0.0 { self.to } else { self.from }
    }

    /// Voltage for the linear motor, V; `supply` is the bridge's, V.
    pub fn voltage(&mut self, p: &Parameters, x: &Estimate, supply: f32) -> f32 {
        let angle = self.angle.follow(x.angle);
        // Half a turn beyond a bound the stroke is lost: it is the neighbouring turn's business now.
        let center = 0.5 * (self.from + self.to);
        if (angle - center).abs() > 0.5 * (self.to - self.from) + core::f32::consts::PI {
            self.angle = Unwrapped::near(x.angle, center);
        }
        match self.style {
            Stroke::BangBang => self.bang_bang(p, x, supply),
            Stroke::Proportional => self.proportional(p, x),
        }
    }

    fn bang_bang(&mut self, p: &Parameters, x: &Estimate, supply: f32) -> f32 {
        let brake = Brake::new(p, x, supply);
        let speed = self.heading * x.speed;
        let distance = self.heading * (self.bound() - self.angle.value());
        if self.braking && speed <= brake.deceleration * p.tick {
            // It stops within this tick; the same voltage drives the stroke back.
            self.heading = -self.heading;
            self.braking = false;
            return self.heading * brake.reach;
        }
        let gained = brake.acceleration(speed) * p.tick;
        let after = distance - (speed + 0.5 * gained) * p.tick;
        self.braking = speed > 0.0 && brake.stopping_distance(speed + gained) >= after;
        if !self.braking && distance <= 0.0 && speed <= 0.0 {
            // Beyond the bound and not moving away from the way back.
            self.heading = -self.heading;
        }
        if self.braking { self.heading * brake.voltage(speed, distance) } else { self.heading * brake.reach }
    }

    /// The thesis's own: P on the angle as it is, the direction switches where the bound is passed. For comparison.
    pub fn thesis_voltage(&mut self, p: &Parameters, x: &Estimate) -> f32 {
        let angle = x.angle;
        if self.heading * (self.bound() - angle) <= p.oscillator.switch_margin {
            self.heading = -self.heading;
        }
        p.oscillator.proportional * (self.bound() - angle)
    }

    /// P toward the bound, thesis (4.8) with the drag fed forward; turns round a margin before it.
    fn proportional(&mut self, p: &Parameters, x: &Estimate) -> f32 {
        let distance = self.heading * (self.bound() - self.angle.value());
        if distance <= p.oscillator.switch_margin {
            self.heading = -self.heading;
        }
        let error = self.bound() - self.angle.value();
        let drag = if x.drag > 0.0 { x.drag } else { 0.0 };
        p.oscillator.proportional * error + sign(error) * drag * p.motor.resistance / p.motor.torque_constant
    }
}

/// What the motor can do along and against its motion. Forward is the heading.
#[derive(Clone, Copy, Debug)]
struct Brake {
    /// Voltage left for the linear motor with the bridge fully driven, V.
    reach: f32,
    /// N·m per V at standstill.
    per_volt: f32,
    /// N·m of back-EMF braking and viscosity per rad/s.
    damping: f32,
    drag: f32,
    inertia: f32,
    back_emf: f32,
    /// From standstill with the counted share of full voltage backward, rad/s².
    deceleration: f32,
}

impl Brake {
    fn new(p: &Parameters, x: &Estimate, supply: f32) -> Self {
        let m = &p.motor;
        let per_volt = m.torque_constant / m.resistance;
        let reach = reach(&p.bridge, supply);
        let drag = if x.drag > 0.0 { x.drag } else { 0.0 };
        Self {
            reach,
            per_volt,
            damping: per_volt * m.torque_constant + m.viscous,
            drag,
            inertia: m.inertia,
            back_emf: m.torque_constant,
            deceleration: (p.oscillator.brake_share * per_volt * reach + drag) / m.inertia,
        }
    }

    /// With full voltage forward, rad/s².
    fn acceleration(&self, speed: f32) -> f32 {
        (self.per_volt * self.reach - self.damping * speed - sign(speed) * self.drag) / self.inertia
    }

    /// `∫ ω dω / (a + bω)` from 0 to the speed: `(a/b²)(z − ln(1 + z))` with z = bω/a, by the Padé form
    /// `z²/(2 + 4z/3)`, within 1 % up to z = 1.
    fn stopping_distance(&self, speed: f32) -> f32 {
        let a = self.deceleration;
        let b = self.damping / self.inertia;
        square(speed) / (2.0 * a + 4.0 / 3.0 * b * speed)
    }

    /// Voltage (forward positive) that stops from `speed` in `distance`.
    fn voltage(&self, speed: f32, distance: f32) -> f32 {
        let full = -self.reach;
        if distance <= 0.0 {
            return full;
        }
        // Constant deceleration over the distance; back-EMF and viscosity count with their mean over it.
        let needed = self.inertia * square(speed) / (2.0 * distance);
        let torque = needed - self.drag - 2.0 / 3.0 * self.damping * speed;
        clamp(-torque / self.per_volt, full, self.reach + self.back_emf * speed)
    }
}
