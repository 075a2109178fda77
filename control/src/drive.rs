//! Between the voltage that the linear motor of the thesis would need and the duty that the real bridge is given.
//!
//! The bridge's transistors and diodes take [`Bridge::drop`] against the current, so the winding of thesis (4.1) sees
//! `v − drop·sign(i)` while current flows; none flows while `|v − K ω| < drop`, which the linear motor sees as `v = K ω`.

use crate::parameters::{Bridge, Motor};
use crate::sample::Actuation;
use crate::scalar::{clamp, sign};

/// A duty and what it can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Duty, −1 … 1.
    pub duty: f32,
    /// The demand was beyond the supply: +1 upward, −1 downward, 0 within.
    pub saturated: f32,
}

/// Supply of the bridge under its own load, V.
#[must_use]
pub fn supply(bridge: &Bridge, duty: f32, current: f32) -> f32 {
    let drawn = duty * current;
    // Current that flows back does not lift the supply: the boost converter takes none.
    let fallen = if drawn > 0.0 { bridge.rail - bridge.rail_resistance * drawn } else { bridge.rail };
    if fallen > 0.1 * bridge.rail { fallen } else { 0.1 * bridge.rail }
}

/// Highest voltage that the bridge can leave for the linear motor while current flows its way, V.
#[must_use]
pub fn reach(bridge: &Bridge, supply: f32) -> f32 {
    let reach = supply * (1.0 - bridge.deadband) - bridge.drop;
    if reach > 0.0 { reach } else { 0.0 }
}

/// The duty for a voltage `v` (V) at the linear motor turning at `speed` (rad/s).
#[must_use]
pub fn invert(bridge: &Bridge, motor: &Motor, v: f32, speed: f32, supply: f32) -> Drive {
    // Around zero current the drop fades in: a sign would chatter.
    let flow = clamp((v - motor.torque_constant * speed) / (motor.resistance * bridge.fade_current), -1.0, 1.0);
    let share = (v + bridge.drop * flow) / supply;
    let wanted = share + (bridge.deadband + bridge.dead_duty) * clamp(share * 100.0, -1.0, 1.0);
    let duty = clamp(wanted, -1.0, 1.0);
    let saturated = if wanted > 1.0 {
        1.0
    } else if wanted < -1.0 {
        -1.0
    } else {
        0.0
    };
    Drive { duty, saturated }
}

/// Voltage that the linear motor sees under an actuation, V.
#[must_use]
pub fn effective(bridge: &Bridge, motor: &Motor, actuation: Actuation, speed: f32, supply: f32) -> f32 {
    let back_emf = motor.torque_constant * speed;
    if !actuation.enable {
        return back_emf;
    }
    // A full duty does not switch and loses no dead time.
    let lost = if actuation.duty.abs() < 1.0 { bridge.deadband + bridge.dead_duty } else { bridge.deadband };
    let magnitude = actuation.duty.abs() - lost;
    let out = if magnitude > 0.0 { sign(actuation.duty) * magnitude * supply } else { 0.0 };
    let net = out - back_emf;
    if net.abs() <= bridge.drop { back_emf } else { out - sign(net) * bridge.drop }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BRIDGE: Bridge =
        Bridge { rail: 5.0, rail_resistance: 0.5, drop: 2.0, dead_duty: 0.01, deadband: 0.02, fade_current: 0.005 };
    const MOTOR: Motor = Motor {
        resistance: 16.0,
        torque_constant: 0.02,
        inertia: 1.4e-6,
        viscous: 1e-6,
        drag: 2e-3,
        drag_limit: 6e-3,
        continuous_current: 0.1,
        thermal_time_constant: 3.0,
    };

    #[test]
    fn inversion_and_bridge_cancel_within_the_supply() {
        for speed in [-50.0, -10.0, 0.0, 20.0, 55.0] {
            for step in -20..=20i16 {
                let v = 0.1 * f32::from(step) + MOTOR.torque_constant * speed;
                let drive = invert(&BRIDGE, &MOTOR, v, speed, 5.0);
                let current = (v - MOTOR.torque_constant * speed) / MOTOR.resistance;
                if drive.saturated.abs() > 0.5 || current.abs() < BRIDGE.fade_current {
                    continue;
                }
                let actuation = Actuation { duty: drive.duty, enable: true };
                let back = effective(&BRIDGE, &MOTOR, actuation, speed, 5.0);
                assert!((back - v).abs() < 1e-3, "{v} V at {speed} rad/s came back as {back} V");
            }
        }
    }

    #[test]
    fn saturation_is_told_with_its_side() {
        assert!(invert(&BRIDGE, &MOTOR, 4.0, 0.0, 5.0).saturated > 0.5);
        assert!(invert(&BRIDGE, &MOTOR, -4.0, 0.0, 5.0).saturated < -0.5);
        assert!(invert(&BRIDGE, &MOTOR, 1.0, 0.0, 5.0).saturated.abs() < 0.5);
    }

    #[test]
    fn an_open_bridge_and_a_duty_within_the_drop_carry_no_current() {
        let open = effective(&BRIDGE, &MOTOR, Actuation { duty: 1.0, enable: false }, 30.0, 5.0);
        assert!((open - 0.6).abs() < 1e-6);
        let weak = effective(&BRIDGE, &MOTOR, Actuation { duty: 0.3, enable: true }, 0.0, 5.0);
        assert!(weak.abs() < 1e-6);
    }

    #[test]
    fn the_supply_falls_only_under_load() {
        assert!((supply(&BRIDGE, 1.0, 0.4) - 4.8).abs() < 1e-6);
        assert!((supply(&BRIDGE, -1.0, 0.4) - 5.0).abs() < 1e-6);
        assert!(supply(&BRIDGE, 1.0, 1e9) > 0.0);
    }
}
