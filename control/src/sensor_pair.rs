//! Two potentiometers on one shaft, their blind arcs apart: which of them is believed, and which one has failed.
//!
//! Outside their own arcs both readings are used, one after the other. Where the estimate sides with one (`FIT_SIGMA`,
//! `CLEARLY`) and the other contradicts it, only the fitting one is used, and the other is doubted; doubted for long enough
//! it has failed, is not used any more, and the robot goes on as one with a single sensor does. What needs no witness stays
//! as it is there: two sensors that are wrong together, and the only one left, are found by the supervisor.
//!
//! Where they contradict each other and the estimate lies between them, nobody can tell which one lies. Then neither is
//! believed: the angle counts as lost, and without an angle readings that contradict each other are no readings.

use core::f32::consts::PI;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::angle::wrap;
use crate::estimator::{Estimate, Estimator, GateOutcome, Measured};
use crate::parameters::{Parameters, Tuning};
use crate::sample::{AdcCode, Sample};
use crate::scalar::clamp;
use crate::second_sensor::SecondSensor;
use crate::sensor::Reading;

/// One of the two angle sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, Schema)]
pub enum Sensor {
    /// The one that shaft angle 0 is defined by.
    #[default]
    First,
    /// The other one.
    Second,
}

/// What a tick's codes say, as angles of the shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairReading {
    /// Of the first sensor.
    pub first: Reading,
    /// Of the second one; `None` where there is none.
    pub second: Option<Reading>,
}

/// A reading for the line through the last ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Shaft angle, rad.
    pub angle: f32,
    /// Delay of the conversion behind the first sensor's, s.
    pub delay: f32,
    /// The reading before was the other sensor's.
    pub changed: bool,
}

/// What two readings say about each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Agreement {
    /// Both fit.
    Agree,
    /// Only this one fits.
    Sides(Sensor),
    /// They contradict each other, and the estimate sides with neither.
    Disagree,
    /// One of them is blind, or both contradict the estimate together.
    Unknown,
}

/// Farther than this from the estimate, in standard deviations of a reading, a sensor contradicts it.
const FIT_SIGMA: f32 = 2.0;
/// The estimate sides with a reading that is so many times nearer than the other one. Between two that drift apart it is in
/// the middle.
const CLEARLY: f32 = 6.0;
/// Where both readings are used, each counts with so many times its standard deviation: their errors are those of their angles, tick
/// after tick, so that two sensors together tell no more than one alone. Tuned in simulation.
const TOGETHER: f32 = 3.0;
/// A fitting reading takes back this share of the doubt that a contradicting one gathers.
const FORGET: f32 = 0.25;
/// The shift between the two is a mean over so many ticks: two turns at 8 Hz, so that their linearity errors average out.
const SHIFT_TICKS: u16 = 256;
/// Share of a rejected sample that counts towards the loss of the angle while the other sensor is blind and cannot speak.
const ALONE: u16 = 1;
/// Weight of a whole rejected sample.
const WHOLE: u16 = Estimator::WHOLE;

/// What is known about the two beyond their last readings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pair {
    failed: Option<Sensor>,
    /// Whose readings the line goes through.
    lead: Sensor,
    /// How long each has contradicted while the other fitted, less what was taken back, s.
    doubt: [f32; 2],
    /// How long both have contradicted the estimate and each other, s.
    disagreement: f32,
    /// Where the second one's gap is beside its nominal place, rad: what the two differ by in the mean.
    shift: f32,
    compared: u16,
    /// Ticks for which the sensors must still agree before either is believed again, after a contradiction without an angle.
    disputed: u16,
    /// How long only the second one has been seen, nobody knowing yet how it is mounted, s.
    waited: f32,
}

impl Pair {
    /// The sensor that has failed. It stays so until the robot starts anew.
    #[must_use]
    pub fn failed(&self) -> Option<Sensor> {
        self.failed
    }

    /// Reads a tick's codes.
    #[must_use]
    pub fn read(&self, p: &Parameters, sample: &Sample) -> PairReading {
        let second = match (&p.second, sample.second) {
            (Some(second), Some(code)) => Some(match second.map.read(code) {
                Reading::Angle(angle) => Reading::Angle(wrap(angle + self.zero(second))),
                end => end,
            }),
            _ => None,
        };
        PairReading { first: p.sensor.read(sample.angle), second }
    }

    /// The code and reading that the supervisor watches: those of the sensor that is less in doubt.
    #[must_use]
    pub fn watched(&self, sample: &Sample, seen: &PairReading) -> (AdcCode, Reading) {
        match (sample.second, seen.second) {
            (Some(code), Some(reading)) if self.less_doubted() == Sensor::Second => (code, reading),
            _ => (sample.angle, seen.first),
        }
    }

    fn less_doubted(&self) -> Sensor {
        let [first, second] = self.doubt;
        match self.failed {
            Some(Sensor::First) => Sensor::Second,
            None if first > second => Sensor::Second,
            _ => Sensor::First,
        }
    }

    /// Middle of the second one's gap, rad.
    fn zero(&self, second: &SecondSensor) -> f32 {
        wrap(second.offset + self.shift)
    }

    /// Whether every working sensor is blind at an angle (rad).
    #[must_use]
    pub fn is_blind(&self, p: &Parameters, seen: &PairReading, angle: f32) -> bool {
        let second = p.second.as_ref().filter(|_| seen.second.is_some());
        let first_is = || p.sensor.is_blind(angle);
        let second_is = |second: &SecondSensor| second.map.is_blind(wrap(angle - self.zero(second)));
        match (second, self.failed) {
            (None, _) | (_, Some(Sensor::Second)) => first_is(),
            (Some(second), Some(Sensor::First)) => second_is(second),
            (Some(second), None) => first_is() && second_is(second),
        }
    }

    /// How far the wiper of the sensor that leads is behind the shaft at a speed (rad/s), rad.
    #[must_use]
    pub fn lag(&self, p: &Parameters, speed: f32) -> f32 {
        match (&p.second, self.lead) {
            (Some(second), Sensor::Second) => second.map.lag(speed),
            _ => p.sensor.lag(speed),
        }
    }

    /// The reading that the line goes on with: one sensor's as long as it sees, for where they change over the two differ.
    /// `None` where nobody sees, and without an angle where both do and contradict each other.
    /// `time` is that since the last sample, s: the first sensor is waited for, because shaft angle 0 is its own, but not for
    /// ever.
    pub fn lead(
        &mut self,
        p: &Parameters,
        tuning: &Tuning,
        seen: &PairReading,
        (tracking, time): (bool, f32),
    ) -> Option<Lead> {
        let first = match seen.first {
            Reading::Angle(angle) if !p.sensor.is_blind(angle) => Some(angle),
            _ => None,
        };
        let (Some(second), Some(reading)) = (&p.second, seen.second) else {
            return first.map(|angle| Lead { angle, delay: 0.0, changed: false });
        };
        let first = first.filter(|_| self.failed != Some(Sensor::First));
        let other = match reading {
            Reading::Angle(angle) if self.failed != Some(Sensor::Second) => {
                Some(angle).filter(|angle| !second.map.is_blind(wrap(angle - self.zero(second))))
            }
            _ => None,
        };
        if let (Some(one), Some(two)) = (first, other) {
            // A wiper on insulation may agree for a moment.
            self.disputed = match wrap(two - one).abs() > reach(second, tuning.reading) {
                true if !tracking => p.acquisition.samples,
                _ => self.disputed.saturating_sub(1),
            };
        }
        let sensor = match (first, other) {
            (None, None) => return None,
            _ if self.disputed > 0 && !tracking => return None,
            (Some(_), None) => Sensor::First,
            (None, Some(_)) => {
                if !tracking && self.compared == 0 && self.waited < p.acquisition.patience {
                    self.waited += time;
                    return None;
                }
                Sensor::Second
            }
            (Some(_), Some(_)) => {
                let [doubt, other_doubt] = self.doubt;
                match self.lead {
                    Sensor::First if doubt > other_doubt => Sensor::Second,
                    Sensor::Second if other_doubt > doubt => Sensor::First,
                    lead => lead,
                }
            }
        };
        let changed = sensor != self.lead;
        self.lead = sensor;
        match sensor {
            Sensor::First => first.map(|angle| Lead { angle, delay: 0.0, changed }),
            Sensor::Second => other.map(|angle| Lead { angle, delay: second.delay, changed }),
        }
    }

    /// Takes a tick's readings into the filter. `offset` is how much later than the tick the first one is of, `time`
    /// what the tick counts for as evidence, both s.
    pub fn update(
        &mut self,
        p: &Parameters,
        tuning: &Tuning,
        estimator: &mut Estimator,
        seen: &PairReading,
        (offset, time): (f32, f32),
    ) -> GateOutcome {
        let (Some(second), Some(reading)) = (&p.second, seen.second) else {
            return match self.failed {
                // The only one left was not converted.
                Some(Sensor::First) => estimator.count(GateOutcome::Rejected, WHOLE),
                _ => estimator.update(p, tuning, seen.first, offset),
            };
        };
        let measured = self.measured(p, second, tuning, &estimator.estimate(), &[seen.first, reading], offset);
        let [first, other] = measured;
        let alone = match self.failed {
            Some(Sensor::Second) => first,
            Some(Sensor::First) => other,
            None => {
                let time = (time, reach(second, tuning.reading));
                return self.update_both(p, second, estimator, &measured, time);
            }
        };
        let gate = estimator.weigh(p, &alone);
        estimator.count(gate, WHOLE)
    }

    fn measured(
        &self,
        p: &Parameters,
        second: &SecondSensor,
        tuning: &Tuning,
        x: &Estimate,
        [first, other]: &[Reading; 2],
        offset: f32,
    ) -> [Measured; 2] {
        let shaft = x.angle_of_reading(p);
        let angle = wrap(shaft - self.zero(second));
        [
            Measured {
                reading: *first,
                lag: p.sensor.lag(x.speed),
                blind: p.sensor.is_blind(shaft),
                offset,
                noise: tuning.reading,
            },
            Measured {
                reading: *other,
                lag: second.map.lag(x.speed),
                blind: second.map.is_blind(angle),
                offset: offset + second.delay,
                noise: tuning.reading * second.noise,
            },
        ]
    }

    fn update_both(
        &mut self,
        p: &Parameters,
        second: &SecondSensor,
        estimator: &mut Estimator,
        measured: &[Measured; 2],
        (time, reach): (f32, f32),
    ) -> GateOutcome {
        let [first, other] = measured;
        let innovations = [estimator.innovation(first), estimator.innovation(other)];
        let agreement = compare_readings(measured, innovations, reach);
        self.weigh_evidence(p, agreement, time);
        if self.disagreement >= p.estimator.sensor_persistence {
            self.disagreement = 0.0;
            self.disputed = p.acquisition.samples;
            return estimator.count(GateOutcome::Rejected, u16::MAX);
        }
        if let (Agreement::Agree, [Some(one), Some(two)]) = (agreement, innovations) {
            self.align(second, two - one);
        }
        let share = TOGETHER;
        let together = |m: &Measured| Measured { noise: share * m.noise, ..*m };
        let verdicts = match agreement {
            Agreement::Sides(Sensor::First) => [estimator.weigh(p, first), GateOutcome::Rejected],
            Agreement::Sides(Sensor::Second) => [GateOutcome::Rejected, estimator.weigh(p, other)],
            _ => [estimator.weigh(p, &together(first)), estimator.weigh(p, &together(other))],
        };
        match verdicts {
            [GateOutcome::Accepted, _] | [_, GateOutcome::Accepted] => estimator.count(GateOutcome::Accepted, WHOLE),
            [GateOutcome::Rejected, GateOutcome::Rejected] => estimator.count(GateOutcome::Rejected, WHOLE),
            // The other one will speak in a moment; but should the shaft rest there, it never does.
            [GateOutcome::Rejected, _] | [_, GateOutcome::Rejected] => estimator.count(GateOutcome::Rejected, ALONE),
            [GateOutcome::Blind, GateOutcome::Blind] => estimator.count(GateOutcome::Blind, WHOLE),
        }
    }

    fn weigh_evidence(&mut self, p: &Parameters, agreement: Agreement, time: f32) {
        let [first, other] = &mut self.doubt;
        match agreement {
            Agreement::Agree => {
                forget(first, time);
                forget(other, time);
                self.disagreement = 0.0;
            }
            Agreement::Sides(Sensor::First) => {
                forget(first, time);
                *other += time;
            }
            Agreement::Sides(Sensor::Second) => {
                *first += time;
                forget(other, time);
            }
            Agreement::Disagree => self.disagreement += time,
            Agreement::Unknown => {}
        }
        let persistence = p.estimator.sensor_persistence;
        if *first >= persistence {
            self.failed = Some(Sensor::First);
        } else if *other >= persistence {
            self.failed = Some(Sensor::Second);
        }
    }

    /// Moves the second one's zero towards the first one's by what they differ (rad) when both fit.
    fn align(&mut self, second: &SecondSensor, apart: f32) {
        self.compared = self.compared.saturating_add(1).min(SHIFT_TICKS);
        let step = apart / f32::from(self.compared);
        self.shift = clamp(self.shift - step, -second.tolerance, second.tolerance);
    }
}

fn forget(doubt: &mut f32, time: f32) {
    let left = *doubt - FORGET * time;
    *doubt = if left > 0.0 { left } else { 0.0 };
}

/// How far two readings may differ, rad: `noise` is the first one's standard deviation.
fn reach(second: &SecondSensor, noise: f32) -> f32 {
    0.5 * FIT_SIGMA * noise * (1.0 + second.noise) + second.tolerance
}

fn compare_readings([first, other]: &[Measured; 2], innovations: [Option<f32>; 2], reach: f32) -> Agreement {
    if first.blind || other.blind {
        return Agreement::Unknown;
    }
    // A code of an end, where the estimate is not in the arc, is as far off as can be.
    let [one, two] = innovations.map(|innovation| innovation.map_or(PI, f32::abs));
    let fits = [one <= FIT_SIGMA * first.noise, two <= FIT_SIGMA * other.noise];
    let apart = match innovations {
        [Some(one), Some(two)] => (two - one).abs() > reach,
        _ => false,
    };
    match fits {
        [true, false] if CLEARLY * one <= two => Agreement::Sides(Sensor::First),
        [false, true] if CLEARLY * two <= one => Agreement::Sides(Sensor::Second),
        _ if apart => Agreement::Disagree,
        [true, true] => Agreement::Agree,
        _ => Agreement::Unknown,
    }
}
