//! Whole numbers from Python, which have no least and no greatest there.

use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;

use crate::errors::InputError;

/// A whole number that Rust can hold.
pub trait Whole: for<'a, 'py> FromPyObject<'a, 'py, Error = PyErr> {
    /// The greatest.
    const MAX: u64;
}

impl Whole for u16 {
    const MAX: u64 = Self::MAX as u64;
}

impl Whole for u32 {
    const MAX: u64 = Self::MAX as u64;
}

impl Whole for u64 {
    const MAX: u64 = Self::MAX;
}

impl Whole for usize {
    const MAX: u64 = Self::MAX as u64;
}

/// A whole number from 0 on; what is none is a `TypeError`, as everywhere in Python.
///
/// # Errors
/// It is no whole number, or out of range.
pub fn whole<T: Whole>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<T> {
    value.extract::<T>().map_err(|error| match error.is_instance_of::<PyOverflowError>(value.py()) {
        true => InputError::new_err(format!("{name}: {value} is not a whole number from 0 to {}", T::MAX)),
        false => error,
    })
}

/// The functions by which arguments of these names are read: `#[pyo3(from_py_with = arguments::seed)]`.
macro_rules! arguments {
    ($($name:ident: $type:ty,)*) => {
        $(pub fn $name(value: &Bound<'_, PyAny>) -> PyResult<$type> {
            whole(stringify!($name), value)
        })*
    };
}

arguments! {
    angle: u16,
    battery: u16,
    draws: usize,
    num_envs: usize,
    seed: u64,
    threads: usize,
    time_us: u64,
}

/// The same of arguments that may be `None`.
macro_rules! optional_arguments {
    ($($name:ident: $type:ty,)*) => {
        $(pub fn $name(value: &Bound<'_, PyAny>) -> PyResult<Option<$type>> {
            if value.is_none() { Ok(None) } else { whole(stringify!($name), value).map(Some) }
        })*
    };
}

optional_arguments! {
    module: usize,
    most_samples: usize,
    second: u16,
}
