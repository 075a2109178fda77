//! What the firmware takes from a robot file: the designed controller, and what the boards need to measure and drive as the
//! file says. A robot that an ESP32 board cannot be is refused here, when the firmware is built.
//!
//! [`Image`] is written with postcard. The firmware reads the same bytes as `shell::image::Image`, field by field in the
//! same order (tested in `shell/tests/image.rs`).

use std::path::{Path, PathBuf};

use control::Parameters;
use control::protocol::radio::NAME;
use serde::Serialize;

use crate::angle_code::AdcCurve;
use crate::design::{self, DesignError};
use crate::robot::{Battery, Potentiometer, Robot, Sensor};

/// Control period of the firmware, s.
const TICK_S: f64 = 1e-3;
/// Share of a control period that conversions may take; the rest is for the decisions and the radio.
const CONVERSION_SHARE: f64 = 1.0 / 3.0;
/// Clock of the LEDC peripheral on both chips, Hz (ESP32 and ESP32-C3 technical reference manuals: APB_CLK).
const PWM_CLOCK_HZ: f64 = 80e6;
/// Finest steps of the LEDC on both chips (ESP32-C3: 14 bit).
const MOST_PWM_STEPS: f64 = 16384.0;
/// Highest integer part of the LEDC's clock divider (10 bit).
const MOST_PWM_DIVIDER: f64 = 1023.0;
/// Bits of both chips' converters.
const ADC_BITS: f64 = 12.0;
/// What a pin of either chip bears, V (data sheets: VDD + 0.3 V at VDD = 3.3 V).
const PIN_LIMIT_V: f64 = 3.6;
/// More files than this do not stand on each other: the reader refuses them.
const MOST_FILES: usize = 9;
/// Distance from the median of its tick, in standard deviations of the noise, at which a conversion is an outlier.
const OUTLIER_SIGMA: f64 = 5.0;

/// Why the firmware cannot be built for a robot.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ImageError {
    /// There is no controller for it.
    #[error("{0}")]
    #[diagnostic(help("`cargo run --release -- design --robot FILE` shows the design step by step"))]
    Design(#[from] DesignError),
    /// The boards cannot be this robot.
    #[error("{field}: {reason}")]
    Unfit {
        /// Dotted path in the robot file.
        field: &'static str,
        /// What is there, and what the firmware needs.
        reason: String,
        /// Advice: what to change, where.
        #[help]
        help: String,
    },
}

/// A robot as the firmware takes it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Image {
    /// The robot's name, at most [`NAME`].
    pub name: String,
    /// The designed controller.
    pub parameters: Parameters,
    /// Conversions of the wiper in a tick, of which the median is taken.
    pub conversions: u8,
    /// A conversion farther than this from the median is an outlier, LSB.
    pub outlier_lsb: u16,
    /// PWM frequency, Hz.
    pub pwm_hz: u32,
    /// PWM resolution: duty 1 is `2^pwm_bits` steps.
    pub pwm_bits: u8,
    /// The converter's curve: the codes that the controller expects for a voltage.
    pub curve: Curve,
}

/// [`AdcCurve`] in the chip's precision.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Full scale, codes.
    pub top_code: f32,
    /// Slope of the straight part, codes per V.
    pub codes_per_v: f32,
    /// How much too low the straight part reads, V.
    pub low_v: f32,
    /// Reads zero below, V.
    pub zero_below_v: f32,
    /// The parabola begins, V.
    pub bend_v: f32,
    /// Reads full scale above, V.
    pub saturates_v: f32,
    /// The parabola's coefficient, codes per V².
    pub bend_codes_per_v2: f32,
}

impl Image {
    /// Designs the controller and takes from the file what the boards need.
    ///
    /// # Errors
    /// No controller can be designed, or the first field that an ESP32 board cannot follow.
    pub fn of(robot: &Robot) -> Result<Self, ImageError> {
        let potentiometer = potentiometer(robot)?;
        battery(robot, potentiometer)?;
        let parameters = design::parameters(robot)?;
        let tick = f64::from(parameters.tick);
        // The parameters hold single precision.
        if (tick - TICK_S).abs() > 1e-6 * TICK_S {
            let reason = format!("the period is {tick} s, the firmware's loop runs every {TICK_S} s");
            return Err(unfit("controller.tick_s", reason, format!("set its value to {TICK_S:e}")));
        }
        if robot.name.len() > NAME {
            let reason = format!("`{}` is {} bytes long, the firmware keeps {NAME}", robot.name, robot.name.len());
            return Err(unfit("name", reason, "choose a shorter name".into()));
        }
        second(potentiometer)?;
        let adc = &potentiometer.adc;
        let (pwm_hz, pwm_bits) = pwm(robot)?;
        Ok(Self {
            name: robot.name.clone(),
            parameters,
            conversions: conversions(potentiometer)?,
            outlier_lsb: (OUTLIER_SIGMA * adc.noise_lsb.high).ceil() as u16,
            pwm_hz,
            pwm_bits,
            curve: Curve::new(&AdcCurve::new(adc)),
        })
    }
}

impl Curve {
    fn new(curve: &AdcCurve) -> Self {
        Self {
            top_code: curve.top_code as f32,
            codes_per_v: curve.codes_per_v as f32,
            low_v: curve.low_v as f32,
            zero_below_v: curve.zero_below_v as f32,
            bend_v: curve.bend_v as f32,
            saturates_v: curve.saturates_v as f32,
            bend_codes_per_v2: curve.bend_codes_per_v2 as f32,
        }
    }
}

/// A robot file and the files that it stands on: what a build must look at again when it changes. What cannot be read ends
/// the list, and is an error when the robot is loaded.
#[must_use]
pub fn files(path: &Path) -> Vec<PathBuf> {
    let base_of = |path: &PathBuf| -> Option<PathBuf> {
        let table: toml::Table = std::fs::read_to_string(path).ok()?.parse().ok()?;
        Some(path.parent()?.join(table.get("base")?.as_str()?))
    };
    std::iter::successors(Some(path.to_path_buf()), base_of).take(MOST_FILES).collect()
}

fn unfit(field: &'static str, reason: String, help: String) -> ImageError {
    ImageError::Unfit { field, reason, help }
}

fn potentiometer(robot: &Robot) -> Result<&Potentiometer, ImageError> {
    let Sensor::Potentiometer(potentiometer) = &robot.sensor else {
        let kind = if matches!(robot.sensor, Sensor::Ideal) { "ideal" } else { "encoder" };
        let reason = format!("`{kind}` is for simulation only, the firmware's boards read a potentiometer");
        let help = "describe the potentiometer: kind = \"potentiometer\" and its table [sensor.adc]";
        return Err(unfit("sensor.kind", reason, help.into()));
    };
    let supply = potentiometer.supply_v.value;
    if supply > PIN_LIMIT_V {
        let reason = format!("the wiper reaches {supply} V, a pin of the chip bears {PIN_LIMIT_V} V");
        return Err(unfit("sensor.supply_v", reason, "feed the potentiometer from the chip's own 3.3 V".into()));
    }
    let bits = potentiometer.adc.bits.value;
    if bits != ADC_BITS {
        let reason = format!("the converter has {bits} bits, the boards' have {ADC_BITS}");
        return Err(unfit("sensor.adc.bits", reason, format!("set its value to {ADC_BITS}")));
    }
    Ok(potentiometer)
}

/// The cell must be measured: without it the supervisor could not see that it is empty.
fn battery<'r>(robot: &'r Robot, potentiometer: &Potentiometer) -> Result<&'r Battery, ImageError> {
    let Some(battery) = &robot.supply.battery else {
        let reason = "there is none, and without its divider the firmware cannot tell when the cell is empty".into();
        let help = "add the table [supply.battery]; its `divider` is what the two resistors hand to the ADC";
        return Err(unfit("supply.battery", reason, help.into()));
    };
    let divider = battery.divider.value;
    let full = battery.open_circuit_v.iter().map(|[_, volt]| *volt).fold(0.0, f64::max);
    let top = potentiometer.adc.saturates_above_v.value;
    if full * divider >= top {
        let reason = format!(
            "a full cell of {full} V times {divider} is {} V at the pin, the converter saturates at {top} V",
            full * divider
        );
        let help = format!("choose resistors for a divider of at most {:.2}", 0.8 * top / full);
        return Err(unfit("supply.battery.divider", reason, help));
    }
    Ok(battery)
}

/// The boards read both wipers by the same converter, fed by the same supply.
fn second(potentiometer: &Potentiometer) -> Result<(), ImageError> {
    let Some(second) = &potentiometer.second else { return Ok(()) };
    let same_adc = second.adc.as_ref().is_none_or(|adc| *adc == potentiometer.adc);
    if !same_adc {
        let reason = "it differs from [sensor.adc], and the boards have one converter for both sensors".into();
        return Err(unfit("sensor.second.adc", reason, "leave it out".into()));
    }
    let supply = second.supply_v.as_ref().unwrap_or(&potentiometer.supply_v).value;
    if supply > PIN_LIMIT_V {
        let reason = format!("the wiper reaches {supply} V, a pin of the chip bears {PIN_LIMIT_V} V");
        return Err(unfit("sensor.second.supply_v", reason, "feed the potentiometer from the chip's supply".into()));
    }
    Ok(())
}

fn conversions(potentiometer: &Potentiometer) -> Result<u8, ImageError> {
    let adc = &potentiometer.adc;
    let (count, each) = (adc.conversions.value, adc.conversion_s.value);
    if count.fract() != 0.0 {
        let reason = format!("{count} conversions are no whole number");
        return Err(unfit("sensor.adc.conversions", reason, "choose a whole number".into()));
    }
    // One more for the cell.
    let wipers = if potentiometer.second.is_some() { 2.0 } else { 1.0 };
    let most = (((CONVERSION_SHARE * TICK_S / each).floor() - 1.0) / wipers).floor();
    if count > most {
        let of = if wipers > 1.0 { "either wiper" } else { "the wiper" };
        let reason = format!(
            "{count} conversions of {of} and one of the cell at {:.1} µs each take more than a third of a tick \
             of {:.0} µs",
            1e6 * each,
            1e6 * TICK_S
        );
        let help = if most < 1.0 {
            format!("sensor.adc.conversion_s must be at most {:.0e} s", 0.5 * CONVERSION_SHARE * TICK_S)
        } else {
            format!("set its value to at most {most}")
        };
        return Err(unfit("sensor.adc.conversions", reason, help));
    }
    // At most 64 (the schema's bound).
    Ok(count as u8)
}

/// Frequency in Hz and resolution in bits.
fn pwm(robot: &Robot) -> Result<(u32, u8), ImageError> {
    let (frequency, steps) = (robot.driver.pwm_frequency_hz.value, robot.driver.pwm_steps.value);
    let field = "driver.pwm_steps";
    if !(2.0..=MOST_PWM_STEPS).contains(&steps) || steps.log2().fract() != 0.0 {
        let reason = format!("{steps} steps, the chips' PWM (LEDC) has a power of two from 2 to {MOST_PWM_STEPS}");
        let help = format!("at {frequency} Hz choose {} or less", finest(frequency));
        return Err(unfit(field, reason, help));
    }
    if frequency * steps > PWM_CLOCK_HZ {
        let reason = format!(
            "{steps} steps at {frequency} Hz need a clock of {:.4} MHz, the chips' PWM (LEDC) has {} MHz",
            1e-6 * frequency * steps,
            1e-6 * PWM_CLOCK_HZ
        );
        return Err(unfit(field, reason, format!("choose {} steps or less", finest(frequency))));
    }
    let field = "driver.pwm_frequency_hz";
    if frequency.fract() != 0.0 {
        let reason = format!("{frequency} Hz is no whole number of hertz");
        return Err(unfit(field, reason, "choose a whole number".into()));
    }
    if PWM_CLOCK_HZ / (frequency * steps) > MOST_PWM_DIVIDER {
        let slowest = (PWM_CLOCK_HZ / (MOST_PWM_DIVIDER * steps)).ceil();
        let reason = format!("{frequency} Hz is too slow for the chips' PWM (LEDC) at {steps} steps");
        return Err(unfit(field, reason, format!("choose {slowest} Hz or more")));
    }
    Ok((frequency as u32, steps.log2() as u8))
}

/// The most steps at a frequency.
fn finest(frequency: f64) -> f64 {
    (PWM_CLOCK_HZ / frequency).log2().floor().exp2().clamp(2.0, MOST_PWM_STEPS)
}
