//! What must hold between fields, beyond each field's own range.

mod body;

use super::radio::BIT_RATES;
use super::{Adc, Battery, Correction, Effects, Potentiometer, Quantity, Radio, Robot, Sensor};
use crate::schema::Reader;
use crate::tree::Table;

/// Notes every contradiction.
pub(super) fn check(robot: &Robot, table: &Table, reader: &mut Reader) {
    let mut checks = Checks { table, reader };
    checks.effects(&robot.effects);
    if let Some(battery) = &robot.supply.battery {
        checks.battery(battery);
    }
    if let Sensor::Potentiometer(potentiometer) = &robot.sensor {
        checks.potentiometer(potentiometer);
    }
    if let Some(radio) = &robot.radio {
        checks.radio(radio);
    }
    checks.whole("driver.pwm_steps", robot.driver.pwm_steps.value);
    checks.body(robot);
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

    /// No effect stands beside one that contains it.
    fn effects(&mut self, effects: &Effects) {
        let listed: Vec<_> = effects.listed().collect();
        for &inner in &listed {
            if let Some(outer) = listed.iter().find(|outer| outer.contains(inner)) {
                let message = format!("stands beside {}, which contains it", outer.name());
                self.wrong(&format!("effects.{}", inner.name()), &message, "keep one of the two tables");
            }
        }
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
        self.adc("sensor.adc", &potentiometer.adc);
        if let Some(correction) = &potentiometer.correction {
            self.correction("sensor.correction", correction);
        }
        let Some(second) = &potentiometer.second else { return };
        if let Some(adc) = &second.adc {
            self.adc("sensor.second.adc", adc);
        }
        if let Some(correction) = &second.correction {
            self.correction("sensor.second.correction", correction);
        }
        let gap = |electrical: &Quantity| 360.0 - electrical.value;
        let own = second.electrical_angle_deg.as_ref().unwrap_or(&potentiometer.electrical_angle_deg);
        let reach = 0.5 * (gap(&potentiometer.electrical_angle_deg) + gap(own));
        let apart = 180.0 - (second.offset_deg.value - 180.0).abs();
        if apart <= reach {
            let message =
                format!("is {apart}° from the first one's gap, and the two gaps reach {reach}°: they overlap");
            self.wrong("sensor.second.offset_deg", &message, "mount it half a turn away: 180°");
        }
    }

    fn adc(&mut self, path: &str, adc: &Adc) {
        self.whole(&format!("{path}.bits"), adc.bits.value);
        self.whole(&format!("{path}.conversions"), adc.conversions.value);
        let (zero, bend, top) = (adc.zero_below_v.value, adc.bend_above_v.value, adc.saturates_above_v.value);
        if !(zero < bend && bend < top) {
            let message = "zero_below_v < bend_above_v < saturates_above_v is required";
            self.wrong(path, message, "compare the three values");
        }
    }

    fn correction(&mut self, path: &str, correction: &Correction) {
        if !(correction.blind_from_deg < 0.0 && correction.blind_to_deg > 0.0) {
            let help = "angle 0 is the middle of the gap; run `scram identify potentiometer` again";
            self.wrong(path, "blind_from_deg < 0 < blind_to_deg is required", help);
        }
        if correction.cos_deg.len() != correction.sin_deg.len() {
            let help = "give every harmonic both amplitudes";
            self.wrong(path, "cos_deg and sin_deg must be equally long", help);
        }
        if correction.deg_per_code == 0.0 {
            let help = "run `scram identify potentiometer` again";
            self.wrong(&format!("{path}.deg_per_code"), "must not be 0", help);
        }
    }

    fn radio(&mut self, radio: &Radio) {
        for (key, count) in [
            ("radio.channel", &radio.channel),
            ("radio.retries", &radio.retries),
            ("radio.receive_queue", &radio.receive_queue),
        ] {
            self.whole(key, count.value);
        }
        for (key, rate) in [
            ("radio.unicast_bit_per_s", &radio.unicast_bit_per_s),
            ("radio.broadcast_bit_per_s", &radio.broadcast_bit_per_s),
        ] {
            if !BIT_RATES.contains(&rate.value) {
                let help =
                    "write 1e6, 2e6, 5.5e6, 11e6 (802.11b), 6e6, 9e6, 12e6, 18e6, 24e6, 36e6, 48e6 or 54e6 (802.11g)";
                self.wrong(key, "is no bit rate of 802.11b or 802.11g", help);
            }
        }
        self.ordered(("radio.handling_least_s", &radio.handling_least_s), ("handling_most_s", &radio.handling_most_s));
        self.ordered(("radio.tail_least_s", &radio.tail_least_s), ("tail_most_s", &radio.tail_most_s));
        let (least, most) = (&radio.late_callback_least_s, &radio.late_callback_most_s);
        self.ordered(("radio.late_callback_least_s", least), ("late_callback_most_s", most));
        self.ordered(("radio.quiet_loss_share", &radio.quiet_loss_share), ("loss_share", &radio.loss_share));
        self.ordered(("radio.loss_share", &radio.loss_share), ("burst_loss_share", &radio.burst_loss_share));
    }

    fn ordered(&mut self, (path, less): (&str, &Quantity), (key, more): (&str, &Quantity)) {
        if less.value > more.value {
            self.wrong(path, &format!("must not be above {key}"), "compare the two values");
        }
    }
}
