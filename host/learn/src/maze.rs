//! Through a maze: a planner's way, and a robot that follows it by its pose (thesis 5.3.3, Fig. 5.5).

use hal_sim::body::Track;
use serde::Serialize;
use sweep::VariantBuilder;
use tasks::{Definition, DriveKind, Environments, Maze, MazeRun, Part, Task};

use super::LearnError;
use super::gait::{self, End, Gait, Played};
use super::seeds;
use super::settings::MazeSettings;
use super::sides;
use super::way::Way;

/// What came of a robot in a maze.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// When it reached the exit, s; none if it did not.
    pub reached_s: Option<f64>,
    /// What was left of the way, m.
    pub left_m: f64,
    /// How it ended.
    pub end: End,
}

impl MazeSettings {
    /// The environments of a maze, with robots drawn from the file's spreads.
    #[must_use]
    pub fn definition(&self, maze: &Maze) -> Definition {
        let task = Task::Maze(MazeRun::new(maze.clone()));
        let mut definition = Definition {
            episode_s: self.patience_s,
            drive: DriveKind::Motor,
            parts: vec![Part::Pose],
            ..sides::definition(task, self.frequency_hz, self.interval_s, self.alpha_deg)
        };
        definition.randomization.share = self.randomize;
        definition
    }
}

/// How a robot that sees its pose goes through a maze.
#[must_use]
pub fn pursuit(maze: &Maze, settings: &MazeSettings, actions: [usize; 2]) -> Gait {
    let unit = settings.definition(maze).length_unit_m;
    let start = maze.start();
    let way = maze.way().into_iter().map(|point| [0, 1].map(|axis| (point[axis] - start[axis]) / unit));
    Gait::Pursuit { actions, lookahead: settings.lookahead_m / unit, way: Way::new(way.collect()) }
}

/// The file's robot goes through a maze, and how it moved.
///
/// # Errors
/// The environments'.
pub fn first(
    robot: &VariantBuilder,
    settings: &MazeSettings,
    maze: &Maze,
    gait: &Gait,
    threads: Option<usize>,
) -> Result<(Outcome, Played, Option<Track>), LearnError> {
    let mut definition = settings.definition(maze);
    definition.randomization.share = 0.0;
    let mut environments = Environments::with_threads(robot.clone(), definition, 1, threads)?;
    environments.record(0, true);
    let enough = |played: &Played| played.stands(settings.interval_s);
    let played = gait::play(&mut environments, std::slice::from_ref(gait), &[seeds::FILES_ROBOT], &enough)?;
    let played = played.into_iter().next().unwrap_or_default();
    Ok((outcome(&played, maze, settings), played, environments.track(0).cloned()))
}

/// Robots drawn from the file's spreads go through a maze, one for each seed.
///
/// # Errors
/// The environments'.
pub fn judged(
    robot: &VariantBuilder,
    settings: &MazeSettings,
    (maze, gait): (&Maze, &Gait),
    seeds: std::ops::Range<u64>,
    threads: Option<usize>,
) -> Result<Vec<Outcome>, LearnError> {
    let seeds: Vec<u64> = seeds.map(|seed| seeds::MAZE_JUDGED + seed).collect();
    let enough = |played: &Played| played.stands(settings.interval_s);
    let played = gait::play_each(robot, settings.definition(maze), (gait, &seeds), &enough, threads)?;
    Ok(played.iter().map(|played| outcome(played, maze, settings)).collect())
}

fn outcome(played: &Played, maze: &Maze, settings: &MazeSettings) -> Outcome {
    let last = played.path.last().map_or(maze.start(), |pose| [pose.x, pose.y]);
    let end = played.end(maze.at_exit(last), settings.interval_s, settings.patience_s);
    Outcome { reached_s: (end == End::Arrived).then_some(played.seconds), left_m: maze.distance_to_exit(last), end }
}

#[cfg(test)]
mod tests {
    use tasks::Pose;

    use super::*;

    fn played(path: Vec<[f64; 2]>, seconds: f64) -> Played {
        let path = path.into_iter().map(|[x, y]| Pose { x, y, heading: 0.0 }).collect();
        Played { path, seconds, ..Played::default() }
    }

    #[test]
    fn a_way_is_followed_from_the_start_in_the_observation_s_unit() {
        let settings = MazeSettings { lookahead_m: 0.05, ..MazeSettings::default() };
        let gait = pursuit(&Maze::figure_5_5(0.2), &settings, [1, 0]);
        // In centimetres from the start, which is at (0, 40).
        let way = Way::new(vec![[0.0, 0.0], [40.0, 0.0], [40.0, -40.0], [80.0, -40.0]]);
        assert_eq!(gait, Gait::Pursuit { actions: [1, 0], lookahead: 5.0, way });
    }

    #[test]
    fn every_end_has_its_name() {
        let maze = Maze::figure_5_5(0.2);
        let settings = MazeSettings { patience_s: 100.0, interval_s: 10.0, ..MazeSettings::default() };
        let end = |path: Vec<[f64; 2]>, seconds: f64| outcome(&played(path, seconds), &maze, &settings).end;
        let way = |count: usize, step: f64| (0..count).map(|i| [step * i as f64, 0.4]).collect::<Vec<_>>();
        assert_eq!(end(vec![[0.0, 0.4], [0.78, 0.02]], 20.0), End::Arrived);
        assert_eq!(end(way(7, 1e-4), 60.0), End::Stood);
        assert_eq!(end(way(6, 1e-4), 50.0), End::Stopped, "it did not stand for a minute yet");
        assert_eq!(end(way(11, 0.01), 100.0), End::OutOfTime);
        let outcome = outcome(&played(way(11, 0.01), 100.0), &maze, &settings);
        assert!((outcome.left_m - 1.0).abs() < 1e-9 && outcome.reached_s.is_none(), "{outcome:?}");
    }
}
