//! The sensor map of the controller: nominal curve of potentiometer and converter, or the file's correction.

use std::f64::consts::{PI, TAU};

use common::wrap;
use control::SecondSensor;
use control::sensor::{HARMONICS, Harmonic, KNOTS, Knot, SensorMap};

use super::DesignError;
use crate::angle_code::{AdcCurve, Track, angle_scale};
use crate::robot::{Correction, Potentiometer, Sensor};

/// Codes this many standard deviations of noise from an end cannot be told from it.
const END_SIGMA: f64 = 3.0;

/// The map of a sensor; `edge_margin` (rad) widens the arc on both sides.
pub(super) fn map(sensor: &Sensor, edge_margin: f64) -> Result<SensorMap, DesignError> {
    let mut map = match sensor {
        Sensor::Ideal | Sensor::Encoder(_) => digital(sensor),
        Sensor::Potentiometer(potentiometer) => wiper(potentiometer)?,
    };
    // Without an arc it has no effect, but it is a parameter that people read.
    map.edge_margin = edge_margin as f32;
    Ok(map)
}

/// The second potentiometer; `noises` are the standard deviations (any unit) of an uncalibrated and of a calibrated one.
pub(super) fn second(sensor: &Sensor, edge_margin: f64, noises: [f64; 2]) -> Result<Option<SecondSensor>, DesignError> {
    let Sensor::Potentiometer(first) = sensor else { return Ok(None) };
    let (Some(second), Some(resolved)) = (&first.second, first.second_resolved()) else { return Ok(None) };
    let noise = |part: &Potentiometer| noises[usize::from(part.correction.is_some())];
    let offset = &second.offset_deg;
    let turned = offset.value.to_radians();
    Ok(Some(SecondSensor {
        map: SensorMap { edge_margin: edge_margin as f32, ..wiper(&resolved)? },
        // Half a turn may be a rounding beyond the circle's end.
        offset: (wrap(turned) as f32).clamp(-PI as f32, PI as f32),
        tolerance: (offset.high - offset.value).max(offset.value - offset.low).to_radians() as f32,
        // From the middle of the first one's conversions to the middle of its own, which follow them.
        delay: (0.5 * (first.adc.duration_s() + resolved.adc.duration_s())) as f32,
        noise: (noise(&resolved) / noise(first)) as f32,
    }))
}

fn wiper(potentiometer: &Potentiometer) -> Result<SensorMap, DesignError> {
    let mut map = nominal(potentiometer);
    if let Some(correction) = &potentiometer.correction {
        apply(&mut map, &AdcCurve::new(&potentiometer.adc), correction)?;
    }
    map.half_play = (0.5 * potentiometer.hysteresis_deg.value.to_radians()) as f32;
    Ok(map)
}

fn digital(sensor: &Sensor) -> SensorMap {
    let scale = angle_scale(sensor);
    let mut map = SensorMap::EMPTY;
    let top = f64::from(scale.top_code) + 1.0;
    // No code means anything but an angle: nothing is beyond the ends.
    fill(&mut map, [(0.0, scale.zero), (top, scale.zero + scale.rad_per_code * top)].into_iter());
    map
}

fn nominal(potentiometer: &Potentiometer) -> SensorMap {
    let curve = AdcCurve::new(&potentiometer.adc);
    let track = Track::new(potentiometer);
    let mut map = SensorMap::EMPTY;
    let ends = END_SIGMA * potentiometer.adc.noise_lsb.high;
    map.lowest_code = ends.ceil() as u16;
    map.highest_code = (curve.top_code - ends).floor() as u16;
    // Straight up to where the lower end has caught up, straight to the bend, and a polygon in the parabola.
    let caught_up = curve.code(2.0 * curve.zero_below_v - curve.low_v);
    let bend = curve.code(curve.bend_v);
    let bent = KNOTS - 3;
    let codes = [0.0, caught_up, bend]
        .into_iter()
        .chain((1..=bent).map(|k| bend + (f64::from(map.highest_code) - bend) * k as f64 / bent as f64));
    let knots: Vec<_> = codes.map(|code| (code, track.angle(curve.voltage(code)))).collect();
    fill(&mut map, knots.into_iter());
    map.blind_to = track.angle(curve.voltage(f64::from(map.lowest_code))) as f32;
    map.blind_from = (track.angle(curve.voltage(f64::from(map.highest_code))) - TAU) as f32;
    map
}

fn apply(map: &mut SensorMap, curve: &AdcCurve, correction: &Correction) -> Result<(), DesignError> {
    let count = correction.cos_deg.len();
    if count != correction.sin_deg.len() || count > HARMONICS {
        return Err(DesignError::Harmonics { cos: count, sin: correction.sin_deg.len(), most: HARMONICS });
    }
    // The knots stay where the converter's nominal curve needs them; its line is the correction's.
    for knot in &mut map.knots {
        let straightened = curve.straightened(f64::from(knot.code));
        knot.angle = (correction.zero_deg + correction.deg_per_code * straightened).to_radians() as f32;
    }
    for (slot, (cos, sin)) in map.harmonics.iter_mut().zip(correction.cos_deg.iter().zip(&correction.sin_deg)) {
        *slot = Harmonic { cos: cos.to_radians() as f32, sin: sin.to_radians() as f32 };
    }
    map.harmonic_count = count as u16;
    map.blind_from = correction.blind_from_deg.to_radians() as f32;
    map.blind_to = correction.blind_to_deg.to_radians() as f32;
    Ok(())
}

/// Knots in order; the last one is repeated to the end.
fn fill(map: &mut SensorMap, points: impl Iterator<Item = (f64, f64)>) {
    let mut last = Knot::default();
    let mut points = points;
    for knot in &mut map.knots {
        if let Some((code, angle)) = points.next() {
            last = Knot { code: code as f32, angle: angle as f32 };
        }
        *knot = last;
    }
}
