//! The second of two potentiometers: its correction, and where it stands on the shaft.

use robot_file::angle_code::{AdcCurve, corrected_angle};
use robot_file::robot::{Correction, Potentiometer, Quantity, Robot, Sensor};
use serde::Serialize;

use super::error::PotentiometerError;
use super::line::{potentiometer, require_potentiometer};
use super::summary::PotentiometerFit;
use common::conventions::{degrees, radians};
use common::wrap;
use recording::{AngleReading, Recording};

/// The offset is found as exactly as the two corrections leave it, but no range is narrower than this, degrees.
const LEAST_RANGE_DEG: f64 = 0.3;

/// What one run says about the second sensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SecondFit {
    /// In angles from the middle of its own gap.
    pub own: PotentiometerFit,
    /// For `sensor.second.offset_deg`.
    #[serde(rename = "second_offset_deg")]
    pub offset: Quantity,
}

/// Fits the second sensor's correction to one recording at constant voltage, and its offset from the first one: by the
/// first one's correction where the robot file has one, by one from the same recording where it has none.
///
/// # Errors
/// As [`potentiometer`], and the robot or the recording has one sensor only.
pub fn second_potentiometer(robot: &Robot, recording: &Recording) -> Result<SecondFit, PotentiometerError> {
    let first = require_potentiometer(robot)?;
    let second = first.second_resolved().ok_or(PotentiometerError::NoSecond)?;
    if recording.adc_second.is_empty() {
        return Err(PotentiometerError::NoCodes { run: recording.path.display().to_string(), column: "adc_second" });
    }
    let alone = Robot { sensor: Sensor::Potentiometer(Box::new(second.clone())), ..robot.clone() };
    let angle = AngleReading::Adc(recording.adc_second.clone());
    let own = potentiometer(&alone, &Recording { angle, adc_second: Vec::new(), ..recording.clone() })?;
    let correction = match &first.correction {
        Some(correction) => correction.clone(),
        None => potentiometer(robot, recording)?.correction,
    };
    let offset = offset(recording, (first, &correction), (&second, &own))?;
    Ok(SecondFit { own, offset })
}

/// Mean of what the two differ by while both see.
fn offset(
    recording: &Recording,
    (first, correction): (&Potentiometer, &Correction),
    (second, own): (&Potentiometer, &PotentiometerFit),
) -> Result<Quantity, PotentiometerError> {
    let run = || recording.path.display().to_string();
    let AngleReading::Adc(codes) = &recording.angle else {
        return Err(PotentiometerError::NoCodes { run: run(), column: "adc" });
    };
    // The second one's conversions follow the first one's; meanwhile the shaft turns on.
    let later = own.speed_rad_per_s * 0.5 * (first.adc.duration_s() + second.adc.duration_s());
    let curves = [AdcCurve::new(&first.adc), AdcCurve::new(&second.adc)];
    let differences: Vec<f64> = recording
        .t_s
        .iter()
        .zip(codes.iter().zip(&recording.adc_second))
        .filter(|(t_s, _)| (own.from_s..=own.to_s).contains(*t_s))
        .filter_map(|(_, (one, two))| {
            let one = seen(correction, &curves[0], (*one)?)?;
            let two = seen(&own.correction, &curves[1], (*two)?)?;
            Some(one - two + later)
        })
        .collect();
    let (sin, cos) = differences.iter().fold((0.0, 0.0), |(sin, cos), d| (sin + d.sin(), cos + d.cos()));
    let rough = f64::atan2(sin, cos);
    let mut about: Vec<f64> = differences.iter().map(|difference| wrap(difference - rough)).collect();
    // The middle one: spikes do not move it.
    about.sort_by(f64::total_cmp);
    let Some(middle) = about.get(about.len() / 2) else {
        return Err(PotentiometerError::Undetermined { samples: 0 });
    };
    let value = degrees(rough + middle).rem_euclid(360.0);
    let range = LEAST_RANGE_DEG.max(2.0 * correction.residual_deg.hypot(own.correction.residual_deg));
    let name = recording.path.file_name().map_or_else(|| "a run in memory".into(), |name| name.to_string_lossy());
    let source = format!("scram identify potentiometer --sensor second {name}: {} samples of both", differences.len());
    Ok(Quantity { value, low: value - range, high: value + range, source })
}

/// The angle of a code, rad; `None` in the blind arc.
fn seen(correction: &Correction, curve: &AdcCurve, code: u16) -> Option<f64> {
    if code == 0 || f64::from(code) >= curve.top_code {
        return None;
    }
    let angle = wrap(corrected_angle(correction, curve, f64::from(code)));
    let blind = radians(correction.blind_from_deg)..=radians(correction.blind_to_deg);
    (!blind.contains(&angle)).then_some(angle)
}
