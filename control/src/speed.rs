//! LQG speed control, thesis (4.4) and (4.5): `u = K (r − x̂)`, `r = [β₀ + 2π f t, 2π f, i_free]`.

use crate::angle::{Unwrapped, wrap};
use crate::drive::reach;
use crate::estimator::Estimate;
use crate::parameters::{Parameters, SpeedLaw};
use crate::scalar::{clamp, sign};

/// Deviation from the target speed up to which phase is kept under saturation, share of the target.
const SLACK_BAND: f32 = 0.05;

/// Speed control with its phase reference.
#[derive(Clone, Copy, Debug)]
pub struct SpeedControl {
    omega: f32,
    /// Reference phase, rad, wrapped.
    phase: f32,
    /// Estimated angle over whole turns against the reference: the thesis's law counts them.
    followed: Unwrapped,
    lag: f32,
}

impl SpeedControl {
    /// Holds `omega` (rad/s) with the phase starting at the present angle.
    #[must_use]
    pub fn new(omega: f32, estimate: &Estimate) -> Self {
        Self { omega, phase: estimate.angle, followed: Unwrapped::near(estimate.angle, 0.0), lag: 0.0 }
    }

    /// Another target; the phase goes on from where it is.
    pub fn retarget(&mut self, omega: f32) {
        self.omega = omega;
    }

    /// The target speed, rad/s.
    #[must_use]
    pub fn omega(&self) -> f32 {
        self.omega
    }

    /// The reference phase, rad, −π … π.
    #[must_use]
    pub fn phase(&self) -> f32 {
        self.phase
    }

    /// Puts the phase reference on the present angle (β₀ anew).
    pub fn reset_phase(&mut self, estimate: &Estimate) {
        self.phase = estimate.angle;
        self.followed = Unwrapped::near(estimate.angle, 0.0);
        self.lag = 0.0;
    }

    /// Moves the reference on by a time (s).
    pub fn advance(&mut self, elapsed: f32) {
        let step = self.omega * elapsed;
        self.phase = wrap(self.phase + step);
        self.lag += step;
    }

    /// Voltage for the linear motor, V; `supply` is the bridge's, V.
    pub fn voltage(&mut self, p: &Parameters, x: &Estimate, supply: f32) -> f32 {
        match p.speed.law {
            SpeedLaw::Refined => self.refined(p, x, supply),
            SpeedLaw::Thesis => self.thesis(p, x),
        }
    }

    /// What keeps the speed when there is no angle to hold a phase with, V.
    #[must_use]
    pub fn voltage_without_phase(p: &Parameters, omega: f32, x: &Estimate) -> f32 {
        let i_free = free_current(p, omega, x.drag);
        p.motor.resistance * i_free
            + p.motor.torque_constant * omega
            + p.speed.speed_gain * (omega - x.speed)
            + p.speed.current_gain * (i_free - x.current)
    }

    /// Feed-forward of back-EMF and estimated drag, and a phase that only counts as far as the supply can act on it:
    /// what the supply cannot give is taken out of β₀, so nothing winds up and there is nothing to catch up with.
    fn refined(&mut self, p: &Parameters, x: &Estimate, supply: f32) -> f32 {
        let base = Self::voltage_without_phase(p, self.omega, x);
        let mut error = wrap(self.phase - x.angle);
        if error.abs() > p.speed.phase_reset_error {
            error = 0.0;
        }
        let gain = p.speed.angle_gain;
        let limit = reach(&p.bridge, supply);
        let demand = base + gain * error;
        if gain > 0.0 && demand.abs() > limit && sign(demand) * error > 0.0 {
            let excess = (demand.abs() - limit) / gain;
            let saturation_hold = self.saturation_hold(p, x);
            let kept = if error.abs() < saturation_hold { error.abs() } else { saturation_hold };
            error = sign(error) * clamp(error.abs() - excess, kept, error.abs());
        }
        self.phase = wrap(x.angle + error);
        base + gain * error
    }

    /// Phase error that is kept although the supply cannot act on it at once, rad: near the ceiling every ripple of the
    /// estimate saturates for a moment, and shedding phase each time would slow the mean. None while spinning up.
    fn saturation_hold(&self, p: &Parameters, x: &Estimate) -> f32 {
        let deviation = (self.omega - x.speed).abs() / (SLACK_BAND * self.omega.abs() + 1e-6);
        p.speed.saturation_hold * clamp(1.0 - deviation, 0.0, 1.0)
    }

    /// Control law of the thesis, unchanged.
    fn thesis(&mut self, p: &Parameters, x: &Estimate) -> f32 {
        let before = self.followed.value();
        self.lag -= self.followed.follow(x.angle) - before;
        let i_free = free_current(p, self.omega, p.motor.drag);
        p.speed.angle_gain * self.lag
            + p.speed.speed_gain * (self.omega - x.speed)
            + p.speed.current_gain * (i_free - x.current)
    }
}

/// i_free of (4.4): what the motor draws at a steady speed (rad/s) against a drag (N·m), A.
fn free_current(p: &Parameters, omega: f32, drag: f32) -> f32 {
    (sign(omega) * drag + p.motor.viscous * omega) / p.motor.torque_constant
}
