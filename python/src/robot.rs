//! `scram.Robot`: a robot file, checked.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::errors::unusable_file;

/// Robot file, read and checked.
#[pyclass(frozen, module = "scram")]
pub struct Robot {
    robot: robot_file::Robot,
}

#[pymethods]
impl Robot {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let robot = py.detach(|| robot_file::Robot::load(&path)).map_err(|error| unusable_file(&path, &error))?;
        Ok(Self { robot })
    }

    /// Short name, as in the file.
    #[getter]
    fn name(&self) -> &str {
        &self.robot.name
    }
}
