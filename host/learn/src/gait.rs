//! Ways to choose actions, and what comes of them.

use std::ops::Range;

use common::angle::wrap;
use robot_file::gait::GaitStep;
use serde::{Deserialize, Serialize};
use sweep::VariantBuilder;
use tasks::{Definition, Environments, Pose};

use super::LearnError;
use super::policy::Policy;
use super::way::Way;

/// Episodes are played so many side by side.
pub const SIDE_BY_SIDE: usize = 32;
/// Places of a path are so far apart, s.
const ALONG_S: f64 = 0.5;
/// A robot that came no farther than [`STANDING_M`] in so much time stands, s.
const STANDING_S: f64 = 60.0;
/// m: at that speed a metre takes four hours.
const STANDING_M: f64 = 0.004;

/// A way to choose actions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gait {
    /// Always the likeliest action of a policy.
    Policy(Policy),
    /// Always the same action.
    Constant(usize),
    /// One action for so many steps, then another, and again: thesis (5.3) with ±F.
    Alternation {
        /// The two actions.
        actions: [usize; 2],
        /// How many steps each is held.
        steps: [usize; 2],
    },
    /// To and fro about an angle of the shaft, as fast as the interval between actions lets it turn back: thesis Fig. 5.4. It looks at
    /// the observation's last two numbers, which must be [`tasks::Part::Shaft`].
    Oscillation {
        /// The action that turns the shaft clockwise, and the one that turns it back.
        actions: [usize; 2],
        /// Angle in the middle, rad, counter-clockwise.
        centre_rad: f64,
        /// How far to either side, rad, less than half a turn.
        amplitude_rad: f64,
    },
    /// Along a way by the pose, which must be the observation's first three numbers: to the left or to the right, whichever turns
    /// towards the point of the way that is so far ahead (pure pursuit, R. C. Coulter 1992).
    Pursuit {
        /// The action that turns the robot to the left, and the one that turns it to the right.
        actions: [usize; 2],
        /// How far ahead that point lies, in the observation's unit of length.
        lookahead: f64,
        /// From the start on.
        way: Way,
    },
    /// Actions in turn, the last one from then on: what was noted of another robot.
    Script(Vec<usize>),
}

/// What there is to choose an action by.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Actions taken before.
    pub step: usize,
    /// The observation.
    pub observation: &'a [f32],
    /// The action before, if there was one.
    pub previous: Option<usize>,
}

impl Gait {
    /// The action of a step.
    #[must_use]
    pub fn choose(&self, seen: &Seen<'_>) -> usize {
        match self {
            Self::Policy(policy) => policy.best(seen.observation),
            Self::Constant(action) => *action,
            Self::Alternation { actions, steps } => {
                let first = seen.step % (steps[0] + steps[1]).max(1) < steps[0];
                if first { actions[0] } else { actions[1] }
            }
            Self::Oscillation { actions: [clockwise, back], centre_rad, amplitude_rad } => {
                let [.., cos, sin] = seen.observation else { return *clockwise };
                let off = wrap(f64::from(*sin).atan2(f64::from(*cos)) - centre_rad);
                if off >= *amplitude_rad {
                    *clockwise
                } else if off <= -amplitude_rad {
                    *back
                } else {
                    seen.previous.unwrap_or(if off > 0.0 { *clockwise } else { *back })
                }
            }
            Self::Pursuit { actions: [left, right], lookahead, way } => {
                let &[x, y, heading, ..] = seen.observation else { return *left };
                let [x, y, heading] = [x, y, heading].map(f64::from);
                let [ahead_x, ahead_y] = way.ahead([x, y], *lookahead);
                let off = wrap(heading - (ahead_y - y).atan2(ahead_x - x));
                if off > 0.0 { *right } else { *left }
            }
            Self::Script(actions) => actions.get(seen.step).or(actions.last()).copied().unwrap_or_default(),
        }
    }
}

impl Gait {
    /// What it is called, with what its actions are and the time between two of them.
    #[must_use]
    pub fn words(&self, known: &[GaitStep], interval_s: f64) -> String {
        let words = |action: usize| known.get(action).map_or_else(|| "?".to_owned(), ToString::to_string);
        let hz = |action: usize| match known.get(action) {
            Some(GaitStep::Frequency(hz)) => hz.to_string(),
            _ => words(action),
        };
        match self {
            Self::Policy(_) => "learned".to_owned(),
            Self::Constant(action) => format!("constant {}", words(*action)),
            Self::Alternation { actions, steps } => {
                let held =
                    |which: usize| format!("{} for {:.2} s", words(actions[which]), steps[which] as f64 * interval_s);
                format!("{}, {}", held(0), held(1))
            }
            Self::Oscillation { actions: [a, b], centre_rad, amplitude_rad } => {
                let (centre, amplitude) = (wrap(*centre_rad).to_degrees(), amplitude_rad.to_degrees());
                format!("{centre:.0}° ± {amplitude:.0}°, {} and {} Hz", hz(*a), hz(*b))
            }
            Self::Pursuit { actions: [left, right], .. } => {
                format!("along a way, {} to the left, {} to the right", words(*left), words(*right))
            }
            Self::Script(_) => "as noted".to_owned(),
        }
    }
}

/// How the way of a robot that goes somewhere ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// There.
    Arrived,
    /// It stood, or ran against a wall, for a minute.
    Stood,
    /// Its supervisor stopped it, or its simulation diverged.
    Stopped,
    /// It was on its way when its time was over.
    OutOfTime,
}

/// What an episode came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Played {
    /// Sum of the rewards, with what a fault left out: the robot stands where its supervisor stopped it.
    pub sum: f64,
    /// How long it was, s.
    pub seconds: f64,
    /// Turned in all, counter-clockwise, rad.
    pub turned: f64,
    /// From where it began to where it ended, m.
    pub drift: f64,
    /// Farthest from where it began, m.
    pub farthest: f64,
    /// The actions.
    pub actions: Vec<usize>,
    /// Where the robot was at the start and after every action.
    #[serde(skip)]
    pub path: Vec<Pose>,
}

impl Played {
    /// Mean rate of turning, rad/s, counter-clockwise.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.turned / self.seconds
    }

    /// Whether the robot has not come from its place for a minute, acting every `interval_s`.
    #[must_use]
    pub fn stands(&self, interval_s: f64) -> bool {
        let long = (STANDING_S / interval_s).round() as usize;
        let Some(place) = self.path.len().checked_sub(long + 1) else { return false };
        apart(&self.path[place], &self.path[self.path.len() - 1]) < STANDING_M
    }

    /// How its way ended, if it acted every `interval_s` for `patience_s` at most and is there or not.
    #[must_use]
    pub fn end(&self, is_there: bool, interval_s: f64, patience_s: f64) -> End {
        if is_there {
            End::Arrived
        } else if self.stands(interval_s) {
            End::Stood
        } else if self.seconds < patience_s - 0.5 * interval_s {
            End::Stopped
        } else {
            End::OutOfTime
        }
    }

    /// Length of the path, m: through places half a second apart, within which the shaft turns a few times, whose to and fro is no way.
    #[must_use]
    pub fn length(&self) -> f64 {
        let interval_s = self.seconds / (self.path.len().max(2) - 1) as f64;
        let every = (ALONG_S / interval_s).round().max(1.0) as usize;
        let places: Vec<&Pose> = self.path.iter().step_by(every).collect();
        places.windows(2).map(|pair| apart(pair[0], pair[1])).sum()
    }

    /// Radius of the circle on which the robot walks, m: the length of its path over what it turned.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.length() / self.turned.abs()
    }

    /// Drift for each whole turn, m; infinite where it does not turn.
    #[must_use]
    pub fn drift_per_turn(&self) -> f64 {
        self.drift / (self.turned.abs() / std::f64::consts::TAU)
    }
}

/// Plays an episode of every seed, each with its gait, to its end or until `enough` of it: where one is over the next one begins. What an
/// episode comes to depends on its seed and its gait alone, not on how many environments there are.
///
/// # Errors
/// The environments'.
///
/// # Panics
/// If there are not as many gaits as seeds.
pub fn play(
    environments: &mut Environments,
    gaits: &[Gait],
    seeds: &[u64],
    enough: &dyn Fn(&Played) -> bool,
) -> Result<Vec<Played>, LearnError> {
    assert_eq!(gaits.len(), seeds.len(), "a gait for each seed");
    let (size, interval_s) = (environments.definition().observation_size(), environments.definition().interval_s);
    let mut seen = vec![0.0; size * environments.len()];
    let mut played: Vec<Played> = vec![Played::default(); seeds.len()];
    let mut next = 0..seeds.len();
    // Of each environment the episode that it plays.
    let mut under_way: Vec<Option<usize>> = vec![None; environments.len()];
    let mut over = vec![true; environments.len()];
    loop {
        for which in (0..environments.len()).filter(|which| over[*which]).collect::<Vec<_>>() {
            under_way[which] = next.next();
            over[which] = false;
            let Some(episode) = under_way[which] else { continue };
            environments.reset(which, Some(seeds[episode]))?;
            environments.observe(which, &mut seen[which * size..(which + 1) * size]);
            played[episode].path.push(environments.pose(which));
        }
        if under_way.iter().all(Option::is_none) {
            return Ok(played);
        }
        let choose = |(episode, observation): (&Option<usize>, &[f32])| {
            episode.map_or(0, |episode| {
                let actions = &played[episode].actions;
                gaits[episode].choose(&Seen { step: actions.len(), observation, previous: actions.last().copied() })
            })
        };
        let actions: Vec<usize> = under_way.iter().zip(seen.chunks(size)).map(choose).collect();
        let stepped = environments.step(&actions)?;
        for (which, episode) in under_way.iter().enumerate().filter_map(|(which, episode)| Some((which, (*episode)?))) {
            let one = &mut played[episode];
            one.take(actions[which], stepped.rewards[which], environments.pose(which));
            one.seconds += interval_s;
            one.sum += environments.left_out(which, 1.0);
            over[which] = stepped.terminated[which] || stepped.truncated[which] || enough(one);
        }
        seen = stepped.observations;
    }
}

/// Plays one gait in an episode of every seed, [`SIDE_BY_SIDE`] at a time; else as [`play`].
///
/// # Errors
/// The environments'.
pub fn play_each(
    robot: &VariantBuilder,
    definition: Definition,
    (gait, seeds): (&Gait, &[u64]),
    enough: &dyn Fn(&Played) -> bool,
    threads: Option<usize>,
) -> Result<Vec<Played>, LearnError> {
    let together = SIDE_BY_SIDE.min(seeds.len()).max(1);
    let mut environments = Environments::with_threads(robot.clone(), definition, together, threads)?;
    play(&mut environments, &vec![gait.clone(); seeds.len()], seeds, enough)
}

impl Played {
    fn take(&mut self, action: usize, reward: f64, pose: Pose) {
        let (start, before) = (self.path[0], self.path[self.path.len() - 1]);
        self.sum += reward;
        self.turned += wrap(pose.heading - before.heading);
        self.drift = apart(&start, &pose);
        self.farthest = self.farthest.max(self.drift);
        self.actions.push(action);
        self.path.push(pose);
    }
}

/// From one place to another, m.
fn apart(from: &Pose, to: &Pose) -> f64 {
    (to.x - from.x).hypot(to.y - from.y)
}

/// What makes a gait better than another.
pub type Worth<'a> = &'a dyn Fn(&Played) -> f64;

/// Of many gaits for each measure of worth the one that is worth most in an episode of a seed; so many are tried side by side as there
/// are environments.
///
/// # Errors
/// The environments'.
pub fn best(
    environments: &mut Environments,
    gaits: &[Gait],
    seed: u64,
    worths: &[Worth<'_>],
    tell: &mut dyn FnMut(usize),
) -> Result<Vec<Option<(Gait, f64)>>, LearnError> {
    let mut best: Vec<Option<(Gait, f64)>> = vec![None; worths.len()];
    let mut tried = 0;
    for wave in gaits.chunks(environments.len()) {
        let played = play(environments, wave, &vec![seed; wave.len()], &|_| false)?;
        for (gait, played) in wave.iter().zip(played) {
            for (best, worth) in best.iter_mut().zip(worths) {
                let worth = worth(&played);
                if best.as_ref().is_none_or(|(_, known)| worth > *known) {
                    *best = Some((gait.clone(), worth));
                }
            }
        }
        tried += wave.len();
        tell(tried);
    }
    Ok(best)
}

/// Every constant one of some actions.
#[must_use]
pub fn constants(actions: Range<usize>) -> Vec<Gait> {
    actions.map(Gait::Constant).collect()
}

/// Oscillations by every pair of one action that turns the shaft clockwise and one that turns it back, about so many angles around the
/// shaft.
#[must_use]
pub fn oscillations(frequencies_hz: &[f64], amplitude_rad: f64, centres: usize) -> Vec<Gait> {
    let of_sign = |sign: f64| (0..frequencies_hz.len()).filter(move |&action| sign * frequencies_hz[action] > 0.0);
    let pairs = of_sign(1.0).flat_map(|a| of_sign(-1.0).map(move |b| [a, b]));
    let about = |actions: [usize; 2]| {
        let centre = move |place: usize| std::f64::consts::TAU * place as f64 / centres as f64;
        (0..centres).map(move |place| Gait::Oscillation { actions, centre_rad: centre(place), amplitude_rad })
    };
    pairs.flat_map(about).collect()
}

/// Every alternation of two of so many actions, each held for one of some numbers of steps.
#[must_use]
pub fn alternations(actions: usize, steps: &[usize]) -> Vec<Gait> {
    let pairs = (0..actions).flat_map(|a| (0..actions).map(move |b| [a, b])).filter(|[a, b]| a < b);
    let held = |actions: [usize; 2]| {
        let both = steps.iter().flat_map(|&first| steps.iter().map(move |&second| [first, second]));
        both.map(move |steps| Gait::Alternation { actions, steps })
    };
    pairs.flat_map(held).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alternation_holds_each_action_as_long_as_it_says() {
        let gait = Gait::Alternation { actions: [7, 2], steps: [2, 3] };
        let chosen: Vec<usize> =
            (0..7).map(|step| gait.choose(&Seen { step, observation: &[], previous: None })).collect();
        assert_eq!(chosen, [7, 7, 2, 2, 2, 7, 7]);
        assert_eq!(alternations(3, &[1, 4]).len(), 3 * 4);
        assert_eq!(constants(0..10)[9].choose(&Seen { step: 5, observation: &[], previous: None }), 9);
    }

    #[test]
    fn an_oscillation_turns_back_at_its_bounds_also_across_half_a_turn() {
        let gait = Gait::Oscillation { actions: [8, 1], centre_rad: 3.0, amplitude_rad: 0.5 };
        let chosen = |angle: f64, previous: Option<usize>| {
            gait.choose(&Seen { step: 0, observation: &[9.0, angle.cos() as f32, angle.sin() as f32], previous })
        };
        assert_eq!([chosen(3.3, Some(1)), chosen(3.6, Some(1)), chosen(3.3, Some(8))], [1, 8, 8]);
        assert_eq!([chosen(2.4, Some(8)), chosen(2.6, Some(1)), chosen(3.3, None), chosen(2.7, None)], [1, 1, 8, 1]);
    }

    #[test]
    fn steering_turns_towards_the_line_ahead() {
        let gait = Gait::Pursuit { actions: [1, 0], lookahead: 2.0, way: Way::new(vec![[0.0, 0.0], [9.0, 0.0]]) };
        let chosen =
            |y: f32, heading: f32| gait.choose(&Seen { step: 0, observation: &[40.0, y, heading], previous: None });
        // On the line, heading to the left of it or to the right.
        assert_eq!([chosen(0.0, 0.1), chosen(0.0, -0.1)], [0, 1]);
        // 1 to the left: the point 2 ahead lies 0.46 rad to the right.
        assert_eq!([chosen(1.0, -0.45), chosen(1.0, -0.48)], [0, 1]);
    }

    #[test]
    fn an_episode_is_the_same_in_whichever_environment_its_turn_comes() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml");
        let document = robot_file::edit::Document::load(file.as_ref()).unwrap();
        let robot = document.robot().unwrap();
        let robot = sweep::VariantBuilder::new(document, robot).unwrap();
        let task = tasks::Task::Turn(tasks::Turn::default());
        let definition = tasks::Definition { interval_s: 0.04, episode_s: 0.4, ..tasks::Definition::new(task) };
        let environments = |count: usize| Environments::new(robot.clone(), definition.clone(), count).unwrap();
        let gait = Gait::Alternation { actions: [9, 0], steps: [1, 2] };
        let seeds = [3, 9, 4, 1, 5];
        // Some end earlier than others, so that they are not in step.
        let enough = |played: &Played| played.turned > 0.0 && played.actions.len() > 4;
        let alone: Vec<Played> = seeds
            .iter()
            .flat_map(|seed| play(&mut environments(1), std::slice::from_ref(&gait), &[*seed], &enough).unwrap())
            .collect();
        let gaits = vec![gait; seeds.len()];
        assert_eq!(play(&mut environments(2), &gaits, &seeds, &enough).unwrap(), alone);
        assert_eq!(play(&mut environments(8), &gaits, &seeds, &|_| false).unwrap()[4].actions.len(), 10);
    }

    #[test]
    fn who_stays_where_he_is_for_a_minute_stands() {
        let walked = |speed: f64, seconds: usize| {
            let path = (0..=seconds).map(|s| Pose { x: speed * s as f64, y: 0.0, heading: 0.0 }).collect();
            Played { path, ..Played::default() }.stands(1.0)
        };
        assert_eq!(
            [walked(6e-5, 60), walked(6e-5, 59), walked(7e-5, 60), walked(0.0, 200)],
            [true, false, false, true]
        );
    }

    #[test]
    fn a_script_is_played_to_its_last_action() {
        let gait = Gait::Script(vec![2, 0, 1]);
        let chosen: Vec<usize> =
            (0..5).map(|step| gait.choose(&Seen { step, observation: &[], previous: None })).collect();
        assert_eq!(chosen, [2, 0, 1, 1, 1]);
    }

    #[test]
    fn turning_is_counted_over_whole_turns_and_drift_from_the_start() {
        let pose = |x: f64, heading: f64| Pose { x, y: 0.0, heading };
        let mut played = Played { seconds: 2.0, path: vec![pose(0.0, 3.0)], ..Played::default() };
        played.take(1, -1.0, pose(0.02, -3.0));
        played.take(4, -0.5, pose(0.01, -2.0));
        let turned = (std::f64::consts::TAU - 6.0) + 1.0;
        assert!((played.turned - turned).abs() < 1e-12 && (played.rate() - turned / 2.0).abs() < 1e-12);
        assert_eq!((played.drift, played.farthest, played.sum), (0.01, 0.02, -1.5));
        assert_eq!(played.actions, [1, 4]);
    }
}
