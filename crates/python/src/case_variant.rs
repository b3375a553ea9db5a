//! Variants of a case in memory, and pickled cases.

use std::sync::Arc;

use grainwake_run::case::{Case, ShapeFile};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::case::{DICT, PyCase, grain_store};
use crate::case_dict::override_list;
use crate::error::{Raise, input, refused_dict};
use crate::running::interruptible;
use crate::threads::detached;

/// Constructor of a pickled case and its arguments.
type Reduced<'py> = (Bound<'py, PyAny>, (String, Vec<(String, Bound<'py, PyBytes>)>, String));

#[pymethods]
impl PyCase {
    /// Vary the case in memory.
    ///
    /// Parameters
    /// ----------
    /// overrides : dict or sequence of str
    ///     As in `load`, on top of the overrides of this case. A `Grain` may stand for the file of
    ///     a grain, as in ``{"grain.0.file": pebble}``.
    ///
    /// Returns
    /// -------
    /// Case
    ///     The case as if it had been read with all overrides: defaults that depend on a changed
    ///     value change too. It keeps the grains of this case and needs none of their files.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The result is no case; the message names the override.
    ///
    /// Examples
    /// --------
    /// >>> import grainwake as gw
    /// >>> sphere = gw.Grain.sphere("2 mm")
    /// >>> case = gw.Case.new(
    /// ...     size=["8 mm", "8 mm", "16 mm"],
    /// ...     grains=[sphere.at(["4 mm", "4 mm", "12 mm"], density=2500)],
    /// ...     end="0.1 s",
    /// ... )
    /// >>> case.with_overrides({"time.end": "0.2 s"}).end
    /// 0.2
    fn with_overrides(&self, py: Python<'_>, overrides: &Bound<'_, PyAny>) -> PyResult<PyCase> {
        let store = grain_store()?;
        let set = override_list(Some(overrides), Some(store.path()))?;
        let case = interruptible(py, |stop| self.case.with_overrides(&set, stop))?;
        let case = match self.case.origin().name() == DICT {
            true => case.map_err(|error| refused_dict(&error)),
            false => case.raise(),
        };
        Ok(PyCase { case: case? })
    }

    #[staticmethod]
    fn _from_parts(
        py: Python<'_>,
        resolved: &str,
        grains: Vec<(String, Vec<u8>)>,
        origin: &str,
    ) -> PyResult<PyCase> {
        let grains = grains.into_iter().map(|(name, bytes)| (name, Arc::new(bytes))).collect();
        let case = detached(py, || Case::from_resolved(resolved, grains))?.raise()?;
        let origin = serde_json::from_str(origin).map_err(|error| input(error.to_string()))?;
        Ok(PyCase { case: case.with_origin(origin) })
    }

    /// Parts of a pickled case: its text with all defaults, its grain files by name, and the text
    /// and overrides that its variants are made from.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let (py, case) = (slf.py(), &slf.get().case);
        let file = |(name, bytes): &ShapeFile| (name.clone(), PyBytes::new(py, bytes));
        let grains = case.shapes.iter().map(file).collect();
        let origin = serde_json::to_string(case.origin());
        let origin =
            origin.map_err(|error| input(format!("the case cannot be pickled: {error}")))?;
        let rebuild = slf.get_type().getattr("_from_parts")?;
        Ok((rebuild, (case.resolved.clone(), grains, origin)))
    }
}
