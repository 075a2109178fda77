//! Which mistakes make the file's shaft answer as the recorded one does.
//!
//! An angle that reads s times too large and a time that reads m times too long turn gain, damping and steady speed a volt into
//! s/m², 1/m and s/m times themselves. A drive in another unit is read again as what it may be. A mistake is a set of these.

use std::f64::consts::TAU;

use robot_file::robot::{Robot, Sensor};
use serde::Serialize;

use super::Reading;
use super::expected::{Allowed, Expected};
use super::motion::DriveAs;

/// What is wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Angle and drive have opposite signs.
    ReversedSign,
    /// The angle is in this unit (a word of `scram import`), and called radians.
    AngleUnit(String),
    /// The angle was imported from another unit than it is in: it reads so many times too large.
    AngleTwice(f64),
    /// The sensor turns with the motor, before the gears.
    MotorSide,
    /// The number of counts a turn is wrong: it reads so many times too large.
    CountsPerTurn(f64),
    /// The angle is the integral of a speed in rpm that is called rad/s.
    SpeedInRpm,
    /// The duty's full scale is this number and not 1.
    DutyFullScale(f64),
    /// The drive is a voltage, V, and called a duty.
    DutyInVolts,
    /// The drive is a duty and called a voltage.
    VoltageIsDuty,
    /// The voltage is in mV and called V.
    VoltageInMillivolts,
    /// The time is in this unit (a word of `scram import`), and called seconds.
    TimeUnit(String),
    /// The times read so many times too long, by a factor of no unit or of one that was applied twice.
    ClockRate(f64),
    /// The supply, V.
    Supply(f64),
    /// The torque constant, N·m/A: another motor.
    TorqueConstant(f64),
    /// The mechanical time constant, s: another load or winding.
    TimeConstant(f64),
    /// The recording holds what no rig measures, or no rig of this file.
    Recording,
}

/// Factors by which a mistake makes readings too large.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scales {
    angle: f64,
    time: f64,
}

impl Scales {
    const RIGHT: Self = Self { angle: 1.0, time: 1.0 };

    fn speed(self) -> f64 {
        self.angle / self.time
    }

    fn gain(self) -> f64 {
        self.speed() / self.time
    }

    fn damping(self) -> f64 {
        1.0 / self.time
    }

    fn and(self, other: Self) -> Self {
        Self { angle: self.angle * other.angle, time: self.time * other.time }
    }
}

/// An observed answer: its size, and by which factor it may be off.
#[derive(Clone, Copy, Debug)]
pub struct Observed {
    pub value: f64,
    pub doubt: f64,
}

/// What was observed of the shaft's answer; `None` where the runs do not tell.
#[derive(Clone, Copy, Debug, Default)]
pub struct Answer {
    pub gain: Option<Observed>,
    pub damping: Option<Observed>,
    pub speed: Option<Observed>,
    /// The steady speed a volt is at least this, whatever drags.
    pub speed_at_least: Option<f64>,
}

impl Answer {
    /// Whether the runs tell anything.
    pub fn is_known(&self) -> bool {
        self.gain.is_some() || self.damping.is_some() || self.speed.is_some() || self.speed_at_least.is_some()
    }
}

/// What is known beside the answer.
pub struct Circumstances<'a> {
    pub robot: &'a Robot,
    pub expected: Expected,
    /// A turn in the angle's unit, where the reading is wrapped.
    pub turn: Option<f64>,
    pub drive: DriveColumn,
    pub supply_is_measured: bool,
    /// The answer as it stands tells next to nothing: an explanation must be one by which it tells something.
    pub hidden: bool,
    /// Much of the motion is none that the answer explains: it does not tell how soon the shaft takes up its speed. One that coasts
    /// within the drop of its driver looks slow.
    pub rough: bool,
    /// Usual time between rows, in the recording's unit.
    pub step: f64,
}

impl Circumstances<'_> {
    /// Rows that are seconds apart are of no motor's recording.
    pub fn rows_are_slow(&self) -> bool {
        self.step >= SLOW_ROWS_S
    }
}

/// What the drive column looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveColumn {
    pub is_voltage: bool,
    /// A duty beyond ±1.
    pub is_beyond_duty: bool,
    pub largest: f64,
}

impl DriveColumn {
    /// A voltage that ends at exactly 1, with a supply that has more.
    pub fn looks_like_a_duty(&self, robot: &Robot) -> bool {
        self.is_voltage && (self.largest - 1.0).abs() < 1e-9 && robot.supply.rail_v.low > 2.0
    }
}

/// A set of mistakes that fits, the less likely the larger its penalty.
#[derive(Clone, Debug)]
pub struct Explanation {
    pub causes: Vec<Cause>,
    pub penalty: f64,
}

/// Explanations that are told at most.
const MOST: usize = 3;
/// Penalty beyond the best one's at which an explanation is not told.
const FAR: f64 = 1.6;
/// A factor of another motor or supply that is told beside a mistaken unit.
const ANOTHER_RIG: std::ops::Range<f64> = 0.02..50.0;
/// A factor of another load or winding that is told beside a mistaken unit.
const ANOTHER_LOAD: std::ops::Range<f64> = 0.002..500.0;
/// Rows this far apart are of a clock in another unit, s.
const SLOW_ROWS_S: f64 = 0.5;
/// Supplies that there are, V.
const SUPPLIES: std::ops::Range<f64> = 0.5..60.0;

/// What explains an answer, the likeliest first. `read` reads the drive column as something else.
pub fn explain(answer: &Answer, at: &Circumstances, read: &dyn Fn(DriveAs) -> Reading) -> Vec<Explanation> {
    let mut found = Vec::new();
    if !at.drive.is_beyond_duty {
        units(at, None, &read(DriveAs::Named), &mut found);
    }
    for drive in drives(at) {
        units(at, Some(&drive), &read(drive.read_as), &mut found);
    }
    if found.is_empty() && at.rows_are_slow() {
        return clocks(at);
    }
    if found.is_empty() && at.drive.is_beyond_duty && !answer.is_known() {
        return full_scales(at);
    }
    let simplest = found.iter().map(|one| one.causes.len()).min().unwrap_or(usize::MAX);
    found.retain(|one| one.causes.len() == simplest);
    if !at.drive.is_beyond_duty && !at.rows_are_slow() {
        found.extend(another_rig(answer, at, simplest));
    }
    if at.rough {
        found.retain(|one| !matches!(one.causes[..], [Cause::TimeConstant(_)]));
    }
    found.sort_by(|a, b| a.penalty.total_cmp(&b.penalty));
    let best = found.first().map_or(0.0, |one| one.penalty);
    found.retain(|one| one.penalty < best + FAR);
    found.truncate(MOST);
    found
}

/// Whether the file answers like this.
pub fn is_right(answer: &Answer, expected: &Expected) -> bool {
    fits(answer, expected, Scales::RIGHT)
}

/// Whether the file with a mistake's factors answers like this.
fn fits(answer: &Answer, expected: &Expected, scales: Scales) -> bool {
    let within = |observed: Option<Observed>, allowed: &Allowed, factor: f64| {
        observed.is_none_or(|one| {
            let value = one.value / factor;
            value * one.doubt >= allowed.low && value / one.doubt <= allowed.high
        })
    };
    let both = || match (answer.speed, answer.damping) {
        (Some(speed), Some(damping)) => expected.allows(
            (speed.value * damping.value / scales.gain(), speed.doubt),
            (damping.value / scales.damping(), damping.doubt),
        ),
        _ => true,
    };
    within(answer.gain, &expected.gain(), scales.gain())
        && within(answer.damping, &expected.damping(), scales.damping())
        && within(answer.speed, &expected.speed(), scales.speed())
        && answer.speed_at_least.is_none_or(|least| least / scales.speed() <= expected.speed().high)
        && both()
}

/// How far from the file's own values a mistake leaves the answer, in factors of two.
fn distance(answer: &Answer, expected: &Expected, scales: Scales) -> f64 {
    let pairs = [
        (answer.speed, expected.speed(), scales.speed(), 1.0),
        (answer.gain.filter(|_| answer.speed.is_none()), expected.gain(), scales.gain(), 0.5),
        (answer.damping, expected.damping(), scales.damping(), 0.25),
    ];
    pairs
        .into_iter()
        .filter_map(|(observed, allowed, factor, weight)| {
            Some(weight * (observed?.value / factor / allowed.value).log2().abs())
        })
        .sum()
}

type Part = (Cause, Scales, f64);

/// Mistaken units that fit, at most two of them, beside what the drive is read as.
fn units(at: &Circumstances, drive: Option<&DrivePart>, reading: &Reading, found: &mut Vec<Explanation>) {
    let options = |parts: Vec<Part>| std::iter::once(None).chain(parts.into_iter().map(Some)).collect::<Vec<_>>();
    for angle in &options(angles(at)) {
        let answer = reading.answer(TAU * angle.as_ref().map_or(1.0, |part| part.1.angle));
        for time in &options(times(at)) {
            let parts: Vec<&Part> = [angle, time].into_iter().flatten().collect();
            let count = parts.len() + usize::from(drive.is_some());
            if !(1..=2).contains(&count) || at.rows_are_slow() && time.is_none() {
                continue;
            }
            let scales = parts.iter().fold(Scales::RIGHT, |all, part| all.and(part.1));
            let tells = if at.hidden { answer.speed.is_some() } else { answer.is_known() };
            if tells && fits(&answer, &at.expected, scales) {
                let own = parts.iter().map(|part| part.2).sum::<f64>() + drive.map_or(0.0, |drive| drive.penalty);
                let causes = drive.map(|drive| drive.cause.clone()).into_iter();
                found.push(Explanation {
                    causes: causes.chain(parts.iter().map(|part| part.0.clone())).collect(),
                    penalty: own + distance(&answer, &at.expected, scales),
                });
            }
        }
    }
}

fn angle(cause: Cause, factor: f64, penalty: f64) -> Part {
    (cause, Scales { angle: factor, ..Scales::RIGHT }, penalty)
}

/// Angles that are no radians of the shaft. A reading that is wrapped says itself how large a turn is.
fn angles(at: &Circumstances) -> Vec<Part> {
    let unit = |name: &str, turn: f64| angle(Cause::AngleUnit(name.to_owned()), turn / TAU, 0.0);
    let gear = at.robot.motor.gear_ratio.value;
    let on_the_motor = (gear > 1.5).then(|| angle(Cause::MotorSide, gear, 0.7));
    let mut parts = vec![unit("deg", 360.0), unit("turns", 1.0)];
    match &at.robot.sensor {
        Sensor::Encoder(encoder) => {
            parts.push(unit(&format!("counts/{}", encoder.counts_per_turn.value), encoder.counts_per_turn.value))
        }
        Sensor::Ideal | Sensor::Potentiometer(_) => {
            let powers = (8..=16).map(|bits| f64::from(1 << bits));
            // Beside degrees a number of counts that nobody has named is far-fetched.
            parts.extend(powers.map(|counts| angle(Cause::AngleUnit(format!("counts/{counts}")), counts / TAU, 1.8)));
        }
    }
    if let Some(turn) = at.turn {
        parts.retain(|part| (part.1.angle * TAU / turn - 1.0).abs() < 0.01);
        // Wrapped at another turn than the radians': the numbers themselves name the unit.
        parts.iter_mut().for_each(|part| part.2 -= 1.0);
        parts.extend(on_the_motor);
        return parts;
    }
    parts.extend(on_the_motor);
    let twice = [TAU / 360.0, TAU, 360.0, 1.0 / 360.0];
    parts.extend(twice.map(|factor| angle(Cause::AngleTwice(factor), factor, 0.9)));
    parts.extend([4.0, 0.25].map(|factor| angle(Cause::CountsPerTurn(factor), factor, 1.0)));
    parts.push(angle(Cause::SpeedInRpm, 60.0 / TAU, 0.9));
    parts
}

/// What the drive column may be in place of what its name says.
struct DrivePart {
    cause: Cause,
    read_as: DriveAs,
    penalty: f64,
}

/// Full scales of a duty that people write.
const FULL_SCALES: [f64; 13] =
    [100.0, 127.0, 255.0, 400.0, 500.0, 511.0, 1000.0, 1023.0, 2047.0, 4095.0, 8191.0, 32767.0, 65535.0];
/// Full scales of a duty that was divided by one that is not its own.
const DIVIDED: [f64; 5] = [0.01, 1.0 / 255.0, 255.0 / 1023.0, 255.0 / 4095.0, 1.0 / 1023.0];

/// Drives that are no duty, or no voltage.
fn drives(at: &Circumstances) -> Vec<DrivePart> {
    let full_scale = |scale: f64, penalty: f64| DrivePart {
        cause: Cause::DutyFullScale(scale),
        read_as: DriveAs::Duty(scale),
        penalty,
    };
    let largest = at.drive.largest;
    if at.drive.is_voltage {
        let millivolts = DrivePart { cause: Cause::VoltageInMillivolts, read_as: DriveAs::Millivolts, penalty: 0.0 };
        let duty = DrivePart { cause: Cause::VoltageIsDuty, read_as: DriveAs::Duty(1.0), penalty: 0.0 };
        return if largest <= 1.01 { vec![millivolts, duty] } else { vec![millivolts] };
    }
    if !at.drive.is_beyond_duty {
        let can_be = DIVIDED.into_iter().filter(|scale| (0.4..1.02).contains(&(largest / scale)));
        return can_be.map(|scale| full_scale(scale, 0.4)).collect();
    }
    // The nearest full scale above what is there; volts up to the supply.
    let beyond = |scale: f64| 0.4 * (scale / largest).log2().max(0.0);
    let can_be = FULL_SCALES.into_iter().filter(|scale| largest <= 1.005 * scale);
    let mut parts: Vec<DrivePart> = can_be.map(|scale| full_scale(scale, beyond(scale))).collect();
    let rail_v = at.robot.supply.rail_v.value;
    if largest <= 1.3 * rail_v {
        parts.push(DrivePart { cause: Cause::DutyInVolts, read_as: DriveAs::Volts, penalty: beyond(rail_v) });
    }
    parts
}

/// Times that are no seconds.
fn times(at: &Circumstances) -> Vec<Part> {
    let unit = |name: &str, seconds: f64, penalty: f64| {
        (Cause::TimeUnit(name.to_owned()), Scales { time: 1.0 / seconds, ..Scales::RIGHT }, penalty)
    };
    let slow = if at.rows_are_slow() { 0.0 } else { 0.8 };
    let rate = (Cause::ClockRate(1e-3), Scales { time: 1e-3, ..Scales::RIGHT }, 0.8);
    let clocks = [unit("ms", 1e-3, slow), unit("us", 1e-6, slow), unit("ns", 1e-9, slow), unit("min", 60.0, 1.0), rate];
    let is_rate = |part: &Part| RATES.contains(&(part.1.time / at.step));
    clocks.into_iter().filter(is_rate).collect()
}

/// Rates at which motors are recorded, rows a second.
const RATES: std::ops::Range<f64> = 5.0..100_000.0;

/// Units of a clock by nothing but how far the rows are apart.
fn clocks(at: &Circumstances) -> Vec<Explanation> {
    let units = [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
    let rate = |seconds: f64| 1.0 / (at.step * seconds);
    let mut found: Vec<Explanation> = units
        .into_iter()
        .filter(|(_, seconds)| RATES.contains(&rate(*seconds)))
        .map(|(name, seconds)| {
            let penalty = 0.5 * (rate(seconds) / 1000.0).log10().abs();
            Explanation { causes: vec![Cause::TimeUnit(name.to_owned())], penalty }
        })
        .collect();
    found.sort_by(|a, b| a.penalty.total_cmp(&b.penalty));
    found
}

/// Scales of a duty by nothing but how large it is.
fn full_scales(at: &Circumstances) -> Vec<Explanation> {
    let one = |drive: DrivePart| Explanation { causes: vec![drive.cause], penalty: drive.penalty };
    let mut found: Vec<Explanation> = drives(at).into_iter().map(one).collect();
    found.sort_by(|a, b| a.penalty.total_cmp(&b.penalty));
    found.truncate(MOST);
    found
}

/// Another motor, supply, load or clock: whatever factor it takes.
fn another_rig(answer: &Answer, at: &Circumstances, simplest: usize) -> Vec<Explanation> {
    let none_else = simplest == usize::MAX || simplest > 1;
    let told = |factor: f64| none_else || ANOTHER_RIG.contains(&factor);
    let one = |cause: Cause, penalty: f64| Explanation { causes: vec![cause], penalty };
    let expected = &at.expected;
    let usual_s = 1.0 / expected.damping().value;
    let alone = |part: Answer| part.is_known().then(|| is_right(&part, expected));
    let speed_is_right =
        alone(Answer { speed: answer.speed, speed_at_least: answer.speed_at_least, ..Answer::default() });
    let damping_is_right = alone(Answer { damping: answer.damping, ..Answer::default() });
    let mut found = Vec::new();
    // Each may be right on its own and both together not: then it is the one that is farther off for its range.
    let far = |observed: Option<Observed>, allowed: Allowed| {
        observed.map_or(0.0, |one| {
            let end = if one.value > allowed.value { allowed.high } else { allowed.low };
            (one.value / allowed.value).ln() / (end / allowed.value).ln()
        })
    };
    let neither = speed_is_right == Some(true) && damping_is_right == Some(true);
    let is_pace = neither && far(answer.damping, expected.damping()) > far(answer.speed, expected.speed());
    // The shaft reaches the right speed at another pace, or it is known only how it begins.
    let pace = match (answer.damping, answer.gain) {
        (Some(damping), _) if damping_is_right == Some(false) || is_pace => Some(damping.value * usual_s),
        (None, Some(gain)) => Some(gain.value / expected.gain().value),
        _ => None,
    };
    if speed_is_right != Some(false) {
        found.extend(
            pace.filter(|pace| none_else || ANOTHER_LOAD.contains(pace))
                .map(|pace| one(Cause::TimeConstant(usual_s / pace), 0.8)),
        );
    }
    let speed = answer.speed.map(|one| one.value).or(answer.speed_at_least).map(|one| one / expected.speed().value);
    let Some(speed) = speed.filter(|speed| told(*speed)) else { return found };
    if !found.is_empty() && answer.speed.is_some() || answer.speed.is_none() && speed_is_right != Some(false) {
        return found;
    }
    found.push(one(Cause::TorqueConstant(at.robot.motor.torque_constant_nm_per_a.value / speed), 0.8));
    let supply = at.robot.supply.rail_v.value * speed;
    let is_open = !at.supply_is_measured && !at.drive.is_voltage;
    if is_open && damping_is_right != Some(false) && SUPPLIES.contains(&supply) {
        found.push(one(Cause::Supply(supply), 0.9));
    }
    let same_pace = answer.damping.is_some_and(|damping| (damping.value * usual_s / speed).log2().abs() < 0.6);
    if same_pace && damping_is_right == Some(false) {
        found.push(one(Cause::ClockRate(1.0 / speed), 0.9));
    }
    found
}
