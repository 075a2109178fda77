//! A policy with what made it, as it is written to a file, and played on a robot whose pose is measured from outside.

use std::path::Path;

use robot_file::gait::GaitStep;
use serde::{Deserialize, Serialize};
use tasks::{Definition, DriveKind, Part, Pose};

use super::LearnError;
use super::policy::Policy;
use super::settings::{Direction, Settings};

/// A policy with what made it, as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyFile {
    /// Name of the robot that learned it.
    pub robot: String,
    /// Which way it turns.
    pub direction: Direction,
    /// Seed of the training.
    pub seed: u64,
    /// Updates of the training.
    pub updates: usize,
    /// The learning file.
    pub settings: Settings,
    /// The network.
    pub policy: Policy,
}

impl PolicyFile {
    /// Reads one.
    ///
    /// # Errors
    /// It cannot be read, is none, its learning file has a number out of its range, or its network does not fit it.
    pub fn load(path: &Path) -> Result<Self, LearnError> {
        let wrong = |problem: String| LearnError::Policy { path: path.to_owned(), problem };
        let text = std::fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
        let file: Self = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        let definition = file.definition();
        definition.check()?;
        let (seen, acts) = (definition.observation_size(), definition.actions().len());
        match file.policy.sizes() {
            None => Err(wrong("its layers do not fit each other".to_owned())),
            Some(sizes) if sizes != (seen, acts) => {
                let (takes, gives) = sizes;
                Err(wrong(format!(
                    "its network takes {takes} numbers and chooses among {gives} actions, its learning file has {seen} and {acts}"
                )))
            }
            Some(_) => Ok(file),
        }
    }

    /// What it acted on.
    #[must_use]
    pub fn definition(&self) -> Definition {
        self.settings.turn.definition(self.direction)
    }
}

/// A policy as it is played on a robot whose pose is measured from outside: an episode after the other, each of which begins where the
/// robot then is.
#[derive(Clone, Debug)]
pub struct PolicyPlayer {
    policy: Policy,
    definition: Definition,
    actions: Vec<GaitStep>,
    /// Where the episode began, and how many actions ago.
    begun: Option<(Pose, usize)>,
}

impl PolicyPlayer {
    /// Plays it from the beginning.
    ///
    /// # Errors
    /// It observes more than a pose, which is all that is measured; or it was learned with a shaft that follows its frequency at once,
    /// which no motor does.
    pub fn new(file: PolicyFile) -> Result<Self, LearnError> {
        let definition = file.definition();
        if definition.parts != [Part::Pose] {
            return Err(LearnError::Unplayable("it observes more than the pose", r#"observe = ["pose"]"#));
        }
        if definition.drive != DriveKind::Motor {
            return Err(LearnError::Unplayable("it was learned without a motor", r#"drive = "motor""#));
        }
        let actions = definition.actions();
        Ok(Self { policy: file.policy, definition, actions, begun: None })
    }

    /// Time from an action to the next, s.
    #[must_use]
    pub fn interval_s(&self) -> f64 {
        self.definition.interval_s
    }

    /// The next action of a robot that is here.
    pub fn act(&mut self, pose: Pose) -> GaitStep {
        let (start, taken) =
            self.begun.filter(|(_, taken)| *taken < self.definition.episode_steps()).unwrap_or((pose, 0));
        self.begun = Some((start, taken + 1));
        let seen = tasks::observed_pose(pose.seen_from(start), self.definition.length_unit_m);
        self.actions[self.policy.best(&seen)]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Chooses its last action where the robot is more than 20 mm ahead of its start, its first one otherwise.
    fn file() -> PolicyFile {
        let settings: Settings =
            toml::from_str("[turn]\ndrive = \"motor\"\ninterval_s = 0.5\nepisode_s = 2").expect("a learning file");
        let mut weights = vec![vec![0.0; 3]; 10];
        weights[9][0] = 1.0;
        let mut bias = vec![-9.0; 10];
        (bias[0], bias[9]) = (2.0, 0.0);
        let policy = serde_json::json!({ "layers": [{ "weights": weights, "bias": bias }] });
        let policy = serde_json::from_value(policy).expect("a policy");
        PolicyFile { robot: "any".into(), direction: Direction::Left, seed: 1, updates: 1, settings, policy }
    }

    fn written(text: &str) -> Result<PolicyFile, LearnError> {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("policy.json");
        std::fs::write(&path, text).expect("written");
        PolicyFile::load(&path)
    }

    #[test]
    fn an_episode_begins_where_the_robot_is_and_sees_it_from_there() {
        let mut player = PolicyPlayer::new(file()).expect("it sees the pose alone");
        let [first, last] = [-8.0, 8.0].map(GaitStep::Frequency);
        // Facing +y: ahead is +y.
        let at = |y: f64| Pose { x: 0.3, y, heading: FRAC_PI_2 };
        assert_eq!([0.1, 0.115, 0.125, 0.13].map(|y| player.act(at(y))), [first, first, last, last]);
        assert_eq!(player.act(at(0.14)), first, "after four actions the next episode begins");
        assert_eq!(player.act(at(0.161)), last);
        // The other way round it is behind its start.
        let mut player = PolicyPlayer::new(file()).expect("it sees the pose alone");
        let back = |y: f64| Pose { heading: -FRAC_PI_2, ..at(y) };
        assert_eq!([0.1, 0.2, 0.05].map(|y| player.act(back(y))), [first, first, last]);
    }

    #[test]
    fn a_file_that_is_none_says_why() {
        let good = file();
        let text = |file: &PolicyFile| serde_json::to_string(file).expect("text");
        assert_eq!(written(&text(&good)).expect("it is one"), good);
        let said = |text: &str| written(text).expect_err("it is none").to_string();
        assert!(said("{}").contains("policy.json: missing field `robot`"), "{}", said("{}"));
        let mut other = good.clone();
        other.settings.turn.frequencies_hz.pop();
        assert!(said(&text(&other)).contains("chooses among 10 actions, its learning file has 3 and 9"));
        let mut hasty = good.clone();
        hasty.settings.turn.interval_s = -1.0;
        assert!(said(&text(&hasty)).contains("interval_s"), "{}", said(&text(&hasty)));
        let ragged = text(&good).replacen("[0.0,0.0,0.0]", "[0.0,0.0]", 1);
        assert!(said(&ragged).contains("do not fit each other"), "{}", said(&ragged));
    }

    #[test]
    fn what_is_not_measured_and_what_no_motor_does_is_refused() {
        let refused = |change: &dyn Fn(&mut super::super::Turning)| {
            let mut file = file();
            change(&mut file.settings.turn);
            PolicyPlayer::new(file).expect_err("it is refused").to_string()
        };
        let seeing = refused(&|turn| turn.observe.push(super::super::Observed::Shaft));
        assert!(seeing.contains("observes more than the pose"), "{seeing}");
        let exact = refused(&|turn| turn.drive = super::super::Drive::Exact);
        assert!(exact.contains("without a motor"), "{exact}");
    }
}
