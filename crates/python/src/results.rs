//! Files of run folders and study folders, read by the libraries.

use std::path::PathBuf;

use grainwake_formats::{events, grains, pvd, summary, table::Table, vti, vtp};
use grainwake_report::ReportError;
use grainwake_report::run_folder::RunFolder;
use grainwake_run::case::quantity::Time;
use grainwake_run::provenance::Provenance;
use grainwake_study::Plan;
use numpy::IntoPyArray;
use numpy::ndarray::{Array, IxDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::quantity;
use crate::arrays::{json, numbers, rows, vectors};
use crate::error::{IntoException, Raise, input, system};
use crate::threads::detached;

/// Content of a table, and notes on unfinished lines.
type Content<'py> = (Bound<'py, PyDict>, Vec<String>);

/// Columns of a table of numbers by name.
#[pyfunction]
pub fn _read_table(py: Python<'_>, path: PathBuf) -> PyResult<Content<'_>> {
    let mut notes = Vec::new();
    let table = py.detach(|| Table::read(&path, &mut notes)).raise()?;
    let columns = PyDict::new(py);
    for name in table.names() {
        let values = table.column(name).unwrap_or_default().to_vec();
        columns.set_item(name, numbers(py, values))?;
    }
    Ok((columns, notes))
}

/// Columns of `grains.csv`, checked as the report does.
#[pyfunction]
pub fn _read_grains(py: Python<'_>, path: PathBuf) -> PyResult<Content<'_>> {
    // The rows are checked for damage; the columns keep the order of the file.
    py.detach(|| grains::read(&path, &mut Vec::new())).raise()?;
    _read_table(py, path)
}

/// Events in order of time as dicts.
#[pyfunction]
pub fn _read_events(py: Python<'_>, path: PathBuf) -> PyResult<(Bound<'_, PyAny>, Vec<String>)> {
    let mut notes = Vec::new();
    let events = events::read(&path, &mut notes).raise()?;
    Ok((json(py, &events)?, notes))
}

/// Entries (time, group, file) of a collection.
#[pyfunction]
pub fn _read_collection(path: PathBuf) -> PyResult<Vec<(f64, String, String)>> {
    let entries = pvd::read(&path)
        .map_err(|what| input(format!("{} could not be read ({what})", path.display())))?;
    Ok(entries.into_iter().map(|entry| (entry.time, entry.group, entry.file)).collect())
}

/// Image of a slice or field: time, cells, spacing, origin and arrays of the shape (z, y, x) or
/// (z, y, x, components).
#[pyfunction]
pub fn _read_image(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let image =
        py.detach(|| vti::read(&path)).map_err(|error| system(error.kind(), error.to_string()))?;
    let [nx, ny, nz] = image.frame.cells;
    let arrays = PyDict::new(py);
    for array in image.arrays {
        let mut shape = vec![nz, ny, nx];
        if array.components > 1 {
            shape.push(array.components);
        }
        let values = Array::from_shape_vec(IxDyn(&shape), array.data)
            .map_err(|error| input(format!("{}: {error}", path.display())))?;
        arrays.set_item(array.name, values.into_pyarray(py))?;
    }
    let content = PyDict::new(py);
    content.set_item("time", image.frame.time)?;
    content.set_item("cells", (nx, ny, nz))?;
    content.set_item("spacing", <(f64, f64, f64)>::from(image.frame.spacing))?;
    content.set_item("origin", <(f64, f64, f64)>::from(image.frame.origin))?;
    content.set_item("arrays", arrays)?;
    Ok(content)
}

/// Surfaces of grains: time, points, triangles, and velocity and grain where the file has them.
#[pyfunction]
pub fn _read_surface(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let surface = py
        .detach(|| vtp::read(&path))
        .map_err(|what| input(format!("{} could not be read: {what}", path.display())))?;
    let content = PyDict::new(py);
    content.set_item("time", surface.time)?;
    content.set_item("points", vectors(py, surface.points.into_iter()))?;
    let corners = surface.triangles.into_iter().map(|face| face.map(|v| v as i64));
    content.set_item("triangles", rows(py, corners))?;
    content.set_item("velocity", surface.velocity.map(|v| vectors(py, v.into_iter())))?;
    let owners = |grains: Vec<usize>| numbers(py, grains.iter().map(|g| *g as i64).collect());
    content.set_item("grain", surface.grains.map(owners))?;
    Ok(content)
}

/// Writes the figures and the page of a run folder or a study folder; returns the page and notes.
#[pyfunction]
pub fn _render(py: Python<'_>, folder: PathBuf) -> PyResult<(PathBuf, Vec<String>)> {
    detached(py, || {
        if Plan::exists_in(&folder) {
            let done = grainwake_study::render(&folder).map_err(IntoException::into_exception)?;
            return Ok((done.page, done.notes));
        }
        let done = grainwake_report::render(&folder)
            .map_err(|error: ReportError| error.into_exception())?;
        Ok((done.page, done.notes))
    })?
}

/// Missing, unfinished or damaged parts of a run folder.
#[pyfunction]
pub fn _run_notes(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<String>> {
    let opened = py.detach(|| RunFolder::open(&folder));
    let mut notes = match opened {
        Ok(run) => run.notes,
        Err(error @ ReportError::NotARun(_)) => return Err(error.into_exception()),
        // The other parts can still be read.
        Err(error) => vec![error.to_string()],
    };
    if !folder.join(summary::FILE).is_file() {
        notes.push("summary.json is missing: the run has not finished".to_owned());
    }
    if let Some(provenance) = Provenance::read(&folder) {
        let own = env!("CARGO_PKG_VERSION");
        if version(&provenance.version) > version(own) {
            notes.push(format!(
                "the run was made by version {}, this is version {own}: update the package",
                provenance.version
            ));
        }
    }
    Ok(notes)
}

/// Returns the numbers of a version, "0.1.0" -> [0, 1, 0].
fn version(text: &str) -> Vec<u64> {
    text.split('.').map(|part| part.parse().unwrap_or(0)).collect()
}

/// Time in seconds of a number or a string with a unit.
#[pyfunction]
pub fn _seconds(time: &Bound<'_, PyAny>) -> PyResult<f64> {
    quantity::<Time>("time", time)
}
