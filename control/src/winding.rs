//! How hot the winding is, from what the bridge is told: the last resort against whatever no other trigger sees.
//!
//! The winding's temperature above its housing follows the power that it turns into heat, with one time constant:
//! `τ ḣ = (i/i_c)² − h`, where `i_c` is the current that the motor bears for ever. So `h` is 1 after long driving at that
//! current, and a command that draws more may go on for the shorter, the more it draws. There is no sensor of current: `i` is the
//! model's, from duty, supply and estimated speed, and while no angle is known it is that of a blocked shaft.

use crate::drive;
use crate::parameters::Parameters;
use crate::sample::Actuation;
use crate::scalar::square;

/// The winding of the motor.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Winding {
    /// Heat in the winding, as a multiple of what the continuous current keeps there.
    heat: f32,
}

impl Winding {
    /// A winding that has this heat, as a multiple of what the continuous current keeps in it.
    #[must_use]
    pub fn with_heat(heat: f32) -> Self {
        Self { heat }
    }

    /// The heat, as a multiple of what the continuous current keeps in the winding.
    #[must_use]
    pub fn heat(&self) -> f32 {
        self.heat
    }

    /// A time (s) under a current (A).
    pub fn advance(&mut self, p: &Parameters, current: f32, seconds: f32) {
        let share = seconds / p.motor.thermal_time_constant;
        // A pause longer than the time constant: everything has settled. NaN counts as the longest.
        let share = if share < 1.0 { share } else { 1.0 };
        self.heat += share * (square(current / p.motor.continuous_current) - self.heat);
    }
}

/// Current that the bridge would drive through a motor at rest, A; 0 while it is off.
#[must_use]
pub fn standstill_current(p: &Parameters, actuation: Actuation) -> f32 {
    if !actuation.enable {
        return 0.0;
    }
    drive::effective(&p.bridge, &p.motor, actuation, 0.0, p.bridge.rail) / p.motor.resistance
}
