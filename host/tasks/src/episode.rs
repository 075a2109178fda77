//! One environment's episode: where its robot is, how far it got, what it is worth.

use common::angle::wrap;
use hal_sim::body::{Plan, Snapshot, Track};
use hal_sim::random::{Source, Stream};

use super::definition::Definition;
use super::error::TaskError;
use super::group::{Common, Group};
use super::observation::Seen;
use super::specimen::Specimens;
use super::task::{Moved, Pose, Task};

/// Robots that are drawn for an episode at most, where one cannot be simulated.
const TRIES: usize = 100;

/// An environment's episode.
#[derive(Debug)]
pub(crate) struct Episode {
    /// Of the seeds of this environment's episodes.
    seeds: Stream,
    pub seed: u64,
    pub plan: Plan,
    start: Pose,
    pose: Pose,
    velocity: [f64; 3],
    shaft_angle: f64,
    /// Actions taken.
    pub steps: usize,
    /// What stopped it, in words.
    pub fault: Option<String>,
    /// Whether its supervisor did: its simulation may have diverged.
    stopped: bool,
    /// Where the centre was after every action, m.
    pub trail: Vec<[f64; 2]>,
    /// Kept for the 3D page, where asked for.
    pub track: Option<Track>,
}

/// What came of an action.
pub(crate) struct Step {
    pub reward: f64,
    pub terminated: bool,
    pub truncated: bool,
}

impl Episode {
    /// Before the first reset.
    pub fn none(plan: Plan) -> Self {
        Self {
            seeds: Stream::new(0, Source::Episodes),
            seed: 0,
            plan,
            start: Pose::default(),
            pose: Pose::default(),
            velocity: [0.0; 3],
            shaft_angle: 0.0,
            steps: 0,
            fault: None,
            stopped: false,
            trail: vec![],
            track: None,
        }
    }

    /// Begins an episode: the next of its environment, or the first one of a seed.
    pub fn begin(
        &mut self,
        (group, i): (&mut Group, usize),
        common: &Common,
        specimens: &Specimens,
        seed: Option<u64>,
    ) -> Result<(), TaskError> {
        if let Some(seed) = seed {
            self.seeds = Stream::new(seed, Source::Episodes);
        }
        // Without the topmost bit, a number with a sign holds it, too: numpy's usual one.
        self.seed = self.seeds.seed() >> 1;
        let at = start(&common.definition, self.seed);
        let mut stream = Specimens::stream(self.seed);
        let mut draw = || {
            let variant = specimens.draw(&mut stream)?;
            group.replace(i, common, &variant, self.seed, at)?;
            Ok(common.plan(&variant))
        };
        let mut found = draw();
        for _ in 1..TRIES {
            // Values that no robot can have together, or a body that is too stiff for the step.
            if specimens.is_nominal() || !matches!(found, Err(TaskError::Robot(_) | TaskError::Body(_))) {
                break;
            }
            found = draw();
        }
        self.plan = found.map_err(|error| match error {
            TaskError::Robot(_) | TaskError::Body(_) if !specimens.is_nominal() => {
                TaskError::NoSpecimen { tries: TRIES, seed: self.seed, last: error.to_string() }
            }
            other => other,
        })?;
        self.pose = pose(&group.snapshot(i));
        // The thesis's (x_i, y_i) is where the robot stands; a line and a maze stay where they are.
        let origin =
            if matches!(common.definition.task, Task::Turn(_)) { self.pose } else { common.definition.place() };
        self.start = Pose { heading: 0.0, ..origin };
        (self.velocity, self.steps, self.fault, self.stopped) = ([0.0; 3], 0, None, false);
        self.shaft_angle = group.shaft_angle(i);
        self.trail = vec![[self.pose.x, self.pose.y]];
        if let Some(track) = &mut self.track {
            *track = Track { plan: self.plan.clone(), snapshots: vec![group.snapshot(i)], energy_j: vec![] };
            track.snapshots[0].time_s = 0.0;
        }
        Ok(())
    }

    /// Takes what came of an action.
    pub fn finish(&mut self, (group, i): (&Group, usize), definition: &Definition) -> Step {
        self.steps += 1;
        let late = self.steps >= definition.episode_steps();
        let after = pose(&group.snapshot(i));
        if !after.is_finite() {
            self.fault = Some("the simulation diverged".to_owned());
            return Step { reward: 0.0, terminated: false, truncated: true };
        }
        let before = std::mem::replace(&mut self.pose, after);
        let moved = Moved { start: self.start, before, after, interval_s: definition.interval_s };
        let turned = wrap(after.heading - before.heading);
        self.velocity = [after.x - before.x, after.y - before.y, turned].map(|d| d / definition.interval_s);
        self.shaft_angle = group.shaft_angle(i);
        self.trail.push([after.x, after.y]);
        self.fault = group.fault(i);
        self.stopped = self.fault.is_some();
        let (reward, reached) = definition.task.reward(&moved);
        let terminated = reached || self.stopped;
        Step { reward, terminated, truncated: late && !terminated }
    }

    /// What the steps that its supervisor left out would have come to, the robot standing where it was stopped, each worth `discount` times
    /// the one before; 0 where it did not end the episode.
    pub fn left_out(&self, definition: &Definition, discount: f64) -> f64 {
        if !self.stopped {
            return 0.0;
        }
        let Self { start, pose, .. } = *self;
        let stands = Moved { start, before: pose, after: pose, interval_s: definition.interval_s };
        let (reward, _) = definition.task.reward(&stands);
        let left = definition.episode_steps().saturating_sub(self.steps);
        (1..=left).rev().fold(0.0, |sum, _| discount * (reward + sum))
    }

    /// Writes what is observed.
    pub fn observe(&self, definition: &Definition, to: &mut [f32]) {
        let seen = Seen {
            start: self.start,
            pose: self.pose,
            velocity: self.velocity,
            shaft_angle: self.shaft_angle,
            walls: &self.plan.walls,
        };
        seen.write(&definition.parts, definition.length_unit_m, to);
    }

    /// Keeps a snapshot, if this episode is recorded.
    pub fn keep(&mut self, snapshot: Snapshot, interval_s: f64) {
        if let Some(track) = &mut self.track {
            let time_s = track.snapshots.last().map_or(0.0, |last| last.time_s) + interval_s;
            track.snapshots.push(Snapshot { time_s, ..snapshot });
        }
    }

    pub fn pose(&self) -> Pose {
        self.pose
    }
}

impl Definition {
    /// Where a robot starts that starts in its place.
    pub(crate) fn place(&self) -> Pose {
        self.task.maze().map_or(Pose::default(), |maze| {
            let [x, y] = maze.start();
            Pose { x, y, heading: maze.start_heading() }
        })
    }
}

/// Where the robot of a seed starts.
fn start(definition: &Definition, seed: u64) -> Pose {
    let (place, mut stream) = (definition.place(), Stream::new(seed, Source::StartPose));
    let mut off = |width: f64| stream.uniform(-width, width);
    Pose {
        x: place.x + off(definition.start.position_m),
        y: place.y + off(definition.start.position_m),
        heading: place.heading + off(definition.start.heading_rad),
    }
}

fn pose(snapshot: &Snapshot) -> Pose {
    let [x, y, _] = snapshot.centroid();
    Pose { x, y, heading: snapshot.heading() }
}
