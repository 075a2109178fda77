//! A recording made ready for rollouts: angles on one scale, inputs integrated, the run cut into segments.

use std::f64::consts::TAU;

use common::{quantile, wrap};
use hal_sim::driver::Driver;
use robot_file::angle_code::{AdcCurve, Track as Element, angle_scale, corrected_angle};
use robot_file::robot::{Potentiometer, Robot, Sensor};

use super::DiagnoseError;
use super::blind_arc::{MARGIN, drop_jumps};
use super::probe::SLOW;
use super::repeats::Repeats;
use recording::{AngleReading, Drive, Recording};

/// Readings that are wrapped range over no more turns than this.
const WRAPPED: f64 = 1.02;
/// A rollout needs at least this many readings.
const FEWEST_READINGS: usize = 10;
/// A step in time this many times the usual one ends a segment.
pub const GAP: f64 = 4.0;

/// One run.
#[derive(Clone, Debug)]
pub struct Track {
    /// For messages and plots.
    pub name: String,
    /// Seconds.
    pub t: Vec<f64>,
    /// Angle read, rad, unwrapped where readings follow each other; NaN where there is none.
    pub angle: Vec<f64>,
    /// Weight of each reading in fits and judgements: 0 where missing or a spike, else 1.
    pub weight: Vec<f64>,
    /// What the bridge's switches do from this sample to the next: duty; or V where `terminals_measured`.
    pub drive: Vec<f64>,
    /// Largest size of `drive`.
    pub drive_scale: f64,
    /// The voltage was measured at the terminals: the bridge's drop, deadband and sag lie before that point.
    pub terminals_measured: bool,
    /// Supply measured, V; empty without a column and where the terminals were measured.
    pub supply_v: Vec<f64>,
    /// The angle was read as a potentiometer's code, so that its blind arc is in it.
    pub has_blind_arc: bool,
    /// Readings dropped because they are from the sensor's blind arc.
    pub dropped: usize,
    /// Missing readings in a row across which the turns are counted right.
    pub counted_across: usize,
    /// Readings that repeat the one before; where they were held they are dropped.
    pub repeats: Repeats,
    /// Sum of squares by which those that were dropped are off, rad².
    pub held_square: f64,
    /// Integral of `drive` up to each sample.
    pub drive_integral: Vec<f64>,
    /// Whether the bridge drives from this sample to the next.
    pub enable: Vec<bool>,
    /// Current, A, NaN where missing; empty without a column.
    pub current: Vec<f64>,
    /// Of a robot on the ground: where it begins, x and y, m, and heading, rad.
    pub first_pose: Option<[f64; 3]>,
    /// Torque that a body on the ground has on the shaft from this sample to the next, N·m; empty on a bench.
    pub load_torque: Vec<f64>,
    /// Samples around which the readings hardly say how that body pulls; empty where they do.
    pub pull_unknown: Vec<bool>,
    /// Time since the shaft stood or turned round, s.
    pub since_reversal: Vec<f64>,
    /// Which of all runs it is.
    pub place: usize,
    /// Rollouts.
    pub segments: Vec<Segment>,
}

/// One rollout: samples `first..last` of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// First sample.
    pub first: usize,
    /// One past the last sample.
    pub last: usize,
    /// It follows the segment before it without a gap, so what no sensor sees (bristle, battery) carries over.
    pub linked: bool,
    /// No reading is missing in between, or none of so many that the shaft may turn half round meanwhile: the turns are counted right.
    pub whole: bool,
}

/// How to cut runs.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Length of a segment, s.
    pub horizon_s: f64,
    /// At most this many segments a run, evenly spread in blocks.
    pub most_segments: usize,
}

/// A rig may turn so many times as fast as its file says.
const FASTER: f64 = 2.0;
/// rad.
const NEARLY_HALF_A_TURN: f64 = 2.5;

/// Shortest time over which a speed is taken from readings, s.
const SPEED_OVER_S: f64 = 0.02;

/// Time since the shaft was last slower than `slow` (rad/s) or turned the other way, s, as the readings tell it at each sample.
fn since_reversal(t: &[f64], angle: &[f64], slow: f64) -> Vec<f64> {
    let mut since = vec![0.0; t.len()];
    let (mut back, mut last, mut turned) = (0, t.first().copied().unwrap_or(0.0), 0.0);
    for k in 0..t.len() {
        while back + 1 < k && t[k] - t[back + 1] >= SPEED_OVER_S {
            back += 1;
        }
        let speed = (angle[k] - angle[back]) / (t[k] - t[back]).max(SPEED_OVER_S);
        // Where readings are missing, the shaft goes on as before.
        if speed.is_finite() {
            if speed.abs() < slow || speed * turned < 0.0 {
                last = t[k];
            }
            turned = speed;
        }
        since[k] = t[k] - last;
    }
    since
}

impl Track {
    /// Checks a recording and makes it ready; `index` names a run without a path.
    pub fn new(robot: &Robot, recording: &Recording, index: usize) -> Result<Self, DiagnoseError> {
        let name = recording
            .path
            .file_stem()
            .map_or_else(|| format!("run {}", index + 1), |stem| stem.to_string_lossy().into_owned());
        let bad = |problem: String, help: &str| DiagnoseError::Recording {
            run: name.clone(),
            problem,
            help: help.to_owned(),
        };
        let n = recording.len();
        if n < 2 * FEWEST_READINGS {
            return Err(bad(format!("only {n} samples"), "a run needs at least a few rollouts of 0.1 s"));
        }
        if let Some(i) = (1..n).find(|&i| !recording.t_s[i].is_finite() || recording.t_s[i] <= recording.t_s[i - 1]) {
            return Err(bad(
                format!("t_s does not increase at sample {i}"),
                "t_s is in seconds and strictly increasing",
            ));
        }
        let (command, terminals_measured) = match &recording.drive {
            Drive::Duty(duty) => (duty, false),
            Drive::Voltage(voltage) => (voltage, true),
        };
        let mut angle =
            readings(robot, &recording.angle).map_err(|problem| bad(problem, "use the robot file of this rig"))?;
        let potentiometer = match &robot.sensor {
            Sensor::Potentiometer(sensor) if matches!(recording.angle, AngleReading::Adc(_)) => Some(sensor),
            _ => None,
        };
        let mut dropped = 0;
        if let Some(sensor) = potentiometer
            && angle.len() == n
        {
            let read = angle.iter().flatten().count();
            drop_jumps(&mut angle, &recording.t_s, no_load_speed(robot), deviation(sensor));
            dropped = read - angle.iter().flatten().count();
        }
        let with_supply = !terminals_measured && recording.supply_v.len() == n;
        let lengths = [command.len(), angle.len(), recording.enable.len()];
        if lengths.iter().any(|&length| length != n) {
            return Err(bad(
                format!("columns of unequal length: t_s {n}, others {lengths:?}"),
                "every column has a cell a row",
            ));
        }
        if let Some(i) = command.iter().position(|value| !value.is_finite()) {
            return Err(bad(format!("drive is not finite at sample {i}"), "duty is −1 … 1, voltage_v in volts"));
        }
        if !terminals_measured && command.iter().any(|duty| duty.abs() > 1.0 + 1e-6) {
            return Err(bad("duty beyond −1 … 1".into(), "name the column voltage_v if these are volts"));
        }
        let driver = Driver::new(robot);
        let drive: Vec<f64> = if terminals_measured {
            command.clone()
        } else {
            command.iter().map(|duty| driver.switched(*duty)).collect()
        };
        let mut drive_integral = vec![0.0; n];
        for i in 1..n {
            drive_integral[i] = drive_integral[i - 1] + drive[i - 1] * (recording.t_s[i] - recording.t_s[i - 1]);
        }
        let current: Vec<f64> = recording.current_a.iter().map(|cell| cell.unwrap_or(f64::NAN)).collect();
        let farthest = FASTER * no_load_speed(robot) * usual_step(&recording.t_s);
        let is_continuous = is_continuous(&angle);
        let on_one_scale = |readings: &[Option<f64>]| match is_continuous {
            true => readings.iter().map(|reading| reading.unwrap_or(f64::NAN)).collect(),
            false => unwrapped(readings, farthest),
        };
        let mut on_scale: Vec<f64> = on_one_scale(&angle);
        // A potentiometer in its blind arc repeats readings too.
        let repeats = if potentiometer.is_some() { Repeats::default() } else { Repeats::of(&on_scale) };
        let counted_across = match potentiometer {
            // A shaft that is lost in the blind arc comes out of it on any turn.
            Some(_) => 0,
            None if is_continuous => usize::MAX,
            None => (NEARLY_HALF_A_TURN / farthest) as usize,
        };
        let mut held_square = 0.0;
        if !repeats.stale.is_empty() {
            let held: Vec<f64> = repeats.stale.iter().map(|&i| on_scale[i]).collect();
            repeats.stale.iter().for_each(|&i| angle[i] = None);
            on_scale = on_one_scale(&angle);
            held_square = square_off(&recording.t_s, &on_scale, &repeats.stale, &held);
        }
        let mut track = Self {
            t: recording.t_s.clone(),
            weight: angle.iter().map(|reading| f64::from(reading.is_some())).collect(),
            since_reversal: since_reversal(&recording.t_s, &on_scale, SLOW * no_load_speed(robot)),
            place: index,
            angle: on_scale,
            drive_scale: drive.iter().fold(0.0, |most: f64, value| most.max(value.abs())),
            drive,
            terminals_measured,
            supply_v: if with_supply { recording.supply_v.clone() } else { Vec::new() },
            has_blind_arc: potentiometer.is_some(),
            dropped,
            counted_across,
            repeats,
            held_square,
            drive_integral,
            enable: recording.enable.clone(),
            current: if current.len() == n { current } else { Vec::new() },
            first_pose: recording.pose.iter().flatten().next().copied(),
            load_torque: Vec::new(),
            pull_unknown: Vec::new(),
            segments: Vec::new(),
            name,
        };
        track.check_angles(robot)?;
        track.cut(Cut { horizon_s: 0.1, most_segments: usize::MAX });
        Ok(track)
    }

    /// Usual time between samples, s.
    #[must_use]
    pub fn usual_step(&self) -> f64 {
        usual_step(&self.t)
    }

    /// Readings of all segments, without the two of each that its start takes.
    #[must_use]
    pub fn readings(&self) -> f64 {
        self.segments.iter().map(|one| self.read(one)).sum()
    }

    /// Readings of a segment, without the two that its start takes; never less than 1.
    #[must_use]
    pub fn read(&self, segment: &Segment) -> f64 {
        (self.weight[segment.first..segment.last].iter().sum::<f64>() - 2.0).max(1.0)
    }

    /// Cuts the run into segments.
    pub fn cut(&mut self, cut: Cut) {
        let usual = self.usual_step();
        let mut segments = Vec::new();
        let mut first = 0;
        let mut contiguous = false;
        while first < self.t.len() {
            let mut last = first + 1;
            while last < self.t.len()
                && self.t[last] - self.t[first] < cut.horizon_s - 0.5 * usual
                && self.t[last] - self.t[last - 1] < GAP * usual
            {
                last += 1;
            }
            let readings = self.weight[first..last].iter().filter(|&&weight| weight > 0.0).count();
            let long_enough = self.t[last - 1] - self.t[first] > 0.7 * cut.horizon_s;
            let hole = longest_hole(&self.weight[first..last]);
            let enough_read = readings >= FEWEST_READINGS.max((last - first) / 4) && 2 * hole <= last - first;
            let unknown = self.pull_unknown.get(first..last).is_some_and(|samples| samples.contains(&true));
            if long_enough && enough_read && !unknown {
                segments.push(Segment { first, last, linked: contiguous, whole: hole <= self.counted_across });
                contiguous = true;
            } else {
                contiguous = false;
            }
            if last < self.t.len() && self.t[last] - self.t[last - 1] >= GAP * usual {
                contiguous = false;
            }
            first = last;
        }
        if segments.len() > cut.most_segments {
            const BLOCK: usize = 10;
            let stride = segments.len().div_ceil(cut.most_segments);
            segments = segments
                .chunks(BLOCK)
                .step_by(stride)
                .flat_map(|block| {
                    let mut block = block.to_vec();
                    block[0].linked = false;
                    block
                })
                .collect();
        }
        self.segments = segments;
    }

    /// The whole run in windows of a length (s), whatever was read in them; they are linked but for holes in time.
    #[must_use]
    pub fn windows(&self, length_s: f64) -> Vec<Segment> {
        let usual = self.usual_step();
        let mut windows: Vec<Segment> = Vec::new();
        let mut first = 0;
        while first < self.t.len() {
            let inside = |last: usize| {
                self.t[last] - self.t[first] < length_s - 0.5 * usual && self.t[last] - self.t[last - 1] < GAP * usual
            };
            let last = (first + 1..self.t.len()).find(|&last| !inside(last)).unwrap_or(self.t.len());
            let linked = first > 0 && self.t[first] - self.t[first - 1] < GAP * usual;
            windows.push(Segment { first, last, linked, whole: false });
            first = last;
        }
        windows
    }

    /// Angles in degrees, or a shaft faster than the motor can turn: another unit or another rig.
    fn check_angles(&self, robot: &Robot) -> Result<(), DiagnoseError> {
        let bad = |problem: String, help: &str| {
            Err(DiagnoseError::Recording { run: self.name.clone(), problem, help: help.to_owned() })
        };
        let readings = self.weight.iter().filter(|&&weight| weight > 0.0).count();
        if readings < 2 * FEWEST_READINGS {
            return bad(format!("only {readings} angle readings"), "angle_rad (or adc) must not be empty");
        }
        let no_load = no_load_speed(robot);
        let speeds: Vec<f64> = (0..self.t.len().saturating_sub(20))
            .step_by(10)
            .map(|i| (self.angle[i + 20] - self.angle[i]).abs() / (self.t[i + 20] - self.t[i]))
            .filter(|speed| speed.is_finite())
            .collect();
        let mut speeds = speeds;
        let fast = quantile(&mut speeds, 0.95).unwrap_or(0.0);
        if fast > 4.0 * no_load {
            return bad(
                format!("the shaft turns at {fast:.0} rad/s, this motor without load at {no_load:.0} rad/s"),
                "angle_rad is in radians and t_s in seconds; is this the right robot file?",
            );
        }
        Ok(())
    }
}

/// The most samples in a row without a reading.
fn longest_hole(weights: &[f64]) -> usize {
    weights.split(|&weight| weight > 0.0).map(<[f64]>::len).max().unwrap_or(0)
}

/// The motor's speed without load, rad/s.
fn no_load_speed(robot: &Robot) -> f64 {
    robot.supply.rail_v.value / robot.motor.torque_constant_nm_per_a.value
}

/// Angles, rad, from the reading column.
pub fn readings(robot: &Robot, column: &AngleReading) -> Result<Vec<Option<f64>>, String> {
    match column {
        AngleReading::Angle(cells) => {
            if cells.iter().flatten().any(|angle| !angle.is_finite()) {
                return Err("angle_rad is not finite".into());
            }
            Ok(cells.clone())
        }
        AngleReading::Adc(cells) => match &robot.sensor {
            Sensor::Potentiometer(sensor) => {
                Ok(cells.iter().map(|cell| cell.and_then(|code| angle_of_code(sensor, code))).collect())
            }
            sensor @ (Sensor::Encoder(_) | Sensor::Ideal) => {
                let scale = angle_scale(sensor);
                Ok(cells.iter().map(|cell| cell.map(|code| scale.angle(f64::from(code)))).collect())
            }
        },
    }
}

/// Standard deviation of what a potentiometer shows at rest, rad, its steps included: at most, as its median of several
/// conversions scatters less.
pub fn deviation(sensor: &Potentiometer) -> f64 {
    let adc = &sensor.adc;
    let per_code = adc.full_scale_v.value / adc.bits.value.exp2() * Element::new(sensor).angle_per_v();
    per_code * (1.0 + adc.noise_lsb.value)
}

/// Shaft angle that a code stands for, rad; `None` where the code may come from the blind arc.
fn angle_of_code(sensor: &Potentiometer, code: u16) -> Option<f64> {
    if let Some(correction) = &sensor.correction {
        let angle = corrected_angle(correction, &AdcCurve::new(&sensor.adc), f64::from(code));
        let wrapped = wrap(angle);
        let blind = wrapped > correction.blind_from_deg.to_radians() - MARGIN
            && wrapped < correction.blind_to_deg.to_radians() + MARGIN;
        return (!blind).then_some(angle);
    }
    let curve = AdcCurve::new(&sensor.adc);
    let element = Element::new(sensor);
    let volts = curve.voltage(f64::from(code));
    let margin = MARGIN / element.angle_per_v();
    let usable =
        volts > curve.zero_below_v.max(0.0) + margin && volts < curve.saturates_v.min(element.supply_v) - margin;
    usable.then(|| wrap(element.angle(volts)))
}

fn usual_step(t_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Whether readings are on one continuous scale as they are: they range over more than a turn, spikes aside. A sensor that holds a reading
/// while the shaft turns on jumps by more than half a turn then, which is none too many.
fn is_continuous(readings: &[Option<f64>]) -> bool {
    let mut known: Vec<f64> = readings.iter().copied().flatten().collect();
    let ends = [0.01, 0.99].map(|share| quantile(&mut known, share).unwrap_or(0.0));
    ends[1] - ends[0] > WRAPPED * TAU
}

/// Sum of squares by which readings are off a straight line between those around them that are left, rad².
fn square_off(t_s: &[f64], angle: &[f64], places: &[usize], readings: &[f64]) -> f64 {
    let off = |(&i, reading): (&usize, &f64)| {
        let before = (0..i).rfind(|&j| !angle[j].is_nan())?;
        let after = (i + 1..angle.len()).find(|&j| !angle[j].is_nan())?;
        let share = (t_s[i] - t_s[before]) / (t_s[after] - t_s[before]);
        Some((reading - angle[before] - share * (angle[after] - angle[before])).powi(2))
    };
    places.iter().zip(readings).filter_map(off).sum()
}

/// Readings on one continuous scale. Across missing readings the shaft is taken to go on at the speed it had; so it is from one to
/// the next where it may turn by `farthest` (rad) in between, and that is near half a turn: which turn it is, the reading alone does
/// not say then.
pub fn unwrapped(readings: &[Option<f64>], farthest: f64) -> Vec<f64> {
    let mut last_turned = 0.0;
    let goes_on = farthest > NEARLY_HALF_A_TURN;
    let mut out = vec![f64::NAN; readings.len()];
    let mut before: Option<(usize, f64)> = None;
    let mut per_sample = 0.0;
    for (i, reading) in readings.iter().enumerate() {
        let Some(angle) = *reading else { continue };
        out[i] = match before {
            None => angle,
            Some((j, last)) => {
                let expected = match i - j {
                    1 if goes_on => last + last_turned,
                    1 => last,
                    missing => last + per_sample * missing as f64,
                };
                let now = expected + wrap(angle - expected);
                last_turned = (now - last) / (i - j) as f64;
                now
            }
        };
        if i >= 8 && out[i - 8].is_finite() {
            per_sample = (out[i] - out[i - 8]) / 8.0;
        }
        before = Some((i, out[i]));
    }
    out
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// A shaft that turns by `per_sample` (rad), of which every tenth reading and the one after it repeat the one before.
    fn held(per_sample: f64) -> Vec<f64> {
        let read = |i: usize| per_sample * (if i % 10 < 2 { i - i % 10 - usize::from(i >= 10) } else { i }) as f64;
        (0..200).map(read).collect()
    }

    #[test]
    fn readings_on_one_scale_stay_there_however_far_the_shaft_turns_past_a_held_one() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/bench-linear.toml");
        let robot = Robot::load(&file).unwrap();
        let angle = held(1.3);
        let recording = Recording {
            t_s: (0..200).map(|i| f64::from(i) * 0.01).collect(),
            enable: vec![true; 200],
            drive: Drive::Duty(vec![0.5; 200]),
            angle: AngleReading::Angle(angle.iter().copied().map(Some).collect()),
            ..Recording::default()
        };
        assert_eq!(Track::new(&robot, &recording, 0).unwrap().angle, angle);
    }

    #[test]
    fn wrapped_readings_are_no_scale_of_their_own() {
        let wrapped: Vec<_> = (0..200).map(|i| Some(wrap(0.3 * f64::from(i)))).collect();
        assert!(!is_continuous(&wrapped));
        assert!(unwrapped(&wrapped, 0.0).windows(2).all(|pair| (pair[1] - pair[0] - 0.3).abs() < 1e-9));
    }
}
