//! Arrays of numpy, and JSON as Python objects.

use crate::failure::Failure;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use serde::Serialize;

/// An array of shape `(rows.len(), N)`.
pub fn matrix<'py, T: Element + Copy, const N: usize>(
    py: Python<'py>,
    rows: impl Iterator<Item = [T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let flat: Vec<T> = rows.flatten().collect();
    let count = flat.len() / N;
    PyArray1::from_vec(py, flat).reshape([count, N])
}

/// An array of one dimension.
pub fn vector<T: Element>(py: Python<'_>, values: impl Iterator<Item = T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, values.collect())
}

/// A value of the library as dictionaries, lists and numbers of Python; what is not known is `None`.
pub fn as_python<'py>(py: Python<'py>, value: &impl Serialize) -> Result<Bound<'py, PyAny>, Failure> {
    let text = serde_json::to_string(value)?;
    Ok(py.import("json")?.call_method1("loads", (text,))?)
}
