//! A sweep whose rows are made elsewhere: the driver's and the workers' side of `scram.cluster`.

use std::path::{Path, PathBuf};

use ::sweep::{Axis, Campaign, Ledger, Lock, LockError, Row, SweepArguments, Target, VariantBuilder, claims};
use clap::{CommandFactory, Parser};
use pyo3::prelude::*;
use robot_file::edit::Document;

use crate::errors::{InputError, ScramError, failed, unusable_file, wrong_input};
use crate::interrupt::interruptible;
use crate::shared::Shared;

/// Run the robot on the ground under many conditions, on all machines of a cluster: the rows of `scram sweep` with the same options
#[derive(Parser, Clone, Debug)]
#[command(name = "python -m scram.cluster sweep", no_binary_name = true, disable_help_flag = true)]
struct Options {
    #[command(flatten)]
    runs: SweepArguments,
    /// The runs by which the thesis's claims are judged
    #[arg(long, conflicts_with_all = ["axes", "sensitivity"])]
    claims: bool,
    /// Begin anew: delete what --out has of an earlier sweep
    #[arg(long)]
    fresh: bool,
    /// The robot file
    #[arg(long, value_name = "FILE", default_value = "robot.toml")]
    robot: PathBuf,
    /// Directory for what is written
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// A row as Python carries it: the run's number, its cells, those of its path.
type Carried = (usize, Vec<String>, Vec<String>);

/// A sweep from a command line.
///
/// What is interrupted goes on to its end and keeps the others waiting until then.
#[pyclass(frozen, module = "scram._scram")]
pub struct Sweep {
    options: Options,
    state: Shared<State>,
}

/// What becomes of a sweep.
struct State {
    campaign: Option<Campaign>,
    paths: bool,
    warnings: Vec<String>,
    /// While the lock lives no other sweep may write where this one does.
    kept: Option<(Ledger, Option<Lock>)>,
}

/// What is missing once the tables are written.
fn over() -> PyErr {
    ScramError::new_err("the sweep is not open, or finished already")
}

impl Options {
    /// The sweep with this robot, made by a driver or by a worker.
    fn state(&self, file: &Path, is_worker: bool) -> PyResult<State> {
        let document = Document::load(file).map_err(|error| unusable_file(file, &error))?;
        let robot = document.robot().map_err(|error| wrong_input(&error))?;
        let settings = self.runs.settings();
        settings.check_step(&robot).map_err(|error| wrong_input(&::sweep::ArgumentError::from(error)))?;
        let builder = VariantBuilder::new(document, robot).map_err(|error| wrong_input(&error))?;
        let axes = Axis::parse_all(&self.runs.axes).map_err(|error| wrong_input(&error))?;
        let (design, paths) = if self.claims {
            let seeds = self.runs.seeds(self.seed);
            (claims::design(seeds).with_runs_a_robot(self.runs.runs_a_robot()), false)
        } else {
            self.runs.design(axes.clone(), self.seed).map_err(|error| wrong_input(&error))?
        };
        let (campaign, warnings) = if is_worker {
            (Campaign::of_checked(&builder, design, settings), Vec::new())
        } else {
            let warnings = builder.check(&axes).map_err(|error| wrong_input(&error))?;
            (Campaign::new(&builder, design, settings).map_err(|error| wrong_input(&error))?, warnings)
        };
        Ok(State { campaign: Some(campaign), paths, warnings, kept: None })
    }
}

impl State {
    fn campaign(&self) -> PyResult<&Campaign> {
        self.campaign.as_ref().ok_or_else(over)
    }

    /// Opens the tables and says which groups of runs are missing.
    fn open(&mut self, options: &Options) -> PyResult<Vec<Vec<usize>>> {
        let out = &options.out;
        std::fs::create_dir_all(out)
            .map_err(|error| ScramError::new_err(format!("the directory {} cannot be made: {error}", out.display())))?;
        let lock = match Lock::take(out) {
            Ok(lock) => Some(lock),
            Err(busy @ LockError::Busy { .. }) => return Err(failed(&busy)),
            Err(unavailable) => {
                self.warnings.push(format!("{unavailable}; run no other sweep there"));
                None
            }
        };
        let campaign = self.campaign()?;
        let stem = if options.claims { "claims" } else { "sweep" };
        let target = Target { directory: out, stem, paths: self.paths, fresh: options.fresh };
        let ledger = campaign.open(&target).map_err(|error| failed(&error))?;
        let pending = campaign.pending(&ledger).map_err(|error| failed(&error))?;
        self.kept = Some((ledger, lock));
        Ok(pending)
    }

    fn rows(&self, runs: &[usize]) -> PyResult<Vec<Carried>> {
        let rows = self.campaign()?.rows(runs).map_err(|error| failed(&error))?;
        let path = |row: &Row| if self.paths { row.path.clone() } else { Vec::new() };
        Ok(rows.into_iter().map(|row| (row.number, row.cells.clone(), path(&row))).collect())
    }

    fn book(&mut self, rows: Vec<Carried>) -> PyResult<()> {
        let (ledger, _) = self.kept.as_mut().ok_or_else(over)?;
        let rows = rows.into_iter().map(|(number, cells, path)| Row { number, cells, path }).collect();
        ledger.book(rows).map_err(|error| failed(&error))
    }

    fn finish(&mut self) -> PyResult<Vec<PathBuf>> {
        let campaign = self.campaign.take().ok_or_else(over)?;
        let (ledger, lock) = self.kept.take().ok_or_else(over)?;
        let swept = campaign.finish(ledger).map_err(|error| failed(&error))?;
        drop(lock);
        Ok(std::iter::once(swept.file).chain(swept.paths_file).collect())
    }
}

impl Sweep {
    /// Works on it: the lock on the directory is the work's until it ends, whoever waits for it.
    fn work<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut State, &Options) -> PyResult<T> + Send + 'static,
    ) -> PyResult<T> {
        let (state, options) = (self.state.clone(), self.options.clone());
        interruptible(py, move |_| work(&mut state.detached(), &options))?
    }
}

#[pymethods]
impl Sweep {
    /// From the options of `scram sweep`. A worker has the robot's file elsewhere, `robot`; what the options ask for was checked by the
    /// driver, and a worker makes only the robots of the runs that it makes.
    #[new]
    #[pyo3(signature = (arguments, robot = None))]
    fn new(py: Python<'_>, arguments: Vec<String>, robot: Option<PathBuf>) -> PyResult<Self> {
        let options = Options::try_parse_from(&arguments).map_err(|error| InputError::new_err(error.to_string()))?;
        let is_worker = robot.is_some();
        let file = robot.unwrap_or_else(|| options.robot.clone());
        let given = options.clone();
        let state = interruptible(py, move |_| given.state(&file, is_worker))??;
        Ok(Self { options, state: Shared::new(state) })
    }

    /// What the options are, for people.
    #[staticmethod]
    fn help() -> String {
        Options::command().render_long_help().to_string()
    }

    /// What should be known before it runs.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> Vec<String> {
        self.state.now(py).warnings.clone()
    }

    /// The robot file that the options name.
    #[getter]
    fn robot_file(&self) -> PathBuf {
        self.options.robot.clone()
    }

    /// Every file that the robot stands on: its own, its base, that one's base.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        robot_file::image::files(&self.options.robot)
    }

    /// All that rows depend on, as text: equal where two machines make the same rows.
    #[getter]
    fn about(&self, py: Python<'_>) -> PyResult<String> {
        self.work(py, |state, _| Ok(state.campaign()?.about().to_string()))
    }

    /// How many rows there will be.
    #[getter]
    fn total(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.state.now(py).campaign()?.design().runs())
    }

    /// How many rows are there.
    #[getter]
    fn done(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.state.now(py).kept.as_ref().ok_or_else(over)?.0.len())
    }

    /// The directory that the options name.
    #[getter]
    fn out(&self) -> PathBuf {
        self.options.out.clone()
    }

    /// Groups of all runs, whatever is there already.
    fn groups(&self, py: Python<'_>) -> PyResult<Vec<Vec<usize>>> {
        self.work(py, |state, _| state.campaign()?.all().map_err(|error| failed(&error)))
    }

    /// Opens the tables in `--out`, keeps other sweeps out, and says which groups of runs are missing.
    fn open(&self, py: Python<'_>) -> PyResult<Vec<Vec<usize>>> {
        self.work(py, State::open)
    }

    /// Makes the rows of runs; nothing is written.
    fn rows(&self, py: Python<'_>, runs: Vec<usize>) -> PyResult<Vec<Carried>> {
        self.work(py, move |state, _| state.rows(&runs))
    }

    /// Keeps rows: once this returns they survive whatever becomes of the process.
    fn book(&self, py: Python<'_>, rows: Vec<Carried>) -> PyResult<()> {
        self.work(py, move |state, _| state.book(rows))
    }

    /// Writes the tables sorted, and says where.
    fn finish(&self, py: Python<'_>) -> PyResult<Vec<PathBuf>> {
        self.work(py, |state, _| state.finish())
    }
}
