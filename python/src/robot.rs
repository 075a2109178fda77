//! `scram.Robot`: a robot file, checked.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use robot_file::edit::Document;
use sweep::VariantBuilder;

use crate::errors::unusable_file;

/// Robot file, read and checked.
#[pyclass(frozen, module = "scram")]
pub struct Robot {
    builder: Arc<VariantBuilder>,
}

impl Robot {
    /// The robot file and its quantities.
    pub fn builder(&self) -> &Arc<VariantBuilder> {
        &self.builder
    }
}

#[pymethods]
impl Robot {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = || {
            let document = Document::load(&path)?;
            let robot = document.robot()?;
            Ok(VariantBuilder::of_any(document, robot))
        };
        let builder = py.detach(read).map_err(|error: robot_file::RobotFileError| unusable_file(&path, &error))?;
        Ok(Self { builder: Arc::new(builder) })
    }

    /// Short name, as in the file.
    #[getter]
    fn name(&self) -> &str {
        &self.builder.robot().name
    }
}
