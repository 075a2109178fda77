//! Whether recordings can be of the rig that a robot file describes, and if not, what to change: a sensor the other way round,
//! units, the time base, the supply, another motor.
//!
//! Nothing is fitted but how the shaft answers its drive ([`response`]): gain, damping and steady speed a volt, in whatever units
//! the recording has. They are compared with what the file's numbers allow ([`expected`]); where they are beyond, the mistakes
//! whose factors bring them back are named ([`explain`]). What the runs do not show is said to be unchecked.

mod expected;
mod explain;
mod motion;
mod response;
mod words;

#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use common::quantile;
use recording::{Drive, Recording, mean_supply_v, supply_problem};
use robot_file::robot::Robot;
use serde::Serialize;

use super::verdict::RigDoubt;

use expected::Expected;
pub use explain::Cause;
use explain::{Answer, Circumstances, DriveColumn, Observed, explain, is_right};
use motion::{DriveAs, Motion};
use response::{Estimate, Response, response};

/// Factor by which an answer is off where friction is another than the equation has.
const STRUCTURE: f64 = 1.1;
/// Standard deviations by which an answer may be off by chance.
const SIGMAS: f64 = 3.0;
/// An answer whose relative deviation is larger is none.
const KNOWN: f64 = 0.25;
/// A sign is known where the value is this many deviations from zero.
const SIGN_SIGMAS: f64 = 6.0;
/// Share of its work that a drive does one way where that way is its sign.
const OPPOSED: f64 = 0.5;
/// What another unit of the angle leaves is at most this share of what radians leave.
const SAME: f64 = 1.03;
/// Samples that a comparison of drive and motion needs.
const FEWEST: usize = 50;

/// What a check found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RigCheck {
    /// What is wrong; nothing where the recordings can be of this rig.
    pub findings: Vec<Finding>,
    /// What the recordings do not show, in words.
    pub unchecked: Vec<String>,
    /// Recordings that no motion can be read from, each with the reason.
    pub unreadable: Vec<String>,
}

/// Something that does not go together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// What is wrong.
    pub problem: String,
    /// What gave it away, in figures.
    pub evidence: String,
    /// What would explain it, the likeliest first, each with what to change.
    pub mends: Vec<Mend>,
    /// How to tell several explanations apart.
    pub tell_apart: Option<String>,
}

impl Finding {
    /// What is wrong, with its evidence, in one line.
    #[must_use]
    pub fn reason(&self) -> String {
        if self.evidence.is_empty() { self.problem.clone() } else { format!("{} ({})", self.problem, self.evidence) }
    }

    /// What to change, a line an explanation, and how to tell them apart.
    #[must_use]
    pub fn mend(&self) -> String {
        let lines = self.mends.iter().map(|mend| match self.mends.len() {
            1 => mend.change.clone(),
            _ => format!("if {}: {}", mend.words, mend.change),
        });
        let tell_apart = self.tell_apart.iter().map(|ways| format!("to know which: {ways}"));
        lines.chain(tell_apart).collect::<Vec<_>>().join("\n")
    }
}

impl From<&Finding> for RigDoubt {
    fn from(finding: &Finding) -> Self {
        Self { reason: finding.reason(), mend: finding.mend() }
    }
}

/// An explanation with what to change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mend {
    /// The mistakes; several where one alone does not explain it.
    pub causes: Vec<Cause>,
    /// The mistakes in words.
    pub words: String,
    /// What to change, and to what.
    pub change: String,
    /// The line of the robot file that changes, as a dotted path.
    pub field: Option<String>,
}

/// Checks recordings of one rig against the robot file that is to describe it.
#[must_use]
pub fn check_rig(robot: &Robot, recordings: &[Recording]) -> RigCheck {
    let mut found = RigCheck::default();
    found.findings.extend(supply(robot, recordings));
    let mut moved: Vec<(&Recording, Motion)> = Vec::new();
    for one in recordings {
        match Motion::new(robot, one) {
            Ok(motion) => moved.push((one, motion)),
            Err(reason) => found.unreadable.push(format!("{}: {reason}", one.path.display())),
        }
    }
    for (is_voltage, beyond) in [(false, false), (true, false), (false, true)] {
        let runs: Vec<&(&Recording, Motion)> = moved
            .iter()
            .filter(|(one, motion)| {
                let of_kind = matches!(one.drive, Drive::Voltage(_)) == is_voltage;
                of_kind && (is_voltage || motion.is_beyond_duty() == beyond)
            })
            .collect();
        if !runs.is_empty() {
            check_alike(robot, &runs, &mut found);
        }
    }
    found
}

/// The supply, where it was measured.
fn supply(robot: &Robot, recordings: &[Recording]) -> Option<Finding> {
    recordings.iter().find_map(|one| {
        let (problem, mean) = (supply_problem(one, robot)?, mean_supply_v(one)?);
        Some(words::supply(problem, robot, mean))
    })
}

/// Checks runs whose drive is of one kind.
fn check_alike(robot: &Robot, runs: &[&(&Recording, Motion)], found: &mut RigCheck) {
    let motions: Vec<&Motion> = runs.iter().map(|(_, motion)| motion).collect();
    let supply_is_measured = runs.iter().all(|(one, _)| one.supply_v.len() == one.len());
    let turn = motions.iter().find_map(|motion| motion.turn);
    let named = response(&motions, turn.unwrap_or(TAU));
    let mut at = Circumstances {
        robot,
        expected: Expected::new(robot, supply_is_measured),
        turn,
        drive: DriveColumn {
            is_voltage: matches!(runs[0].0.drive, Drive::Voltage(_)),
            is_beyond_duty: motions.iter().any(|motion| motion.is_beyond_duty()),
            largest: motions.iter().map(|motion| motion.largest_drive).fold(0.0, f64::max),
        },
        supply_is_measured,
        hidden: false,
        rough: named.as_ref().is_some_and(Response::is_rough),
        step: motions.iter().map(|motion| motion.usual_step).fold(0.0, f64::max),
    };
    match sign(&motions, named.as_ref()) {
        Some(Sign { reversed: true, evidence }) => found.findings.push(words::reversed(evidence)),
        None => found.unchecked.push("the sign of the angle: drive and motion do not tell".to_owned()),
        Some(_) => {}
    }
    let answer = observed(named.as_ref(), &motions);
    found.unchecked.extend(words::unchecked(&answer));
    let read = |drive_as: DriveAs| {
        Reading::new(runs.iter().map(|(one, motion)| motion.driven(robot, one, drive_as)).collect(), at.turn)
    };
    let odd = at.drive.is_beyond_duty || at.drive.looks_like_a_duty(robot) || at.rows_are_slow();
    let is_right = !odd && is_right(&answer, &at.expected);
    // In another unit than radians a pendulum's weight looks like noise.
    at.hidden = is_right && answer.speed.is_none() && robot.effects.laws().largest_torque() > 0.0;
    if is_right && !at.hidden {
        return;
    }
    let explanations = explain(&answer, &at, &read);
    if at.rough && explanations.is_empty() {
        found.unchecked.push(words::rough());
    } else if !is_right || !explanations.is_empty() {
        found.findings.push(words::scales(&answer, &at, &explanations));
    }
}

/// Runs whose drive column is read in one way.
struct Reading {
    motions: Vec<Motion>,
    /// A turn in the angle's unit, where the reading is wrapped.
    turn: Option<f64>,
    /// With what turns with the shaft told by that, or else by radians.
    usual: Option<Response>,
}

impl Reading {
    fn new(motions: Vec<Motion>, turn: Option<f64>) -> Self {
        let usual = response(&motions.iter().collect::<Vec<_>>(), turn.unwrap_or(TAU));
        Self { motions, turn, usual }
    }

    /// The answer of an angle with a turn.
    fn answer(&self, turn: f64) -> Answer {
        let motions: Vec<&Motion> = self.motions.iter().collect();
        if self.turn.is_some() || turn == TAU {
            return observed(self.usual.as_ref(), &motions);
        }
        // What turns with the shaft is told by its angle, in that unit in which it is explained better.
        let Some(usual) = &self.usual else { return observed(response(&motions, turn).as_ref(), &motions) };
        let other = response::of_length(&motions, usual.length, turn);
        let as_good = other.filter(|other| other.left_over <= SAME * usual.left_over);
        observed(Some(as_good.as_ref().unwrap_or(usual)), &motions)
    }
}

/// Which way the angle counts.
struct Sign {
    reversed: bool,
    evidence: String,
}

/// By the shaft's answer; else by the work that the motor does on its shaft, which over a run that ends about as slowly as it
/// began is positive.
fn sign(motions: &[&Motion], answer: Option<&Response>) -> Option<Sign> {
    if let Some(gain) = answer.map(|answer| answer.gain)
        && gain.value.abs() > SIGN_SIGMAS * gain.deviation
    {
        let evidence = format!("a volt changes the speed by {:.1} ± {:.1} rad/s²", gain.value, gain.deviation);
        return Some(Sign { reversed: gain.value < 0.0, evidence });
    }
    let share = work(motions)?;
    (share.abs() > OPPOSED).then(|| Sign {
        reversed: share < 0.0,
        evidence: format!("{:.0} % of the drive's work on the shaft are against its motion", 50.0 * (1.0 - share)),
    })
}

/// Work of the drive on the shaft, over that without signs; of a shaft that a motor drives it is positive.
fn work(motions: &[&Motion]) -> Option<f64> {
    let (mut work, mut size, mut count) = (0.0, 0.0, 0);
    for run in motions {
        for i in SPEED_SAMPLES..run.t.len() {
            let travel = run.angle[i] - run.angle[i - SPEED_SAMPLES];
            if run.enable[i - SPEED_SAMPLES] && travel.abs() > 6.0 * run.noise {
                let mean = run.volts[i - SPEED_SAMPLES..i].iter().sum::<f64>() / SPEED_SAMPLES as f64;
                work += mean * travel;
                size += (mean * travel).abs();
                count += 1;
            }
        }
    }
    (count >= FEWEST && size > 0.0).then(|| work / size)
}

/// What of an answer is known. Its sign is another question.
fn observed(answer: Option<&Response>, motions: &[&Motion]) -> Answer {
    let nothing = Answer { speed_at_least: speed_at_least(motions), ..Answer::default() };
    let Some(answer) = answer else { return nothing };
    let known = |estimate: Estimate| {
        let doubt = STRUCTURE * (SIGMAS * estimate.relative()).exp();
        (estimate.relative() < KNOWN).then(|| Observed { value: estimate.value.abs(), doubt })
    };
    // A shaft that gains speed by itself is none: what pulls at it is not in the equation.
    if answer.damping.value <= 0.0 {
        return Answer { gain: known(answer.gain), ..nothing };
    }
    let (gain, damping, speed) = (known(answer.gain), known(answer.damping), known(answer.speed));
    Answer { gain, damping, speed, ..nothing }
}

/// Samples over which a speed is taken.
const SPEED_SAMPLES: usize = 16;

/// How fast the shaft turns most of the time when it turns fast, for the largest voltage that a run has.
fn speed_at_least(motions: &[&Motion]) -> Option<f64> {
    let of_run = |run: &&Motion| {
        let most = run.volts.iter().fold(0.0, |most: f64, volts| most.max(volts.abs()));
        let ends = (0..run.t.len().saturating_sub(SPEED_SAMPLES)).map(|i| (i, i + SPEED_SAMPLES));
        let travel = |(i, j): (usize, usize)| (run.angle[j] - run.angle[i]).abs() - 6.0 * run.noise;
        let speeds = ends.map(|(i, j)| travel((i, j)) / (run.t[j] - run.t[i]));
        let mut speeds: Vec<f64> = speeds.filter(|speed| speed.is_finite()).collect();
        quantile(&mut speeds, 0.9).filter(|_| most > 0.0).map(|speed| speed / most)
    };
    motions.iter().filter_map(of_run).reduce(f64::max)
}
