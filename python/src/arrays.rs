//! Arrays of numpy, and JSON as Python objects.

use crate::failure::Failure;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
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

/// The argument `name` as stamps, ns; an array of int64 is not copied.
pub fn stamps_ns<'py>(name: &str, value: &Bound<'py, PyAny>) -> Result<PyReadonlyArray1<'py, i64>, Failure> {
    let expected = "integers (nanoseconds) of shape (n,)";
    let array = checked(name, value, "iu", expected)?;
    let stamps = cast::<i64>(&array)?.cast_into::<PyArray1<i64>>();
    let stamps = stamps.map_err(|_| unexpected(name, expected, &array))?.readonly();
    // Only unsigned integers of 64 bits become other numbers.
    if kind(&array)? == "u" && stamps.as_array().iter().any(|stamp| *stamp < 0) {
        return Err(Failure::input(format!("{name}: a stamp exceeds the largest int64")));
    }
    Ok(stamps)
}

/// The argument `name` as rows of `columns` numbers; an array of `T` is not copied.
pub fn rows<'py, T: Element>(
    name: &str,
    value: &Bound<'py, PyAny>,
    columns: usize,
) -> Result<PyReadonlyArray2<'py, T>, Failure> {
    let expected = format!("numbers of shape (n, {columns})");
    let array = checked(name, value, "iuf", &expected)?;
    let rows = cast::<T>(&array)?.cast_into::<PyArray2<T>>().ok().map(|array| array.readonly());
    rows.filter(|rows| rows.as_array().ncols() == columns).ok_or_else(|| unexpected(name, &expected, &array))
}

/// The argument as an array, if numpy's letter for the kind of its type is one of `kinds`.
fn checked<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    kinds: &str,
    expected: &str,
) -> Result<Bound<'py, PyAny>, Failure> {
    let array = value.py().import("numpy")?.call_method1("asarray", (value,));
    let array = array.map_err(|error| Failure::input(format!("{name}: expected {expected}: {error}")))?;
    // An empty list becomes an array of floating-point numbers.
    let is_empty: bool = array.getattr("size")?.eq(0)?;
    if is_empty || kinds.contains(&kind(&array)?) { Ok(array) } else { Err(unexpected(name, expected, &array)) }
}

fn cast<'py, T: Element>(array: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = array.py();
    array.call_method("astype", (T::get_dtype(py),), Some(&[("copy", false)].into_py_dict(py)?))
}

/// Numpy's letter for the kind of the type of an array.
fn kind(array: &Bound<'_, PyAny>) -> PyResult<String> {
    array.getattr("dtype")?.getattr("kind")?.extract()
}

fn unexpected(name: &str, expected: &str, array: &Bound<'_, PyAny>) -> Failure {
    let attribute = |name: &str| array.getattr(name).map(|value| value.to_string()).unwrap_or_default();
    Failure::input(format!("{name}: expected {expected}, got {} of shape {}", attribute("dtype"), attribute("shape")))
}

/// A value of the library as dictionaries, lists and numbers of Python; what is not known is `None`.
pub fn as_python<'py>(py: Python<'py>, value: &impl Serialize) -> Result<Bound<'py, PyAny>, Failure> {
    let text = serde_json::to_string(value)?;
    Ok(py.import("json")?.call_method1("loads", (text,))?)
}
