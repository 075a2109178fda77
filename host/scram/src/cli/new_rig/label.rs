//! From what a label or data sheet says to the numbers of a robot file, each with how far it may be off and why.
//!
//! At a voltage V a motor without load turns at ω₀ = (V − R I₀)/K, and blocked it draws V/R and pulls with K V/R. Gears of ratio N
//! and efficiency η turn a speed into 1/N and a torque into η N times itself.

use std::f64::consts::{PI, TAU};

use miette::miette;
use robot_file::robot::Quantity;

use super::super::Failure;
use super::Answers;
use super::questions::{Asker, Question, is_unknown, number};

/// Parts of one kind differ by so much from their label.
const LABEL: f64 = 0.15;
/// Current without load, as a share of the blocked motor's: of small brushed motors from a few per cent to a fifth.
const NO_LOAD_SHARE: [f64; 3] = [0.1, 0.03, 0.2];
/// Efficiency of gears: a single spur stage to four planetary ones.
const GEARS: [f64; 3] = [0.7, 0.5, 0.95];
/// Mechanical time constant of a small brushed motor without load, s.
const TIME_CONSTANT_S: [f64; 3] = [0.02, 0.005, 0.08];
/// Inductance over resistance of small cored motors, s.
const ELECTRICAL_S: [f64; 3] = [1e-4, 1e-5, 1e-3];
/// Current that a motor bears for long, as a share of the blocked motor's.
const CONTINUOUS_SHARE: [f64; 3] = [0.25, 0.1, 0.5];
/// Rows that a motor's answer needs within its mechanical time constant.
const ROWS: f64 = 5.0;

/// The load on the shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Load {
    Inertia(f64),
    Disc { mass_kg: f64, radius_m: f64 },
    None,
    Unknown,
}

/// The angle sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sensor {
    Encoder { counts: f64 },
    Potentiometer { bits: f64, travel_deg: f64 },
    Ideal,
}

/// The bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Driver {
    Mosfet,
    Bipolar,
    Unknown,
}

/// A rig as its robot file has it.
pub struct Rig {
    pub name: String,
    pub supply: Quantity,
    pub resistance: Quantity,
    pub inductance: Quantity,
    pub torque_constant: Quantity,
    pub rotor: Quantity,
    pub viscous: Quantity,
    pub gear_ratio: Quantity,
    pub continuous: Quantity,
    pub load: Quantity,
    pub pwm: Quantity,
    pub driver: Driver,
    pub sensor: Sensor,
    sampling_s: Option<f64>,
}

/// A number by its value and the factors to its ends.
fn quantity(value: f64, low: f64, high: f64, source: impl Into<String>) -> Quantity {
    // Three digits: a label has no more.
    let digits = |value: f64| format!("{value:.3e}").parse().unwrap_or(value);
    Quantity { value: digits(value), low: digits(low), high: digits(high), source: source.into() }
}

fn about(value: f64, share: f64, source: impl Into<String>) -> Quantity {
    quantity(value, value * (1.0 - share), value * (1.0 + share), source)
}

/// What the label says of the motor, at the output shaft.
struct Label {
    volts: f64,
    speed: Option<f64>,
    stall_a: Option<f64>,
    resistance: Option<f64>,
    stall_nm: Option<f64>,
    no_load_a: Option<f64>,
    /// Losses of gears that the numbers do not have in them: the torque's factor.
    gears: Option<f64>,
}

impl Rig {
    /// Asks for what is not given.
    pub fn asked(given: &Answers, stem: &str, asker: &mut Asker) -> Result<Self, Failure> {
        let name = match &given.name {
            Some(name) => name.clone(),
            None => stem.to_owned(),
        };
        let supply_v = ask_supply(given, asker)?;
        let label = ask_label(given, supply_v, asker)?;
        let (load, sensor) = (ask_load(given, asker)?, ask_sensor(given, asker)?);
        let (driver, pwm_hz) = (ask_driver(given, asker)?, ask_pwm(given, asker)?);
        let sampling_s = ask_sampling(given, asker)?;
        let (torque_constant, resistance) = label.motor()?;
        let stiffness = torque_constant.value * torque_constant.value / resistance.value;
        let rotor = quantity(
            TIME_CONSTANT_S[0] * stiffness,
            TIME_CONSTANT_S[1] * stiffness,
            TIME_CONSTANT_S[2] * stiffness,
            "estimated from K²/R and a mechanical time constant without load of 20 ms, 5 to 80, as small brushed motors have",
        );
        let continuous = CONTINUOUS_SHARE.map(|share| share * label.volts / resistance.value);
        let pwm = match pwm_hz {
            Some(hz) => about(hz, 0.0, "label"),
            None => quantity(20e3, 1e3, 40e3, "unknown: estimated, above hearing; Arduino's own is 490 Hz to 1 kHz"),
        };
        Ok(Self {
            name,
            supply: about(supply_v, 0.05, "label; ±5 % (estimated)"),
            inductance: inductance(&resistance),
            viscous: label.viscous(&torque_constant, &resistance),
            gear_ratio: label.gear_ratio(given),
            continuous: quantity(
                continuous[0],
                continuous[1],
                continuous[2],
                "estimated from the blocked motor's current: a quarter, a tenth to a half",
            ),
            load: load.quantity(&rotor),
            rotor,
            torque_constant,
            resistance,
            pwm,
            driver,
            sensor,
            sampling_s,
        })
    }

    /// What a person should know of the numbers.
    pub fn remarks(&self) -> Vec<String> {
        let inertia = self.rotor.value + self.load.value;
        let time_s = inertia * self.resistance.value / self.torque_constant.value.powi(2);
        let speed = self.supply.value / self.torque_constant.value;
        let mut said = vec![format!(
            "without load it turns at about {:.3} rad/s ({:.0} rpm) and takes up its speed in about {:.0} ms",
            speed,
            speed * 60.0 / TAU,
            time_s * 1e3
        )];
        if let Some(sampling_s) = self.sampling_s.filter(|sampling_s| *sampling_s * ROWS > time_s) {
            said.push(format!(
                "a row every {:.1} ms is too slow to show that: record every {:.1} ms or faster",
                sampling_s * 1e3,
                time_s / ROWS * 1e3
            ));
        }
        said
    }
}

fn inductance(resistance: &Quantity) -> Quantity {
    let [value, low, high] = ELECTRICAL_S.map(|seconds| (seconds * resistance.value).clamp(1e-7, 1.0));
    quantity(value, low, high, "estimated from an electrical time constant of 0.1 ms, 0.01 to 1")
}

impl Label {
    /// K and R at the output shaft.
    fn motor(&self) -> Result<(Quantity, Quantity), Failure> {
        let volts = self.volts;
        let resistance = match (self.resistance, self.stall_a) {
            (Some(ohm), _) => Some(about(ohm, LABEL, "label: the winding's resistance; ±15 % (estimated)")),
            (None, Some(stall_a)) => {
                let source = format!("label: {volts} V over the blocked motor's {stall_a} A; ±15 % (estimated)");
                Some(about(volts / stall_a, LABEL, source))
            }
            _ => None,
        };
        let shares = match (self.no_load_a, &resistance) {
            (Some(no_load_a), Some(ohm)) => [no_load_a * ohm.value / volts; 3],
            _ => NO_LOAD_SHARE,
        };
        if let (Some(no_load_a), true) = (self.no_load_a, shares[0] >= 1.0) {
            let blocked_a = no_load_a / shares[0];
            let help = "a small motor draws a tenth of it without load: correct --no-load-a, or --stall-a and --resistance-ohm";
            return Err(Failure::Usage(miette!(
                help = help,
                "--no-load-a: {no_load_a} A without load is more than the {blocked_a:.3} A of the blocked motor"
            )));
        }
        let torque_constant = match (self.speed, self.stall_nm, &resistance) {
            (Some(speed), _, _) => {
                let [value, most, least] = shares.map(|share| (volts * (1.0 - share) / speed).max(0.0));
                let source = format!(
                    "label: {speed:.3} rad/s without load at {volts} V, less {:.0} % for the current without load ({}); ±15 % \
                     (estimated)",
                    100.0 * shares[0],
                    if self.no_load_a.is_some() { "label" } else { "estimated" }
                );
                quantity(value, least * (1.0 - LABEL), most * (1.0 + LABEL), source)
            }
            (None, Some(torque), Some(ohm)) => {
                let value = torque * ohm.value / volts;
                let source = format!("label: {torque} N·m of the blocked motor over its current; ±30 % (estimated)");
                about(value, 2.0 * LABEL, source)
            }
            _ => return Err(too_little()),
        };
        match (resistance, self.stall_nm) {
            (Some(resistance), _) => Ok((torque_constant, resistance)),
            (None, Some(torque)) => {
                let [value, low, high] = (match self.gears {
                    Some(_) => GEARS.map(|efficiency| efficiency / GEARS[0]),
                    None => [1.0, 1.0 - 2.0 * LABEL, 1.0 + 2.0 * LABEL],
                })
                .map(|factor| factor * torque_constant.value * volts / torque);
                let source =
                    format!("estimated from K and the label's {torque:.4} N·m of the blocked motor at {volts} V");
                Ok((torque_constant, quantity(value, low, high, source)))
            }
            (None, None) => Err(too_little()),
        }
    }

    /// Half of what the motor loses without load, at most all of it: the rest is dry friction.
    fn viscous(&self, k: &Quantity, resistance: &Quantity) -> Quantity {
        let share = self.no_load_a.map_or(NO_LOAD_SHARE[0], |no_load_a| no_load_a * resistance.value / self.volts);
        let speed = self.speed.unwrap_or(self.volts * (1.0 - share) / k.value);
        let lost = k.value * share * self.volts / resistance.value / speed;
        let from = if self.no_load_a.is_some() { "the label's" } else { "an estimated" };
        let source = format!("estimated from {from} current without load: half of the losses, none to all");
        quantity(0.5 * lost, 0.0, lost, source)
    }

    fn gear_ratio(&self, given: &Answers) -> Quantity {
        match given.gear_ratio.as_deref().and_then(|text| number(text, "").ok().flatten()) {
            Some(ratio) => about(ratio, 0.0, "label"),
            None => self.gears.map_or_else(
                || about(1.0, 0.0, "no gears, or numbers of the output shaft"),
                |ratio| about(ratio, 0.0, "label"),
            ),
        }
    }
}

fn too_little() -> Failure {
    let help = "the speed without load (--no-load-rpm) with one of --stall-a, --resistance-ohm and --stall-torque-nm, or \
                --stall-torque-nm with --stall-a or --resistance-ohm; a data sheet or a measurement has them";
    Failure::Usage(miette!(help = help, "that is too little to know the motor by"))
}

impl Load {
    fn read(text: &str) -> Result<Self, String> {
        if is_unknown(text) {
            return Ok(Self::Unknown);
        }
        if text == "none" {
            return Ok(Self::None);
        }
        let positive = |text: &str, unit: &str| number(text, unit)?.ok_or_else(|| format!("`{text}` is no number"));
        let parts: Vec<&str> = text.split([':', ' ']).filter(|part| !part.is_empty()).collect();
        match parts[..] {
            ["disc", mass, radius] => {
                Ok(Self::Disc { mass_kg: positive(mass, "kg")?, radius_m: positive(radius, "m")? })
            }
            [inertia] => Ok(Self::Inertia(positive(inertia, "kg·m²")?)),
            _ => Err(format!("`{text}` is none of an inertia in kg·m², disc:KG:M, none and unknown")),
        }
    }

    fn quantity(self, rotor: &Quantity) -> Quantity {
        match self {
            Self::Inertia(inertia) => about(inertia, 0.1, "label; ±10 % (estimated)"),
            Self::Disc { mass_kg, radius_m } => {
                let source = format!("estimated from a disc of {mass_kg} kg and {radius_m} m: half of m r²; ±15 %");
                about(0.5 * mass_kg * radius_m * radius_m, LABEL, source)
            }
            Self::None => quantity(0.0, 0.0, 0.1 * rotor.value, "nothing on the shaft; at most a tenth of the rotor's"),
            Self::Unknown => quantity(
                rotor.value,
                0.0,
                10.0 * rotor.value,
                "unknown: estimated as the rotor's own, none to ten times it",
            ),
        }
    }
}

fn ask_supply(given: &Answers, asker: &mut Asker) -> Result<f64, Failure> {
    let question = Question { option: "supply-v", text: "Supply of the bridge, V", example: "12", default: None };
    asker.answer(&question, given.supply_v.as_deref(), |text| {
        number(text, "V")?.ok_or_else(|| "nothing follows without it; measure it".to_owned())
    })
}

fn ask_label(given: &Answers, supply_v: f64, asker: &mut Asker) -> Result<Label, Failure> {
    let mut optional = |option, text, example, default, given: &Option<String>, unit: &'static str| {
        let question = Question { option, text, example, default };
        asker.answer(&question, given.as_deref(), |text| number(text, unit))
    };
    let unknown = Some("unknown");
    let volts = optional(
        "label-v",
        "Voltage for which the label's numbers hold, V; unknown for the supply",
        "6",
        unknown,
        &given.label_v,
        "V",
    )?;
    let speed = match &given.no_load_rad_per_s {
        Some(_) => optional(
            "no-load-rad-per-s",
            "Speed without load, rad/s",
            "31",
            unknown,
            &given.no_load_rad_per_s,
            "rad/s",
        )?,
        None => optional("no-load-rpm", "Speed without load, rpm", "300", None, &given.no_load_rpm, "rpm")?
            .map(|rpm| rpm * PI / 30.0),
    };
    let said = given.resistance_ohm.is_some() || given.stall_torque_nm.is_some() && speed.is_some();
    let of_stall = if said && given.stall_a.is_none() {
        None
    } else {
        optional("stall-a", "Current of the blocked motor, A", "2.5", unknown, &given.stall_a, "A")?
    };
    let resistance = match (of_stall, &given.resistance_ohm) {
        (Some(_), None) => None,
        (None, None) if given.stall_torque_nm.is_some() => None,
        _ => optional("resistance-ohm", "Resistance of the winding, Ω", "4.8", unknown, &given.resistance_ohm, "ohm")?,
    };
    let known = of_stall.is_some() || resistance.is_some();
    let stall_nm = if known && speed.is_some() && given.stall_torque_nm.is_none() {
        None
    } else {
        let torque = &given.stall_torque_nm;
        optional("stall-torque-nm", "Torque of the blocked motor, N·m", "0.5", None, torque, "N·m")?
    };
    let no_load_a = optional("no-load-a", "Current without load, A", "0.12", unknown, &given.no_load_a, "A")?;
    let ratio = optional(
        "gear-ratio",
        "Gear ratio, motor turns per turn of the output shaft",
        "34",
        Some("1"),
        &given.gear_ratio,
        "",
    )?;
    let label = Label {
        volts: volts.unwrap_or(supply_v),
        speed,
        stall_a: of_stall,
        resistance,
        stall_nm,
        no_load_a,
        gears: None,
    };
    let Some(ratio) = ratio.filter(|ratio| *ratio != 1.0) else { return Ok(label) };
    let question = Question {
        option: "numbers-at",
        text: "Where do speed and torque hold, at the shaft behind the gears or at the motor",
        example: "motor",
        default: Some("shaft"),
    };
    let at_motor = asker.answer(&question, given.numbers_at.as_deref(), |text| match text {
        "motor" => Ok(true),
        "shaft" => Ok(false),
        _ => Err(format!("`{text}` is neither shaft nor motor")),
    })?;
    let behind = |label: Label| Label {
        speed: label.speed.map(|speed| speed / ratio),
        stall_nm: label.stall_nm.map(|torque| GEARS[0] * torque * ratio),
        ..label
    };
    let label = Label { gears: Some(ratio), ..label };
    Ok(if at_motor { behind(label) } else { label })
}

fn ask_load(given: &Answers, asker: &mut Asker) -> Result<Load, Failure> {
    let question = Question {
        option: "load",
        text: "What turns with the shaft: inertia in kg·m², disc:KG:M, none or unknown",
        example: "disc:0.2:0.04",
        default: Some("unknown"),
    };
    asker.answer(&question, given.load.as_deref(), Load::read)
}

fn ask_sensor(given: &Answers, asker: &mut Asker) -> Result<Sensor, Failure> {
    let question = Question {
        option: "sensor",
        text: "Angle sensor: encoder:COUNTS a turn of the output shaft, potentiometer:BITS:DEG, or ideal",
        example: "encoder:1024",
        default: None,
    };
    asker.answer(&question, given.sensor.as_deref(), |text| {
        let parts: Vec<&str> = text.split([':', ' ']).filter(|part| !part.is_empty()).collect();
        let positive = |text: &str| number(text, "")?.ok_or_else(|| format!("`{text}` is no number"));
        match parts[..] {
            ["ideal"] => Ok(Sensor::Ideal),
            ["encoder", counts] => Ok(Sensor::Encoder { counts: positive(counts)? }),
            ["potentiometer", bits, travel] => {
                Ok(Sensor::Potentiometer { bits: positive(bits)?, travel_deg: positive(travel)? })
            }
            _ => Err(format!("`{text}` is none of encoder:COUNTS, potentiometer:BITS:DEG and ideal")),
        }
    })
}

fn ask_driver(given: &Answers, asker: &mut Asker) -> Result<Driver, Failure> {
    let question = Question {
        option: "driver",
        text: "The bridge: mosfet, bipolar (L293, L298) or unknown",
        example: "mosfet",
        default: Some("unknown"),
    };
    asker.answer(&question, given.driver.as_deref(), |text| match text {
        "mosfet" => Ok(Driver::Mosfet),
        "bipolar" => Ok(Driver::Bipolar),
        _ if is_unknown(text) => Ok(Driver::Unknown),
        _ => Err(format!("`{text}` is none of mosfet, bipolar and unknown")),
    })
}

fn ask_pwm(given: &Answers, asker: &mut Asker) -> Result<Option<f64>, Failure> {
    let question = Question { option: "pwm-hz", text: "PWM frequency, Hz", example: "20000", default: Some("unknown") };
    asker.answer(&question, given.pwm_hz.as_deref(), |text| number(text, "Hz"))
}

fn ask_sampling(given: &Answers, asker: &mut Asker) -> Result<Option<f64>, Failure> {
    let question = Question {
        option: "sampling-s",
        text: "Sampling period of the recordings, s",
        example: "0.002",
        default: Some("unknown"),
    };
    asker.answer(&question, given.sampling_s.as_deref(), |text| number(text, "s"))
}
