//! What must hold between fields, beyond each field's own range.

use super::{Battery, Potentiometer, Robot, Sensor};
use crate::schema::Reader;
use crate::tree::Table;

/// Notes every contradiction.
pub(super) fn check(robot: &Robot, table: &Table, reader: &mut Reader) {
    let mut checks = Checks { table, reader };
    let effects = &robot.effects;
    if effects.coulomb_friction.is_some() && effects.stribeck_friction.is_some() {
        checks.wrong(
            "effects.coulomb_friction",
            "stands beside stribeck_friction, which contains it",
            "keep one of the two tables",
        );
    }
    if let Some(battery) = &robot.supply.battery {
        checks.battery(battery);
    }
    if let Sensor::Potentiometer(potentiometer) = &robot.sensor {
        checks.potentiometer(potentiometer);
    }
    if effects.battery_sag.is_some() && robot.supply.rail_v.value <= 0.0 {
        checks.wrong("effects.battery_sag", "needs a supply", "give supply.rail_v");
    }
    checks.whole("driver.pwm_steps", robot.driver.pwm_steps.value);
}

struct Checks<'c> {
    table: &'c Table,
    reader: &'c mut Reader,
}

impl Checks<'_> {
    fn wrong(&mut self, path: &str, message: &str, help: &str) {
        let at = self.table.find(path).map_or(&self.table.at, |entry| &entry.key).clone();
        self.reader.wrong(&at, path, message, Some(help.into()));
    }

    fn whole(&mut self, path: &str, value: f64) {
        if value.fract() != 0.0 {
            self.wrong(path, "must be a whole number", "write it without a fraction");
        }
    }

    fn battery(&mut self, battery: &Battery) {
        let path = "supply.battery.open_circuit_v";
        let curve = &battery.open_circuit_v;
        let reaches = |end: Option<&[f64; 2]>, charge: f64| end.is_some_and(|pair| pair[0] == charge);
        if !reaches(curve.first(), 0.0) || !reaches(curve.last(), 1.0) {
            self.wrong(path, "must run from charge 0 to charge 1", "add the missing end as [charge, volt]");
        } else if curve.windows(2).any(|pair| pair[0][0] >= pair[1][0] || pair[0][1] >= pair[1][1]) {
            self.wrong(path, "charge and voltage must both increase", "order the pairs from empty to full");
        }
    }

    fn potentiometer(&mut self, potentiometer: &Potentiometer) {
        let adc = &potentiometer.adc;
        self.whole("sensor.adc.bits", adc.bits.value);
        self.whole("sensor.adc.conversions", adc.conversions.value);
        let (zero, bend, top) = (adc.zero_below_v.value, adc.bend_above_v.value, adc.saturates_above_v.value);
        if !(zero < bend && bend < top) {
            let message = "zero_below_v < bend_above_v < saturates_above_v is required";
            self.wrong("sensor.adc", message, "compare the three values");
        }
        if let Some(correction) = &potentiometer.correction {
            let path = "sensor.correction";
            if !(correction.blind_from_deg < 0.0 && correction.blind_to_deg > 0.0) {
                let help = "angle 0 is the middle of the gap; run `scram identify potentiometer` again";
                self.wrong(path, "blind_from_deg < 0 < blind_to_deg is required", help);
            }
            if correction.cos_deg.len() != correction.sin_deg.len() {
                let help = "give every harmonic both amplitudes";
                self.wrong(path, "cos_deg and sin_deg must be equally long", help);
            }
            if correction.deg_per_code == 0.0 {
                self.wrong(
                    "sensor.correction.deg_per_code",
                    "must not be 0",
                    "run `scram identify potentiometer` again",
                );
            }
        }
    }
}
