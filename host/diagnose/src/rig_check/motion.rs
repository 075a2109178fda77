//! What the sensor and the bridge of a recording said, in the recording's own units: neither the angle's nor the time's is
//! taken for granted.

use std::f64::consts::TAU;

use common::{median, quantile};
use hal_sim::driver::Driver;
use recording::{AngleReading, Drive, Recording};
use robot_file::robot::{Robot, Sensor};

use crate::{floor, track};

/// A wrapped reading jumps by at least this share of its range.
const JUMP: f64 = 0.6;
/// A range that is a wrapped turn's is at least and at most this share of the turn.
const TURN_SHARE: std::ops::Range<f64> = 0.75..1.02;
/// Duty beyond 1 by no more is rounding.
const ROUNDING: f64 = 1e-6;

/// How the drive column is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveAs {
    /// As its name says.
    Named,
    /// As a duty whose full scale is this.
    Duty(f64),
    /// As a voltage that the bridge was told to give, V.
    Volts,
    /// As a voltage in mV.
    Millivolts,
}

/// One run.
#[derive(Clone)]
pub struct Motion {
    /// In the recording's unit of time.
    pub t: Vec<f64>,
    /// In the recording's unit of angle, on one continuous scale; NaN where there is none.
    pub angle: Vec<f64>,
    /// Mean voltage behind the driver's drop, from a sample to the next, V.
    pub volts: Vec<f64>,
    /// Whether the bridge drives.
    pub enable: Vec<bool>,
    /// Largest size of the drive column.
    pub largest_drive: f64,
    /// A turn in the column's unit, where the reading is wrapped.
    pub turn: Option<f64>,
    /// Usual time between samples.
    pub usual_step: f64,
    /// Standard deviation of the reading's noise, in its unit.
    pub noise: f64,
}

impl Motion {
    /// Or why no motion can be read from a recording: few samples, columns of unequal length, time that does not increase, a
    /// drive that is not finite.
    pub fn new(robot: &Robot, recording: &Recording) -> Result<Self, String> {
        let (Drive::Duty(drive) | Drive::Voltage(drive)) = &recording.drive;
        let n = recording.len();
        let read = track::readings(robot, &recording.angle)?;
        if n < 2 {
            return Err(format!("{n} of the two samples that a motion needs"));
        }
        if recording.t_s.iter().any(|t| !t.is_finite()) || recording.t_s.windows(2).any(|pair| pair[1] <= pair[0]) {
            return Err("time does not increase from sample to sample".to_owned());
        }
        if [drive.len(), read.len(), recording.enable.len()].iter().any(|&length| length != n) {
            return Err("its columns have different lengths".to_owned());
        }
        if drive.iter().any(|value| !value.is_finite()) {
            return Err("its drive is not finite everywhere".to_owned());
        }
        let turn = match &recording.angle {
            AngleReading::Angle(_) => turn(robot, &read),
            AngleReading::Adc(_) => Some(TAU),
        };
        let angle: Vec<f64> = match turn {
            Some(turn) => {
                let unit = turn / TAU;
                let scaled: Vec<Option<f64>> = read.iter().map(|cell| cell.map(|angle| angle / unit)).collect();
                track::unwrapped(&scaled, 0.0).into_iter().map(|angle| unit * angle).collect()
            }
            None => read.iter().map(|cell| cell.unwrap_or(f64::NAN)).collect(),
        };
        let mut steps: Vec<f64> = recording.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let usual_step = median(&mut steps).unwrap_or(0.0);
        Ok(Self {
            t: recording.t_s.clone(),
            noise: floor::fast_noise(&angle),
            angle,
            volts: volts(robot, recording, DriveAs::Named),
            enable: recording.enable.clone(),
            largest_drive: drive.iter().fold(0.0, |most: f64, value| most.max(value.abs())),
            turn,
            usual_step,
        })
    }

    /// The same motion with the drive column read in another way.
    pub fn driven(&self, robot: &Robot, recording: &Recording, drive_as: DriveAs) -> Self {
        Self { volts: volts(robot, recording, drive_as), ..self.clone() }
    }

    /// Whether the drive is a duty that is none.
    pub fn is_beyond_duty(&self) -> bool {
        self.largest_drive > 1.0 + ROUNDING
    }
}

/// Voltage at the terminals, V; of a duty by the supply, behind what the file's driver takes.
fn volts(robot: &Robot, recording: &Recording, drive_as: DriveAs) -> Vec<f64> {
    let (Drive::Duty(drive) | Drive::Voltage(drive)) = &recording.drive;
    let is_voltage = matches!(recording.drive, Drive::Voltage(_));
    let measured = (recording.supply_v.len() == drive.len()).then_some(&recording.supply_v);
    let supply = |i: usize| measured.map_or(robot.supply.rail_v.value, |supply| supply[i]);
    let (driver, laws) = (Driver::new(robot), robot.effects.laws());
    let drop_v = laws.bridge().drop_v;
    let behind_the_bridge = |i: usize, duty: f64| {
        let before = laws.duty(driver.switched(duty)) * supply(i);
        (before.abs() - drop_v).max(0.0).copysign(before)
    };
    let one = |i: usize, value: f64| match drive_as {
        DriveAs::Named if is_voltage => value,
        DriveAs::Named => behind_the_bridge(i, value),
        DriveAs::Duty(full_scale) => behind_the_bridge(i, value / full_scale),
        DriveAs::Volts => behind_the_bridge(i, value / supply(i)),
        DriveAs::Millivolts => value / 1000.0,
    };
    drive.iter().enumerate().map(|(i, &value)| one(i, value)).collect()
}

/// A full turn in the unit of a wrapped reading; `None` of one that is not wrapped. What is wrapped stays within a turn and jumps
/// by about as much.
fn turn(robot: &Robot, read: &[Option<f64>]) -> Option<f64> {
    let known: Vec<f64> = read.iter().copied().flatten().collect();
    let range = known.iter().copied().fold(f64::MIN, f64::max) - known.iter().copied().fold(f64::MAX, f64::min);
    let mut steps: Vec<f64> = known.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let jumps = steps.iter().filter(|step| **step > JUMP * range).count();
    if jumps == 0 || quantile(&mut steps, 0.5)? > 0.3 * range {
        return None;
    }
    let counts = match &robot.sensor {
        Sensor::Encoder(encoder) => Some(encoder.counts_per_turn.value),
        Sensor::Ideal | Sensor::Potentiometer(_) => None,
    };
    let powers = (8..=16).map(|bits| f64::from(1 << bits));
    let mut turns = [TAU, 360.0, 1.0].into_iter().chain(counts).chain(powers);
    // Without a better one a turn of radians, as recordings have it.
    turns.find(|turn| TURN_SHARE.contains(&(range / turn))).or(Some(TAU).filter(|turn| range < *turn))
}
