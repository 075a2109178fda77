//! Terms that no effect of the catalogue has: a torque on the shaft, or an error of the reading, that follows one coordinate by
//! a curve that nobody has chosen. They say where a misfit lives whatever its law is.

use std::f64::consts::TAU;

/// What a term follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Follows {
    /// The shaft's angle: torques of one to four waves a turn.
    Angle,
    /// The shaft's speed: torques at nine speeds, linear in between.
    Speed,
    /// The voltage at the terminals before the bridge's own drop: torques at nine voltages.
    Voltage,
    /// The time in the run: a friction and a share of the voltage at five times.
    Time,
    /// The wiper's angle: errors of the reading of one to six waves a turn.
    Reading,
    /// The shaft's angle: a friction that comes and goes one to sixteen times a turn.
    Mesh,
    /// The motor's current: torques at nine currents.
    Current,
    /// The time since the shaft last stood or turned round: a friction at six times.
    Reversal,
    /// The run: a friction and a share of the voltage in each.
    Run,
    /// The shaft's speed: what slips between shaft and sensor at nine speeds.
    SlipWithSpeed,
    /// The motor's current: which share of the way slips between shaft and sensor at nine currents.
    SlipWithCurrent,
}

/// Scales of a rig's runs, from which the curves' knots follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spans {
    /// Highest speed, rad/s.
    pub speed: f64,
    /// Highest voltage, V.
    pub voltage: f64,
    /// Highest current, A.
    pub current: f64,
    /// Longest run, s.
    pub time: f64,
    /// How many runs there are.
    pub runs: usize,
    /// Size of a torque, N·m.
    pub torque: f64,
}

/// Size of an error of the reading, rad.
const READING: f64 = 0.01;
/// Knots of a curve over a signed coordinate, as shares of its span: close where friction bends.
const KNOTS: [f64; 9] = [-1.0, -0.5, -0.2, -0.05, 0.0, 0.05, 0.2, 0.5, 1.0];
/// Knots over the time.
const TIMES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Knots over the time since the shaft stood or turned round, s: close where friction recovers and grease gives way.
const SINCE: [f64; 6] = [0.0, 0.02, 0.05, 0.12, 0.3, 1.0];
/// Most waves a turn that a friction comes and goes with: beyond, a rollout at usual speeds averages over them.
const MESH_ORDERS: usize = 16;
/// Share of the highest speed that slips.
const SLIPS: f64 = 0.01;
/// Share of the highest speed at which friction has half reached its level; a shaft below it stands.
pub(super) const SLOW: f64 = 0.02;

impl Follows {
    /// Those that are asked whether there is anything at all.
    pub const FIRST: [Self; 5] = [Self::Angle, Self::Speed, Self::Voltage, Self::Time, Self::Reading];

    /// Those around the shaft.
    pub const AROUND: [Self; 3] = [Self::Angle, Self::Reading, Self::Mesh];

    /// Every one, to say where a misfit lives.
    pub const ALL: [Self; 11] = [
        Self::Angle,
        Self::Speed,
        Self::Voltage,
        Self::Time,
        Self::Reading,
        Self::Mesh,
        Self::Current,
        Self::Reversal,
        Self::Run,
        Self::SlipWithSpeed,
        Self::SlipWithCurrent,
    ];

    /// Name in the exchange format.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Angle | Self::Reading | Self::Mesh => "angle_rad",
            Self::Speed | Self::SlipWithSpeed => "speed_rad_per_s",
            Self::Voltage => "voltage_v",
            Self::Current | Self::SlipWithCurrent => "current_a",
            Self::Time => "time_s",
            Self::Reversal => "time_since_reversal_s",
            Self::Run => "run",
        }
    }

    /// How many terms its curve has.
    #[must_use]
    pub fn terms(self, spans: &Spans) -> usize {
        match self {
            Self::Angle => 8,
            Self::Speed | Self::Voltage | Self::Current | Self::SlipWithSpeed | Self::SlipWithCurrent => KNOTS.len(),
            Self::Time => 2 * TIMES.len(),
            Self::Reading => 12,
            Self::Mesh => 2 * MESH_ORDERS,
            Self::Reversal => SINCE.len(),
            Self::Run => 2 * spans.runs,
        }
    }
}

/// What a curve follows on a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// What it follows.
    pub follows: Follows,
    /// The rig's scales.
    pub spans: Spans,
}

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// What it follows.
    pub shape: Shape,
    /// How much there is of each of its terms, in each one's own size.
    pub terms: Vec<f64>,
}

/// The shaft at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Angle, rad.
    pub angle: f64,
    /// Speed, rad/s.
    pub speed: f64,
    /// Voltage at the terminals before the bridge's own drop, V; 0 while it is open.
    pub voltage: f64,
    /// Current of the motor, A.
    pub current: f64,
    /// Time in the run, s.
    pub time: f64,
    /// Time since the shaft stood or turned round, s.
    pub since_reversal: f64,
    /// Which of the runs.
    pub run: usize,
}

impl Shape {
    /// Whether its terms are torques.
    #[must_use]
    pub fn of_torques(&self) -> bool {
        !matches!(self.follows, Follows::Reading | Follows::SlipWithSpeed | Follows::SlipWithCurrent)
    }

    /// How many terms the curve has.
    #[must_use]
    pub fn terms(&self) -> usize {
        self.follows.terms(&self.spans)
    }

    /// Torque of a term at a moment, N·m.
    fn torque(&self, term: usize, at: Moment) -> f64 {
        let spans = &self.spans;
        spans.torque
            * match self.follows {
                Follows::Angle => wave(term, at.angle),
                Follows::Speed => hat(&KNOTS, term, at.speed / spans.speed),
                Follows::Voltage => hat(&KNOTS, term, at.voltage / spans.voltage),
                Follows::Current => hat(&KNOTS, term, at.current / spans.current),
                Follows::Time => {
                    let of = if term < TIMES.len() { self.along_motion(at) } else { at.voltage / spans.voltage };
                    of * hat(&TIMES, term % TIMES.len(), at.time / spans.time)
                }
                Follows::Run => {
                    let of = if term < spans.runs { self.along_motion(at) } else { at.voltage / spans.voltage };
                    of * f64::from(u8::from(term % spans.runs == at.run))
                }
                Follows::Mesh => self.along_motion(at) * wave(term, at.angle),
                Follows::Reversal => self.along_motion(at) * hat(&SINCE, term, at.since_reversal),
                Follows::Reading | Follows::SlipWithSpeed | Follows::SlipWithCurrent => 0.0,
            }
    }

    /// ±1 along the motion, 0 at rest.
    fn along_motion(&self, at: Moment) -> f64 {
        (at.speed / (SLOW * self.spans.speed)).tanh()
    }

    /// How fast the sensor gains on the shaft by a term at a moment, rad/s.
    fn slip(&self, term: usize, at: Moment) -> f64 {
        let spans = &self.spans;
        match self.follows {
            Follows::SlipWithSpeed => SLIPS * spans.speed * hat(&KNOTS, term, at.speed / spans.speed),
            // A belt creeps by a share of its way.
            Follows::SlipWithCurrent => SLIPS * at.speed.abs() * hat(&KNOTS, term, at.current / spans.current),
            _ => 0.0,
        }
    }

    /// Error of the reading by a term where the wiper stands at an angle (rad), rad.
    fn reading_error(&self, term: usize, wiper: f64) -> f64 {
        if self.follows == Follows::Reading { READING * wave(term, wiper) } else { 0.0 }
    }
}

impl Probe {
    /// One term of a curve, in its own size.
    #[must_use]
    pub fn term(shape: Shape, term: usize) -> Self {
        let mut terms = vec![0.0; shape.terms()];
        terms[term] = 1.0;
        Self { shape, terms }
    }

    /// Torque at a moment, N·m.
    #[must_use]
    pub fn torque(&self, at: Moment) -> f64 {
        self.sum(|term| self.shape.torque(term, at))
    }

    /// How fast the sensor gains on the shaft at a moment, rad/s.
    #[must_use]
    pub fn slip(&self, at: Moment) -> f64 {
        self.sum(|term| self.shape.slip(term, at))
    }

    /// Error of the reading where the wiper stands at an angle (rad), rad.
    #[must_use]
    pub fn reading_error(&self, wiper: f64) -> f64 {
        self.sum(|term| self.shape.reading_error(term, wiper))
    }

    fn sum(&self, of_term: impl Fn(usize) -> f64) -> f64 {
        let there = self.terms.iter().enumerate().filter(|(_, much)| **much != 0.0);
        there.map(|(term, much)| much * of_term(term)).sum()
    }
}

/// cos θ, sin θ, cos 2θ, …
fn wave(term: usize, angle: f64) -> f64 {
    let phase = (term / 2 + 1) as f64 * angle % TAU;
    if term.is_multiple_of(2) { phase.cos() } else { phase.sin() }
}

/// 1 at one of ascending knots, 0 at the others, linear in between; constant beyond the ends.
fn hat(knots: &[f64], term: usize, at: f64) -> f64 {
    let here = knots[term];
    let neighbour = if at < here { term.checked_sub(1) } else { Some(term + 1).filter(|next| *next < knots.len()) };
    neighbour.map_or(1.0, |next| (1.0 - (at - here) / (knots[next] - here)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hats_of_a_curve_add_up_to_one() {
        for knots in [&KNOTS[..], &TIMES[..], &SINCE[..]] {
            for i in -30..=30 {
                let at = 0.05 * f64::from(i);
                let sum: f64 = (0..knots.len()).map(|term| hat(knots, term, at)).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{sum} at {at}");
            }
            for (term, knot) in knots.iter().enumerate() {
                assert_eq!(hat(knots, term, *knot), 1.0);
            }
        }
    }

    #[test]
    fn waves_are_orthogonal_over_a_turn() {
        let turn = |a: usize, b: usize| -> f64 {
            (0..360).map(|i| f64::from(i).to_radians()).map(|angle| wave(a, angle) * wave(b, angle)).sum()
        };
        for a in 0..12 {
            for b in 0..=a {
                assert!((turn(a, b) - if a == b { 180.0 } else { 0.0 }).abs() < 1e-9, "{a} {b}");
            }
        }
    }
}
