//! What looks wrong in an imported run but may be meant: units and signs that do not fit together, a drive that never changes,
//! rows that come unevenly. Only where a number decides; what a recording refuses by itself is no warning (`plausible.rs`).

use std::f64::consts::{PI, TAU};

use common::statistics::median;

use super::mapping::Mapping;
use super::table::Table;
use super::units::Quantity;
use crate::{AngleReading, Drive, Recording};

/// No rig samples a shaft faster than this, Hz.
const FASTEST_HZ: f64 = 100e3;
/// Sampled more slowly than this, no motion of a motor is seen, Hz.
const SLOWEST_HZ: f64 = 5.0;
/// A step of time beyond the median's share of this is uneven.
const UNEVEN: f64 = 0.2;
/// Steps of the angle in the recording's and in the file's unit that are the wrap of a turn.
const WRAP_DEG: std::ops::Range<f64> = 340.0..361.0;
const WRAP_RAD: std::ops::Range<f64> = 6.0..6.4;
/// Drive and motion whose correlation is below this are opposed.
const OPPOSED: f64 = -0.5;
/// Samples that a comparison of columns needs.
const FEWEST: usize = 50;

/// Sentences for people.
pub(super) fn look(recording: &Recording, table: &Table, mapping: &Mapping) -> Vec<String> {
    let mut found = Vec::new();
    if mapping.rate_hz.is_none() {
        found.extend(time(recording));
    }
    found.extend(drive(recording));
    found.extend(angle_unit(recording, mapping));
    found.extend(speed_unit(recording, table, mapping));
    found.extend(direction(recording, mapping));
    found
}

fn time(recording: &Recording) -> Vec<String> {
    let steps: Vec<f64> = recording.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(middle) = median(&mut steps.clone()) else { return Vec::new() };
    let mut found = Vec::new();
    let rate = 1.0 / middle;
    if rate > FASTEST_HZ {
        found.push(format!(
            "{rate:.0} rows a second: is the time's unit right? It would be 1000 times as long in ms for µs"
        ));
    } else if rate < SLOWEST_HZ {
        found
            .push(format!("{rate:.2} rows a second: is the time's unit right? A time in ms that is called s looks so"));
    }
    let uneven = steps.iter().filter(|step| (**step - middle).abs() > UNEVEN * middle).count();
    if uneven > 0 {
        let longest = steps.iter().copied().fold(0.0, f64::max);
        found.push(format!(
            "sampled unevenly: {uneven} of {} steps of time are more than 20 % off their median of {:.3} ms, the longest is {:.3} ms",
            steps.len(),
            middle * 1e3,
            longest * 1e3
        ));
    }
    found
}

fn drive(recording: &Recording) -> Option<String> {
    let (Drive::Duty(column) | Drive::Voltage(column)) = &recording.drive;
    let first = *column.first()?;
    let constant = column.len() > 1 && column.iter().all(|value| *value == first);
    let switched = recording.enable.windows(2).any(|pair| pair[0] != pair[1]);
    (constant && !switched).then(|| {
        format!("the drive is {first} in every row: is it the right column? A model is not tested by one drive")
    })
}

/// Known angles with their times.
fn angles(recording: &Recording) -> Vec<(f64, f64)> {
    let AngleReading::Angle(column) = &recording.angle else { return Vec::new() };
    recording.t_s.iter().zip(column).filter_map(|(t_s, angle)| Some((*t_s, (*angle)?))).collect()
}

/// Steps of the angle; those as large as half a turn may be wraps.
fn steps(recording: &Recording) -> Vec<f64> {
    angles(recording).windows(2).map(|pair| pair[1].1 - pair[0].1).collect()
}

/// Wraps of a turn in another unit than the one that was said. A reading that is wrapped stays within one turn.
fn angle_unit(recording: &Recording, mapping: &Mapping) -> Option<String> {
    let source = mapping.columns.get(&Quantity::Angle)?;
    let factor = source.unit.factor;
    let steps = steps(recording);
    let usual = median(&mut steps.iter().map(|step| step.abs()).collect::<Vec<_>>())?;
    let (low, high) =
        angles(recording).iter().fold((f64::MAX, f64::MIN), |(low, high), (_, a)| (low.min(*a), high.max(*a)));
    let wraps = |range: &std::ops::Range<f64>, scale: f64| {
        high - low < range.end * scale
            && usual < 0.1 * range.start * scale
            && steps.iter().any(|step| range.contains(&(step.abs() / scale)))
    };
    if (factor - 1.0).abs() < 1e-9 && wraps(&WRAP_DEG, 1.0) {
        return Some(format!("\"{}\" is said to be in rad and jumps by 360: it looks like degrees", source.column));
    }
    // In the file's own numbers, a turn is 2π where degrees or turns were said.
    let is_rad = (factor - 1.0).abs() < 1e-9;
    if !is_rad && (factor * 360.0 - TAU).abs() < 1e-9 && wraps(&WRAP_RAD, factor) {
        return Some(format!("\"{}\" is said to be in degrees and jumps by 2π: it looks like radians", source.column));
    }
    None
}

/// The angle's change against the integral of a speed that was recorded beside it.
fn speed_unit(recording: &Recording, table: &Table, mapping: &Mapping) -> Option<String> {
    let (angle, speed) = (mapping.columns.get(&Quantity::Angle)?, mapping.columns.get(&Quantity::Speed)?);
    let (angles, speeds) = (table.column(&angle.column)?, table.column(&speed.column)?);
    let times = mapping.columns.get(&Quantity::Time).and_then(|time| Some((time, table.column(&time.column)?)));
    let at = |row: usize| match (&times, mapping.rate_hz) {
        (Some((source, column)), _) => source.value(column[row]),
        (None, rate) => row as f64 / rate.unwrap_or(1.0),
    };
    let inside = (recording.t_s.first()?, recording.t_s.last()?);
    let (mut changes, mut products, mut squares, mut count) = (0.0, 0.0, 0.0, 0);
    for row in 1..angles.len() {
        let (from, to) = (at(row - 1), at(row));
        let change = angle.value(angles[row]) - angle.value(angles[row - 1]);
        let expected = 0.5 * (speed.value(speeds[row]) + speed.value(speeds[row - 1])) * (to - from);
        // Half a turn may be a wrap; beyond the window is another run.
        let known = change.abs() < PI && expected.is_finite() && from >= *inside.0 && to <= *inside.1;
        if known {
            changes += change * change;
            products += change * expected;
            squares += expected * expected;
            count += 1;
        }
    }
    // Without a common course nothing is said about the scale.
    if count < FEWEST || products * products < 0.8 * changes * squares {
        return None;
    }
    let ratio = products / squares;
    if ratio < 0.0 {
        return Some(format!(
            "\"{}\" and \"{}\" turn in opposite ways: one of them has the wrong sign",
            angle.column, speed.column
        ));
    }
    (!(0.5..2.0).contains(&ratio)).then(|| {
        format!(
            "the angle \"{}\" changes {ratio:.3} times as fast as \"{}\" says: one of their units is wrong",
            angle.column, speed.column
        )
    })
}

/// A motor works on its shaft: over a run that ends as slowly as it began, drive and speed have the same sign on average.
/// Where they are clearly opposed, one of the signs is wrong.
fn direction(recording: &Recording, mapping: &Mapping) -> Option<String> {
    // With a goal the drive is computed from the angle: a reversed angle is reversed in both.
    if !mapping.has(Quantity::Duty) && !mapping.has(Quantity::Voltage) && !mapping.has(Quantity::TerminalVoltage) {
        return None;
    }
    let AngleReading::Angle(angles) = &recording.angle else { return None };
    let (Drive::Duty(drive) | Drive::Voltage(drive)) = &recording.drive;
    let (mut work, mut motion, mut driven, mut count) = (0.0, 0.0, 0.0, 0);
    for row in 1..recording.len() {
        let (Some(before), Some(now)) = (angles[row - 1], angles[row]) else { continue };
        if !recording.enable[row - 1] {
            continue;
        }
        let speed = common::wrap(now - before) / (recording.t_s[row] - recording.t_s[row - 1]);
        work += drive[row - 1] * speed;
        motion += speed * speed;
        driven += drive[row - 1] * drive[row - 1];
        count += 1;
    }
    (count >= FEWEST && work < OPPOSED * (motion * driven).sqrt()).then(|| {
        "the shaft turns against its drive nearly all the time: one of the two has the wrong sign; put - in front of its \
         column (--map angle=-NAME:deg)"
            .into()
    })
}
