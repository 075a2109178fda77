//! Ways to choose actions, and what comes of them.

use common::angle::wrap;
use serde::{Deserialize, Serialize};
use tasks::{Environments, Pose};

use super::LearnError;
use super::policy::Policy;

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
    /// Along the line y = 0 by the pose, which must be the observation's first three numbers: to the left or to the right, whichever
    /// turns towards the point of the line that is so far ahead.
    Steering {
        /// The action that turns the robot to the left, and the one that turns it to the right.
        actions: [usize; 2],
        /// How far ahead that point lies, in the observation's unit of length.
        lookahead: f64,
    },
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
            Self::Steering { actions: [left, right], lookahead } => {
                let [_, y, heading, ..] = seen.observation else { return *left };
                let off = wrap(f64::from(*heading) + f64::from(*y).atan2(*lookahead));
                if off > 0.0 { *right } else { *left }
            }
        }
    }
}

impl Gait {
    /// What it is called, with the frequencies of its actions and the time between two of them.
    #[must_use]
    pub fn words(&self, frequencies_hz: &[f64], interval_s: f64) -> String {
        let hz = |action: usize| frequencies_hz.get(action).map_or_else(|| "?".to_owned(), ToString::to_string);
        match self {
            Self::Policy(_) => "learned".to_owned(),
            Self::Constant(action) => format!("constant {} Hz", hz(*action)),
            Self::Alternation { actions, steps } => {
                let held =
                    |which: usize| format!("{} Hz for {:.2} s", hz(actions[which]), steps[which] as f64 * interval_s);
                format!("{}, {}", held(0), held(1))
            }
            Self::Oscillation { actions: [a, b], centre_rad, amplitude_rad } => {
                let (centre, amplitude) = (wrap(*centre_rad).to_degrees(), amplitude_rad.to_degrees());
                format!("{centre:.0}° ± {amplitude:.0}°, {} and {} Hz", hz(*a), hz(*b))
            }
            Self::Steering { actions: [left, right], .. } => {
                format!("along a line, {} Hz to the left, {} Hz to the right", hz(*left), hz(*right))
            }
        }
    }
}

/// What an episode came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Played {
    /// Sum of the rewards.
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

    /// Drift for each whole turn, m; infinite where it does not turn.
    #[must_use]
    pub fn drift_per_turn(&self) -> f64 {
        self.drift / (self.turned.abs() / std::f64::consts::TAU)
    }
}

/// Plays an episode in every environment, environment i with gait i and seed i, to its end or until `enough` of it.
///
/// # Errors
/// The environments'.
///
/// # Panics
/// If there are not as many gaits and seeds as environments.
pub fn play(
    environments: &mut Environments,
    gaits: &[Gait],
    seeds: &[u64],
    enough: &dyn Fn(&Played) -> bool,
) -> Result<Vec<Played>, LearnError> {
    assert!(gaits.len() == environments.len() && seeds.len() == gaits.len(), "a gait and a seed for each environment");
    let size = environments.definition().observation_size();
    let mut seen = vec![0.0; size * gaits.len()];
    for (which, seed) in seeds.iter().enumerate() {
        environments.reset(which, Some(*seed))?;
        environments.observe(which, &mut seen[which * size..(which + 1) * size]);
    }
    let begin = |which: usize| Played { path: vec![environments.pose(which)], ..Played::default() };
    let mut played: Vec<Played> = (0..gaits.len()).map(begin).collect();
    let mut over = vec![false; gaits.len()];
    for step in 0..environments.definition().episode_steps() {
        let choose = |((gait, observation), played): ((&Gait, &[f32]), &Played)| {
            gait.choose(&Seen { step, observation, previous: played.actions.last().copied() })
        };
        let actions: Vec<usize> = gaits.iter().zip(seen.chunks(size)).zip(&played).map(choose).collect();
        let stepped = environments.step(&actions)?;
        for ((which, one), over) in played.iter_mut().enumerate().zip(&mut over).filter(|(_, over)| !**over) {
            one.take(actions[which], stepped.rewards[which], environments.pose(which));
            one.seconds += environments.definition().interval_s;
            *over = stepped.terminated[which] || stepped.truncated[which] || enough(one);
        }
        seen = stepped.observations;
        if over.iter().all(|over| *over) {
            break;
        }
    }
    Ok(played)
}

impl Played {
    fn take(&mut self, action: usize, reward: f64, pose: Pose) {
        let (start, before) = (self.path[0], self.path[self.path.len() - 1]);
        self.sum += reward;
        self.turned += wrap(pose.heading - before.heading);
        self.drift = (pose.x - start.x).hypot(pose.y - start.y);
        self.farthest = self.farthest.max(self.drift);
        self.actions.push(action);
        self.path.push(pose);
    }
}

/// Of many gaits the one with the greatest sum of rewards in an episode of a seed, so many tried side by side.
///
/// # Errors
/// The environments'.
pub fn best(
    environments: &mut Environments,
    gaits: &[Gait],
    seed: u64,
    tell: &mut dyn FnMut(usize),
) -> Result<Option<(Gait, Played)>, LearnError> {
    let mut best: Option<(Gait, Played)> = None;
    let mut tried = 0;
    for wave in gaits.chunks(environments.len()) {
        // The last wave is filled up with the first of its gaits.
        let filled: Vec<Gait> =
            (0..environments.len()).map(|i| wave[if i < wave.len() { i } else { 0 }].clone()).collect();
        let played = play(environments, &filled, &vec![seed; filled.len()], &|_| false)?;
        for (gait, played) in wave.iter().zip(played) {
            if best.as_ref().is_none_or(|(_, known)| played.sum > known.sum) {
                best = Some((gait.clone(), played));
            }
        }
        tried += wave.len();
        tell(tried);
    }
    Ok(best)
}

/// Every constant action.
#[must_use]
pub fn constants(actions: usize) -> Vec<Gait> {
    (0..actions).map(Gait::Constant).collect()
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
        assert_eq!(constants(10)[9].choose(&Seen { step: 5, observation: &[], previous: None }), 9);
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
        let gait = Gait::Steering { actions: [1, 0], lookahead: 2.0 };
        let chosen =
            |y: f32, heading: f32| gait.choose(&Seen { step: 0, observation: &[40.0, y, heading], previous: None });
        // On the line, heading to the left of it or to the right.
        assert_eq!([chosen(0.0, 0.1), chosen(0.0, -0.1)], [0, 1]);
        // 1 to the left: the point 2 ahead lies 0.46 rad to the right.
        assert_eq!([chosen(1.0, -0.45), chosen(1.0, -0.48)], [0, 1]);
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
