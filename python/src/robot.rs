//! `scram.Robot`: a robot file, checked, with other values of its quantities.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use robot_file::edit::Document;
use sweep::{SettingError, VariantBuilder};

use crate::arguments;
use crate::errors::{InputError, failed, unusable_file, wrong_input};

/// A number of a robot file, its plausible range, and where it comes from.
#[pyclass(frozen, eq, get_all, module = "scram")]
#[derive(Clone, PartialEq)]
pub struct Quantity {
    /// In the unit at the end of its path.
    value: f64,
    /// Lower end of the plausible range, in the same unit.
    low: f64,
    /// Upper end.
    high: f64,
    /// Where it comes from, for people.
    source: String,
}

#[pymethods]
impl Quantity {
    fn __repr__(&self) -> String {
        format!("Quantity(value={}, low={}, high={}, source={:?})", self.value, self.low, self.high, self.source)
    }
}

impl From<&robot_file::robot::Quantity> for Quantity {
    fn from(quantity: &robot_file::robot::Quantity) -> Self {
        let robot_file::robot::Quantity { value, low, high, source } = quantity.clone();
        Self { value, low, high, source }
    }
}

/// A robot file, read and checked.
///
/// Parameters
/// ----------
/// path
///     The file.
/// **overrides
///     Other values of its quantities, by their dotted paths as `scram sim --set` takes them; the file itself is not changed. A value
///     outside the file's low … high is warned of.
///
/// Raises
/// ------
/// MissingFileError
///     There is no such file.
/// InputError
///     It is no robot file, there is no such quantity, or its value is not allowed.
///
/// Examples
/// --------
/// >>> import scram
/// >>> robot = scram.Robot("robot.toml", **{"motor.resistance_ohm": 17})
/// >>> robot.quantities["motor.resistance_ohm"].value
/// 17.0
/// >>> one_of_many = robot.draw(seed=3)
/// >>> one_of_many.quantities["ground.friction"] == robot.quantities["ground.friction"]
/// False
#[pyclass(frozen, module = "scram")]
#[derive(Clone)]
pub struct Robot {
    builder: Arc<VariantBuilder>,
    path: PathBuf,
}

impl Robot {
    /// The robot of a file in memory that came from one on the disk. It is read and checked, which takes about 10 ms: not with Python's
    /// lock.
    pub fn of(document: Document, path: PathBuf) -> PyResult<Self> {
        let robot = document.robot().map_err(|error| wrong_input(&error))?;
        Ok(Self { builder: Arc::new(VariantBuilder::of_any(document, robot)), path })
    }

    /// The robot.
    pub fn robot(&self) -> &robot_file::Robot {
        self.builder.robot()
    }

    /// The robot file and its quantities.
    pub fn builder(&self) -> &Arc<VariantBuilder> {
        &self.builder
    }

    /// The robot file, to change a copy of it.
    pub fn document(&self) -> &Document {
        self.builder.document()
    }

    /// Where the file was read from, from the root on.
    pub fn path(&self) -> &PathBuf {
        &self.path
    }

    /// The same robot of another document: see [`Self::of`].
    pub fn with(&self, document: Document) -> PyResult<Self> {
        Self::of(document, self.path.clone())
    }

    /// Warns of a value that the file thinks implausible, as a sweep does of its axes'.
    fn warn_outside(&self, py: Python<'_>, path: &str, value: f64) -> PyResult<()> {
        let Some(Quantity { low, high, .. }) = self.builder.quantity(path).map(Quantity::from) else { return Ok(()) };
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let what = format!("{path}={value} is outside the {low} … {high} that the robot file thinks plausible");
        let what = CString::new(what).unwrap_or_default();
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &what, 1)
    }

    fn changed(&self, changed: Result<Document, SettingError>) -> PyResult<Self> {
        self.with(changed.map_err(|error| wrong_input(&error))?)
    }
}

/// From the root on, so that the file and its base are found again whatever the working directory is then.
fn from_root(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Values by their dotted paths.
fn values(overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, f64)>> {
    let Some(overrides) = overrides else { return Ok(Vec::new()) };
    let value = |(path, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let path: String = path.extract()?;
        match value.extract::<f64>() {
            Ok(number) if number.is_finite() => Ok((path, number)),
            _ => Err(InputError::new_err(format!("{path}={}: not a finite number", value.repr()?))),
        }
    };
    overrides.iter().map(value).collect()
}

#[pymethods]
impl Robot {
    #[new]
    #[pyo3(signature = (path, /, **overrides))]
    fn new(py: Python<'_>, path: PathBuf, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let path = from_root(&path);
        let read = || Self::of(Document::load(&path).map_err(|error| unusable_file(&path, &error))?, path.clone());
        py.detach(read)?.replace(py, overrides)
    }

    /// From the text of a robot file; `path` is for messages, and a base is looked for beside it.
    #[classmethod]
    #[pyo3(signature = (text, path = PathBuf::from("robot.toml")))]
    fn from_text(class: &Bound<'_, PyType>, text: &str, path: PathBuf) -> PyResult<Self> {
        let path = from_root(&path);
        class.py().detach(|| {
            let document = Document::parse(text, &path.display().to_string()).map_err(|error| wrong_input(&error))?;
            Self::of(document, path)
        })
    }

    /// Name of the robot, as in the file.
    #[getter]
    fn name(&self) -> &str {
        &self.robot().name
    }

    /// One line about it, as in the file.
    #[getter]
    fn summary(&self) -> &str {
        &self.robot().summary
    }

    /// Whether it has a body and can walk.
    #[getter]
    fn has_body(&self) -> bool {
        self.robot().body.is_some()
    }

    /// Every number of the file by its dotted path.
    #[getter]
    fn quantities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let quantities = PyDict::new(py);
        for (path, quantity) in self.builder.quantities() {
            quantities.set_item(path, Quantity::from(quantity).into_pyobject(py)?)?;
        }
        Ok(quantities)
    }

    /// The robot with other values of some quantities.
    #[pyo3(signature = (**overrides))]
    fn replace(&self, py: Python<'_>, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let values = values(overrides)?;
        if values.is_empty() {
            return Ok(self.clone());
        }
        let values: Vec<(&str, f64)> = values.iter().map(|(path, value)| (path.as_str(), *value)).collect();
        let changed = py.detach(|| self.changed(self.builder.set(&values)))?;
        for (path, value) in values {
            self.warn_outside(py, path, value)?;
        }
        Ok(changed)
    }

    /// A robot whose uncertain numbers are drawn from the file's spreads: uniform from low to high, in the logarithm where high is more than
    /// three times low. What is decided stays: the controller's numbers, the link's and the chip's, α. The same seed gives the same
    /// robot.
    fn draw(&self, py: Python<'_>, #[pyo3(from_py_with = arguments::seed)] seed: u64) -> PyResult<Self> {
        py.detach(|| self.changed(self.builder.drawn(seed)))
    }

    /// Writes the robot file, whole or not at all.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.document().save(&path)).map_err(|error| failed(&error))
    }

    /// The text of the robot file.
    #[getter]
    fn text(&self) -> String {
        self.document().text()
    }

    /// A base is named as the file names it, and looked for beside the file.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, PathBuf))> {
        let this = slf.get();
        Ok((slf.getattr("from_text")?, (this.text(), this.path.clone())))
    }

    fn __repr__(&self) -> String {
        format!("<scram.Robot {} of {}>", self.robot().name, self.path.display())
    }
}
