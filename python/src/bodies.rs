//! `scram._scram.Environments`: the batch of robots under the environments of `scram/envs`.

use hal_sim::body::Precision;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use robot_file::edit::Document;
use sweep::VariantBuilder;
use tasks::{
    Definition, DriveKind, Maze, MazeRun, Part, Randomization, Reset, Start, Steps, Straight, Task, TaskError, Turn,
};

use crate::errors::{InputError, failed, wrong_input};
use crate::robot::Robot;

/// The project's robot file, for who names none.
const ROBOT: &str = include_str!("../../robot.toml");
/// Seed of the random maze that is drawn where none is named.
const MAZE_SEED: u64 = 0;

/// The names of `scram/envs/definitions.py`.
#[derive(FromPyObject)]
struct Given {
    task: String,
    frequencies_hz: Vec<f64>,
    oscillations_deg: Vec<[f64; 2]>,
    interval_s: f64,
    episode_s: f64,
    drive: String,
    step_s: f64,
    precision: String,
    observe: Vec<String>,
    length_unit_m: f64,
    start_position_m: f64,
    start_heading_rad: f64,
    alpha_deg: Option<f64>,
    randomize: f64,
    randomized: Vec<String>,
}

#[derive(FromPyObject)]
struct GivenTurn {
    direction: String,
    yaw_rate_rad_per_s: f64,
    k_rot: f64,
    k_pos: f64,
}

#[derive(FromPyObject)]
struct GivenStraight {
    k_ahead: f64,
    k_side: f64,
    k_heading: f64,
}

#[derive(FromPyObject)]
struct GivenMaze {
    maze: String,
    cell_m: f64,
    columns: usize,
    rows: usize,
    maze_seed: u64,
    k_progress: f64,
    k_step: f64,
    k_exit: f64,
}

/// One of several words.
fn chosen<T: Copy>(field: &str, word: &str, known: &[(&str, T)]) -> PyResult<T> {
    let found = known.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
    found.ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        InputError::new_err(format!("{field}: there is no `{word}`\n  help: give one of {}", names.join(", ")))
    })
}

const DRIVES: [(&str, DriveKind); 2] = [("exact", DriveKind::Exact), ("motor", DriveKind::Motor)];
const PRECISIONS: [(&str, Precision); 2] = [("single", Precision::Single), ("double", Precision::Double)];
/// Counter-clockwise is positive.
const DIRECTIONS: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];
const MAZES: [(&str, bool); 2] = [("figure-5.5", false), ("random", true)];

fn task(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Task> {
    match name {
        "turn" => {
            let GivenTurn { direction, yaw_rate_rad_per_s, k_rot, k_pos } = given.extract()?;
            let sign = chosen("direction", &direction, &DIRECTIONS)?;
            Ok(Task::Turn(Turn { desired_rad_per_s: sign * yaw_rate_rad_per_s, k_rot, k_pos }))
        }
        "straight" => {
            let GivenStraight { k_ahead, k_side, k_heading } = given.extract()?;
            Ok(Task::Straight(Straight { k_ahead, k_side, k_heading }))
        }
        "maze" => {
            let GivenMaze { maze, cell_m, columns, rows, maze_seed, k_progress, k_step, k_exit } = given.extract()?;
            let maze = if chosen("maze", &maze, &MAZES)? {
                if columns * rows < 2 {
                    let what = format!(
                        "columns, rows: {columns} by {rows} cells make no maze\n  help: give two cells or more"
                    );
                    return Err(InputError::new_err(what));
                }
                Maze::random(cell_m, columns, rows, maze_seed)
            } else {
                Maze::figure_5_5(cell_m)
            };
            Ok(Task::Maze(MazeRun { maze, k_progress, k_step, k_exit }))
        }
        other => Err(InputError::new_err(format!("task: there is no `{other}`"))),
    }
}

fn definition(given: &Bound<'_, PyAny>) -> PyResult<Definition> {
    let all: Given = given.extract()?;
    let parts = all.observe.iter().map(|part| chosen("observe", part, &Part::ALL)).collect::<PyResult<_>>()?;
    Ok(Definition {
        task: task(&all.task, given)?,
        frequencies_hz: all.frequencies_hz,
        oscillations_deg: all.oscillations_deg,
        interval_s: all.interval_s,
        episode_s: all.episode_s,
        drive: chosen("drive", &all.drive, &DRIVES)?,
        step_s: all.step_s,
        precision: chosen("precision", &all.precision, &PRECISIONS)?,
        parts,
        length_unit_m: all.length_unit_m,
        start: Start { position_m: all.start_position_m, heading_rad: all.start_heading_rad },
        alpha_deg: all.alpha_deg,
        randomization: Randomization { share: all.randomize, paths: all.randomized },
    })
}

fn word<T: PartialEq>(value: &T, known: &[(&'static str, T)]) -> &'static str {
    known.iter().find(|(_, known)| known == value).map_or("", |(name, _)| name)
}

/// What an environment is where nothing else is said.
#[pyfunction]
pub fn environment_defaults<'py>(py: Python<'py>, task: &str) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    let task = match task {
        "turn" => Task::Turn(Turn::default()),
        "straight" => Task::Straight(Straight::default()),
        "maze" => {
            let maze = Maze::figure_5_5(Maze::CELL_M);
            values.set_item("cell_m", maze.cell_m())?;
            let [columns, rows] = maze.size();
            values.set_item("columns", columns)?;
            values.set_item("rows", rows)?;
            values.set_item("maze_seed", MAZE_SEED)?;
            Task::Maze(MazeRun::new(maze))
        }
        other => return Err(InputError::new_err(format!("task: there is no `{other}`"))),
    };
    for (name, value) in task.weights() {
        values.set_item(name, value)?;
    }
    let definition = Definition::new(task);
    values.set_item("frequencies_hz", definition.frequencies_hz)?;
    values.set_item("oscillations_deg", definition.oscillations_deg)?;
    values.set_item("interval_s", definition.interval_s)?;
    values.set_item("episode_s", definition.episode_s)?;
    values.set_item("drive", word(&definition.drive, &DRIVES))?;
    values.set_item("step_s", definition.step_s)?;
    values.set_item("precision", word(&definition.precision, &PRECISIONS))?;
    values.set_item("observe", definition.parts.iter().map(|part| word(part, &Part::ALL)).collect::<Vec<_>>())?;
    values.set_item("length_unit_m", definition.length_unit_m)?;
    values.set_item("start_position_m", definition.start.position_m)?;
    values.set_item("start_heading_rad", definition.start.heading_rad)?;
    values.set_item("alpha_deg", definition.alpha_deg)?;
    values.set_item("randomize", definition.randomization.share)?;
    values.set_item("randomized", definition.randomization.paths)?;
    Ok(values)
}

/// What went wrong: with what was given, or while it was done.
fn raised(error: &TaskError) -> PyErr {
    match error {
        TaskError::NoSpecimen { .. } | TaskError::Threads(_) => failed(error),
        _ => wrong_input(error),
    }
}

/// Observations, rewards, terminated, truncated.
type Outcome<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<bool>>);

/// Many environments of one definition, advanced together.
#[pyclass(module = "scram._scram")]
pub struct Environments {
    inner: tasks::Environments,
}

#[pymethods]
impl Environments {
    #[new]
    #[pyo3(signature = (definition, count, robot = None, threads = None))]
    fn new(
        py: Python<'_>,
        #[pyo3(from_py_with = definition)] definition: Definition,
        count: usize,
        robot: Option<PyRef<'_, Robot>>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let builder = match robot {
            Some(robot) => robot.builder().as_ref().clone(),
            None => {
                let document = Document::parse(ROBOT, "robot.toml").map_err(|error| wrong_input(&error))?;
                let robot = document.robot().map_err(|error| wrong_input(&error))?;
                VariantBuilder::of_any(document, robot)
            }
        };
        let made = py.detach(|| tasks::Environments::with_threads(builder, definition, count, threads));
        Ok(Self { inner: made.map_err(|error| raised(&error))? })
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    /// Least and greatest value of every number of an observation.
    #[getter]
    fn observation_bounds<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>) {
        let bounds = self.inner.definition().observation_bounds();
        let end = |end: usize| bounds.iter().map(|bound| bound[end] as f32).collect::<Vec<_>>().into_pyarray(py);
        (end(0), end(1))
    }

    /// How fast the exact drive's shaft changes its speed, rad/s².
    #[getter]
    fn shaft_acceleration_rad_per_s2(&self) -> f64 {
        self.inner.shaft_acceleration()
    }

    /// One action of every environment.
    fn step<'py>(&mut self, py: Python<'py>, actions: PyReadonlyArray1<'py, i64>) -> PyResult<Outcome<'py>> {
        // An action below 0 becomes one that does not exist.
        let actions: Vec<usize> =
            actions.as_array().iter().map(|action| usize::try_from(*action).unwrap_or(usize::MAX)).collect();
        let steps = py.detach(|| self.inner.step(&actions)).map_err(|error| raised(&error))?;
        let Steps { observations, rewards, terminated, truncated } = steps;
        let size = self.inner.definition().observation_size();
        let observations = observations.into_pyarray(py).reshape([rewards.len(), size])?;
        Ok((observations, rewards.into_pyarray(py), terminated.into_pyarray(py), truncated.into_pyarray(py)))
    }

    /// Begins episodes: where `mask` is true the next one, or with `seeds` the first one of each seed.
    #[pyo3(signature = (mask, seeds = None))]
    fn reset(&mut self, py: Python<'_>, mask: PyReadonlyArray1<'_, bool>, seeds: Option<Vec<u64>>) -> PyResult<()> {
        let count = self.inner.len();
        if seeds.as_ref().is_some_and(|seeds| seeds.len() != count) {
            return Err(InputError::new_err(format!("seed: give one for each of the {count} environments")));
        }
        let reset = |(i, begins): (usize, &bool)| match (begins, &seeds) {
            (false, _) => Reset::Keep,
            (true, None) => Reset::Next,
            (true, Some(seeds)) => Reset::Seed(seeds[i]),
        };
        let resets: Vec<Reset> = mask.as_array().iter().enumerate().map(reset).collect();
        py.detach(|| self.inner.reset_each(&resets)).map_err(|error| raised(&error))
    }

    /// What every environment shows now.
    fn observations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let size = self.inner.definition().observation_size();
        let mut all = vec![0.0; self.inner.len() * size];
        all.chunks_mut(size).enumerate().for_each(|(i, row)| self.inner.observe(i, row));
        all.into_pyarray(py).reshape([self.inner.len(), size])
    }

    /// x and y, m, and heading, rad, of every robot.
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let poses = (0..self.inner.len()).flat_map(|i| {
            let pose = self.inner.pose(i);
            [pose.x, pose.y, pose.heading]
        });
        poses.collect::<Vec<_>>().into_pyarray(py).reshape([self.inner.len(), 3])
    }

    /// Seed of every episode.
    fn episode_seeds<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        (0..self.inner.len()).map(|i| self.inner.episode_seed(i).cast_signed()).collect::<Vec<_>>().into_pyarray(py)
    }

    /// What stopped a robot.
    fn fault(&self, i: usize) -> Option<&str> {
        self.inner.fault(i)
    }

    /// Keeps every episode of an environment from its next reset on.
    fn record(&mut self, i: usize) {
        self.inner.record(i, true);
    }

    /// What was kept of the present episode as a page that shows it in 3D; none before the first step.
    fn page(&self, py: Python<'_>, i: usize, title: &str) -> Option<String> {
        py.detach(|| {
            let track = self.inner.track(i)?;
            (track.snapshots.len() > 1).then(|| plot::view::page(track, title))
        })
    }

    /// The robot as it is now: rows of red, green and blue.
    fn picture<'py>(&self, py: Python<'py>, i: usize, width: u32, height: u32) -> PyResult<Bound<'py, PyArray3<u8>>> {
        if !(1..=8000).contains(&width) || !(1..=8000).contains(&height) {
            return Err(InputError::new_err(format!(
                "render_size: {width} by {height} pixels\n  help: give 1 to 8000 each"
            )));
        }
        let (plan, snapshot, trail) = (self.inner.plan(i), self.inner.snapshot(i), self.inner.trail(i));
        let pixels = py.detach(|| plot::picture(plan, &snapshot, trail, [width, height]));
        pixels.into_pyarray(py).reshape([height as usize, width as usize, 3])
    }

    /// The environment's robot for MuJoCo.
    fn mjcf(&self, i: usize) -> PyResult<String> {
        mjcf::model("scram", self.inner.plan(i), &mjcf::Options::default()).map_err(|error| wrong_input(&error))
    }
}
