//! The shaft that a robot file describes, at its nominal values.

use description::robot::{Quantity, Robot};

use crate::shaft::{BridgeDrop, Friction, Gravity, Shaft};

/// The shaft with the effects that the file lists.
///
/// Coulomb and Stribeck friction exclude each other in a file; should both be there, Stribeck, which contains Coulomb,
/// counts. One bristle carries all friction: its length is that of the sliding friction, and the load friction's where
/// that is alone.
#[must_use]
pub fn shaft(robot: &Robot) -> Shaft {
    let motor = &robot.motor;
    let effects = &robot.effects;
    Shaft {
        resistance_ohm: motor.resistance_ohm.value,
        inductance_h: motor.inductance_h.value,
        torque_constant: motor.torque_constant_nm_per_a.value,
        inertia_kg_m2: motor.rotor_inertia_kg_m2.value + robot.load.inertia_kg_m2.value,
        viscous: motor.viscous_nm_s_per_rad.value,
        friction: friction(robot),
        gravity: effects.gravity_tilt.as_ref().map_or(Gravity { torque_nm: 0.0, direction_rad: 0.0 }, |tilt| Gravity {
            torque_nm: tilt.torque_nm.value,
            direction_rad: tilt.direction_deg.value.to_radians(),
        }),
        bridge: effects.driver_drop.as_ref().map_or(BridgeDrop { drop_v: 0.0, slope_ohm: 0.0 }, |drop| BridgeDrop {
            drop_v: drop.drop_v.value,
            slope_ohm: drop.slope_ohm.value,
        }),
    }
}

fn friction(robot: &Robot) -> Friction {
    let effects = &robot.effects;
    let mut friction = Friction::NONE;
    let presliding = |quantity: &Quantity| quantity.value.to_radians();
    if let Some(load) = &effects.load_friction {
        friction.load_coefficient = load.coefficient.value;
        friction.presliding_rad = presliding(&load.presliding_deg);
    }
    if let Some(stribeck) = &effects.stribeck_friction {
        friction.coulomb_nm = stribeck.torque_nm.value;
        friction.breakaway_excess_nm = stribeck.breakaway_excess_nm.value;
        friction.stribeck_speed_rad_per_s = stribeck.speed_rad_per_s.value;
        friction.presliding_rad = presliding(&stribeck.presliding_deg);
    } else if let Some(coulomb) = &effects.coulomb_friction {
        friction.coulomb_nm = coulomb.torque_nm.value;
        friction.presliding_rad = presliding(&coulomb.presliding_deg);
    }
    friction
}
