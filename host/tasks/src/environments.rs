//! Many environments, advanced together over threads.

use hal_sim::body::{Snapshot, Track};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use robot_file::gait::GaitStep;
use sweep::{SIDE_BY_SIDE, VariantBuilder};

use super::definition::Definition;
use super::episode::Episode;
use super::error::TaskError;
use super::group::{Common, Group};
use super::shaft::RampedShaft;
use super::specimen::Specimens;
use super::task::Pose;

/// What came of a step of every environment, in their order.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Steps {
    /// Row after row, [`Definition::observation_size`] numbers each.
    pub observations: Vec<f32>,
    /// Of the step.
    pub rewards: Vec<f64>,
    /// Whether the task's goal is reached, or the robot's supervisor stopped it.
    pub terminated: Vec<bool>,
    /// Whether the time is over, or the simulation diverged.
    pub truncated: Vec<bool>,
}

/// Environments of one definition.
#[derive(Debug)]
pub struct Environments {
    common: Common,
    specimens: Specimens,
    groups: Vec<(Group, Vec<Episode>)>,
    /// Environments in every group but the last.
    together: usize,
    count: usize,
    /// None: the groups are advanced in the calling thread.
    pool: Option<ThreadPool>,
}

/// What becomes of an environment in [`Environments::reset_each`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// It stays as it is.
    Keep,
    /// The next episode of its seed begins.
    Next,
    /// The first episode of a seed begins.
    Seed(u64),
}

impl Environments {
    /// So many environments over all cores, environment i at the first episode of seed i.
    ///
    /// # Errors
    /// A number of the definition is out of its range, the robot has no body, or no controller takes the actions.
    pub fn new(robot: VariantBuilder, definition: Definition, count: usize) -> Result<Self, TaskError> {
        Self::with_threads(robot, definition, count, None)
    }

    /// The same over so many threads.
    ///
    /// # Errors
    /// As [`Self::new`], or there can be no such threads.
    pub fn with_threads(
        robot: VariantBuilder,
        definition: Definition,
        count: usize,
        threads: Option<usize>,
    ) -> Result<Self, TaskError> {
        definition.check()?;
        if count == 0 {
            return Err(TaskError::definition("num_envs", "there is no environment", "give 1 or more"));
        }
        let specimens = Specimens::new(robot, definition.alpha_deg, &definition.randomization)?;
        let common = Common::new(definition, specimens.nominal(), !specimens.is_nominal())?;
        let threads = threads.unwrap_or_else(rayon::current_num_threads).min(count).max(1);
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| TaskError::Threads(error.to_string()))?;
        // Not more to a group than gives every thread one.
        let together = count.div_ceil(threads).clamp(1, SIDE_BY_SIDE);
        let group = |first: usize| {
            let members = together.min(count - first);
            let episodes = (0..members).map(|_| Episode::none(common.plan(specimens.nominal()))).collect();
            Ok::<_, TaskError>((Group::new(&common, specimens.nominal(), members)?, episodes))
        };
        let groups = (0..count).step_by(together).map(group).collect::<Result<_, _>>()?;
        let pool = (threads > 1).then_some(pool);
        let mut environments = Self { common, specimens, groups, together, count, pool };
        let seeds: Vec<Reset> = (0..count).map(|i| Reset::Seed(i as u64)).collect();
        environments.reset_each(&seeds)?;
        Ok(environments)
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none: never.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// What they are.
    #[must_use]
    pub fn definition(&self) -> &Definition {
        &self.common.definition
    }

    /// How fast the speed of the file's robot's shaft changes with the exact drive, rad/s².
    #[must_use]
    pub fn shaft_acceleration(&self) -> f64 {
        RampedShaft::new(&self.specimens.nominal().robot, 0.0).acceleration()
    }

    /// Begins an episode of environment `i`: the first one of a seed, or the next one.
    ///
    /// # Errors
    /// No robot that is drawn can be simulated.
    ///
    /// # Panics
    /// There is no such environment.
    pub fn reset(&mut self, i: usize, seed: Option<u64>) -> Result<(), TaskError> {
        let (group, episodes) = &mut self.groups[i / self.together];
        let member = i % self.together;
        episodes[member].begin((group, member), &self.common, &self.specimens, seed)
    }

    /// The same of several, over threads.
    ///
    /// # Errors
    /// As [`Self::reset`], or there are not as many resets as environments.
    pub fn reset_each(&mut self, resets: &[Reset]) -> Result<(), TaskError> {
        if resets.len() != self.count {
            let what = format!("{} resets for {} environments", resets.len(), self.count);
            return Err(TaskError::Actions(what));
        }
        let Self { common, specimens, groups, together, pool, .. } = self;
        let reset = |((group, episodes), resets): (&mut (Group, Vec<Episode>), &[Reset])| {
            for (member, (episode, reset)) in episodes.iter_mut().zip(resets).enumerate() {
                let seed = match reset {
                    Reset::Keep => continue,
                    Reset::Next => None,
                    Reset::Seed(seed) => Some(*seed),
                };
                episode.begin((group, member), common, specimens, seed)?;
            }
            Ok(())
        };
        match pool {
            None => groups.iter_mut().zip(resets.chunks(*together)).try_for_each(reset),
            Some(pool) => pool.install(|| groups.par_iter_mut().zip(resets.par_chunks(*together)).try_for_each(reset)),
        }
    }

    /// One action of every environment, an index of [`Definition::actions`] each. Nothing is reset: an episode that ended goes on until
    /// it is.
    ///
    /// # Errors
    /// There are not as many actions as environments, or one does not exist.
    pub fn step(&mut self, actions: &[usize]) -> Result<Steps, TaskError> {
        let known = self.common.definition.actions();
        if actions.len() != self.count {
            return Err(TaskError::Actions(format!("{} actions for {} environments", actions.len(), self.count)));
        }
        if let Some(wrong) = actions.iter().find(|action| **action >= known.len()) {
            return Err(TaskError::Actions(format!("there is no action {wrong} among {}", known.len())));
        }
        let chosen: Vec<GaitStep> = actions.iter().map(|action| known[*action]).collect();
        let size = self.common.definition.observation_size();
        let mut steps = Steps {
            observations: vec![0.0; self.count * size],
            rewards: vec![0.0; self.count],
            terminated: vec![false; self.count],
            truncated: vec![false; self.count],
        };
        let Self { common, groups, together, pool, .. } = self;
        let definition = &common.definition;
        let observations = steps.observations.chunks_mut(*together * size);
        let ends = steps.terminated.chunks_mut(*together).zip(steps.truncated.chunks_mut(*together));
        let rows = observations.zip(steps.rewards.chunks_mut(*together)).zip(ends);
        let all: Vec<_> = groups.iter_mut().zip(chosen.chunks(*together)).zip(rows).collect();
        let step = |(((group, episodes), chosen), ((observations, rewards), (terminated, truncated))): Job<'_>| {
            advance(group, episodes, definition, chosen);
            for (member, episode) in episodes.iter_mut().enumerate() {
                let step = episode.finish((group, member), definition);
                episode.observe(definition, &mut observations[member * size..(member + 1) * size]);
                (rewards[member], terminated[member], truncated[member]) =
                    (step.reward, step.terminated, step.truncated);
            }
        };
        match pool {
            None => all.into_iter().for_each(step),
            Some(pool) => pool.install(|| all.into_par_iter().for_each(step)),
        }
        Ok(steps)
    }

    /// What environment `i` shows now.
    ///
    /// # Panics
    /// There is no such environment, or `to` is not as long as an observation.
    pub fn observe(&self, i: usize, to: &mut [f32]) {
        assert_eq!(to.len(), self.definition().observation_size(), "a place for every number of an observation");
        self.episode(i).observe(self.definition(), to);
    }

    /// Keeps every episode of environment `i` from its next reset on, or no longer.
    pub fn record(&mut self, i: usize, record: bool) {
        let episode = &mut self.groups[i / self.together].1[i % self.together];
        let empty = || Track { plan: episode.plan.clone(), snapshots: vec![], energy_j: vec![] };
        episode.track = record.then(empty);
    }

    /// What was kept of the episode of environment `i`.
    #[must_use]
    pub fn track(&self, i: usize) -> Option<&Track> {
        self.episode(i).track.as_ref()
    }

    /// What really is with the robot of environment `i`. Its time is that of its group.
    #[must_use]
    pub fn snapshot(&self, i: usize) -> Snapshot {
        self.groups[i / self.together].0.snapshot(i % self.together)
    }

    /// What the robot of environment `i` is made of, and the walls around it.
    #[must_use]
    pub fn plan(&self, i: usize) -> &hal_sim::body::Plan {
        &self.episode(i).plan
    }

    /// Where the robot of environment `i` was at the start and after every action, m.
    #[must_use]
    pub fn trail(&self, i: usize) -> &[[f64; 2]] {
        &self.episode(i).trail
    }

    /// Where the robot of environment `i` is.
    #[must_use]
    pub fn pose(&self, i: usize) -> Pose {
        self.episode(i).pose()
    }

    /// Seed of the episode of environment `i`: it draws all that is random in it.
    #[must_use]
    pub fn episode_seed(&self, i: usize) -> u64 {
        self.episode(i).seed
    }

    /// Time since the start of the episode of environment `i`, s.
    #[must_use]
    pub fn time_s(&self, i: usize) -> f64 {
        self.episode(i).steps as f64 * self.definition().interval_s
    }

    /// What stopped the robot of environment `i`, in words.
    #[must_use]
    pub fn fault(&self, i: usize) -> Option<&str> {
        self.episode(i).fault.as_deref()
    }

    /// What the rest of the episode of environment `i` would have come to, each step worth `discount` times the one before, had it not been
    /// ended by a fault: the robot stands where its supervisor stopped it. 0 where that did not end it. Rewards of steps do not have it in them;
    /// where every step costs, a learner without it learns to be stopped.
    #[must_use]
    pub fn left_out(&self, i: usize, discount: f64) -> f64 {
        self.episode(i).left_out(self.definition(), discount)
    }

    fn episode(&self, i: usize) -> &Episode {
        &self.groups[i / self.together].1[i % self.together]
    }
}

/// A group with its episodes and frequencies, and where its rows go: observations and rewards, terminated and truncated.
type Job<'a> = (
    (&'a mut (Group, Vec<Episode>), &'a [GaitStep]),
    ((&'a mut [f32], &'a mut [f64]), (&'a mut [bool], &'a mut [bool])),
);

fn advance(group: &mut Group, episodes: &mut [Episode], definition: &Definition, actions: &[GaitStep]) {
    if episodes.iter().all(|episode| episode.track.is_none()) {
        return group.advance(definition, actions, None);
    }
    group.advance(definition, actions, Some(&mut |i, snapshot, interval_s| episodes[i].keep(snapshot, interval_s)));
}
