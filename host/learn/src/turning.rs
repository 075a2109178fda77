//! What was learned about turning in place, beside ways to turn that need no learning.

use std::f64::consts::TAU;

use serde::Serialize;
use sweep::VariantBuilder;
use tasks::{Definition, DriveKind, Environments, Part};

use super::LearnError;
use super::gait::{self, Gait, Played, SIDE_BY_SIDE};
use super::policy::Policy;
use super::seeds;
use super::settings::{Direction, Settings};

/// Steps for which an alternation holds a frequency: with a Δt of 20 ms a swing of 100° or so takes two.
const HELD: [usize; 3] = [1, 2, 4];
/// Amplitude of the thesis's oscillation, Fig. 5.4, rad.
const AMPLITUDE_RAD: f64 = 100.0 * TAU / 360.0;
/// Middles of an oscillation that are tried around the shaft.
const CENTRES: usize = 16;
/// A robot that turns slower than this is not said to turn, rad/s: a turn takes two minutes.
const LEAST_RATE_RAD_PER_S: f64 = 0.05;
/// How often an oscillation looks whether it is to turn back, s.
const OSCILLATION_INTERVAL_S: f64 = 1e-3;

/// A way to turn in place.
#[derive(Clone, Debug)]
pub struct Contender {
    /// What it is called.
    pub name: String,
    /// How it chooses actions.
    pub gait: Gait,
    /// Where it was chosen.
    pub definition: Definition,
    /// Episodes that were played to find it.
    pub tried: usize,
}

/// What several episodes came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// Mean sum of rewards, of the reward for a step of the learning file's Δt.
    pub sum_of_rewards: f64,
    /// Mean rate of turning, °/s, counter-clockwise.
    pub rate_deg_per_s: f64,
    /// The slowest tenth and the fastest tenth end here, °/s.
    pub rates_deg_per_s: [f64; 2],
    /// Median of the drift for a whole turn, mm.
    pub drift_mm_per_turn: f64,
    /// Median radius of the circle on which it walks, mm.
    pub radius_mm: f64,
    /// Median of the farthest from the start, mm.
    pub farthest_mm: f64,
    /// Share of the episodes that were not over before their time.
    pub to_the_end: f64,
}

/// The learned policy; by the reward the best constant frequency, the best alternation of two and the best oscillation: one by ±100°, or one
/// of those that are actions where there are any; and of the oscillations the one on the smallest circle, where one turns the robot at all.
///
/// # Errors
/// The environments'.
pub fn contenders(
    robot: &VariantBuilder,
    (settings, direction): (&Settings, Direction),
    policy: Policy,
    threads: Option<usize>,
    tell: &mut dyn FnMut(usize, usize),
) -> Result<Vec<Contender>, LearnError> {
    let mut definition = settings.turn.definition(direction);
    // All are chosen on the file's robot, and turn one.
    definition.randomization.share = 0.0;
    let often =
        Definition { interval_s: OSCILLATION_INTERVAL_S, parts: vec![Part::Pose, Part::Shaft], ..definition.clone() };
    let (hz, known) = (&definition.frequencies_hz, definition.actions());
    let oscillations = match known.len() - hz.len() {
        0 => (gait::oscillations(hz, AMPLITUDE_RAD, CENTRES), &often),
        _ => (gait::constants(hz.len()..known.len()), &definition),
    };
    let kinds =
        [(gait::constants(0..hz.len()), &definition), (gait::alternations(hz.len(), &HELD), &definition), oscillations];
    let all: usize = kinds.iter().map(|(gaits, _)| gaits.len()).sum();
    let mut found = vec![Contender {
        name: "learned".to_owned(),
        gait: Gait::Policy(policy),
        definition: definition.clone(),
        tried: settings.ppo.steps * settings.turn.updates / definition.episode_steps(),
    }];
    let mut before = 0;
    let mut tightest = None;
    for (gaits, definition) in &kinds {
        let mut side_by_side = Environments::with_threads(robot.clone(), (*definition).clone(), SIDE_BY_SIDE, threads)?;
        let worths: [gait::Worth<'_>; 2] = [&|played| played.sum, &|played| tightness(played, direction)];
        let tell = &mut |tried| tell(before + tried, all);
        let best = gait::best(&mut side_by_side, gaits, seeds::TURNING_CHOSEN, &worths, tell)?;
        before += gaits.len();
        let contender = |gait: Gait| Contender {
            name: gait.words(&known, definition.interval_s),
            gait,
            definition: (*definition).clone(),
            tried: gaits.len(),
        };
        let [by_reward, by_circle] = <[_; 2]>::try_from(best).unwrap_or_else(|_| unreachable!("two worths"));
        found.extend(by_reward.map(|(gait, _)| contender(gait)));
        // That of the last kind stays: where an alternation goes depends on the angle at which the shaft happens to start, an oscillation
        // looks at it.
        let by_circle = by_circle.filter(|(_, worth)| *worth > f64::NEG_INFINITY);
        tightest = by_circle.map(|(gait, _)| contender(gait));
    }
    found.extend(tightest.map(|found| Contender { name: format!("tightest: {}", found.name), ..found }));
    Ok(found)
}

/// How small the circle is on which a robot walks, 1/m; of one that turns the other way or hardly at all, less than any.
fn tightness(played: &Played, direction: Direction) -> f64 {
    let turns = direction.sign() * played.rate() >= LEAST_RATE_RAD_PER_S;
    if turns { 1.0 / played.radius() } else { f64::NEG_INFINITY }
}

/// The robots on which a gait is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Robots {
    /// The file's, driven as the policy was learned.
    Nominal,
    /// Drawn from all of the file's spreads, driven by the firmware's controller and the simulated motor.
    Drawn,
}

/// Plays a contender on so many robots that took no part in choosing or learning it.
///
/// # Errors
/// The environments'.
pub fn episodes(
    robot: &VariantBuilder,
    contender: &Contender,
    robots: Robots,
    count: usize,
    threads: Option<usize>,
) -> Result<Vec<Played>, LearnError> {
    let mut definition = contender.definition.clone();
    if robots == Robots::Drawn {
        definition.drive = DriveKind::Motor;
        definition.randomization.share = 1.0;
    }
    let seeds: Vec<u64> = (0..count as u64).map(|i| seeds::TURNING_JUDGED + i).collect();
    gait::play_each(robot, definition, (&contender.gait, &seeds), &|_| false, threads)
}

/// What episodes came to; the reward of a step counts for Δt of the learning file.
#[must_use]
pub fn judged(played: &[Played], contender: &Contender, interval_s: f64) -> Judged {
    let mean = |of: &dyn Fn(&Played) -> f64| played.iter().map(of).sum::<f64>() / played.len() as f64;
    let quantile = |share: f64, of: &dyn Fn(&Played) -> f64| {
        let mut values: Vec<f64> = played.iter().map(of).collect();
        common::statistics::quantile(&mut values, share).unwrap_or(f64::NAN)
    };
    let rate = |one: &Played| one.rate().to_degrees();
    let whole = contender.definition.episode_s - 0.5 * contender.definition.interval_s;
    Judged {
        sum_of_rewards: mean(&|one| one.sum) * contender.definition.interval_s / interval_s,
        rate_deg_per_s: mean(&rate),
        rates_deg_per_s: [quantile(0.1, &rate), quantile(0.9, &rate)],
        drift_mm_per_turn: 1e3 * quantile(0.5, &Played::drift_per_turn),
        radius_mm: 1e3 * quantile(0.5, &Played::radius),
        farthest_mm: 1e3 * quantile(0.5, &|one| one.farthest),
        to_the_end: mean(&|one| f64::from(u8::from(one.seconds > whole))),
    }
}
