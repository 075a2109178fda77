//! `scram learn maze`

use std::path::Path;

use ::learn::gait::End;
use ::learn::maze::{self, Outcome};
use ::learn::{Gait, LearnError, MazeSettings, sides};
use clap::{Args, ValueEnum};
use hal_sim::body::Track;
use miette::{IntoDiagnostic, Report};
use plot::{Exit, maze_svg};
use serde::Serialize;
use sweep::VariantBuilder;
use tasks::Maze;

use super::super::run_directory::LEARNED;
use super::super::{Done, print, print_json, say, table, write};
use super::{Options, SETTINGS, bar, ended, written};

/// What is written.
const FOUND: &str = "maze.json";
const PICTURE: &str = "maze.svg";
const PAGE: &str = "maze.html";
/// Frames of the picture, as in the thesis's.
const FRAMES: usize = 9;
/// Robots for each of the mazes drawn at random.
const ROBOTS_PER_MAZE: usize = 10;

/// Find the way through a maze by the pose (thesis section 5.3.3)
///
/// A planner finds the way; the file's robot follows it by its pose, +F or −F, whichever turns towards it, with controller, motor and sensor. Writes nine frames as
/// the thesis's Fig. 5.5 and a page in 3D into a directory of its own, out/learn-0001 and so on. With --robots, so many robots drawn from
/// the file's spreads go the same way, and beside them as many that see no pose and do what the file's robot did.
#[derive(Args)]
#[command(mut_arg("out", |arg| arg.default_value(LEARNED.numbered)))]
#[command(after_help = "Examples:\n  \
    scram learn maze --robots 100\n  \
    scram learn maze --maze random --robots 100 --seed 7\n\n\
    docs/learning.md describes the learning file, the method and what is reached.")]
pub struct MazeCommand {
    /// Which maze
    #[arg(long, value_enum, default_value = "figure-5.5")]
    maze: Which,
    /// Judge on so many robots drawn from the file's spreads; of mazes drawn at random, ten in each
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    robots: usize,
    #[command(flatten)]
    options: Options,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Which {
    /// That of the thesis's Fig. 5.5
    #[value(name = "figure-5.5")]
    Figure,
    /// Drawn at random, each by a seed of its own
    Random,
}

#[derive(Serialize)]
struct Output {
    /// The file's robot, in the first maze.
    first: Outcome,
    /// Drawn robots that see their pose.
    by_pose: Vec<Outcome>,
    /// Drawn robots that do what the file's did.
    by_script: Vec<Outcome>,
}

/// Where and how robots go.
struct Course<'a> {
    robot: &'a VariantBuilder,
    settings: &'a MazeSettings,
    sides: [usize; 2],
    threads: Option<usize>,
}

impl Course<'_> {
    /// The file's robot follows the way by its pose.
    fn first(&self, maze: &Maze) -> Result<(Outcome, Gait, Option<Track>), LearnError> {
        let pursuit = maze::pursuit(maze, self.settings, self.sides);
        let (outcome, played, track) = maze::first(self.robot, self.settings, maze, &pursuit, self.threads)?;
        Ok((outcome, Gait::Script(played.actions), track))
    }

    fn judged(&self, maze: &Maze, gait: &Gait, seeds: std::ops::Range<u64>) -> Result<Vec<Outcome>, LearnError> {
        maze::judged(self.robot, self.settings, (maze, gait), seeds, self.threads)
    }
}

impl MazeCommand {
    pub fn run(&self) -> Done {
        self.options.fill(|out| self.go(out))
    }

    fn go(&self, out: &Path) -> Result<(), Report> {
        let settings = self.options.settings()?;
        settings.maze.check()?;
        write(&out.join(SETTINGS), &settings.text())?;
        let robot = self.options.robot()?;
        let maze = Maze::figure_5_5(settings.maze.cell_m);
        let sides = sides(&robot, &settings.maze.definition(&maze), self.options.threads)?;
        let course = Course { robot: &robot, settings: &settings.maze, sides, threads: self.options.threads };
        let mazes = self.mazes(&settings.maze);
        let (output, track) = self.outcomes(&course, &mazes)?;
        let mut files = vec![FOUND, SETTINGS];
        write(&out.join(FOUND), &serde_json::to_string_pretty(&output).into_diagnostic()?)?;
        if let (Some(track), Some(first)) = (track, mazes.first()) {
            let exit = Exit { centre: first.exit_centre(), edge_m: first.cell_m() };
            let title = format!("through a maze, {}", self.options.common.robot.display());
            write(&out.join(PICTURE), &maze_svg(&title, &track, exit, FRAMES)?)?;
            write(&out.join(PAGE), &plot::view::page(&track, &title))?;
            files.extend([PICTURE, PAGE]);
        }
        if self.options.common.json {
            return print_json(&output);
        }
        print(&shown(&output));
        written(out, &files);
        Ok(())
    }

    /// Of all robots in all mazes, and how the file's moved in the first one.
    fn outcomes(&self, course: &Course<'_>, mazes: &[Maze]) -> Result<(Output, Option<Track>), Report> {
        let bar = bar(2 * self.robots, 0);
        bar.set_message("robots");
        let (mut by_pose, mut by_script, mut first) = (vec![], vec![], None);
        for (index, maze) in mazes.iter().enumerate() {
            let (outcome, script, track) = course.first(maze)?;
            if bar.is_hidden() {
                say(&format!("maze {} of {}: the file's robot: {}", index + 1, mazes.len(), words(&outcome)));
            }
            first.get_or_insert((outcome, track));
            let seeds = self.seeds(index, mazes.len());
            let pursuit = maze::pursuit(maze, course.settings, course.sides);
            for (gait, outcomes) in [(&pursuit, &mut by_pose), (&script, &mut by_script)] {
                outcomes.extend(course.judged(maze, gait, seeds.clone())?);
                bar.inc(seeds.end - seeds.start);
            }
        }
        bar.finish_and_clear();
        let Some((first, track)) = first else { unreachable!("there is one maze or more") };
        Ok((Output { first, by_pose, by_script }, track))
    }

    fn mazes(&self, settings: &MazeSettings) -> Vec<Maze> {
        let [columns, rows] = settings.size;
        match self.maze {
            Which::Figure => vec![Maze::figure_5_5(settings.cell_m)],
            Which::Random => {
                let count = self.robots.div_ceil(ROBOTS_PER_MAZE).max(1) as u64;
                let drawn = |index: u64| Maze::random(settings.cell_m, columns, rows, self.options.common.seed + index);
                (0..count).map(drawn).collect()
            }
        }
    }

    /// Seeds of the robots of a maze: no two robots are the same.
    fn seeds(&self, maze: usize, mazes: usize) -> std::ops::Range<u64> {
        let each = if mazes == 1 { self.robots } else { ROBOTS_PER_MAZE };
        let begin = (maze * each).min(self.robots) as u64;
        let base = self.options.common.seed << 20;
        base + begin..base + ((maze + 1) * each).min(self.robots) as u64
    }
}

fn words(outcome: &Outcome) -> String {
    let left = 1e3 * outcome.left_m;
    match (outcome.end, outcome.reached_s) {
        (_, Some(seconds)) => format!("at the exit after {seconds:.0} s"),
        (End::Stood, _) => format!("stands {left:.0} mm before the exit"),
        (End::Stopped, _) => format!("stopped by a fault {left:.0} mm before the exit"),
        _ => format!("out of time {left:.0} mm before the exit"),
    }
}

fn shown(output: &Output) -> String {
    let first = format!("the file's robot: {}", words(&output.first));
    if output.by_pose.is_empty() {
        return first;
    }
    let header = ["drawn robots", "at the exit", "median / s", "stood", "stopped", "out of time"];
    let row = |name: &str, outcomes: &[Outcome]| {
        let ended = ended(outcomes.iter().map(|one| (one.end, one.reached_s)));
        std::iter::once(name.to_owned()).chain(ended).collect::<Vec<_>>()
    };
    let rows = [row("by their pose", &output.by_pose), row("by the file's robot's script", &output.by_script)];
    format!("{first}\n\n{}", table::columns(&header, rows))
}
