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

use crate::arguments::{self, whole};
use crate::errors::{InputError, failed, wrong_input};
use crate::interrupt::interruptible;
use crate::robot::Robot;
use crate::shared::Shared;

/// The project's robot file, for who names none.
const ROBOT: &str = include_str!("../../robot.toml");
/// Simulated seconds, of all robots together, up to which a step is too short to be interrupted: one robot walks some 20 s a second.
/// The thread that an interruptible call works in would cost more than it is worth there.
const BRIEF_S: f64 = 1.0;
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
struct GivenMaze<'py> {
    maze: String,
    cell_m: f64,
    columns: Bound<'py, PyAny>,
    rows: Bound<'py, PyAny>,
    maze_seed: Bound<'py, PyAny>,
    k_progress: f64,
    k_step: f64,
    k_exit: f64,
}

/// Fields of what was given: what is wrong with one is said by its name.
fn fields<'py, T: FromPyObjectOwned<'py, Error = PyErr>>(given: &Bound<'py, PyAny>) -> PyResult<T> {
    let py = given.py();
    given.extract().map_err(|error: PyErr| {
        // The error is of the field, `failed to extract field Given.observe`, and its cause of the value.
        let Some(cause) = error.cause(py) else { return error };
        let said = error.value(py).to_string();
        let field = said.rsplit('.').next().unwrap_or_default();
        let help =
            "the fields of scram.envs.Definition say what each is; several values, also one of several, are a list";
        InputError::new_err(format!("{field}: {}\n  help: {help}", cause.value(py)))
    })
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
            let GivenTurn { direction, yaw_rate_rad_per_s, k_rot, k_pos } = fields(given)?;
            let sign = chosen("direction", &direction, &DIRECTIONS)?;
            Ok(Task::Turn(Turn { desired_rad_per_s: sign * yaw_rate_rad_per_s, k_rot, k_pos }))
        }
        "straight" => {
            let GivenStraight { k_ahead, k_side, k_heading } = fields(given)?;
            Ok(Task::Straight(Straight { k_ahead, k_side, k_heading }))
        }
        "maze" => {
            let GivenMaze { maze, cell_m, columns, rows, maze_seed, k_progress, k_step, k_exit } = fields(given)?;
            let (columns, rows): (usize, usize) = (whole("columns", &columns)?, whole("rows", &rows)?);
            let maze_seed = whole("maze_seed", &maze_seed)?;
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
    let all: Given = fields(given)?;
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
        "turn" => {
            let turn = Turn::default();
            values.set_item("direction", word(&turn.desired_rad_per_s.signum(), &DIRECTIONS))?;
            Task::Turn(turn)
        }
        "straight" => Task::Straight(Straight::default()),
        "maze" => {
            let maze = Maze::figure_5_5(Maze::CELL_M);
            values.set_item("maze", word(&false, &MAZES))?;
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

/// The project's robot, with all that can be varied of it.
fn usual() -> PyResult<VariantBuilder> {
    let document = Document::parse(ROBOT, "robot.toml").map_err(|error| wrong_input(&error))?;
    let robot = document.robot().map_err(|error| wrong_input(&error))?;
    Ok(VariantBuilder::of_any(document, robot))
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

/// Many environments of one definition, advanced together. What is interrupted goes on to its end and keeps the others waiting until then.
#[pyclass(frozen, module = "scram._scram")]
pub struct Environments {
    inner: Shared<tasks::Environments>,
    step_is_brief: bool,
}

#[pymethods]
impl Environments {
    #[new]
    #[pyo3(signature = (definition, num_envs, robot = None, threads = 0))]
    fn new(
        py: Python<'_>,
        #[pyo3(from_py_with = definition)] definition: Definition,
        #[pyo3(from_py_with = arguments::num_envs)] num_envs: usize,
        robot: Option<PyRef<'_, Robot>>,
        #[pyo3(from_py_with = arguments::threads)] threads: usize,
    ) -> PyResult<Self> {
        let given = robot.map(|robot| robot.builder().clone());
        let step_is_brief = num_envs as f64 * definition.interval_s <= BRIEF_S;
        let threads = Some(threads).filter(|threads| *threads > 0);
        let made = interruptible(py, move |_| -> PyResult<_> {
            let builder = match given {
                Some(builder) => builder.as_ref().clone(),
                None => usual()?,
            };
            let made = tasks::Environments::with_threads(builder, definition, num_envs, threads);
            made.map_err(|error| raised(&error))
        })??;
        Ok(Self { inner: Shared::new(made), step_is_brief })
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.inner.now(py).len()
    }

    /// Least and greatest value of every number of an observation.
    #[getter]
    fn observation_bounds<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>) {
        let bounds = self.inner.now(py).definition().observation_bounds();
        let end = |end: usize| bounds.iter().map(|bound| bound[end] as f32).collect::<Vec<_>>().into_pyarray(py);
        (end(0), end(1))
    }

    /// How fast the exact drive's shaft changes its speed, rad/s².
    #[getter]
    fn shaft_acceleration_rad_per_s2(&self, py: Python<'_>) -> f64 {
        self.inner.now(py).shaft_acceleration()
    }

    /// One action of every environment.
    fn step<'py>(&self, py: Python<'py>, actions: PyReadonlyArray1<'py, i64>) -> PyResult<Outcome<'py>> {
        let known = self.inner.now(py).definition().actions().len();
        let index = |action: &i64| {
            let index = usize::try_from(*action).ok();
            index.ok_or_else(|| {
                InputError::new_err(format!(
                    "there is no action {action} among {known}\n  help: they are 0 to {}",
                    known - 1
                ))
            })
        };
        let actions = actions.as_array().iter().map(index).collect::<PyResult<Vec<usize>>>()?;
        let environments = self.inner.clone();
        let step = move || {
            let mut environments = environments.detached();
            environments.step(&actions).map(|steps| (steps, environments.definition().observation_size()))
        };
        let steps = if self.step_is_brief { py.detach(step) } else { interruptible(py, move |_| step())? };
        let (Steps { observations, rewards, terminated, truncated }, size) = steps.map_err(|error| raised(&error))?;
        let observations = observations.into_pyarray(py).reshape([rewards.len(), size])?;
        Ok((observations, rewards.into_pyarray(py), terminated.into_pyarray(py), truncated.into_pyarray(py)))
    }

    /// Begins the episode of its seed where `mask` is true.
    fn reset(
        &self,
        py: Python<'_>,
        mask: PyReadonlyArray1<'_, bool>,
        seeds: PyReadonlyArray1<'_, i64>,
    ) -> PyResult<()> {
        let reset = |(begins, seed): (&bool, &i64)| match begins {
            false => Reset::Keep,
            true => Reset::Seed(seed.cast_unsigned()),
        };
        let resets: Vec<Reset> = mask.as_array().iter().zip(seeds.as_array()).map(reset).collect();
        let environments = self.inner.clone();
        let done = interruptible(py, move |_| environments.detached().reset_each(&resets))?;
        done.map_err(|error| raised(&error))
    }

    /// What every environment shows now.
    fn observations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let environments = self.inner.now(py);
        let (count, size) = (environments.len(), environments.definition().observation_size());
        let mut all = vec![0.0; count * size];
        all.chunks_mut(size).enumerate().for_each(|(i, row)| environments.observe(i, row));
        all.into_pyarray(py).reshape([count, size])
    }

    /// x and y, m, and heading, rad, of every robot.
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let environments = self.inner.now(py);
        let poses = (0..environments.len()).flat_map(|i| {
            let pose = environments.pose(i);
            [pose.x, pose.y, pose.heading]
        });
        poses.collect::<Vec<_>>().into_pyarray(py).reshape([environments.len(), 3])
    }

    /// What stopped every robot; none for one that nothing stopped.
    fn faults(&self, py: Python<'_>) -> Vec<Option<String>> {
        let environments = self.inner.now(py);
        (0..environments.len()).map(|i| environments.fault(i).map(str::to_owned)).collect()
    }

    /// Keeps every episode of an environment from its next reset on.
    fn record(&self, py: Python<'_>, i: usize) {
        self.inner.now(py).record(i, true);
    }

    /// What was kept of the present episode as a page that shows it in 3D; none before the first step.
    fn page(&self, py: Python<'_>, i: usize, title: &str) -> Option<String> {
        py.detach(|| {
            let environments = self.inner.detached();
            let track = environments.track(i)?;
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
        let pixels = py.detach(|| {
            let environments = self.inner.detached();
            let (plan, snapshot, trail) = (environments.plan(i), environments.snapshot(i), environments.trail(i));
            let exit = match &environments.definition().task {
                Task::Maze(run) => Some(plot::Exit { centre: run.maze.exit_centre(), edge_m: run.maze.cell_m() }),
                _ => None,
            };
            plot::picture(plan, &snapshot, trail, exit, [width, height])
        });
        pixels.into_pyarray(py).reshape([height as usize, width as usize, 3])
    }

    /// The environment's robot for MuJoCo.
    fn mjcf(&self, py: Python<'_>, i: usize) -> PyResult<String> {
        let model = py.detach(|| mjcf::model("scram", self.inner.detached().plan(i), &mjcf::Options::default()));
        model.map_err(|error| wrong_input(&error))
    }
}
