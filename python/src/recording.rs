//! `scram.Recording`: a run with its columns as numpy arrays.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::{PyImportError, PyKeyError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use recording::{AngleReading, Cells, Drive, ExtraColumn, ReadOptions, Run, Window};

use crate::arguments;
use crate::errors::{InputError, ScramError, failed, unusable_file, wrong_input};
use crate::interrupt::interruptible;
use crate::shared::Shared;

/// A run: samples, what is known beside them, and of a simulated one its figures.
///
/// ``recording[name]`` is a column as a numpy array of shape (samples,), NaN where a cell is empty, and read-only: what is to be changed
/// is copied first. docs/recordings.md says what the names mean. ``read`` reads one from a file, ``simulate`` makes one, and columns in memory are one by themselves:
///
/// Parameters
/// ----------
/// columns
///     A mapping of names to arrays of shape (samples,), or a pandas data frame; NaN where nothing was measured. ``t_s``, ``duty`` or
///     ``voltage_v`` and ``angle_rad`` or ``adc`` are needed. Truth values are 0 and 1. Columns of words are what the controller was told
///     and said (``state``, ``fault``, ``order``), or ignored, and then named in ``notes``.
/// name
///     What messages and reports call it.
/// metadata
///     What is known beside the samples, with the keys of ``RUN.toml``.
///
/// Raises
/// ------
/// InputError
///     Columns are missing, differ in length or have another shape, or hold words or values that no rig measures.
///
/// Examples
/// --------
/// >>> import scram
/// >>> run = scram.simulate(scram.Robot("robot.toml"), "freq:7", seconds=1, bench=True)
/// >>> run.columns[:4]
/// ['t_s', 'enable', 'duty', 'adc']
/// >>> abs(run.metrics["mean_frequency_hz"] - 7) < 0.2
/// True
/// >>> run.commands[0]
/// (0, 'freq 7', False)
/// >>> import numpy as np
/// >>> t_s = np.arange(1000) * 1e-3
/// >>> scram.Recording({"t_s": t_s, "duty": np.full(1000, 0.5), "angle_rad": 44 * t_s})
/// <scram.Recording of ?, 1000 samples over 0.999 s>
#[pyclass(frozen, module = "scram")]
pub struct Recording {
    run: Arc<Run>,
    metrics: serde_json::Map<String, serde_json::Value>,
    /// Columns that were asked for, each made once.
    arrays: Shared<HashMap<String, Py<PyAny>>>,
}

/// Names of what the controller said in every row.
const SAID: [&str; 3] = ["state", "fault", "tracking"];

impl Recording {
    /// Of a run with its figures.
    pub fn new(run: Run, metrics: serde_json::Map<String, serde_json::Value>) -> Self {
        Self { run: Arc::new(run), metrics, arrays: Shared::new(HashMap::new()) }
    }

    /// The run, which is not copied.
    pub fn run(&self) -> Arc<Run> {
        self.run.clone()
    }

    fn names(&self) -> Vec<&str> {
        let mut names = recording::column_names(&self.run.recording);
        names.extend(self.further().map(|column| column.name.as_str()));
        names.extend(if self.run.log.stated.is_empty() { &[][..] } else { &SAID });
        names
    }

    fn further(&self) -> impl Iterator<Item = &ExtraColumn> {
        self.run.log.numbers.iter().chain(&self.run.extra)
    }

    /// A column; `None` where there is none of this name. Everybody gets the same array, which nobody may write to.
    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        if let Some(array) = self.arrays.now(py).get(name) {
            return Ok(Some(array.bind(py).clone()));
        }
        let Some(array) = self.new_column(py, name)? else { return Ok(None) };
        array.call_method1("setflags", (false,))?;
        self.arrays.now(py).insert(name.to_owned(), array.clone().unbind());
        Ok(Some(array))
    }

    fn new_column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let samples = &self.run.recording;
        if !self.names().contains(&name) {
            return Ok(None);
        }
        let array = match name {
            "t_s" => numbers(py, samples.t_s.iter().copied()),
            "enable" => samples.enable.clone().into_pyarray(py).into_any(),
            "duty" | "voltage_v" => match &samples.drive {
                Drive::Duty(column) | Drive::Voltage(column) => numbers(py, column.iter().copied()),
            },
            "adc" | "angle_rad" => match &samples.angle {
                AngleReading::Angle(column) => numbers(py, column.iter().map(|value| or_nan(*value))),
                AngleReading::Adc(column) => numbers(py, column.iter().map(|code| or_nan(code.map(f64::from)))),
            },
            "adc_second" => numbers(py, samples.adc_second.iter().map(|code| or_nan(code.map(f64::from)))),
            "supply_v" => numbers(py, samples.supply_v.iter().copied()),
            "current_a" => numbers(py, samples.current_a.iter().map(|value| or_nan(*value))),
            "temperature_c" => numbers(py, samples.temperature_c.iter().map(|value| or_nan(*value))),
            "x_m" => self.pose(py, 0),
            "y_m" => self.pose(py, 1),
            "yaw_rad" => self.pose(py, 2),
            "tracking" => {
                let flags: Vec<bool> = self.run.log.stated.iter().map(|stated| stated.tracking).collect();
                flags.into_pyarray(py).into_any()
            }
            "state" => self.words(py, |stated| format!("{:?}", stated.state))?,
            "fault" => self.words(py, |stated| stated.fault.map_or_else(String::new, |fault| format!("{fault:?}")))?,
            other => match self.further().find(|column| column.name == other) {
                Some(column) => numbers(py, column.values.iter().map(|value| or_nan(*value))),
                None => return Ok(None),
            },
        };
        Ok(Some(array))
    }

    fn pose<'py>(&self, py: Python<'py>, axis: usize) -> Bound<'py, PyAny> {
        numbers(py, self.run.recording.pose.iter().map(|pose| or_nan(pose.map(|pose| pose[axis]))))
    }

    fn words<'py>(&self, py: Python<'py>, of: impl Fn(&recording::Stated) -> String) -> PyResult<Bound<'py, PyAny>> {
        let words = PyList::new(py, self.run.log.stated.iter().map(of))?;
        py.import("numpy")?.call_method1("array", (words, "U"))
    }

    /// A library that is not needed for the rest.
    fn library<'py>(py: Python<'py>, name: &str, extra: &str) -> PyResult<Bound<'py, PyModule>> {
        py.import(name).map_err(|error| match error.is_instance_of::<PyImportError>(py) {
            true => ScramError::new_err(format!("{name} is not installed\n  help: pip install 'scram[{extra}]'")),
            false => error,
        })
    }
}

/// File, name, figures and notes of a recording.
type Pickled<'py> = (Bound<'py, PyBytes>, PathBuf, Bound<'py, PyAny>, Vec<String>);

fn or_nan(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

/// A column of whatever numpy makes an array of: numbers where it can, `None` becoming NaN and truth values 0 and 1, otherwise words.
fn cells(name: &str, values: &Bound<'_, PyAny>) -> PyResult<Cells> {
    let wrong = |what: String| {
        let help = "give every column one value a sample, NaN where nothing was measured";
        InputError::new_err(format!("column `{name}`: {what}\n  help: {help}"))
    };
    let asarray = values.py().import("numpy")?.getattr("asarray")?;
    let array = asarray.call1((values,)).map_err(|error| wrong(error.value(values.py()).to_string()))?;
    let shape = array.getattr("shape")?;
    if shape.len()? != 1 {
        return Err(wrong(format!("it is of shape {shape}, not (samples,)")));
    }
    match asarray.call1((values, "float64")) {
        Ok(numbers) => Ok(Cells::Numbers(numbers.extract::<PyReadonlyArray1<'_, f64>>()?.as_array().to_vec())),
        Err(_) => Ok(Cells::Words(array.call_method1("astype", ("U",))?.call_method0("tolist")?.extract()?)),
    }
}

fn numbers<'py>(py: Python<'py>, values: impl Iterator<Item = f64>) -> Bound<'py, PyAny> {
    let values: Bound<'py, PyArray1<f64>> = values.collect::<Vec<_>>().into_pyarray(py);
    values.into_any()
}

#[pymethods]
impl Recording {
    /// The run of columns in memory, as `read` would read them from a file: see `docs/recordings.md` for their names and units.
    #[new]
    #[pyo3(signature = (columns, *, name = PathBuf::from("recording"), metadata = None))]
    fn of_columns(
        py: Python<'_>,
        columns: &Bound<'_, PyAny>,
        name: PathBuf,
        metadata: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let mut given = Vec::new();
        for item in columns.call_method0("items")?.try_iter()? {
            let (name, values): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item?.extract()?;
            let name: String = name.extract().map_err(|_| {
                InputError::new_err(format!(
                    "column {name}: its name is no text\n  help: name columns as in docs/recordings.md"
                ))
            })?;
            let cells = cells(&name, &values)?;
            given.push((name, cells));
        }
        let metadata = metadata.map(pythonize::depythonize).transpose()?.unwrap_or_default();
        let run = interruptible(py, move |_| Run::of_columns(&name, given, metadata))?;
        let run = run.map_err(|error| wrong_input(&error))?;
        Ok(Self::new(run, serde_json::Map::new()))
    }

    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<&str> {
        self.names()
    }

    fn __len__(&self) -> usize {
        self.run.recording.len()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let column = self.column(py, name)?;
        column.ok_or_else(|| PyKeyError::new_err(format!("no column `{name}`; there are {}", self.names().join(", "))))
    }

    fn __contains__(&self, name: &str) -> bool {
        self.names().contains(&name)
    }

    /// What the controller was told: index of the row before which it was, the words, and whether it is the command before again.
    #[getter]
    fn commands(&self) -> Vec<(usize, &str, bool)> {
        self.run.log.commands.iter().map(|command| (command.row, command.text.as_str(), command.repeat)).collect()
    }

    /// What is known of the run beside its samples.
    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize::pythonize(py, &self.run.metadata)?)
    }

    /// Figures of a simulated run, by the names of ``scram sim --json``, which end in their units; empty for one that was read. None is a
    /// figure that the run does not have.
    ///
    /// Of the last command: ``target_frequency_hz``, ``mean_frequency_hz``, ``phase_rms_deg``, ``settling_s``,
    /// ``settling_instantaneous_s``, ``acquired_s``, ``estimate_rms_deg``, ``estimate_rms_blind_deg``, ``peak_current_a``,
    /// ``rms_current_a``, ``energy_j``, ``turning_points_deg``, ``turning_error_median_deg``, ``turning_error_worst_deg``,
    /// ``strokes_ran_away`` (how many), ``oscillation_frequency_hz``, ``position_rms_deg``. Of the run: ``faults``, what broke and how the
    /// supervisor answered.
    ///
    /// ``walk``, of a robot on the ground, is a dictionary in turn: ``longitudinal_mm_per_s`` ahead and ``lateral_mm_per_s`` to the left,
    /// ``yaw_deg_per_s`` counter-clockwise, means from ``speeds_from_s`` (the second half) to the run's end in the frame of the start;
    /// ``displacement_mm`` (ahead, to the left) and ``turned_deg`` from start to end; ``path_mm``, the length of the centroid's path;
    /// ``module_height_mm`` (lowest and highest centre of a module); ``tilt_deg`` (largest of a module against the vertical);
    /// ``energy_per_distance_j_per_m`` over the second half; ``contact_share`` (of its time in which the ground carries a foot: left and
    /// right of module 1, of module 2, …). ``clamped`` stands in its place where a module is clamped: sizes of the feet's paths.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize::pythonize(py, &self.metrics)?)
    }

    /// What a person should know of the file.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.run.notes.clone()
    }

    /// Writes the run as MCAP or CSV, by the ending of the name; the file is whole or not there.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let run = self.run.clone();
        interruptible(py, move |_| run.write(&path))?.map_err(|error| failed(&error))
    }

    /// A file of it, which holds all that a run has but its figures.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let pickle = slf.py().import("scram._pickle")?;
        let file: Bound<'py, PyBytes> = pickle.call_method1("file_of", (slf,))?.cast_into()?;
        let this = slf.get();
        let name = this.run.recording.path.clone();
        Ok((pickle.getattr("recording_of")?, (file, name, this.metrics(slf.py())?, this.notes())))
    }

    /// The recording in a file that was made of another one, with what the file does not hold.
    #[staticmethod]
    fn _of_file(
        py: Python<'_>,
        file: PathBuf,
        name: PathBuf,
        metrics: &Bound<'_, PyAny>,
        notes: Vec<String>,
    ) -> PyResult<Self> {
        let options = ReadOptions { limit: usize::MAX, ..ReadOptions::default() };
        let run = interruptible(py, move |_| Run::load(&file, &options))?;
        let mut run = run.map_err(|error| failed(&error))?;
        (run.recording.path, run.notes) = (name, notes);
        Ok(Self::new(run, pythonize::depythonize(metrics)?))
    }

    /// The columns as a pandas data frame.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pandas = Self::library(py, "pandas", "pandas")?;
        pandas.getattr("DataFrame")?.call1((self.arrays(py)?,))
    }

    /// The columns as an Arrow table.
    fn to_arrow<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let arrow = Self::library(py, "pyarrow", "arrow")?;
        arrow.getattr("table")?.call1((self.arrays(py)?,))
    }

    fn __repr__(&self) -> String {
        let run = &self.run;
        let robot = run.metadata.robot.as_deref().unwrap_or("?");
        let seconds = run.recording.t_s.last().zip(run.recording.t_s.first()).map_or(0.0, |(last, first)| last - first);
        format!("<scram.Recording of {robot}, {} samples over {seconds:.3} s>", run.recording.len())
    }
}

impl Recording {
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let arrays = PyDict::new(py);
        for name in self.names() {
            if let Some(column) = self.column(py, name)? {
                arrays.set_item(name, column)?;
            }
        }
        Ok(arrays)
    }
}

/// Read a recording, MCAP or CSV by the ending of its name.
///
/// Parameters
/// ----------
/// path
///     The file.
/// robot
///     Which robot, by its name in the file; needed where a session has several.
/// from_s, to_s
///     Nothing before and after these times of the recording, s.
/// most_samples
///     Samples held at most: a longer file is thinned by whole blocks of 1000. All of them where nothing is said.
///
/// Where rows are left out, there are only the columns that every recording has.
///
/// Raises
/// ------
/// MissingFileError
///     There is no such file.
/// InputError
///     It is no recording, or holds values that no rig measures.
#[pyfunction]
#[pyo3(signature = (path, *, robot = None, from_s = None, to_s = None, most_samples = None))]
pub fn read(
    py: Python<'_>,
    path: PathBuf,
    robot: Option<String>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    #[pyo3(from_py_with = arguments::most_samples)] most_samples: Option<usize>,
) -> PyResult<Recording> {
    let window = Window { from_s, to_s };
    // All rows, unless somebody wants fewer.
    let options = ReadOptions { limit: most_samples.unwrap_or(usize::MAX), robot, window, ..ReadOptions::default() };
    let file = path.clone();
    let run = interruptible(py, move |_| Run::load(&file, &options))?.map_err(|error| unusable_file(&path, &error))?;
    Ok(Recording::new(run, serde_json::Map::new()))
}
