//! The quantities that a column may hold, and the units in which rigs write them.

use std::f64::consts::{PI, TAU};
use std::fmt;

/// What a column of a foreign file may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Time of the row.
    Time,
    /// Angle of the shaft.
    Angle,
    /// Speed of the shaft; integrated where there is no angle.
    Speed,
    /// Duty of the bridge.
    Duty,
    /// Voltage that the bridge was told to give.
    Voltage,
    /// Voltage measured at the motor's terminals.
    TerminalVoltage,
    /// Supply of the bridge.
    Supply,
    /// Current through the motor.
    Current,
    /// Temperature.
    Temperature,
    /// Where a servo was told to go.
    Goal,
    /// Whether the bridge drives.
    Enable,
}

/// Every quantity under the name that mappings use.
const NAMES: [(&str, Quantity); 11] = [
    ("time", Quantity::Time),
    ("angle", Quantity::Angle),
    ("speed", Quantity::Speed),
    ("duty", Quantity::Duty),
    ("voltage", Quantity::Voltage),
    ("terminal_voltage", Quantity::TerminalVoltage),
    ("supply", Quantity::Supply),
    ("current", Quantity::Current),
    ("temperature", Quantity::Temperature),
    ("goal", Quantity::Goal),
    ("enable", Quantity::Enable),
];

impl Quantity {
    /// The quantity of a name in a mapping.
    ///
    /// # Errors
    /// There is none of this name, or recordings have no place for it: what is wrong, and what to do.
    pub(super) fn of(name: &str) -> Result<Self, (String, String)> {
        if let Some((_, quantity)) = NAMES.iter().find(|(known, _)| *known == name) {
            return Ok(*quantity);
        }
        if matches!(name, "supply_current" | "battery_current" | "bus_current") {
            return Err((
                format!("`{name}`: a recording has no column for the supply's current"),
                "leave it out, or map `current` where the motor's own current was measured: the bridge takes from its \
                 supply about the duty's share of it, so the one cannot stand for the other"
                    .into(),
            ));
        }
        let all: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
        Err((format!("there is no quantity `{name}`"), format!("the quantities are {}", all.join(", "))))
    }

    /// Its name in a mapping.
    #[must_use]
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, quantity)| *quantity == self).map_or("", |(name, _)| name)
    }

    /// Its units, for people.
    pub(super) fn units(self) -> &'static str {
        match self {
            Self::Time => "s, ms, us, ns, min",
            Self::Angle | Self::Goal => "rad, deg, turns, counts/N (N counts a turn)",
            Self::Speed => "rad/s, deg/s, rpm, turns/s",
            Self::Duty => "percent, or the number at full scale, e.g. 255 or 1",
            Self::Voltage | Self::TerminalVoltage | Self::Supply => "V, mV",
            Self::Current => "A, mA",
            Self::Temperature => "C, K",
            Self::Enable => "none: a cell is 1 or 0, true or false",
        }
    }

    /// Whether it is an angle, which `counts` can measure.
    pub(super) fn is_angle(self) -> bool {
        matches!(self, Self::Angle | Self::Goal)
    }
}

/// A unit of a quantity: the value is `factor · number + shift`, in the recording's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// As a mapping spells it.
    pub(super) name: String,
    pub(super) factor: f64,
    pub(super) shift: f64,
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl Unit {
    /// A unit by its name; `None` where this quantity has none of this name.
    pub(super) fn of(quantity: Quantity, name: &str) -> Option<Self> {
        let shift = if (quantity, name) == (Quantity::Temperature, "K") { -273.15 } else { 0.0 };
        Some(Self { name: name.to_owned(), factor: factor(quantity, name)?, shift })
    }

    /// Counts of an encoder.
    pub(super) fn counts(per_turn: f64) -> Option<Self> {
        positive(per_turn).then(|| Self { name: format!("counts/{per_turn}"), factor: TAU / per_turn, shift: 0.0 })
    }

    /// Duty whose full scale is a number.
    pub(super) fn full_scale(number: f64) -> Option<Self> {
        positive(number).then(|| Self { name: number.to_string(), factor: 1.0 / number, shift: 0.0 })
    }

    /// A value in the recording's unit: s, rad, rad/s, V, A, °C, share of 1.
    pub(super) fn value(&self, number: f64) -> f64 {
        self.factor * number + self.shift
    }
}

/// Whether a number can be a scale.
pub(super) fn positive(number: f64) -> bool {
    number.is_finite() && number > 0.0
}

fn factor(quantity: Quantity, name: &str) -> Option<f64> {
    let factor = match (quantity, name) {
        (Quantity::Time, "s") => 1.0,
        (Quantity::Time, "ms") => 1e-3,
        (Quantity::Time, "us" | "µs" | "μs") => 1e-6,
        (Quantity::Time, "ns") => 1e-9,
        (Quantity::Time, "min") => 60.0,
        (Quantity::Angle | Quantity::Goal, "rad") | (Quantity::Speed, "rad/s") => 1.0,
        (Quantity::Angle | Quantity::Goal, "deg" | "°") | (Quantity::Speed, "deg/s" | "°/s") => PI / 180.0,
        (Quantity::Angle | Quantity::Goal, "turns") | (Quantity::Speed, "turns/s") => TAU,
        (Quantity::Angle | Quantity::Goal, _) => {
            return Unit::counts(name.strip_prefix("counts/")?.parse().ok()?).map(|u| u.factor);
        }
        (Quantity::Speed, "rpm") => TAU / 60.0,
        (Quantity::Duty, "percent" | "%") => 0.01,
        (Quantity::Duty, _) => return Unit::full_scale(name.parse().ok()?).map(|u| u.factor),
        (Quantity::Voltage | Quantity::TerminalVoltage | Quantity::Supply, "V")
        | (Quantity::Current, "A")
        | (Quantity::Temperature, "C" | "°C" | "K")
        | (Quantity::Enable, "" | "1") => 1.0,
        (Quantity::Voltage | Quantity::TerminalVoltage | Quantity::Supply, "mV") | (Quantity::Current, "mA") => 1e-3,
        _ => return None,
    };
    Some(factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_is_one_in_every_unit() {
        for (unit, number) in [("rad", PI / 2.0), ("deg", 90.0), ("°", 90.0), ("turns", 0.25), ("counts/4096", 1024.0)]
        {
            let value = Unit::of(Quantity::Angle, unit).unwrap().value(number);
            assert!((value - PI / 2.0).abs() < 1e-15, "{unit}: {value}");
        }
        for (unit, number) in [("rad/s", TAU), ("deg/s", 360.0), ("rpm", 60.0), ("turns/s", 1.0)] {
            let value = Unit::of(Quantity::Speed, unit).unwrap().value(number);
            assert!((value - TAU).abs() < 1e-14, "{unit}: {value}");
        }
    }

    #[test]
    fn the_other_quantities_scale() {
        let cases = [
            (Quantity::Time, "min", 2.0, 120.0),
            (Quantity::Time, "ms", 1500.0, 1.5),
            (Quantity::Time, "us", 1500.0, 1.5e-3),
            (Quantity::Time, "ns", 1500.0, 1.5e-6),
            (Quantity::Duty, "255", -51.0, -0.2),
            (Quantity::Duty, "percent", 20.0, 0.2),
            (Quantity::Duty, "1", 0.2, 0.2),
            (Quantity::Supply, "mV", 7931.0, 7.931),
            (Quantity::Current, "mA", 250.0, 0.25),
            (Quantity::Temperature, "K", 300.0, 26.85),
        ];
        for (quantity, unit, number, expected) in cases {
            let value = Unit::of(quantity, unit).unwrap().value(number);
            assert!((value - expected).abs() < 1e-12, "{number} {unit} is {value}");
        }
    }

    #[test]
    fn a_unit_of_another_quantity_is_none() {
        for (quantity, unit) in [
            (Quantity::Time, "deg"),
            (Quantity::Angle, "ms"),
            (Quantity::Angle, "counts"),
            (Quantity::Angle, "counts/0"),
            (Quantity::Angle, "counts/-3"),
            (Quantity::Duty, "0"),
            (Quantity::Duty, "inf"),
            (Quantity::Duty, "V"),
            (Quantity::Supply, "mA"),
            (Quantity::Enable, "V"),
        ] {
            assert_eq!(Unit::of(quantity, unit), None, "{quantity:?} in {unit}");
        }
    }
}
