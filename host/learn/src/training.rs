//! A training from its beginning, or from where it was stopped, to its end.

use serde::{Deserialize, Serialize};
use sweep::VariantBuilder;
use tasks::Environments;

use super::LearnError;
use super::checkpoint::Checkpoint;
use super::learner::{Learner, Progress};
use super::settings::{Direction, Settings};

/// Everything that a training is between two updates: what it was told, and how far it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Saved {
    /// Name of the robot.
    pub robot: String,
    /// What it was told.
    pub settings: Settings,
    /// Which way it turns.
    pub direction: Direction,
    /// The learning curve so far.
    pub curve: Vec<Progress>,
    /// The learner.
    pub checkpoint: Checkpoint,
}

/// A training that goes on.
pub struct Training {
    robot: String,
    settings: Settings,
    direction: Direction,
    curve: Vec<Progress>,
    learner: Learner<Environments>,
}

impl Training {
    /// Begins.
    ///
    /// # Errors
    /// A number of the settings is out of its range, or the robot has no body that could be advanced.
    pub fn new(
        robot: VariantBuilder,
        settings: Settings,
        direction: Direction,
        seed: u64,
        threads: Option<usize>,
    ) -> Result<Self, LearnError> {
        let name = robot.robot().name.clone();
        let environments = environments(robot, &settings, direction, threads)?;
        let learner = Learner::new(environments, settings.ppo.clone(), seed)?;
        Ok(Self { robot: name, settings, direction, curve: Vec::new(), learner })
    }

    /// Goes on from where a training was saved.
    ///
    /// # Errors
    /// As [`Self::new`], or it was another robot's.
    pub fn resume(robot: VariantBuilder, saved: Saved, threads: Option<usize>) -> Result<Self, LearnError> {
        let name = robot.robot().name.clone();
        LearnError::unless_same(&saved.robot, &name)?;
        let Saved { settings, direction, curve, checkpoint, .. } = saved;
        let environments = environments(robot, &settings, direction, threads)?;
        let learner = Learner::resume(environments, &checkpoint)?;
        Ok(Self { robot: name, settings, direction, curve, learner })
    }

    /// The next update; `None` where all are done.
    ///
    /// # Errors
    /// The environments'.
    pub fn advance(&mut self) -> Result<Option<&Progress>, LearnError> {
        if self.curve.len() >= self.settings.turn.updates {
            return Ok(None);
        }
        let progress = self.learner.update()?;
        self.curve.push(progress);
        Ok(self.curve.last())
    }

    /// What it takes to go on from here.
    #[must_use]
    pub fn saved(&self) -> Saved {
        Saved {
            robot: self.robot.clone(),
            settings: self.settings.clone(),
            direction: self.direction,
            curve: self.curve.clone(),
            checkpoint: self.learner.checkpoint(),
        }
    }

    /// The learning curve so far.
    #[must_use]
    pub fn curve(&self) -> &[Progress] {
        &self.curve
    }

    /// Name of the robot.
    #[must_use]
    pub fn robot(&self) -> &str {
        &self.robot
    }

    /// Seed of all that is drawn.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.learner.seed()
    }

    /// What it was told.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Which way it turns.
    #[must_use]
    pub fn direction(&self) -> Direction {
        self.direction
    }

    /// The policy as it is now.
    #[must_use]
    pub fn policy(&self) -> super::Policy {
        self.learner.policy()
    }
}

fn environments(
    robot: VariantBuilder,
    settings: &Settings,
    direction: Direction,
    threads: Option<usize>,
) -> Result<Environments, LearnError> {
    // Before bodies are made for them.
    settings.ppo.check(settings.turn.environments)?;
    let definition = settings.turn.definition(direction);
    Ok(Environments::with_threads(robot, definition, settings.turn.environments, threads)?)
}
