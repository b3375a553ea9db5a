//! `Study`: many runs of one case.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, Ordering};

use grainwake_run::{FailureKind, Progress};
use grainwake_study::{
    Options, Outcome, Plan, Selection, Study, StudyObserver, execute, records, refuse_to_replace,
    write_tables,
};
use pyo3::prelude::*;

use crate::arguments::flags;
use crate::arrays::json;
use crate::case_dict::override_list;
use crate::error::{Raise, input, numerics, refused, system, warn};
use crate::running::check_progress;
use crate::{running, threads};

/// Study: the runs of a study file.
#[pyclass(module = "grainwake", name = "Study", frozen)]
pub struct PyStudy {
    plan: Plan,
}

/// State of a study that its thread shares with that of Python.
#[derive(Default)]
struct Shared {
    /// Runs that have ended.
    ended: usize,
    messages: Vec<String>,
}

/// Observer that collects messages for the thread of Python.
struct Relay<'a> {
    plan: &'a Plan,
    shared: &'a Mutex<Shared>,
    stop: &'a AtomicBool,
}

impl Relay<'_> {
    fn tell(&self, run: usize, text: &str, ended: bool) {
        let message = format!("{}: {text}", self.plan.runs[run].name);
        let mut shared = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        shared.messages.push(message);
        shared.ended += usize::from(ended);
    }
}

impl StudyObserver for Relay<'_> {
    fn progress(&self, _: usize, _: &Progress) {}
    fn note(&self, run: usize, text: &str) {
        self.tell(run, text, false);
    }
    fn ended(&self, run: usize, outcome: &Outcome) {
        let text = match outcome {
            Outcome::Finished(_) => "finished",
            Outcome::AlreadyFinished => "had finished",
            Outcome::Failed(why, _) => why.lines().next().unwrap_or("failed"),
            Outcome::Interrupted => "interrupted",
            Outcome::Locked => "locked by another program",
        };
        self.tell(run, text, true);
    }
    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

#[pymethods]
impl PyStudy {
    /// Read a study file and expand its runs.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     Study file in TOML; ``docs/reference/study-file.md`` lists its keys.
    /// overrides : dict or sequence of str, optional
    ///     Values that replace those of the cases of all runs, as in `Case.load`.
    ///
    /// Returns
    /// -------
    /// Study
    #[staticmethod]
    #[pyo3(signature = (path, overrides = None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        overrides: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyStudy> {
        let set = override_list(overrides, None)?;
        let read = |stop: &_| Plan::resolve_until(&Study::read(&path)?, &set, stop);
        let plan = running::interruptible(py, read)?.raise()?;
        warn(py, plan.note_on_equal_runs())?;
        Ok(PyStudy { plan })
    }

    /// Execute the runs in a study folder; finished runs are kept, interrupted ones are resumed.
    ///
    /// Parameters
    /// ----------
    /// folder : path-like
    ///     Study folder; it is created.
    /// only : str, optional
    ///     Runs to execute, as for ``grainwake study --only``: names with ``*``, ``?`` and sets,
    ///     separated by commas, or ``"i/N"``, the i-th of N equal shares.
    /// jobs : int, default 1
    ///     Runs at once.
    /// threads : int, default 0
    ///     Threads of each run; 0 shares all cores among the jobs.
    /// retry : bool, default False
    ///     Restart failed runs.
    /// keep_checkpoints : bool, default False
    ///     Keep the checkpoints of finished runs.
    /// accept : list of str, optional
    ///     Commits of other programs whose finished runs count, 12 hexadecimal digits each.
    /// force : bool, default False
    ///     Replace finished runs in the folder whose case or end is another one.
    /// progress : bool or callable, optional
    ///     True shows a bar over the runs, False none; a callable receives a dict with done, runs
    ///     and messages.
    ///
    /// Returns
    /// -------
    /// StudyFolder
    ///     Results of the study.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The folder holds finished runs of other overrides, which `force` would replace; the
    ///     message names them, and nothing has changed.
    /// CaseError, SolverError, OSError
    ///     A run failed; the message lists the failed runs, the others are finished.
    /// KeyboardInterrupt
    ///     The study was interrupted; the same call continues it.
    #[pyo3(signature = (folder, *, only = None, jobs = 1, threads = 0, retry = false, keep_checkpoints = false, accept = None, force = false, progress = None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        folder: PathBuf,
        only: Option<&str>,
        #[pyo3(from_py_with = crate::arguments::jobs)] jobs: usize,
        #[pyo3(from_py_with = crate::arguments::threads)] threads: usize,
        #[pyo3(from_py_with = flags::retry)] retry: bool,
        #[pyo3(from_py_with = flags::keep_checkpoints)] keep_checkpoints: bool,
        accept: Option<Vec<String>>,
        #[pyo3(from_py_with = flags::force)] force: bool,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        check_progress(py, progress)?;
        let plan = self.plan.clone().accepting(&accept.unwrap_or_default());
        let plan = &plan.map_err(|problem| refused(&[problem]))?;
        let selection = only.map_or(Ok(Selection::All), Selection::parse);
        let chosen = selection
            .and_then(|selection| selection.choose(&plan.runs))
            .map_err(|problem| refused(&[problem]))?;
        let jobs = jobs.clamp(1, chosen.len().max(1));
        let (jobs, each) = threads::share(py, jobs, threads)?;
        if !force {
            plan.check_folder(&folder).raise()?;
            refuse_to_replace(&plan.runs, &chosen, &folder).raise()?;
        }
        plan.create_folder(&folder).raise()?;
        let options = Options {
            jobs,
            threads: each,
            retry,
            keep_checkpoints,
            command: running::command(py)?,
        };
        let (shared, stop) = (Mutex::new(Shared::default()), AtomicBool::new(false));
        let display =
            py.import("grainwake._progress")?.call_method1("of_study", (progress, chosen.len()))?;
        let work = || {
            let relay = Relay { plan, shared: &shared, stop: &stop };
            execute(&plan.runs, &chosen, &folder, &options, &relay)
        };
        let show = |_: Python<'_>| -> PyResult<()> {
            let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
            let (new, ended) = (std::mem::take(&mut shared.messages), shared.ended);
            drop(shared);
            if new.is_empty() {
                return Ok(());
            }
            display.call_method1("update", (new, ended)).map(drop)
        };
        let ended = running::attended(py, &stop, work, show);
        display.call_method0("close")?;
        let (outcomes, raised) = ended?;
        let outcomes = outcomes.raise()?;
        py.detach(|| write_tables(&records(plan, &folder)?, &folder)).raise()?;
        match raised {
            Some(error) => Err(error),
            None => failures(plan, &outcomes),
        }?;
        py.import("grainwake._studies")?.call_method1("open", (folder,))
    }

    #[staticmethod]
    fn _from_json(plan: &str) -> PyResult<PyStudy> {
        let plan = serde_json::from_str(plan).map_err(|error| input(error.to_string()))?;
        Ok(PyStudy { plan })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let plan = serde_json::to_string(&slf.get().plan);
        let plan = plan.map_err(|error| input(format!("the study cannot be pickled: {error}")))?;
        Ok((slf.get_type().getattr("_from_json")?, (plan,)))
    }

    /// Title of the study, one line.
    #[getter]
    fn title(&self) -> &str {
        &self.plan.title
    }
    /// Names of the runs.
    #[getter]
    fn runs(&self) -> Vec<&str> {
        self.plan.runs.iter().map(|run| run.name.as_str()).collect()
    }
    /// Runs with base case, overrides, estimated memory and wall time, as a list of dicts.
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, &self.plan.runs)
    }
    fn __len__(&self) -> usize {
        self.plan.runs.len()
    }
    fn __repr__(&self) -> String {
        format!("Study({:?}, {} runs)", self.plan.title, self.plan.runs.len())
    }
}

/// Raises the exception of the worst failure.
fn failures(plan: &Plan, ended: &[(usize, Outcome)]) -> PyResult<()> {
    let failed: Vec<(usize, &str, FailureKind)> = ended
        .iter()
        .filter_map(|(run, outcome)| match outcome {
            Outcome::Failed(why, kind) => Some((*run, why.as_str(), *kind)),
            _ => None,
        })
        .collect();
    let Some(worst) = failed.iter().map(|(.., kind)| *kind).max() else {
        return Ok(());
    };
    let lines: Vec<String> =
        failed.iter().map(|(run, why, _)| format!("{}: {why}", plan.runs[*run].name)).collect();
    let message = format!(
        "{} of {} runs failed:\n{}\nthe other runs are finished; retry=True restarts failed runs",
        failed.len(),
        ended.len(),
        lines.join("\n")
    );
    Err(match worst {
        FailureKind::Input => input(message),
        FailureKind::Computation => numerics(message),
        FailureKind::InputOutput => system(std::io::ErrorKind::Other, message),
    })
}

/// Runs of a study folder as written in its plan, as dicts.
#[pyfunction]
pub fn _read_plan(py: Python<'_>, folder: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let (plan, damage) = Plan::read_or_rebuild(&folder).raise()?;
    warn(py, damage)?;
    json(py, &plan)
}

/// Measured values of all runs of a study folder, as dicts.
#[pyfunction]
pub fn _read_records(py: Python<'_>, folder: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let rows = py
        .detach(|| Plan::read_or_rebuild(&folder).and_then(|(plan, _)| records(&plan, &folder)))
        .raise()?;
    json(py, &rows)
}
