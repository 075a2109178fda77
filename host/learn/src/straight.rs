//! Walking straight by two frequencies of opposite sign in turn, thesis (5.3): how long each is held, found by search; and by feedback of
//! the pose.

use std::f64::consts::TAU;

use serde::Serialize;
use sweep::VariantBuilder;
use tasks::{Definition, DriveKind, Environments, Straight, Task};

use super::LearnError;
use super::gait::{self, End, Gait, Played, SIDE_BY_SIDE};
use super::seeds;
use super::settings::Straightness;
use super::sides::{self, BACKWARD, FORWARD};
use super::way::Way;

/// How a robot walks with a signal, in the mean over several starts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Walked {
    /// Seconds for which +F and −F are held, t₁ and t₂ of (5.3); one of them is 0 where the other one is never left.
    pub held_s: [f64; 2],
    /// From its start to its end over the time, mm/s.
    pub speed_mm_per_s: f64,
    /// Along its path, mm/s.
    pub path_mm_per_s: f64,
    /// Size of the change of heading over the length of the path, turns a metre, counter-clockwise positive.
    pub turns_per_m: f64,
}

/// What the search found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// +F alone and −F alone.
    pub constant: [Walked; 2],
    /// All pairs of holding times.
    pub alternations: Vec<Walked>,
    /// Those of `alternations` than which none is both faster and straighter, the straightest first.
    pub front: Vec<usize>,
    /// The fastest of those whose path curves by less than the bar.
    pub best: Option<usize>,
}

/// Curvature under which a path is called straight, turns a metre.
pub const STRAIGHT_TURNS_PER_M: f64 = 0.2;

/// Tries every pair of holding times.
///
/// # Errors
/// The environments'.
pub fn search(
    robot: &VariantBuilder,
    settings: &Straightness,
    threads: Option<usize>,
    tell: &mut dyn FnMut(usize, usize),
) -> Result<Found, LearnError> {
    let definition = settings.definition();
    let held: Vec<[usize; 2]> =
        settings.held.iter().flat_map(|&first| settings.held.iter().map(move |&second| [first, second])).collect();
    let alternate = |steps: &[usize; 2]| Gait::Alternation { actions: [FORWARD, BACKWARD], steps: *steps };
    let gaits: Vec<Gait> =
        [Gait::Constant(FORWARD), Gait::Constant(BACKWARD)].into_iter().chain(held.iter().map(alternate)).collect();
    let wave = (SIDE_BY_SIDE / settings.starts).max(1);
    let mut environments =
        Environments::with_threads(robot.clone(), definition.clone(), wave * settings.starts, threads)?;
    let seeds: Vec<u64> =
        (0..environments.len()).map(|i| seeds::STRAIGHT_TRIED + (i % settings.starts) as u64).collect();
    let mut walked = Vec::new();
    for some in gaits.chunks(wave) {
        let each: Vec<Gait> = some.iter().flat_map(|gait| std::iter::repeat_n(gait.clone(), settings.starts)).collect();
        let played = gait::play(&mut environments, &each, &seeds[..each.len()], &|_| false)?;
        walked.extend(played.chunks(settings.starts).map(mean));
        tell(walked.len(), gaits.len());
    }
    for (walked, steps) in walked[2..].iter_mut().zip(&held) {
        walked.held_s = steps.map(|steps| steps as f64 * settings.interval_s);
    }
    let alternations = walked.split_off(2);
    let [mut forward, mut backward] = <[Walked; 2]>::try_from(walked).unwrap_or_else(|_| unreachable!("two constants"));
    (forward.held_s, backward.held_s) = ([settings.episode_s, 0.0], [0.0, settings.episode_s]);
    let front = front(&alternations);
    let best = front.iter().copied().rfind(|&place| alternations[place].turns_per_m.abs() < STRAIGHT_TURNS_PER_M);
    Ok(Found { constant: [forward, backward], alternations, front, best })
}

impl Straightness {
    /// The environments that this describes: one action turns the shaft with +F, the other one with −F.
    #[must_use]
    pub fn definition(&self) -> Definition {
        let task = Task::Straight(Straight::default());
        Definition {
            episode_s: self.episode_s,
            ..sides::definition(task, self.frequency_hz, self.interval_s, self.alpha_deg)
        }
    }
}

fn mean(starts: &[Played]) -> Walked {
    let of = |what: &dyn Fn(&Played) -> f64| starts.iter().map(what).sum::<f64>() / starts.len() as f64;
    let path = of(&Played::length);
    Walked {
        held_s: [0.0; 2],
        speed_mm_per_s: 1e3 * of(&|played| played.drift / played.seconds),
        path_mm_per_s: 1e3 * of(&|played| played.length() / played.seconds),
        turns_per_m: of(&|played| played.turned) / TAU / path,
    }
}

/// Of those than which none is both faster and straighter, their places, the straightest first.
fn front(walked: &[Walked]) -> Vec<usize> {
    super::front::front(walked, [|one| -one.turns_per_m.abs(), |one| one.speed_mm_per_s])
}

/// What came of a robot that steers along a line by its pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Steered {
    /// When it had walked the distance, s; none if it did not within its time.
    pub arrived_s: Option<f64>,
    /// Farthest off the line up to there, mm.
    pub farthest_off_mm: f64,
    /// How far it came, mm.
    pub ahead_mm: f64,
    /// How it ended.
    pub end: End,
}

/// Robots drawn from the file's spreads steer along a line with controller, motor and sensor: +F or −F, whichever turns towards it.
///
/// # Errors
/// The environments'.
pub fn steered(
    robot: &VariantBuilder,
    settings: &Straightness,
    found: &Found,
    robots: usize,
    threads: Option<usize>,
) -> Result<Vec<Steered>, LearnError> {
    let mut definition =
        Definition { episode_s: settings.patience_s, drive: DriveKind::Motor, ..settings.definition() };
    definition.randomization.share = settings.randomize;
    let lookahead = settings.lookahead_m / definition.length_unit_m;
    let gait = Gait::Pursuit { actions: found.steering(), lookahead, way: Way::along_x() };
    let seeds: Vec<u64> = (0..robots as u64).map(|i| seeds::STRAIGHT_JUDGED + i).collect();
    let over = |played: &Played| {
        let there = played.path.last().is_some_and(|pose| pose.x >= settings.distance_m);
        there || played.stands(settings.interval_s)
    };
    let played = gait::play_each(robot, definition, (&gait, &seeds), &over, threads)?;
    Ok(played.iter().map(|played| result(played, settings)).collect())
}

impl Found {
    /// The action that turns more to the left, and the one that turns more to the right.
    #[must_use]
    pub fn steering(&self) -> [usize; 2] {
        let [forward, backward] = &self.constant;
        if forward.turns_per_m >= backward.turns_per_m { [FORWARD, BACKWARD] } else { [BACKWARD, FORWARD] }
    }
}

fn result(played: &Played, settings: &Straightness) -> Steered {
    let arrived = played.path.iter().position(|pose| pose.x >= settings.distance_m);
    let walked = &played.path[..arrived.map_or(played.path.len(), |place| place + 1)];
    Steered {
        arrived_s: arrived.map(|steps| steps as f64 * settings.interval_s),
        farthest_off_mm: 1e3 * walked.iter().fold(0.0, |most, pose| pose.y.abs().max(most)),
        ahead_mm: 1e3 * walked.last().map_or(0.0, |pose| pose.x),
        end: played.end(arrived.is_some(), settings.interval_s, settings.patience_s),
    }
}

#[cfg(test)]
mod tests {
    use tasks::Pose;

    use super::*;

    #[test]
    fn the_front_has_what_nothing_beats() {
        let walked = |speed: f64, turns: f64| Walked {
            held_s: [0.0; 2],
            speed_mm_per_s: speed,
            path_mm_per_s: speed,
            turns_per_m: turns,
        };
        let all = [walked(3.0, 0.5), walked(2.0, -0.1), walked(1.0, 0.2), walked(4.0, -0.6), walked(2.5, 0.5)];
        assert_eq!(front(&all), [1, 0, 3]);
    }

    #[test]
    fn a_path_is_measured_by_its_ends_its_length_and_its_turning() {
        let pose = |x: f64, y: f64, heading: f64| Pose { x, y, heading };
        let played = Played {
            seconds: 1.0,
            turned: 0.25 * TAU,
            drift: 0.05,
            path: vec![pose(0.0, 0.0, 0.0), pose(0.03, 0.0, 0.1), pose(0.03, 0.04, 0.25 * TAU)],
            ..Played::default()
        };
        let found = mean(&[played]);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(near(found.speed_mm_per_s, 50.0) && near(found.path_mm_per_s, 70.0), "{found:?}");
        assert!(near(found.turns_per_m, 0.25 / 0.07), "{found:?}");
    }

    #[test]
    fn what_lies_behind_the_distance_does_not_count() {
        let settings = Straightness { distance_m: 0.2, interval_s: 0.1, ..Straightness::default() };
        let pose = |x: f64, y: f64| Pose { x, y, heading: 0.0 };
        let path = vec![pose(0.0, 0.0), pose(0.1, -0.003), pose(0.21, 0.001), pose(0.3, 0.2)];
        let found = result(&Played { path: path.clone(), ..Played::default() }, &settings);
        assert_eq!((found.arrived_s, found.ahead_mm, found.end), (Some(0.2), 210.0, End::Arrived));
        assert!((found.farthest_off_mm - 3.0).abs() < 1e-9);
        let found = result(&Played { path: path[..2].to_vec(), ..Played::default() }, &settings);
        assert_eq!((found.arrived_s, found.ahead_mm, found.end), (None, 100.0, End::Stopped));
    }
}
