//! A rig as the text of its robot file.

use robot_file::robot::Quantity;
use robot_file::unit::{exact, number};
use toml::Value;

use super::label::{Driver, Rig, Sensor};

/// A line `key = { value, low, high, source }`.
fn line(key: &str, quantity: &Quantity) -> String {
    let Quantity { value, low, high, source } = quantity;
    // In seven digits: what was multiplied has a tail of its own.
    let exact = |value: &f64| number(*value);
    let source = Value::String(source.clone());
    format!("{key} = {{ value = {}, low = {}, high = {}, source = {source} }}\n", exact(value), exact(low), exact(high))
}

fn stated(value: f64, low: f64, high: f64, source: &str) -> Quantity {
    Quantity { value, low, high, source: source.to_owned() }
}

/// The whole file.
pub fn of(rig: &Rig) -> String {
    let sensor = match rig.sensor {
        Sensor::Encoder { counts } => format!("encoder of {counts} counts a turn"),
        Sensor::Potentiometer { bits, travel_deg } => format!("potentiometer of {travel_deg}° on {bits} bit"),
        Sensor::Ideal => "ideal angle sensor".to_owned(),
    };
    let summary = format!("motor on a bench, {} V, {sensor}", exact(rig.supply.value));
    let mut text = format!(
        "# Written by scram new-rig from what the label says; `estimated` in a source is a guess with an honest range. Correct what\n\
         # you know better. Units are in the names, motor values at the output shaft. The format: docs/robot-file.md.\n\n\
         name = {}\nsummary = {}\n",
        Value::String(rig.name.clone()),
        Value::String(summary)
    );
    let heat = stated(10.0, 3.0, 30.0, "estimated for the winding of a small motor");
    text += "\n[motor]\n";
    text += &line("resistance_ohm", &rig.resistance);
    text += &line("inductance_h", &rig.inductance);
    text += &line("torque_constant_nm_per_a", &rig.torque_constant);
    text += &line("rotor_inertia_kg_m2", &rig.rotor);
    text += &line("viscous_nm_s_per_rad", &rig.viscous);
    text += &line("gear_ratio", &rig.gear_ratio);
    text += &line("continuous_current_a", &rig.continuous);
    text += &line("thermal_time_constant_s", &heat);
    text += "\n[load]\n";
    text += &line("inertia_kg_m2", &rig.load);
    text += "\n[driver]\n";
    text += &line("pwm_frequency_hz", &rig.pwm);
    text += &line("pwm_steps", &stated(0.0, 0.0, 65536.0, "unknown: taken as continuous"));
    text += &line("dead_time_s", &stated(0.0, 0.0, 1e-6, "unknown: estimated, up to 1 µs"));
    text += "\n[supply]\n";
    text += &line("rail_v", &rig.supply);
    text += "\n[sensor]\n";
    text += &sensor_table(rig.sensor);
    text + &driver_drop(rig.driver)
}

fn sensor_table(sensor: Sensor) -> String {
    match sensor {
        Sensor::Ideal => "kind = \"ideal\"\n".to_owned(),
        Sensor::Encoder { counts } => {
            let half = format!("{:.3e}", 180.0 / counts).parse().unwrap_or(0.1);
            "kind = \"encoder\"\n".to_owned()
                + &line("counts_per_turn", &stated(counts, counts, counts, "label"))
                + &line("noise_deg", &stated(half, 0.2 * half, 4.0 * half, "estimated: half of a count"))
        }
        Sensor::Potentiometer { bits, travel_deg } => potentiometer(bits, travel_deg),
    }
}

/// A potentiometer on the converter's own reference: a converter whose curve is straight from end to end.
fn potentiometer(bits: f64, travel_deg: f64) -> String {
    let travel =
        stated(travel_deg, (0.98 * travel_deg).max(180.0), (1.02 * travel_deg).min(359.0), "label; ±2 % (estimated)");
    let volts = |value: f64, low: f64, high: f64, source: &str| stated(value, low, high, source);
    let noise = 2f64.powf(bits - 11.0).max(0.5);
    "kind = \"potentiometer\"\n".to_owned()
        + &line("electrical_angle_deg", &travel)
        + &line("supply_v", &volts(5.0, 3.3, 5.0, "estimated: the converter's reference; only their ratio counts"))
        + &line("hysteresis_deg", &stated(0.5, 0.0, 2.0, "estimated"))
        + "in_gap = \"any\"\n\n[sensor.adc]\n"
        + &line("bits", &stated(bits, bits, bits, "label"))
        + &line("full_scale_v", &volts(5.0, 3.3, 5.0, "estimated: as supply_v"))
        + &line("zero_below_v", &volts(0.0, 0.0, 0.05, "estimated: reads to its end"))
        + &line("saturates_above_v", &volts(5.0, 4.9, 5.0, "estimated: reads to its end"))
        + &line("low_reading_v", &volts(0.0, -0.02, 0.02, "estimated: straight"))
        + &line("bend_above_v", &volts(4.99, 4.9, 4.995, "estimated: straight"))
        + &line("noise_lsb", &stated(noise, 0.3 * noise, 4.0 * noise, "estimated: one part in two thousand"))
        + &line("spike_share", &stated(0.0, 0.0, 0.01, "estimated"))
        + &line("spike_lsb", &stated(10.0 * noise, 0.0, 40.0 * noise, "estimated"))
        + &line("inl_lsb", &stated(noise, 0.0, 4.0 * noise, "estimated"))
        + &line("conversions", &stated(1.0, 1.0, 4.0, "estimated: one a row"))
        + &line("conversion_s", &stated(1e-4, 1e-5, 2e-4, "estimated: an Arduino's takes 0.1 ms"))
        + &line("jitter_s", &stated(1e-5, 0.0, 1e-4, "estimated"))
}

/// What a bridge takes of its supply.
fn driver_drop(driver: Driver) -> String {
    let (drop_v, knee_a, slope_ohm) = match driver {
        Driver::Unknown => return String::new(),
        Driver::Mosfet => (
            stated(0.0, 0.0, 0.1, "MOSFETs: next to none"),
            stated(0.0, 0.0, 0.005, "estimated: none"),
            stated(0.2, 0.02, 1.0, "estimated: both transistors that conduct"),
        ),
        Driver::Bipolar => (
            stated(2.0, 1.2, 3.0, "estimated: L293 and L298 data sheets, both transistors that conduct"),
            stated(0.0, 0.0, 0.01, "estimated: transistors reach their voltage at some mA"),
            stated(0.8, 0.3, 2.0, "estimated: L293 and L298 data sheets"),
        ),
    };
    let lines =
        [("drop_v", drop_v), ("knee_a", knee_a), ("slope_ohm", slope_ohm)].map(|(key, stated)| line(key, &stated));
    format!("\n[effects.driver_drop]\n{}", lines.concat())
}
