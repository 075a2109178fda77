//! Errors: the text of the Rust error, its causes and its help, as an exception of `scram/errors.py`.

use std::path::Path;

use miette::Diagnostic;
use pyo3::prelude::*;

pyo3::import_exception!(scram.errors, InputError);
pyo3::import_exception!(scram.errors, MissingFileError);
pyo3::import_exception!(scram.errors, ScramError);

/// What a person reads: the error, what caused it, and what to do.
pub fn text(error: &dyn Diagnostic) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        // A transparent error says what its cause says.
        let said = error.to_string();
        if !text.contains(&said) {
            text = format!("{text}: {said}");
        }
        cause = error.source();
    }
    match error.help() {
        Some(help) => format!("{text}\n  help: {help}"),
        None => text,
    }
}

/// The call was given something wrong: `scram.InputError`.
pub fn wrong_input(error: &dyn Diagnostic) -> PyErr {
    InputError::new_err(text(error))
}

/// It could not be done, for no fault of what was given: `scram.ScramError`.
pub fn failed(error: &dyn Diagnostic) -> PyErr {
    ScramError::new_err(text(error))
}

/// A file cannot be used: `scram.MissingFileError` where there is none, otherwise `scram.InputError`.
pub fn unusable_file(path: &Path, error: &dyn Diagnostic) -> PyErr {
    if path.exists() { wrong_input(error) } else { MissingFileError::new_err(text(error)) }
}
