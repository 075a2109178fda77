//! A search for the tick that costs most: courses are changed at random, and the dearest is kept.

use control::Parameters;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use scram::hil::{HilError, Qemu, Remote};
use simulation::{Drive, DriveCommand, Plan, Step};

use super::bits::Compared;
use super::cost::{Robots, gait};
use super::course::{Course, Disturbance, run};

/// What a search found.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Most instructions.
    pub cost: u32,
    /// Ticks missed before that tick.
    pub missed: u16,
    /// Deepest stack, bytes.
    pub stack: u32,
    /// Every tick of the search beside the host's.
    pub compared: Compared,
}

/// Length of a course, ticks: an angle is found after some 30, and then there is time for a few surprises.
const TICKS: usize = 150;
/// A new start after so many changes in a row that found nothing dearer.
const PATIENCE: u32 = 40;

/// Searches for a number of courses.
///
/// # Errors
/// The link to the chip fails.
pub fn search(robots: &Robots, courses: u32, chip: &mut Remote<Qemu>) -> Result<Found, HilError> {
    let mut random = Pcg64::seed_from_u64(1);
    let mut found = Found::default();
    let mut present: Option<(u32, Course)> = None;
    let mut in_vain = 0;
    for _ in 0..courses {
        let candidate = match &present {
            Some((_, course)) => changed(course, &mut random),
            None => fresh(robots, &mut random),
        };
        let outcome = run(&robots.robot, &candidate, chip)?;
        let dearest = outcome.ticks.iter().max_by_key(|ran| ran.cost);
        let (cost, missed) = dearest.map_or((0, 0), |ran| (ran.cost, ran.missed));
        if cost > found.cost {
            (found.cost, found.missed) = (cost, missed);
        }
        found.stack = found.stack.max(outcome.stack);
        found.compared.add(outcome.compared);
        if present.as_ref().is_none_or(|(best, _)| cost > *best) {
            present = Some((cost, candidate));
            in_vain = 0;
        } else {
            in_vain += 1;
        }
        if in_vain > PATIENCE {
            (present, in_vain) = (None, 0);
        }
    }
    Ok(found)
}

fn fresh(robots: &Robots, random: &mut Pcg64) -> Course {
    let seconds = TICKS as f64 * f64::from(robots.calibrated.tick);
    let drive = Drive { steps: vec![Step { at_s: 0.0, command: command(random) }], end_s: None };
    let mut course = Course {
        parameters: parameters(robots, random),
        plan: Plan { drive, seconds, faults: Vec::new() },
        seed: random.random_range(0..1000),
        disturbances: Vec::new(),
    };
    for _ in 0..4 {
        disturb(&mut course, random);
    }
    course
}

fn parameters(robots: &Robots, random: &mut Pcg64) -> Parameters {
    // The calibrated sensor is the dearer one.
    if random.random_ratio(1, 8) { robots.uncalibrated } else { robots.calibrated }
}

fn command(random: &mut Pcg64) -> DriveCommand {
    let style = if random.random() { control::Stroke::BangBang } else { control::Stroke::Proportional };
    match random.random_range(0..8) {
        0 => DriveCommand::Position { deg: random.random_range(-180.0..180.0) },
        1 => DriveCommand::Duty { duty: random.random_range(-1.0..1.0) },
        2..=4 => {
            let from_deg = random.random_range(-300.0..200.0);
            DriveCommand::Oscillate { from_deg, to_deg: from_deg + random.random_range(60.0..300.0), style }
        }
        5 => {
            let mut hz = || if random.random() { 1.0 } else { -1.0 } * random.random_range(1.0..8.5);
            gait(0.04, &[hz(), hz(), hz()], true)
        }
        _ => DriveCommand::Freq { hz: if random.random() { 1.0 } else { -1.0 } * random.random_range(1.0..8.5) },
    }
}

/// Something else at any tick.
fn disturb(course: &mut Course, random: &mut Pcg64) {
    let what = match random.random_range(0..6) {
        0..=2 => Disturbance::Miss(random.random_range(15..21)),
        3 => Disturbance::Angle(random.random_range(0..4096)),
        4 => Disturbance::Late(random.random_range(-480..480)),
        _ => Disturbance::Battery(random.random_range(0..4096)),
    };
    course.disturbances.push((random.random_range(20..TICKS - 21), what));
}

/// A course a little different.
fn changed(course: &Course, random: &mut Pcg64) -> Course {
    let mut course = course.clone();
    match random.random_range(0..6) {
        0 => course.seed = random.random_range(0..1000),
        1 => course.plan.drive.steps[0].command = command(random),
        2 => {
            // Another command on the way: it turns the drive round.
            course.plan.drive.steps.truncate(1);
            let at_s = course.plan.seconds * random.random_range(0.2..0.95);
            course.plan.drive.steps.push(Step { at_s, command: command(random) });
        }
        3 if !course.disturbances.is_empty() => {
            course.disturbances.swap_remove(random.random_range(0..course.disturbances.len()));
        }
        4 if !course.disturbances.is_empty() => {
            let chosen = random.random_range(0..course.disturbances.len());
            let tick = &mut course.disturbances[chosen].0;
            *tick = (*tick + random.random_range(0..7)).saturating_sub(3).clamp(1, TICKS - 2);
        }
        _ => disturb(&mut course, random),
    }
    course.disturbances.sort_by_key(|(tick, _)| *tick);
    course
}
