//! A key's unit, and what a number outside its range may have been meant in.

/// What a key's name may end with, longest first where one ends with another.
const UNITS: &[(&str, &str)] = &[
    ("nm_s3_per_rad3", "N·m·s³/rad³"),
    ("nm_s2_per_rad2", "N·m·s²/rad²"),
    ("nm_s_per_rad", "N·m·s/rad"),
    ("v_s_per_rad", "V·s/rad"),
    ("v_per_rad_s", "V/(rad·s)"),
    ("v_per_rad", "V/rad"),
    ("v_per_as", "V/(A·s)"),
    ("k_per_w", "K/W"),
    ("per_w", "1/W"),
    ("nm_per_rad", "N·m/rad"),
    ("per_rad2", "1/rad²"),
    ("nm_per_a", "N·m/A"),
    ("n_s_per_m", "N·s/m"),
    ("s_per_m", "s/m"),
    ("n_per_m", "N/m"),
    ("m_per_s", "m/s"),
    ("rad_per_s2", "rad/s²"),
    ("rad_per_s", "rad/s"),
    ("deg_per_code", "°/code"),
    ("kg_m2", "kg·m²"),
    ("kg", "kg"),
    ("bit_per_s", "bit/s"),
    ("dbm", "dBm"),
    ("db", "dB"),
    ("ohm", "Ω"),
    ("deg", "°"),
    ("lsb", "LSB"),
    ("ppm", "ppm"),
    ("nm", "N·m"),
    ("hz", "Hz"),
    ("ah", "A·h"),
    ("a", "A"),
    ("h", "H"),
    ("m", "m"),
    ("n", "N"),
    ("s", "s"),
    ("v", "V"),
];

/// The unit that a key's name ends with; "1" for a pure number.
#[must_use]
pub fn of(key: &str) -> &'static str {
    let ends = |suffix: &str| key.strip_suffix(suffix).is_some_and(|rest| rest.ends_with('_'));
    UNITS.iter().find(|(suffix, _)| ends(suffix)).map_or("1", |(_, unit)| unit)
}

/// Units that people mistake for the key's, with the factor that turns their numbers into it.
fn mistaken(unit: &str) -> &'static [(&'static str, f64)] {
    match unit {
        "N·m" => &[("mN·m", 1e-3), ("µN·m", 1e-6)],
        "N·m/A" => &[("mN·m/A", 1e-3)],
        "N·m/rad" => &[("mN·m/rad", 1e-3), ("N·m/°", 180.0 / std::f64::consts::PI)],
        "N·m·s/rad" => &[("mN·m·s/rad", 1e-3), ("µN·m·s/rad", 1e-6)],
        "kg·m²" => &[("kg·cm²", 1e-4), ("g·cm²", 1e-7), ("g·mm²", 1e-9)],
        "kg" => &[("g", 1e-3), ("mg", 1e-6)],
        "m" => &[("mm", 1e-3), ("µm", 1e-6)],
        "m/s" => &[("mm/s", 1e-3)],
        "N" => &[("mN", 1e-3)],
        "N/m" => &[("N/mm", 1e3)],
        "N·s/m" => &[("N·s/mm", 1e3)],
        "s/m" => &[("s/mm", 1e3)],
        "Ω" => &[("mΩ", 1e-3), ("kΩ", 1e3)],
        "H" => &[("mH", 1e-3), ("µH", 1e-6)],
        "A" => &[("mA", 1e-3)],
        "V" => &[("mV", 1e-3)],
        "A·h" => &[("mA·h", 1e-3)],
        "s" => &[("ms", 1e-3), ("µs", 1e-6)],
        "Hz" => &[("kHz", 1e3)],
        "bit/s" => &[("Mbit/s", 1e6), ("kbit/s", 1e3)],
        "ppm" => &[("%", 1e4), ("s/s", 1e6)],
        "°" => &[("radians", 180.0 / std::f64::consts::PI)],
        "rad/s" => &[("rpm", std::f64::consts::PI / 30.0), ("°/s", std::f64::consts::PI / 180.0)],
        "1" => &[("%", 0.01)],
        _ => &[],
    }
}

/// What to write when a number outside `low ..= high` is in one of the units in which it would lie inside.
#[must_use]
pub fn guess(value: f64, low: f64, high: f64, unit: &str) -> Option<String> {
    let shown = if unit == "1" { String::new() } else { format!(" {unit}") };
    let guesses: Vec<_> = mistaken(unit)
        .iter()
        .map(|&(name, factor)| (name, value * factor))
        .filter(|(_, converted)| (low..=high).contains(converted))
        .map(|(name, converted)| format!("if it is in {name}, write {}{shown}", number(converted)))
        .collect();
    (!guesses.is_empty()).then(|| guesses.join("; "))
}

/// A number as a person writes it, in seven digits.
#[must_use]
pub fn number(value: f64) -> String {
    exact(format!("{value:.6e}").parse().unwrap_or(value))
}

/// A number with all of its digits, with an exponent where it is small or large.
#[must_use]
pub fn exact(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// An allowed range with its unit.
#[must_use]
pub fn range(low: f64, high: f64, unit: &str) -> String {
    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
    format!("{} … {}{unit}", number(low), number(high))
}
