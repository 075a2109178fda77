//! The file's own model: its numbers, the effects that it has, and how far a refit may move them.

use description::robot::{Quantity, Robot};

use super::library::{Effect, Free, Numbers, SLOTS, Scale, Sizes, Slot, candidate};

/// The file's own model: all its numbers, and those that the refit moves.
pub struct FileModel {
    /// Values in the file.
    pub numbers: Numbers,
    /// Those that are refitted.
    pub free: Vec<Free>,
    /// Winding inductance, H.
    pub inductance_h: f64,
    /// Bridge supply, V.
    pub rail_v: f64,
    /// Typical sizes.
    pub sizes: Sizes,
    /// Mechanical time constant J R / K², s.
    pub time_constant_s: f64,
    /// Longest step of the integrator, s.
    pub longest_step_s: f64,
}

/// Standard deviation of the prior on a positive number, from the file's spread; never tighter than `least`.
fn spread(quantity: &Quantity, least: f64) -> f64 {
    let ratio = if quantity.low > 0.0 { (quantity.high / quantity.low).ln() / 2.0 } else { 0.0 };
    ratio.max(least)
}

/// Half of the file's plausible range.
fn half_range(quantity: &Quantity) -> f64 {
    0.5 * (quantity.high - quantity.low).abs()
}

impl FileModel {
    /// From the robot file. `duty` says whether the runs give the duty and no measured supply.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let motor = &robot.motor;
        let resistance = motor.resistance_ohm.value;
        let torque_constant = motor.torque_constant_nm_per_a.value;
        let inertia = motor.rotor_inertia_kg_m2.value + robot.load.inertia_kg_m2.value;
        let rail_v = robot.supply.rail_v.value;
        let sizes = Sizes { stall_nm: torque_constant * rail_v / resistance, rail_v, resistance_ohm: resistance };
        let mut numbers = [0.0; SLOTS];
        numbers[Slot::Presliding as usize] = 4e-3;
        numbers[Slot::StribeckSpeed as usize] = 4.0;
        numbers[Slot::RelaxationTime as usize] = 1.0;
        let time_constant_s = inertia * resistance / (torque_constant * torque_constant);
        let mut model = Self {
            numbers,
            free: Vec::new(),
            inductance_h: motor.inductance_h.value,
            rail_v,
            sizes,
            time_constant_s,
            longest_step_s: (time_constant_s / 100.0).clamp(0.5e-3, 1.5e-3),
        };
        let wide = |slot, value: f64, prior| Free {
            slot,
            scale: Scale::Log,
            start: value,
            low: value / 5.0,
            high: value * 5.0,
            prior,
        };
        model.add(wide(Slot::Resistance, resistance, spread(&motor.resistance_ohm, 0.3)));
        model.add(wide(Slot::TorqueConstant, torque_constant, spread(&motor.torque_constant_nm_per_a, 0.15)));
        let load = &robot.load.inertia_kg_m2;
        let total = Quantity {
            value: inertia,
            low: motor.rotor_inertia_kg_m2.low + load.low,
            high: motor.rotor_inertia_kg_m2.high + load.high,
            source: String::new(),
        };
        model.add(wide(Slot::Inertia, inertia, spread(&total, 0.3)));
        let damping = torque_constant * torque_constant / resistance;
        model.add(Free {
            slot: Slot::Viscous,
            scale: Scale::Linear(0.1 * damping),
            start: motor.viscous_nm_s_per_rad.value,
            low: 0.0,
            high: motor.viscous_nm_s_per_rad.value.max(damping) * 20.0,
            prior: 50.0,
        });
        model.add_effects(robot);
        model
    }

    fn add(&mut self, free: Free) {
        self.numbers[free.slot as usize] = free.start;
        self.free.push(free);
    }

    /// Moves a number of the file's effects, with the library's way of moving it and the file's value to start from.
    fn add_from(&mut self, effect: Effect, values: &[(Slot, f64, f64)]) {
        for mut free in candidate(effect, &self.sizes, 0) {
            if let Some((_, value, spread)) = values.iter().find(|(slot, ..)| *slot == free.slot) {
                free.start = value.clamp(free.low, free.high);
                if let Scale::Linear(unit) = free.scale {
                    // As wide as the file says, and never tighter than a fifth of the value.
                    free.prior = (spread.max(0.2 * value.abs()) / unit).max(1.0);
                }
                self.add(free);
            }
        }
    }

    fn add_effects(&mut self, robot: &Robot) {
        let effects = &robot.effects;
        let degree = 1f64.to_radians();
        let told = |slot, quantity: &Quantity, unit: f64| (slot, quantity.value * unit, half_range(quantity) * unit);
        let radians = |quantity: &Quantity| quantity.value.to_radians();
        let mut presliding = None;
        if let Some(it) = &effects.stribeck_friction {
            presliding = Some(radians(&it.presliding_deg));
            self.add_from(
                Effect::Stribeck,
                &[
                    told(Slot::Coulomb, &it.torque_nm, 1.0),
                    told(Slot::BreakawayExcess, &it.breakaway_excess_nm, 1.0),
                    told(Slot::StribeckSpeed, &it.speed_rad_per_s, 1.0),
                ],
            );
        } else if let Some(it) = &effects.coulomb_friction {
            presliding = Some(radians(&it.presliding_deg));
            self.add_from(Effect::Coulomb, &[told(Slot::Coulomb, &it.torque_nm, 1.0)]);
        }
        if let Some(it) = &effects.load_friction {
            presliding.get_or_insert(radians(&it.presliding_deg));
            self.add_from(Effect::Load, &[told(Slot::LoadCoefficient, &it.coefficient, 1.0)]);
        }
        if let Some(presliding) = presliding {
            self.add_from(Effect::Coulomb, &[(Slot::Presliding, presliding, 0.0)]);
        }
        if let Some(it) = &effects.gravity_tilt {
            let (sin, cos) = radians(&it.direction_deg).sin_cos();
            let torque = it.torque_nm.value;
            let spread =
                half_range(&it.torque_nm).max(torque * half_range(&it.direction_deg).to_radians()).max(0.2 * torque);
            self.sizes.stall_nm = self.sizes.stall_nm.max(torque);
            self.add_from(
                Effect::Gravity,
                &[(Slot::GravityCos, torque * cos, spread), (Slot::GravitySin, torque * sin, spread)],
            );
        }
        if let Some(it) = &effects.driver_drop {
            self.add_from(Effect::Drop, &[told(Slot::DropVolts, &it.drop_v, 1.0)]);
            self.numbers[Slot::DropSlope as usize] = it.slope_ohm.value;
        }
        if let Some(it) = &effects.driver_deadband {
            self.add(Free {
                slot: Slot::Deadband,
                scale: Scale::Linear(0.01),
                start: it.width_duty.value,
                low: 0.0,
                high: 0.6,
                prior: f64::INFINITY,
            });
        }
        if let Some(it) = &effects.battery_sag {
            self.add_from(
                Effect::Sag,
                &[
                    told(Slot::SagOhm, &it.resistance_ohm, 1.0),
                    told(Slot::RelaxationOhm, &it.relaxation_ohm, 1.0),
                    told(Slot::RelaxationTime, &it.relaxation_s, 1.0),
                ],
            );
        }
        if let Some(it) = &effects.sensor_nonlinearity {
            let values = [
                told(Slot::Cos1, &it.cos1_deg, degree),
                told(Slot::Sin1, &it.sin1_deg, degree),
                told(Slot::Cos2, &it.cos2_deg, degree),
                told(Slot::Sin2, &it.sin2_deg, degree),
            ];
            self.add_from(Effect::Nonlinearity, &values);
        }
        if let Some(it) = &effects.sensor_delay {
            self.add_from(Effect::Delay, &[told(Slot::Delay, &it.delay_s, 1.0)]);
        }
    }

    /// The file's free numbers and those of the candidates, from one of their starting points.
    #[must_use]
    pub fn with(&self, effects: &[Effect], start: usize) -> Vec<Free> {
        let mut free = self.free.clone();
        for &effect in effects {
            for one in candidate(effect, &self.sizes, start) {
                if !free.iter().any(|known| known.slot == one.slot) {
                    free.push(one);
                }
            }
        }
        free
    }
}
