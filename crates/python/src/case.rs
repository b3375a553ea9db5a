//! `Case`: a validated case.

use std::path::PathBuf;

use grainwake_run::case::{Case, CaseError, schema};
use grainwake_run::number_format::number_of_grains;
use grainwake_run::threads::resolve;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arguments::{Whole, flags, whole};
use crate::arrays::json;
use crate::case_dict::{override_list, to_toml};
use crate::error::{IntoException, Raise, refused_dict, system};
use crate::grain::PyGrain;
use crate::running::interruptible;
use crate::{running, threads};

/// Name of the text of a dict in messages.
pub const DICT: &str = "dict";

/// Case: grains, fluid, box and outputs, read and validated.
///
/// A case is built by `load`, `from_toml`, `from_dict` or `new`. ``docs/reference/case-file.md``
/// lists the keys. Numbers are SI; strings carry their unit.
///
/// Examples
/// --------
/// >>> import grainwake as gw
/// >>> sphere = gw.Grain.sphere("2 mm")
/// >>> case = gw.Case.new(
/// ...     size=["8 mm", "8 mm", "16 mm"],
/// ...     cell_size="0.5 mm",
/// ...     fluid={"density": 1000, "viscosity": "1 mPa s"},
/// ...     grains=[sphere.at(["4 mm", "4 mm", "12 mm"], density="1500 kg/m3")],
/// ...     end="0.1 s",
/// ... )
/// >>> case.cells
/// (16, 16, 32)
#[pyclass(module = "grainwake", name = "Case", frozen, weakref)]
pub struct PyCase {
    pub case: Case,
}

impl PyCase {
    /// Returns the threads of a run: those given, or else those of the case.
    pub fn threads(&self, py: Python<'_>, given: Option<&Whole>) -> PyResult<usize> {
        threads::resolve(py, whole("threads", given, 0)?.unwrap_or(self.case.threads))
    }
}

#[pymethods]
impl PyCase {
    /// Read a case file.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     Case file in TOML.
    /// overrides : dict or sequence of str, optional
    ///     Values that replace those of the file, such as ``{"time.end": "0.5 s"}`` or
    ///     ``{"grain.0.density": 2600}``; None removes a key, so that its default applies. Or
    ///     strings ``"time.end=0.5 s"``, and ``"-time.step"`` for a key that is removed.
    ///
    /// Returns
    /// -------
    /// Case
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The contents are wrong; the message has file, line, key and remedy.
    /// FileNotFoundError
    ///     There is no such file.
    #[staticmethod]
    #[pyo3(signature = (path, overrides = None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        overrides: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyCase> {
        let set = override_list(overrides, None)?;
        let case = interruptible(py, |stop| Case::load_until(&path, &set, stop))?.raise()?;
        Ok(PyCase { case })
    }

    /// Read a case from text.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     Case in TOML.
    /// folder : path-like, default "."
    ///     Folder that grain files are relative to.
    /// overrides : dict or sequence of str, optional
    ///     As in `load`.
    /// name : str, default "case"
    ///     Name of the text in messages.
    ///
    /// Returns
    /// -------
    /// Case
    ///
    /// See Also
    /// --------
    /// with_overrides : another case with the grains of this one.
    #[staticmethod]
    #[pyo3(signature = (text, folder = PathBuf::from("."), overrides = None, *, name = "case"))]
    fn from_toml(
        py: Python<'_>,
        text: &str,
        folder: PathBuf,
        overrides: Option<&Bound<'_, PyAny>>,
        name: &str,
    ) -> PyResult<PyCase> {
        let set = override_list(overrides, None)?;
        let read = |stop: &_| Case::parse_until(text, name, &folder, &set, stop);
        let case = interruptible(py, read)?.map_err(without_files).raise()?;
        Ok(PyCase { case })
    }

    /// Build a case from a dict with the tables and keys of a case file.
    ///
    /// Parameters
    /// ----------
    /// tables : dict
    ///     Contents of the case. A `Grain` may stand for the file of a grain; NumPy numbers and
    ///     arrays are converted, and None leaves a key out.
    /// folder : path-like, default "."
    ///     Folder that grain files are relative to.
    /// overrides : dict or sequence of str, optional
    ///     As in `load`.
    ///
    /// Returns
    /// -------
    /// Case
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The contents are wrong; the message quotes the TOML form of the dict.
    #[staticmethod]
    #[pyo3(signature = (tables, folder = PathBuf::from("."), overrides = None))]
    pub fn from_dict(
        py: Python<'_>,
        tables: &Bound<'_, PyDict>,
        folder: PathBuf,
        overrides: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyCase> {
        let set = override_list(overrides, None)?;
        // The case keeps the contents of the grain files, so that the folder is not needed later.
        let store = grain_store()?;
        let text = to_toml(tables, store.path())?;
        let folder = std::path::absolute(&folder).unwrap_or(folder);
        let read = |stop: &_| Case::parse_until(&text, DICT, &folder, &set, stop);
        let case = interruptible(py, read)?;
        Ok(PyCase { case: case.map_err(|error| refused_dict(&error))? })
    }

    /// JSON schema of a case file.
    ///
    /// Returns
    /// -------
    /// dict
    #[staticmethod]
    fn schema(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        json(py, &schema())
    }

    /// Run the case and fill a run folder, as ``grainwake run`` does.
    ///
    /// Parameters
    /// ----------
    /// folder : path-like
    ///     Run folder; it is created.
    /// resume : bool, default False
    ///     Continue from the last checkpoint in the folder.
    /// force : bool, default False
    ///     Replace a run in the folder.
    /// start_from : path-like, optional
    ///     Start from a checkpoint of another run, "DIR" or "DIR@TIME": the newest one, or the
    ///     newest at or before the time.
    /// threads : int, optional
    ///     Threads; those of the case by default, 0 for all cores. They do not affect the results.
    /// report : bool, default True
    ///     Draw figures and ``report.html``.
    /// progress : bool or callable, optional
    ///     True shows a bar, False none; by default a bar in terminals and notebooks. A callable
    ///     receives a dict with time, end, start, steps, wall_s, dt, gap, phase and contacts.
    ///
    /// Returns
    /// -------
    /// RunFolder
    ///     Results of the run.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The folder holds another run.
    /// SolverError
    ///     The numerics failed; the last checkpoint is kept.
    /// OSError
    ///     Reading or writing failed.
    /// KeyboardInterrupt
    ///     The run was interrupted; a checkpoint was written, and ``resume=True`` continues.
    #[pyo3(signature = (folder, *, resume = false, force = false, start_from = None, threads = None, report = true, progress = None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        folder: PathBuf,
        #[pyo3(from_py_with = flags::resume)] resume: bool,
        #[pyo3(from_py_with = flags::force)] force: bool,
        start_from: Option<PathBuf>,
        threads: Option<Whole>,
        #[pyo3(from_py_with = flags::report)] report: bool,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let threads = self.threads(py, threads.as_ref())?;
        let existing = running::existing(resume, force)?;
        let parent = start_from.map(|from| running::parent(py, &self.case, &from)).transpose()?;
        running::run(py, &self.case, &folder, existing, parent, threads, progress)?;
        if report {
            threads::detached(py, || grainwake_report::render(&folder))?
                .map_err(IntoException::into_exception)?;
        }
        py.import("grainwake._studies")?.call_method1("open", (folder,))
    }

    /// Expected size, cost and warnings, with the names of ``grainwake check --json``.
    ///
    /// Parameters
    /// ----------
    /// threads : int, optional
    ///     Threads of the run.
    ///
    /// Returns
    /// -------
    /// dict
    #[pyo3(signature = (threads = None))]
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        threads: Option<Whole>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let threads = self.threads(py, threads.as_ref())?;
        json(py, &threads::detached(py, || self.case.estimate(threads))?)
    }

    /// Warnings about settings that impair the results.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let threads = resolve(self.case.threads, |_| {});
        Ok(threads::detached(py, || self.case.estimate(threads))?.warnings)
    }
    /// Title, one line.
    #[getter]
    fn title(&self) -> &str {
        &self.case.title
    }
    /// Case in TOML with all defaults written out. It names the grain files without their contents;
    /// `with_overrides` varies a case, and a pickled case holds its grains.
    #[getter]
    fn resolved(&self) -> &str {
        &self.case.resolved
    }
    /// Hash of everything that decides the results up to a given time.
    #[getter]
    fn digest(&self) -> &str {
        &self.case.digest
    }
    /// End of the run [s].
    #[getter]
    fn end(&self) -> f64 {
        self.case.plan.end
    }
    /// Cells along x, y, z.
    #[getter]
    fn cells(&self) -> (usize, usize, usize) {
        let [nx, ny, nz] = self.case.setup.mesh.cells;
        (nx, ny, nz)
    }
    /// Edges of a cell along x, y, z [m].
    #[getter]
    fn spacing(&self) -> (f64, f64, f64) {
        self.case.setup.mesh.spacing.into()
    }
    /// Edges of the box along x, y, z [m].
    #[getter]
    fn size(&self) -> (f64, f64, f64) {
        self.case.setup.mesh.extent().into()
    }
    /// Shapes of the grains.
    #[getter]
    fn grains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let grains = PyList::empty(py);
        for grain in &self.case.setup.grains {
            grains.append(Py::new(py, PyGrain::new(grain.shape.clone()))?)?;
        }
        Ok(grains)
    }
    fn __repr__(&self) -> String {
        let [nx, ny, nz] = self.case.setup.mesh.cells;
        let grains = number_of_grains(self.case.setup.grains.len());
        format!("Case({:?}, {grains}, {nx} x {ny} x {nz} cells)", self.case.title)
    }
}

/// Returns a folder for grains in memory. The case keeps the contents of its grain files, so that
/// the folder is not needed later.
pub fn grain_store() -> PyResult<tempfile::TempDir> {
    tempfile::tempdir().map_err(|error| system(error.kind(), error.to_string()))
}

/// Adds a remedy for text such as `Case.resolved`, which names grain files without their contents.
fn without_files(error: CaseError) -> CaseError {
    let CaseError::Invalid(mut problems) = error else { return error };
    for problem in &mut problems {
        if problem.message.starts_with("there is no grain file") {
            problem.help = Some(
                "grain files are relative to `folder`; the text of Case.resolved names them \
                 without their contents: vary a case with Case.with_overrides, or keep it with \
                 pickle"
                    .to_owned(),
            );
        }
    }
    CaseError::Invalid(problems)
}
