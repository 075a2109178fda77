//! Parameters by name: the numbers that a person may read and change while the robot runs.
//!
//! A name is the number's path in robot.toml, a value has robot.toml's unit, and the range is a hard one: nothing beyond
//! it is ever taken, whoever asks. The default is the factory's set, so robot.toml's value.
//!
//! Here is what robot.toml hands to the controller unchanged but for the unit. The rest enters through a design and is
//! not here, because changed alone it would contradict what was designed from it, and no single field holds it:
//! - `controller.lqg`: the speed law's gains are solved for from these weights, with what surrounds the law;
//! - motor, load, driver, supply and sensor: the transition, the gains and the sensor's curve follow from them. Of the
//!   effects, those are here that one number of the controller takes back: what the bridge takes, and how late a reading is;
//! - `controller.estimator.*_share`: shares of torques that follow from the motor;
//! - `controller.estimator.reading_deg` and its three variants: a sensor's calibration decides which of two is taken, so
//!   that a value that was set would go by the wrong name on half of the robots;
//! - `controller.tick_s`.
//!
//! To change one of these, change robot.toml and flash the robot.
//!
//! The wire carries an entry's place in the list, so [`fingerprint`] is part of the protocol's version.

use core::f32::consts::TAU;

use super::check::{ROUNDING, within};
use super::{ParameterError, Parameters};
use crate::command::Refusal;
use crate::scalar::clamp;

/// What a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Any number of the range.
    Real,
    /// A whole number: a count.
    Whole,
}

/// One number. Values are in its unit, wherever they are given.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Path in robot.toml, under 64 bytes.
    pub name: &'static str,
    /// Unit of robot.toml, for people; empty for a pure number.
    pub unit: &'static str,
    /// What a value is.
    pub kind: Kind,
    /// Lowest value that is ever taken.
    pub low: f32,
    /// Highest value that is ever taken.
    pub high: f32,
    /// Whether a change of it weakens a failsafe.
    pub weaker: Weaker,
    get: fn(&Parameters) -> f32,
    set: fn(&mut Parameters, f32),
}

/// Which change of a number weakens a failsafe: lets a fault last longer, or go unseen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weaker {
    /// No value weakens the failsafe.
    Never,
    /// A value above the factory's weakens the failsafe.
    Above,
    /// A value below the factory's weakens the failsafe.
    Below,
}

/// Why a value is not set. The set stays as it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SetError {
    /// The table ends before this index.
    NoSuchParameter,
    /// A count must be a whole number.
    NotWhole {
        /// Dotted name of the parameter.
        name: &'static str,
        /// Value that was refused.
        value: f32,
    },
    /// Out of its range, or it contradicts another parameter, which may be the one that is named.
    Refused(ParameterError),
}

impl core::fmt::Display for SetError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NoSuchParameter => f.write_str("there is no such parameter"),
            Self::NotWhole { name, value } => write!(f, "{name} must be a whole number, not {value}"),
            Self::Refused(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SetError {}

impl From<ParameterError> for SetError {
    fn from(error: ParameterError) -> Self {
        Self::Refused(error)
    }
}

/// A number that the controller keeps in robot.toml's unit.
macro_rules! real {
    ($name:literal, $unit:literal, $low:literal, $high:literal, $($field:ident).+) => {
        Entry {
            name: $name,
            unit: $unit,
            kind: Kind::Real,
            low: $low,
            high: $high,
            weaker: Weaker::Never,
            get: |parameters| parameters.$($field).+,
            set: |parameters, value| parameters.$($field).+ = value,
        }
    };
}

/// An angle: degrees in robot.toml, radians in the controller.
macro_rules! degrees {
    ($name:literal, $low:literal, $high:literal, $($field:ident).+) => {
        Entry {
            get: |parameters| parameters.$($field).+.to_degrees(),
            set: |parameters, value| parameters.$($field).+ = value.to_radians(),
            ..real!($name, "deg", $low, $high, $($field).+)
        }
    };
}

/// A speed: hertz in robot.toml, rad/s in the controller.
macro_rules! hertz {
    ($name:literal, $low:literal, $high:literal, $($field:ident).+) => {
        Entry {
            get: |parameters| parameters.$($field).+ / TAU,
            set: |parameters, value| parameters.$($field).+ = value * TAU,
            ..real!($name, "Hz", $low, $high, $($field).+)
        }
    };
}

/// A count.
macro_rules! whole {
    ($name:literal, $low:literal, $high:literal, $($field:ident).+) => {
        Entry {
            name: $name,
            unit: "",
            kind: Kind::Whole,
            low: $low,
            high: $high,
            weaker: Weaker::Never,
            get: |parameters| f32::from(parameters.$($field).+),
            set: |parameters, value| parameters.$($field).+ = nearest_count(value),
        }
    };
}

/// A failsafe that a greater number weakens.
const fn at_most(entry: Entry) -> Entry {
    Entry { weaker: Weaker::Above, ..entry }
}

/// A failsafe that a smaller number weakens.
const fn at_least(entry: Entry) -> Entry {
    Entry { weaker: Weaker::Below, ..entry }
}

/// The entries, each at its index. The weak end of a failsafe's range is what the fault campaign drives with
/// (docs/safety.md): beyond it nobody has seen that the bridge goes off in time. Three have no such end: `runaway_rad_per_s` follows
/// from the fastest command, and what the bridge takes (its drop and its deadband) from the bridge.
pub const TABLE: &[Entry] = &[
    degrees!("controller.estimator.edge_margin_deg", 0.0, 30.0, sensor.edge_margin),
    at_most(real!("controller.estimator.speed_rad_per_s", "rad/s", 1e-4, 0.011, estimator.speed.speed)),
    at_most(real!("controller.estimator.stroke_speed_rad_per_s", "rad/s", 1e-4, 0.16, estimator.stroke.speed)),
    at_least(degrees!("controller.estimator.blind_reading_deg", 250.0, 1e4, estimator.blind_reading)),
    at_most(real!("controller.estimator.gate_sigma", "", 1.0, 4.2, estimator.gate)),
    at_most(whole!("controller.estimator.rejected_limit", 2.0, 16.0, estimator.rejected_limit)),
    at_most(degrees!("controller.estimator.initial_angle_deg", 0.01, 3.2, estimator.initial_angle)),
    at_most(real!("controller.estimator.initial_rad_per_s", "rad/s", 0.01, 5.5, estimator.initial_speed)),
    at_least(whole!("controller.estimator.acquire_samples", 11.0, 16.0, acquisition.samples)),
    at_most(degrees!("controller.estimator.acquire_residual_deg", 0.01, 2.2, acquisition.residual)),
    at_least(real!("controller.estimator.acquire_least_rad_per_s", "rad/s", 7.0, 1000.0, acquisition.least_speed)),
    real!("controller.estimator.acquire_rad_per_s", "rad/s", 0.01, 1000.0, acquisition.speed),
    real!("controller.estimator.acquire_patience_s", "s", 1e-3, 10.0, acquisition.patience),
    real!("controller.estimator.sensor_persistence_s", "s", 0.02, 1.0, estimator.sensor_persistence),
    real!("controller.position.proportional_v_per_rad", "V/rad", 1e-3, 1e4, position.proportional),
    real!("controller.position.integral_v_per_rad_s", "V/(rad·s)", 0.0, 1e6, position.integral),
    real!("controller.position.derivative_v_s_per_rad", "V·s/rad", 0.0, 1e4, position.derivative),
    whole!("controller.position.average_samples", 1.0, 16.0, position.average),
    degrees!("controller.position.tolerance_deg", 0.0, 90.0, position.tolerance),
    real!("controller.position.drag_share", "", 0.0, 2.0, position.drag_share),
    real!("controller.oscillator.brake_share", "", 0.05, 1.0, oscillator.brake_share),
    real!("controller.oscillator.proportional_v_per_rad", "V/rad", 1e-3, 1e4, oscillator.proportional),
    degrees!("controller.oscillator.switch_margin_deg", 0.0, 57.0, oscillator.switch_margin),
    // At 0 every standstill would count as driven hard.
    at_most(real!("controller.supervisor.driven_duty", "", 0.01, 0.7, supervisor.driven_duty)),
    at_least(real!("controller.supervisor.stall_rad_per_s", "rad/s", 3.0, 1000.0, supervisor.stall.limit)),
    at_most(real!("controller.supervisor.stall_persistence_s", "s", 0.0, 0.25, supervisor.stall.persistence)),
    at_most(real!("controller.supervisor.stall_bound_s", "s", 0.0, 0.6, supervisor.stall.bound)),
    at_most(real!("controller.supervisor.runaway_rad_per_s", "rad/s", 0.1, 1e4, supervisor.runaway.limit)),
    at_most(real!("controller.supervisor.runaway_persistence_s", "s", 0.0, 0.1, supervisor.runaway.persistence)),
    at_most(real!("controller.supervisor.runaway_bound_s", "s", 0.0, 0.6, supervisor.runaway.bound)),
    at_most(real!("controller.supervisor.open_rad_per_s", "rad/s", 0.0, 7.0, supervisor.sensor_open.limit)),
    at_most(real!("controller.supervisor.open_persistence_s", "s", 0.0, 0.4, supervisor.sensor_open.persistence)),
    at_most(real!("controller.supervisor.open_bound_s", "s", 0.0, 1.5, supervisor.sensor_open.bound)),
    at_most(real!("controller.supervisor.shorted_rad_per_s", "rad/s", 0.0, 7.0, supervisor.sensor_shorted.limit)),
    at_most(real!("controller.supervisor.shorted_persistence_s", "s", 0.0, 0.3, supervisor.sensor_shorted.persistence)),
    at_most(real!("controller.supervisor.shorted_bound_s", "s", 0.0, 0.7, supervisor.sensor_shorted.bound)),
    at_least(real!("controller.supervisor.frozen_lsb", "LSB", 0.5, 100.0, supervisor.sensor_frozen.limit)),
    at_most(real!("controller.supervisor.frozen_persistence_s", "s", 0.0, 0.1, supervisor.sensor_frozen.persistence)),
    at_most(real!("controller.supervisor.frozen_bound_s", "s", 0.0, 0.4, supervisor.sensor_frozen.bound)),
    at_least(real!("controller.supervisor.supply_v", "V", 3.0, 60.0, supervisor.supply_low.limit)),
    at_most(real!("controller.supervisor.supply_persistence_s", "s", 0.0, 0.06, supervisor.supply_low.persistence)),
    at_most(real!("controller.supervisor.supply_bound_s", "s", 0.0, 0.15, supervisor.supply_low.bound)),
    at_most(real!("controller.supervisor.link_slow_s", "s", 0.0, 0.4, supervisor.slow_after)),
    at_most(real!("controller.supervisor.command_age_s", "s", 0.0, 0.6, supervisor.command_old.limit)),
    at_most(real!("controller.supervisor.command_persistence_s", "s", 0.0, 0.05, supervisor.command_old.persistence)),
    at_most(real!("controller.supervisor.command_bound_s", "s", 0.0, 0.7, supervisor.command_old.bound)),
    at_most(real!("controller.supervisor.clock_gap_s", "s", 1e-3, 0.025, supervisor.clock.limit)),
    at_most(real!("controller.supervisor.clock_persistence_s", "s", 0.0, 0.06, supervisor.clock.persistence)),
    at_most(real!("controller.supervisor.clock_bound_s", "s", 0.0, 0.15, supervisor.clock.bound)),
    at_most(real!("controller.supervisor.starved_s", "s", 0.01, 0.06, supervisor.loop_starved.limit)),
    at_most(real!("controller.supervisor.starved_persistence_s", "s", 0.0, 0.01, supervisor.loop_starved.persistence)),
    at_most(real!("controller.supervisor.starved_bound_s", "s", 0.01, 0.2, supervisor.loop_starved.bound)),
    at_most(real!("controller.supervisor.starved_share", "", 0.0, 0.12, supervisor.starved_share)),
    at_most(real!("controller.supervisor.heat_share", "", 1.0, 3.0, supervisor.overheated.limit)),
    at_most(real!("controller.supervisor.heat_persistence_s", "s", 0.0, 0.01, supervisor.overheated.persistence)),
    at_most(real!("controller.supervisor.heat_bound_s", "s", 0.0, 0.1, supervisor.overheated.bound)),
    at_most(real!("controller.supervisor.driven_a", "A", 1e-4, 0.02, supervisor.driven_current)),
    at_least(degrees!("controller.supervisor.stall_window_deg", 5.0, 30.0, supervisor.stall_window)),
    at_most(real!("controller.supervisor.supply_high_v", "V", 3.0, 60.0, supervisor.supply_high)),
    at_least(real!("controller.supervisor.rest_least_lsb", "LSB", 0.0, 100.0, supervisor.rest_least)),
    at_most(real!("controller.supervisor.rest_most_lsb", "LSB", 0.0, 120.0, supervisor.rest_most)),
    // A bridge that is believed to take more than it does makes the current through a blocked motor look small.
    at_most(real!("effects.driver_drop.drop_v", "V", 0.0, 10.0, bridge.drop)),
    at_most(real!("effects.driver_deadband.width_duty", "", 0.0, 0.9, bridge.deadband)),
    real!("effects.sensor_delay.delay_s", "s", 0.0, 0.1, estimator.reading_age),
    hertz!("controller.limits.frequency_hz", 0.01, 150.0, limits.speed),
    hertz!("controller.limits.least_frequency_hz", 0.0, 100.0, limits.least_speed),
    degrees!("controller.limits.least_stroke_deg", 0.1, 343.0, limits.least_stroke),
];

/// The index of a name.
#[must_use]
pub fn find(name: &str) -> Option<u16> {
    TABLE.iter().zip(0..).find_map(|(entry, index)| (entry.name == name).then_some(index))
}

/// A value of the set, in the entry's unit; `None` beyond the table.
#[must_use]
pub fn get(parameters: &Parameters, index: u16) -> Option<f32> {
    TABLE.get(usize::from(index)).map(|entry| (entry.get)(parameters))
}

/// Refuses a value (in the entry's unit) that is a weaker failsafe than the factory's.
///
/// # Errors
/// [`Refusal::WeakensFailsafe`] with what is allowed; an index beyond the table is [`Refusal::NoParameter`].
pub fn keeps_failsafe(index: u16, value: f32, factory: &Parameters) -> Result<(), Refusal> {
    let entry = TABLE.get(usize::from(index)).ok_or(Refusal::NoParameter)?;
    let (low, high) = entry.allowed(factory);
    // At the end of the range a conversion's rounding is let pass.
    if (value - clamp(value, low, high)).abs() > ROUNDING * value.abs() {
        return Err(Refusal::WeakensFailsafe { low, high });
    }
    Ok(())
}

impl Parameters {
    /// The index of the first parameter that is a weaker failsafe than the factory's.
    #[must_use]
    pub fn weaker_than(&self, factory: &Self) -> Option<u16> {
        TABLE.iter().zip(0..).find_map(|(entry, index)| entry.is_weaker(self, factory).then_some(index))
    }

    /// The set with one value changed, in the entry's unit.
    ///
    /// # Errors
    /// See [`SetError`]; the whole set is checked. Numbers that bound each other are changed in the order that keeps the
    /// set sound: to raise a persistence beyond its bound, raise the bound first.
    pub fn with(&self, index: u16, value: f32) -> Result<Self, SetError> {
        let entry = TABLE.get(usize::from(index)).ok_or(SetError::NoSuchParameter)?;
        within(entry.name, value, entry.low, entry.high)?;
        if entry.kind == Kind::Whole && (f32::from(nearest_count(value)) - value).abs() > 0.0 {
            return Err(SetError::NotWhole { name: entry.name, value });
        }
        let mut changed = *self;
        (entry.set)(&mut changed, value);
        changed.check()?;
        Ok(changed)
    }
}

impl Entry {
    /// What may be set, in the entry's unit: a failsafe may become stricter than in the factory's set, not weaker.
    #[must_use]
    pub fn allowed(&self, factory: &Parameters) -> (f32, f32) {
        self.allowed_beside((self.get)(factory))
    }

    /// The same of the factory's value alone.
    #[must_use]
    pub fn allowed_beside(&self, factory: f32) -> (f32, f32) {
        match self.weaker {
            Weaker::Never => (self.low, self.high),
            Weaker::Above => (self.low, factory),
            Weaker::Below => (factory, self.high),
        }
    }

    /// Whether the set's value is a weaker failsafe than the factory's.
    fn is_weaker(&self, parameters: &Parameters, factory: &Parameters) -> bool {
        let (low, high) = self.allowed(factory);
        let value = (self.get)(parameters);
        self.weaker != Weaker::Never && (value - clamp(value, low, high)).abs() > ROUNDING * value.abs()
    }

    /// The set's value is in the range; at its ends a conversion's rounding is let pass.
    pub(super) fn check(&self, parameters: &Parameters) -> Result<(), ParameterError> {
        let value = (self.get)(parameters);
        let inside = clamp(value, self.low, self.high);
        let is_rounded = (value - inside).abs() < ROUNDING * inside.abs();
        within(self.name, if is_rounded { inside } else { value }, self.low, self.high)
    }
}

/// The nearest whole number of 0 ... 65535.
#[expect(clippy::cast_possible_truncation, reason = "kept within the type before")]
fn nearest_count(value: f32) -> u16 {
    (clamp(value, 0.0, f32::from(u16::MAX)) + 0.5) as u16
}

/// A number for the table: FNV-1a of every name, unit, kind and range, in order.
#[must_use]
pub const fn fingerprint() -> u32 {
    fingerprint_of(TABLE)
}

const fn fingerprint_of(mut entries: &[Entry]) -> u32 {
    let mut hash = 0x811C_9DC5;
    while let [entry, rest @ ..] = entries {
        let kind = match entry.kind {
            Kind::Real => 0,
            Kind::Whole => 1,
        };
        // No UTF-8 text holds 0xFF: it ends a word.
        hash = fnv_1a(hash, entry.name.as_bytes());
        hash = fnv_1a(hash, &[0xFF]);
        hash = fnv_1a(hash, entry.unit.as_bytes());
        hash = fnv_1a(hash, &[0xFF, kind]);
        hash = fnv_1a(hash, &entry.low.to_bits().to_le_bytes());
        hash = fnv_1a(hash, &entry.high.to_bits().to_le_bytes());
        entries = rest;
    }
    hash
}

/// FNV-1a of 32 bits (Fowler, Noll, Vo), going on from `hash`.
pub(crate) const fn fnv_1a(mut hash: u32, mut bytes: &[u8]) -> u32 {
    while let [byte, rest @ ..] = bytes {
        hash = (hash ^ *byte as u32).wrapping_mul(0x0100_0193);
        bytes = rest;
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    /// It is there when the program is compiled.
    const FINGERPRINT: u32 = fingerprint();

    #[test]
    fn the_hash_is_fnv_1a() {
        // Noll's published vectors of the 32-bit hash.
        for (text, hash) in [("", 0x811C_9DC5), ("a", 0xE40C_292C), ("foobar", 0xBF9C_F968)] {
            assert_eq!(fnv_1a(0x811C_9DC5, text.as_bytes()), hash, "{text}");
        }
    }

    #[test]
    fn the_fingerprint_changes_with_everything_that_people_and_the_wire_see() {
        let Some((first, rest)) = TABLE.split_first() else { panic!("the table is empty") };
        let changed = [
            Entry { name: "controller.estimator.edge_margin", ..*first },
            Entry { unit: "rad", ..*first },
            Entry { kind: Kind::Whole, ..*first },
            Entry { low: -first.high, ..*first },
            Entry { high: first.high + 1.0, ..*first },
        ];
        let mut hashes = std::vec![FINGERPRINT, fingerprint_of(rest)];
        for entry in changed {
            let mut table = TABLE.to_vec();
            table[0] = entry;
            hashes.push(fingerprint_of(&table));
        }
        let mut swapped = TABLE.to_vec();
        swapped.swap(0, 1);
        hashes.push(fingerprint_of(&swapped));
        let mut unique = hashes.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), hashes.len(), "{hashes:x?}");
    }
}
