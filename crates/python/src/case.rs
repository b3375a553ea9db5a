//! `Case`: a validated case.

use std::path::PathBuf;
use std::sync::Arc;

use grainwake_run::case::{Case, ShapeFile, schema};
use grainwake_run::number_format::number_of_grains;
use grainwake_run::threads::resolve;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyString};

use crate::arguments::{Whole, whole};
use crate::arrays::json;
use crate::case_dict::{override_list, to_toml};
use crate::error::{IntoException, Raise, input, refused_dict, system};
use crate::grain::PyGrain;
use crate::{running, threads};

/// Constructor of a pickled case and its arguments.
type Reduced<'py> = (Bound<'py, PyAny>, (String, Vec<(String, Bound<'py, PyBytes>)>));

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
        let set = override_list(overrides)?;
        let case = py.detach(|| Case::load(&path, &set)).raise()?;
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
    #[staticmethod]
    #[pyo3(signature = (text, folder = PathBuf::from("."), overrides = None, *, name = "case"))]
    fn from_toml(
        py: Python<'_>,
        text: &str,
        folder: PathBuf,
        overrides: Option<&Bound<'_, PyAny>>,
        name: &str,
    ) -> PyResult<PyCase> {
        let set = override_list(overrides)?;
        let case = py.detach(|| Case::parse(text, name, &folder, &set)).raise()?;
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
    fn from_dict(
        py: Python<'_>,
        tables: &Bound<'_, PyDict>,
        folder: PathBuf,
        overrides: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyCase> {
        let set = override_list(overrides)?;
        // The case keeps the contents of the grain files, so that the folder is not needed later.
        let store = tempfile::tempdir().map_err(|e| system(e.kind(), e.to_string()))?;
        let text = to_toml(tables, store.path())?;
        let folder = std::path::absolute(&folder).unwrap_or(folder);
        let case = py.detach(|| Case::parse(&text, "dict", &folder, &set));
        Ok(PyCase { case: case.map_err(|error| refused_dict(&error))? })
    }

    /// Build a case from the values that are given most often.
    ///
    /// Parameters
    /// ----------
    /// size : sequence of float or str
    ///     Edge lengths of the box [m].
    /// cell_size : float, str or sequence
    ///     Edge of a cell [m], one or one per axis.
    /// refinement : int, optional
    ///     2 halves the cells in a box that follows the grains; 1 by default.
    /// refinement_margin : float, str or sequence, optional
    ///     Least distance from the grains to the sides of that box [m], one or one per axis; 0.4
    ///     equivalent diameters by default.
    /// end : float or str
    ///     End of the run [s].
    /// grains : sequence of dict, default ()
    ///     Entries of the list ``grain``, such as those of `Grain.at`.
    /// fluid : dict, optional
    ///     Table ``fluid``: density and viscosity or kinematic_viscosity. Without it the run is
    ///     dry.
    /// gravity : sequence of float or str, optional
    ///     Gravity [m/s2]; (0, 0, -9.81) by default.
    /// boundaries : dict, optional
    ///     Table ``domain.boundaries``; walls by default.
    /// title : str, optional
    ///     One line that says what the case is.
    /// folder : path-like, default "."
    ///     Folder that grain files are relative to.
    /// **tables
    ///     Further tables: contact, coupling, output, run, expect, and the lists packing, poses
    ///     and probe; a dict ``time`` is joined with `end`.
    ///
    /// Returns
    /// -------
    /// Case
    #[staticmethod]
    #[pyo3(signature = (*, size, cell_size, end, refinement = None, refinement_margin = None, grains = None, fluid = None, gravity = None, boundaries = None, title = None, folder = PathBuf::from("."), **tables))]
    fn new(
        py: Python<'_>,
        size: &Bound<'_, PyAny>,
        cell_size: &Bound<'_, PyAny>,
        end: &Bound<'_, PyAny>,
        refinement: Option<Whole>,
        refinement_margin: Option<&Bound<'_, PyAny>>,
        grains: Option<&Bound<'_, PyAny>>,
        fluid: Option<&Bound<'_, PyAny>>,
        gravity: Option<&Bound<'_, PyAny>>,
        boundaries: Option<&Bound<'_, PyAny>>,
        title: Option<&str>,
        folder: PathBuf,
        tables: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyCase> {
        let domain = PyDict::new(py);
        domain.set_item("size", size)?;
        domain.set_item("cell_size", cell_size)?;
        domain.set_item("refinement", whole::<i64>("refinement", refinement.as_ref(), 1)?)?;
        domain.set_item("refinement_margin", refinement_margin)?;
        domain.set_item("boundaries", boundaries)?;
        let time = PyDict::new(py);
        time.set_item("end", end)?;
        let all = PyDict::new(py);
        all.set_item("title", title)?;
        all.set_item("gravity", gravity)?;
        all.set_item("fluid", fluid)?;
        all.set_item("domain", domain)?;
        all.set_item("grain", grains)?;
        for (name, table) in tables.into_iter().flatten() {
            match name.cast::<PyString>()?.to_str()? {
                "domain" => {
                    let message = "domain: its keys are arguments of their own, such as size; a \
                                   case with other keys is made by from_dict";
                    return Err(input(message));
                }
                "grain" if grains.is_some() => {
                    return Err(input("grain: found beside grains; give one of them"));
                }
                "time" => match table.cast::<PyDict>() {
                    Ok(more) if more.contains("end")? => {
                        return Err(input("time.end: found beside end; give one of them"));
                    }
                    Ok(more) => time.update(more.as_mapping())?,
                    Err(_) => {
                        let found = table.get_type().name()?;
                        return Err(input(format!(
                            "time: found a value of type {found}; expected a dict"
                        )));
                    }
                },
                _ => all.set_item(name, table)?,
            }
        }
        all.set_item("time", time)?;
        PyCase::from_dict(py, &all, folder, None)
    }

    #[staticmethod]
    fn _from_parts(
        py: Python<'_>,
        resolved: &str,
        grains: Vec<(String, Vec<u8>)>,
    ) -> PyResult<PyCase> {
        let grains = grains.into_iter().map(|(name, bytes)| (name, Arc::new(bytes))).collect();
        let case = py.detach(|| Case::from_resolved(resolved, grains)).raise()?;
        Ok(PyCase { case })
    }

    /// Parts of a pickled case: its text with all defaults, and its grain files by name.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let (py, case) = (slf.py(), &slf.get().case);
        let file = |(name, bytes): &ShapeFile| (name.clone(), PyBytes::new(py, bytes));
        let grains = case.shapes.iter().map(file).collect();
        Ok((slf.get_type().getattr("_from_parts")?, (case.resolved.clone(), grains)))
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
        resume: bool,
        force: bool,
        start_from: Option<PathBuf>,
        threads: Option<Whole>,
        report: bool,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let threads = self.threads(py, threads.as_ref())?;
        let existing = running::existing(resume, force)?;
        let parent = start_from.map(|from| running::parent(py, &self.case, &from)).transpose()?;
        running::run(py, &self.case, &folder, existing, parent, threads, progress)?;
        if report {
            py.detach(|| grainwake_report::render(&folder))
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
        json(py, &self.case.estimate(threads))
    }

    /// Warnings about settings that impair the results.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.case.estimate(resolve(self.case.threads, |_| {})).warnings
    }
    /// Title, one line.
    #[getter]
    fn title(&self) -> &str {
        &self.case.title
    }
    /// Case in TOML with all defaults written out.
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
