//! Arrays for Python.

use glam::DVec3;
use numpy::ndarray::{Array1, Array2, Dimension};
use numpy::{Element, IntoPyArray, PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// Returns vectors as an array of the shape (n, 3).
pub fn vectors<'py>(
    py: Python<'py>,
    items: impl ExactSizeIterator<Item = DVec3>,
) -> Bound<'py, PyArray2<f64>> {
    rows(py, items.map(|v| v.to_array()))
}

/// Returns rows as an array of the shape (n, N).
pub fn rows<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    items: impl ExactSizeIterator<Item = [T; N]>,
) -> Bound<'py, PyArray2<T>> {
    let count = items.len();
    let flat: Vec<T> = items.flatten().collect();
    let array = Array2::from_shape_vec((count, N), flat);
    array.unwrap_or_else(|_| unreachable!("the iterator has its length")).into_pyarray(py)
}

/// Returns numbers as an array of the shape (n,).
pub fn numbers<T: numpy::Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    Array1::from_vec(values).into_pyarray(py)
}

/// Returns an array whose values can no longer be changed: that of a copy would have no effect.
pub fn read_only<'py, T: Element, D: Dimension>(
    array: Bound<'py, PyArray<T, D>>,
) -> Bound<'py, PyArray<T, D>> {
    array.readwrite().make_nonwriteable();
    array
}

/// Returns a serialisable value as the Python object of its JSON.
pub fn json<'py>(py: Python<'py>, value: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value)
        .map_err(|error| crate::error::input(format!("a value cannot be converted: {error}")))?;
    py.import("json")?.call_method1("loads", (text,))
}
