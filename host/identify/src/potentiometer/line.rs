//! One constant-voltage run of raw codes becomes the sensor's correction.

use std::f64::consts::{PI, TAU};

use robot_file::angle_code::{AdcCurve, Track, angle_scale};
use robot_file::robot::{Potentiometer, Quantity, Robot, Sensor};

use super::arc::{self, Reliable, Zero, ZeroSource};
use super::curve::{self, Curve, Fit};
use super::error::PotentiometerError;
use super::phase::{self, FEWEST_TURNS, Ramp, Reading};
use super::summary::{PotentiometerFit, summarise};
use recording::{AngleReading, Drive, Recording};

/// Guard taken off both ends of the reliable arc before fitting, rad.
const GUARD: f64 = 0.5 * PI / 180.0;
/// How far the nominal line may be off when the gap is looked for, rad.
const SLACK: f64 = 12.0 * PI / 180.0;
/// Where the fit misses by more than this at the ends of the reliable arc, the end is cut off, rad.
const END_TOLERANCE: f64 = 0.3 * PI / 180.0;
/// Mean phase of a turn against the phase polynomial: RMS beyond which the speed is not smooth enough, rad.
const ROUGH_TURNS: f64 = 0.5 * PI / 180.0;
/// Change of speed over the stretch beyond which it is not nearly constant.
const MOST_DRIFT: f64 = 0.1;
/// Standard deviation of the drive over its mean beyond which it is not constant.
const MOST_DRIVE_RIPPLE: f64 = 0.02;

/// Fits the sensor's correction to one recording at constant voltage.
///
/// # Errors
/// When the file has no potentiometer, or the recording is not one of raw codes at a steady speed over at least five
/// turns.
pub fn potentiometer(robot: &Robot, recording: &Recording) -> Result<PotentiometerFit, PotentiometerError> {
    let sensor = require_potentiometer(robot)?;
    let converter = AdcCurve::new(&sensor.adc);
    let track = Track::new(sensor);
    let all = readings(sensor, &converter, &track, recording)?;
    let ramp = phase::find(&all)?;
    drive_is_constant(recording, &ramp)?;
    let steady: Vec<Reading> = all.into_iter().filter(|r| ramp.x(r.t).abs() <= 1.0).collect();

    let scale = angle_scale(&robot.sensor);
    let line = Curve::line(scale.zero, scale.rad_per_code);
    let (fit, reliable) = fit_reliable(&steady, &ramp, &line, (converter.top_code, nonlinearity(sensor, &line)))?;
    speed_is_smooth(&steady, &fit, reliable)?;
    let blind = TAU - (reliable.to - reliable.from);
    if blind < 2.0 * track.half_gap {
        let (blind, gap) = (blind.to_degrees(), 2.0 * track.half_gap.to_degrees());
        let detail = format!("codes fail to follow over {blind:.0}° only, less than the gap of {gap:.0}°");
        return Err(PotentiometerError::NoArc { detail });
    }

    // The nominal curve says where zero is expected, the gap itself where it is.
    let grid = nominal_grid(&converter, &track);
    let offset = arc::line_zero(&fit.curve, reliable, &grid).unwrap_or(0.0);
    let zero = arc::gap_middle(&steady, &fit.ramp, converter.top_code, (offset, 2.0 * track.half_gap, SLACK))
        .unwrap_or(Zero { angle: offset, uncertainty: nominal_uncertainty(sensor), source: ZeroSource::NominalLine });
    Ok(summarise(robot, recording, &converter, &track, &steady, &fit, reliable, (zero, offset)))
}

/// The potentiometer of a robot file.
///
/// # Errors
/// [`PotentiometerError::NoPotentiometer`].
pub fn require_potentiometer(robot: &Robot) -> Result<&Potentiometer, PotentiometerError> {
    match &robot.sensor {
        Sensor::Potentiometer(sensor) => Ok(sensor),
        Sensor::Ideal => Err(PotentiometerError::NoPotentiometer { kind: "ideal" }),
        Sensor::Encoder(_) => Err(PotentiometerError::NoPotentiometer { kind: "encoder" }),
    }
}

/// Samples while the bridge drives.
fn readings(
    sensor: &Potentiometer,
    converter: &AdcCurve,
    track: &Track,
    recording: &Recording,
) -> Result<Vec<Reading>, PotentiometerError> {
    let run = || recording.path.display().to_string();
    let AngleReading::Adc(codes) = &recording.angle else {
        return Err(PotentiometerError::NoCodes { run: run(), column: "adc" });
    };
    let top = converter.top_code as u16;
    let straight_from = converter.zero_below_v + 0.05 * sensor.supply_v.value;
    let straight_to = converter.bend_v.min(converter.saturates_v);
    let mut out = Vec::with_capacity(codes.len());
    for (sample, code) in codes.iter().enumerate() {
        let Some(code) = *code else { continue };
        if code > top {
            return Err(PotentiometerError::CodeTooLarge { run: run(), sample, t_s: recording.t_s[sample], code, top });
        }
        if !recording.enable.get(sample).copied().unwrap_or(true) {
            continue;
        }
        let voltage = converter.voltage(f64::from(code));
        out.push(Reading {
            t: recording.t_s[sample],
            code: f64::from(code),
            straightened: converter.straightened(f64::from(code)),
            nominal: track.angle(voltage),
            middle: voltage > straight_from && voltage < straight_to,
        });
    }
    if out.len() < 50 {
        let seconds = out.last().map_or(0.0, |last| last.t - out[0].t);
        return Err(PotentiometerError::TooShort { turns: 0.0, seconds, fewest: FEWEST_TURNS });
    }
    Ok(out)
}

/// Refuses a drive that was not constant over the steady stretch.
fn drive_is_constant(recording: &Recording, ramp: &Ramp) -> Result<(), PotentiometerError> {
    let (column, values) = match &recording.drive {
        Drive::Duty(values) => ("duty", values),
        Drive::Voltage(values) => ("voltage_v", values),
    };
    let inside: Vec<f64> =
        recording.t_s.iter().zip(values).filter(|(t, _)| ramp.x(**t).abs() <= 1.0).map(|(_, &value)| value).collect();
    let n = inside.len().max(1) as f64;
    let mean = inside.iter().sum::<f64>() / n;
    let spread = (inside.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    if spread > MOST_DRIVE_RIPPLE * mean.abs() {
        return Err(PotentiometerError::DriveVaries { column, percent: 100.0 * spread / mean.abs().max(1e-9) });
    }
    Ok(())
}

/// Fits where the codes follow the shaft and cuts off the ends where the fit does not follow the codes.
fn fit_reliable(
    steady: &[Reading],
    ramp: &Ramp,
    line: &Curve,
    (top_code, nonlinearity): (f64, f64),
) -> Result<(Fit, Reliable), PotentiometerError> {
    let found = arc::reliable(steady, ramp, top_code).ok_or_else(|| PotentiometerError::NoArc {
        detail: "the codes follow the shaft over less than a third of the turn, or all around it".into(),
    })?;
    let mut reliable = found.shrunk(GUARD, GUARD);
    let mut ramp = ramp.clone();
    let mut best = None;
    for _ in 0..2 {
        let inside: Vec<Reading> = steady.iter().filter(|r| reliable.contains(ramp.angle(r.t))).copied().collect();
        let fit = curve::fit(&inside, &ramp, line, nonlinearity)
            .ok_or(PotentiometerError::Undetermined { samples: inside.len() })?;
        let residuals: Vec<(f64, f64)> =
            inside.iter().map(|r| (fit.ramp.angle(r.t), curve::residual(&fit.curve, &fit.ramp, r))).collect();
        // The fit's own gauge is used from here on; it differs by the mean linearity error.
        ramp = fit.ramp.clone();
        let trimmed =
            arc::trimmed(reliable, &residuals, fit.sigma, (2.0_f64.to_radians(), END_TOLERANCE, 12.0_f64.to_radians()));
        let done = trimmed == reliable;
        best = Some((fit, reliable));
        if done {
            break;
        }
        reliable = trimmed;
    }
    best.ok_or(PotentiometerError::Undetermined { samples: steady.len() })
}

/// Refuses a stretch whose speed drifts far or whose turns come early and late.
fn speed_is_smooth(steady: &[Reading], fit: &Fit, reliable: Reliable) -> Result<(), PotentiometerError> {
    let (slowest, fastest) = fit.ramp.speed_range();
    if fastest - slowest > MOST_DRIFT * fastest {
        return Err(PotentiometerError::SpeedVaries { low_hz: slowest / TAU, high_hz: fastest / TAU });
    }
    let mut turns: std::collections::BTreeMap<i64, Vec<f64>> = std::collections::BTreeMap::new();
    for reading in steady {
        let angle = fit.ramp.angle(reading.t);
        if reliable.contains(angle) {
            turns
                .entry((angle / TAU).floor() as i64)
                .or_default()
                .push(curve::residual(&fit.curve, &fit.ramp, reading));
        }
    }
    let means: Vec<f64> = turns.values_mut().filter(|v| v.len() >= 10).filter_map(|v| common::median(v)).collect();
    let rms = (means.iter().map(|m| m * m).sum::<f64>() / means.len().max(1) as f64).sqrt();
    let typical = means.len().max(1) as f64 / steady.len() as f64;
    let limit = ROUGH_TURNS.max(4.0 * fit.sigma * typical.sqrt());
    if rms > limit {
        return Err(PotentiometerError::RoughTurns { rms_deg: rms.to_degrees(), limit_deg: limit.to_degrees() });
    }
    Ok(())
}

/// Size of an amplitude (rad) that the converter's integral nonlinearity leads one to expect. A wave over the code falls on
/// two or three neighbouring harmonics; a file that says zero is not quite believed.
fn nonlinearity(sensor: &Potentiometer, line: &Curve) -> f64 {
    (0.6 * sensor.adc.inl_lsb.value.abs() * line.per_code).max(1e-3)
}

/// Straightened code and nominal angle (rad) along the track.
pub(super) fn nominal_grid(converter: &AdcCurve, track: &Track) -> Vec<(f64, f64)> {
    (1..converter.top_code as u32)
        .step_by(8)
        .map(|code| {
            let voltage = converter.voltage(f64::from(code));
            (converter.codes_per_v * (voltage - converter.low_v), track.angle(voltage))
        })
        .collect()
}

/// Standard uncertainty (rad) of the zero by the nominal line: the quoted ranges taken as ± two standard deviations.
fn nominal_uncertainty(sensor: &Potentiometer) -> f64 {
    let sigma = |quantity: &Quantity| 0.25 * (quantity.high - quantity.low);
    let per_volt = sensor.electrical_angle_deg.value.to_radians() / sensor.supply_v.value;
    let low = sigma(&sensor.adc.low_reading_v) * per_volt;
    // A wrong gain turns about code 0; its mean over the track is half of the electrical angle.
    let half = 0.5 * sensor.electrical_angle_deg.value.to_radians();
    let gain = sigma(&sensor.adc.full_scale_v) / sensor.adc.full_scale_v.value * half;
    let supply = sigma(&sensor.supply_v) / sensor.supply_v.value * half;
    // 0.5° even if the file quotes no range.
    (low * low + gain * gain + supply * supply).sqrt().max(0.5_f64.to_radians())
}
