//! The file's own model: its plant, the effects that it has, and how far a refit may move its numbers.

use std::collections::BTreeMap;

use effects::{Acts, FitNumber, Id, Scale, Sizes};
use hal_sim::plant::Plant as FilePlant;
use robot_file::robot::{Quantity, Robot, Sensor};

use super::converter::ConverterError;
use super::fit::Fit;
use super::model::Plant;
use super::numbers::{Free, Number};

/// The file's own model: its plant, and the numbers that a refit moves.
#[derive(Clone)]
pub struct FileModel {
    /// The plant at the file's values, as a simulation runs it.
    file: FilePlant,
    /// The converter's own error, where nobody has calibrated it.
    converter: Option<ConverterError>,
    /// The file's effects with their values, SI units and radians.
    effects: BTreeMap<Id, Vec<f64>>,
    /// Numbers that are refitted.
    pub free: Vec<Free>,
    /// Bridge supply, V.
    pub rail_v: f64,
    /// Typical sizes.
    sizes: Sizes,
    /// Mechanical time constant J R / K², s.
    pub time_constant_s: f64,
    /// Of what steps usually are.
    step_share: f64,
}

/// Longest steps of the integrator: this many in a mechanical time constant, and more where friction's bristle bends and slides
/// within one.
const STEPS: f64 = 40.0;
const STEPS_WITH_FRICTION: f64 = 100.0;
/// They are never longer and need never be shorter than this, s.
const STEP_S: (f64, f64) = (0.5e-3, 1.5e-3);
/// Small steps as a share of these.
const SMALL_STEPS: f64 = 0.2;

/// Rollouts are never shorter than this many samples.
const FEWEST_SAMPLES: f64 = 25.0;

/// Standard deviation of the prior on a positive number, from the file's spread; never tighter than `least`.
fn spread(quantity: &Quantity, least: f64) -> f64 {
    let ratio = if quantity.low > 0.0 { (quantity.high / quantity.low).ln() / 2.0 } else { 0.0 };
    ratio.max(least)
}

/// The cell's charge is not in a recording: the file's nominal one stands for it. It matters beyond the converter's limits
/// only.
fn charge(robot: &Robot) -> f64 {
    robot.supply.battery.as_ref().map_or(1.0, |battery| battery.charge.value)
}

impl FileModel {
    /// From the robot file.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let file = FilePlant::new(robot, charge(robot));
        let shaft = &file.shaft;
        let rail_v = robot.supply.rail_v.value;
        let stall_nm = shaft.torque_constant * rail_v / shaft.resistance_ohm;
        let time_constant_s =
            shaft.inertia_kg_m2 * shaft.resistance_ohm / (shaft.torque_constant * shaft.torque_constant);
        let sizes = Sizes {
            torque_nm: stall_nm.max(shaft.laws.largest_torque()),
            rail_v,
            resistance_ohm: shaft.resistance_ohm,
            inertia_kg_m2: shaft.inertia_kg_m2,
            free_speed: rail_v / shaft.torque_constant,
            gear_ratio: robot.motor.gear_ratio.value,
            repeats: 1.0,
        };
        let effects: BTreeMap<Id, Vec<f64>> =
            robot.effects.listed().filter_map(|id| Some((id, robot.effects.values(id)?))).collect();
        let mut free = motor_numbers(robot, &file);
        for id in effects.keys().filter(|id| !id.spec().acts.on_the_ground()) {
            for one in file_numbers(robot, *id, &sizes) {
                if !free.iter().any(|known| known.number == one.number) {
                    free.push(one);
                }
            }
        }
        let converter = ConverterError::new(robot);
        free.extend(converter.iter().flat_map(ConverterError::numbers));
        Self { file, converter, effects, free, rail_v, sizes, time_constant_s, step_share: 1.0 }
    }

    /// The same for runs of whose readings at most this share repeat the one before.
    #[must_use]
    pub fn with_repeats(self, most: f64) -> Self {
        Self { sizes: Sizes { repeats: most, ..self.sizes }, ..self }
    }

    /// The same with an integrator whose own error is small beside what noise does to a fit's numbers. With the usual steps it is small
    /// beside the noise of a reading, which names effects, and moves a number that thousands of readings tell by a fifth of a percent.
    #[must_use]
    pub fn in_small_steps(&self) -> Self {
        Self { step_share: SMALL_STEPS, ..self.clone() }
    }

    /// Stall torque, or the largest that the file's own effects have, N·m.
    #[must_use]
    pub fn stall_torque(&self) -> f64 {
        self.sizes.torque_nm
    }

    /// Speed without load at a voltage (V), rad/s.
    #[must_use]
    pub fn no_load_speed(&self, voltage: f64) -> f64 {
        voltage / self.file.shaft.torque_constant
    }

    /// Current of a blocked shaft at a voltage (V), A.
    #[must_use]
    pub fn stall_current(&self, voltage: f64) -> f64 {
        voltage / self.file.shaft.resistance_ohm
    }

    /// Length of free rollouts, s: 0.1; longer for a rig that is slow (twice its mechanical time constant) or slowly sampled.
    #[must_use]
    pub fn usual_horizon(&self, sample_s: f64) -> f64 {
        let twice = 2.0 * self.time_constant_s;
        let slow = if twice > 0.2 { (twice * 10.0).round().min(10.0) / 10.0 } else { 0.1 };
        slow.max(FEWEST_SAMPLES * sample_s)
    }

    /// Holds positive numbers near values that are known from elsewhere: number, value, standard deviation as a share. Whether
    /// there are any.
    pub fn hold(&mut self, known: Vec<(Number, f64, f64)>) -> bool {
        for (number, value, share) in &known {
            for free in self.free.iter_mut().filter(|one| one.number == *number) {
                let factor = value / free.start;
                (free.start, free.low, free.high) = (*value, free.low * factor, free.high * factor);
                free.prior = *share;
            }
        }
        !known.is_empty()
    }

    /// How many numbers of the file a fit moves.
    #[must_use]
    pub fn own_numbers(&self) -> usize {
        self.free.len()
    }

    /// The file's free numbers, and after them those of added effects, from one of their starting points.
    #[must_use]
    pub fn with(&self, added: &[Id], start: usize) -> Vec<Free> {
        let mut free = self.free.clone();
        for one in added.iter().flat_map(|id| numbers_of_effect(*id, &self.sizes, start)) {
            if !free.iter().any(|known| known.number == one.number) {
                free.push(one);
            }
        }
        free
    }

    /// How many starting points effects are worth.
    #[must_use]
    pub fn starts(&self, added: &[Id]) -> usize {
        added.iter().flat_map(|id| id.fit(&self.sizes)).map(|one| one.count_of_starts()).max().unwrap_or(1)
    }

    /// The plant with added effects, its free numbers at these coordinates.
    #[must_use]
    pub fn plant(&self, added: &[Id], free: &[Free], coordinates: &[f64]) -> Plant {
        let value = |number: Number| {
            let place = free.iter().position(|one| one.number == number)?;
            Some(free[place].number(coordinates[place]))
        };
        let mut file = self.file.clone();
        let shaft = &mut file.shaft;
        for (number, field) in [
            (Number::Resistance, &mut shaft.resistance_ohm),
            (Number::TorqueConstant, &mut shaft.torque_constant),
            (Number::Inertia, &mut shaft.inertia_kg_m2),
            (Number::Viscous, &mut shaft.viscous),
        ] {
            *field = value(number).unwrap_or(*field);
        }
        if let Some(time_s) = value(Number::WindingTime) {
            shaft.inductance_h = time_s * shaft.resistance_ohm;
        }
        for (id, values) in self.values(added, value) {
            id.put(&mut shaft.laws, Some(&values));
        }
        for id in self.replaced(added) {
            id.put(&mut shaft.laws, None);
        }
        let longest_step_s = self.longest_step(file.shaft.laws.presliding().is_some());
        Plant::new(file, self.converter.map(|error| error.with(value)), longest_step_s)
    }

    /// Of the integrator, s.
    fn longest_step(&self, has_friction: bool) -> f64 {
        let steps = if has_friction { STEPS_WITH_FRICTION } else { STEPS };
        self.step_share * (self.time_constant_s / steps).clamp(STEP_S.0, STEP_S.1)
    }

    /// The file's effects that an added one contains and takes the place of.
    fn replaced(&self, added: &[Id]) -> Vec<Id> {
        self.effects.keys().copied().filter(|id| added.iter().any(|outer| outer.contains(*id))).collect()
    }

    /// Places of an effect's numbers among those that a fit moved.
    #[must_use]
    pub fn numbers_of(&self, id: Id, fit: &Fit) -> Vec<usize> {
        let own = id.fit(&self.sizes);
        let place = |one: &FitNumber| fit.free.iter().position(|free| free.number == Number::OfEffect(one.name));
        own.iter().filter_map(place).collect()
    }

    /// The values of the effects of a model, in the order of their parameters: the file's, where no number moves them.
    pub fn values(&self, added: &[Id], value: impl Fn(Number) -> Option<f64>) -> BTreeMap<Id, Vec<f64>> {
        let mut effects = self.effects.clone();
        for id in self.replaced(added) {
            effects.remove(&id);
        }
        for &id in added {
            effects.entry(id).or_insert_with(|| vec![0.0; id.spec().parameters.len()]);
        }
        for (id, values) in effects.iter_mut().filter(|(id, _)| !id.spec().acts.on_the_ground()) {
            let own = id.fit(&self.sizes);
            let mut numbers = id.fit_of_values(values, own.len());
            for (number, one) in numbers.iter_mut().zip(&own) {
                *number = value(Number::OfEffect(one.name)).unwrap_or(*number);
            }
            id.values_of_fit(&numbers, values);
        }
        effects
    }
}

/// A rotor has at least this share of the inertia that the file says.
const LEAST_ROTOR: f64 = 0.01;

/// The load's inertia where the file's eccentric gives it, kg·m²; 0 where rotor and load keep their proportion.
fn load_given(robot: &Robot) -> f64 {
    if robot.eccentric.is_some() { robot.load.inertia_kg_m2.value } else { 0.0 }
}

/// R, K, J, b and L/R, as far as the file's ranges let them move.
fn motor_numbers(robot: &Robot, file: &FilePlant) -> Vec<Free> {
    let (motor, shaft) = (&robot.motor, &file.shaft);
    let wide = |number, words, value: f64, prior| Free::of_motor(number, words, value, 5.0, prior);
    let load = &robot.load.inertia_kg_m2;
    let total = Quantity {
        value: shaft.inertia_kg_m2,
        low: motor.rotor_inertia_kg_m2.low + load.low,
        high: motor.rotor_inertia_kg_m2.high + load.high,
        source: String::new(),
    };
    let inertia = wide(Number::Inertia, "the inertia", shaft.inertia_kg_m2, spread(&total, 0.3));
    let damping = shaft.torque_constant * shaft.torque_constant / shaft.resistance_ohm;
    let (resistance, torque_constant) = (&motor.resistance_ohm, &motor.torque_constant_nm_per_a);
    let winding_time = shaft.inductance_h / shaft.resistance_ohm;
    let winding = wide(Number::WindingTime, "the winding's time constant", winding_time, 1.0);
    let mut numbers = vec![
        wide(Number::Resistance, "the winding's resistance", shaft.resistance_ohm, spread(resistance, 0.3)),
        wide(Number::TorqueConstant, "the torque constant", shaft.torque_constant, spread(torque_constant, 0.15)),
        // Of a load that an eccentric gives, the file keeps what it says: the rotor has the rest, which is positive.
        Free {
            low: inertia.low.max(load_given(robot) + LEAST_ROTOR * motor.rotor_inertia_kg_m2.value),
            follows_scale: -1.0,
            ..inertia
        },
        Free {
            scale: Scale::Linear(0.1 * damping),
            low: 0.0,
            high: shaft.viscous.max(damping) * 20.0,
            step: 2e-3,
            follows_scale: -1.0,
            ..wide(Number::Viscous, "the viscous damping", shaft.viscous, 50.0)
        },
    ];
    numbers.extend((winding_time > 0.0).then_some(winding));
    numbers
}

/// The numbers of an effect from one of its starting points. Those whose unit the catalogue takes from a torque or a resistance of
/// the rig follow the scale of torques.
fn numbers_of_effect(id: Id, sizes: &Sizes, start: usize) -> Vec<Free> {
    let e = std::f64::consts::E;
    let other = Sizes {
        torque_nm: sizes.torque_nm / e,
        resistance_ohm: sizes.resistance_ohm * e,
        inertia_kg_m2: sizes.inertia_kg_m2 / e,
        ..*sizes
    };
    let follows = |one: &FitNumber, at_other: &FitNumber| match (one.scale, at_other.scale) {
        (Scale::Linear(unit), Scale::Linear(at_other)) => (at_other / unit).ln(),
        _ => (at_other.starts[0] / one.starts[0]).ln(),
    };
    let with_scale = |(one, at_other): (FitNumber, FitNumber)| Free {
        follows_scale: follows(&one, &at_other),
        ..Free::of_effect(&one, start)
    };
    id.fit(sizes).into_iter().zip(id.fit(&other)).map(with_scale).collect()
}

/// The numbers of an effect of the file: the catalogue's way of moving them, the file's values to start from, and its
/// ranges as priors.
fn file_numbers(robot: &Robot, id: Id, sizes: &Sizes) -> Vec<Free> {
    let (Some(values), Some(ranges)) = (robot.effects.values(id), robot.effects.half_ranges(id)) else {
        return Vec::new();
    };
    let own = id.fit(sizes);
    let starts = id.fit_of_values(&values, own.len());
    let spreads = id.fit_ranges(&values, &spread_left(robot, id, &values, ranges), own.len());
    let with_file = |((one, start), spread): ((&Free, &f64), &f64)| {
        let mut free = *one;
        // What the file says is possible, wherever the catalogue's own fits stop.
        (free.start, free.low, free.high) = (*start, free.low.min(*start), free.high.max(*start));
        // As wide as the file says, and never tighter than a fifth of the value.
        let spread = spread.max(0.2 * start.abs());
        free.prior = match free.scale {
            Scale::Linear(unit) => (spread / unit).max(1.0),
            Scale::Log => spread / start,
        };
        free
    };
    numbers_of_effect(id, sizes, 0).iter().zip(&starts).zip(&spreads).map(with_file).collect()
}

/// Half ranges of an effect's values, about which the file may be wrong. What a sensor's correction has taken away is not
/// in the readings any more, however wide the range of the bare part is.
fn spread_left(robot: &Robot, id: Id, values: &[f64], ranges: Vec<f64>) -> Vec<f64> {
    let corrected = matches!(&robot.sensor, Sensor::Potentiometer(sensor) if sensor.correction.is_some());
    let unknown = values.iter().all(|value| *value == 0.0);
    if corrected && unknown && id.spec().acts == Acts::Sensor { vec![0.0; ranges.len()] } else { ranges }
}

#[cfg(test)]
mod tests;
