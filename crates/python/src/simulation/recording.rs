//! Run folder of a simulation that Python steps.

use std::path::{Path, PathBuf};

use grainwake_formats::summary::EndReason;
use grainwake_run::case::Case;
use grainwake_run::number_format::quantity;
use grainwake_run::{Options, Recording, RunError, Watch};
use grainwake_solver::sim::{Simulation, StepError};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use rayon::ThreadPool;

use super::{Ended, PySimulation, changing, reading};
use crate::arguments::flags;
use crate::error::{IntoException, Raise, input, warn};
use crate::running::{command, existing};
use crate::threads::detached;

/// Name of this program in the provenance.
const PROGRAM: &str = "Python";

/// Failure of a step.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    /// Step in memory.
    #[error(transparent)]
    Step(#[from] StepError),
    /// Step into a run folder.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The case ends at this time [s].
    #[error(
        "the case ends at t = {}, and its run folder records nothing later: give it a later end",
        quantity(*.0, "s")
    )]
    End(f64),
}

impl IntoException for Failure {
    fn into_exception(self) -> PyErr {
        match self {
            Failure::Step(error) => error.into_exception(),
            Failure::Run(error) => error.into_exception(),
            Failure::End(_) => input(self.to_string()),
        }
    }
}

impl Failure {
    /// Returns the failure that ends the steps; `sound` says whether the state is that of the last
    /// step.
    pub(super) fn ended(&self, sound: bool) -> Ended {
        match self {
            Failure::Run(error @ RunError::Io { source, .. }) if sound => {
                Ended::Output(source.kind(), error.to_string())
            }
            other => Ended::Step(other.to_string()),
        }
    }
}

/// Takes one time step, and writes what is due.
pub(super) fn step(
    sim: &mut Simulation,
    recording: Option<&mut Recording>,
    watch: Option<&mut Watch>,
    horizon: f64,
) -> Result<(), Failure> {
    let Some(recording) = recording else {
        sim.step(horizon)?;
        if let Some(watch) = watch {
            watch.update(sim);
        }
        return Ok(());
    };
    if recording.at_end(sim) {
        return Err(Failure::End(sim.time()));
    }
    recording.step(sim, horizon)?;
    Ok(())
}

/// Returns the stop condition of the case, if it holds.
pub(super) fn stopped(
    sim: &Simulation,
    recording: Option<&Recording>,
    watch: Option<&Watch>,
) -> Option<EndReason> {
    recording.map_or_else(|| watch?.stopped(sim), |recording| recording.stopped(sim))
}

/// Opens a run folder and builds its simulation; `(resume, force)` treat an existing run.
pub(super) fn start(
    py: Python<'_>,
    case: &Case,
    folder: &Path,
    (resume, force): (bool, bool),
    threads: usize,
    pool: &ThreadPool,
) -> PyResult<(Simulation, Recording)> {
    let options = Options {
        existing: existing(resume, force)?,
        command: command(py)?,
        threads,
        controlled_from: Some(PROGRAM.into()),
        ..Options::default()
    };
    let job = case.job_in(folder, options.existing).raise()?;
    let mut notes: Vec<String> = Vec::new();
    let started = py.detach(|| {
        let mut note = |text: &str| notes.push(text.to_owned());
        pool.install(|| Recording::start(&job, folder, &options, &mut note))
    });
    warn(py, notes.into_iter().filter(|note| !note.starts_with("resuming")))?;
    started.raise()
}

impl PySimulation {
    /// Refuses to write into a run folder that is closed or was not given.
    fn may_write(&self) -> PyResult<()> {
        if self.output.is_none() {
            return Err(input("there is no run folder: give Simulation(case, output=\"runs/x\")"));
        }
        self.may_continue()
    }
}

#[pymethods]
impl PySimulation {
    /// Run folder; None without one.
    #[getter]
    fn output(slf: &Bound<'_, Self>) -> PyResult<Option<PathBuf>> {
        Ok(reading(slf)?.output.clone())
    }

    /// Write a checkpoint into the run folder, from which ``resume=True`` continues.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The simulation has no run folder, or the folder is closed.
    /// OSError
    ///     Writing failed.
    fn checkpoint(slf: &Bound<'_, Self>) -> PyResult<()> {
        let mut this = changing(slf)?;
        this.may_write()?;
        let PySimulation { pool, sim, recording, .. } = &mut *this;
        let Some(recording) = recording else { return Ok(()) };
        slf.py().detach(|| pool.install(|| recording.checkpoint(sim))).raise()
    }

    /// Write the last outputs and the summary, close the run folder, and draw the report.
    ///
    /// Parameters
    /// ----------
    /// report : bool, default True
    ///     Whether to draw the report.
    ///
    /// Returns
    /// -------
    /// RunFolder
    ///     The run folder.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The simulation has no run folder, or the folder is closed.
    /// SolverError
    ///     A step has failed.
    /// OSError
    ///     Writing failed; ``resume=True`` continues from the last checkpoint, and
    ///     `save_checkpoint` keeps the present state in another place.
    ///
    /// Notes
    /// -----
    /// The simulation can still be read, but not stepped. A run that is finished before the end of
    /// the case is continued by ``resume=True``.
    #[pyo3(signature = (*, report = true))]
    fn finish<'py>(
        slf: &Bound<'py, Self>,
        #[pyo3(from_py_with = flags::report)] report: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, mut this) = (slf.py(), changing(slf)?);
        this.may_write()?;
        let folder = this.output.clone();
        let PySimulation { pool, sim, recording, closed_by, failed, .. } = &mut *this;
        if let Some(recording) = recording.take() {
            *closed_by = recording.stopped(sim);
            let finished = py.detach(|| pool.install(|| recording.finish(sim)));
            if let Err(error) = finished {
                let error = Failure::Run(error);
                *failed = Some(error.ended(true));
                return Err(error).raise();
            }
        }
        drop(this);
        if let (true, Some(folder)) = (report, &folder) {
            detached(py, || grainwake_report::render(folder))?.raise()?;
        }
        py.import("grainwake._studies")?.call_method1("open", (folder,))
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Finishes the run folder; after an exception, writes a checkpoint and closes it.
    fn __exit__(
        slf: &Bound<'_, Self>,
        kind: &Bound<'_, PyAny>,
        _value: &Bound<'_, PyAny>,
        _traceback: &Bound<'_, PyAny>,
    ) -> PyResult<bool> {
        if reading(slf)?.recording.is_none() {
            return Ok(false);
        }
        if kind.is_none() {
            PySimulation::finish(slf, true)?;
            return Ok(false);
        }
        let written = PySimulation::checkpoint(slf);
        let mut this = changing(slf)?;
        this.closed_by = this.stopped();
        this.recording = None;
        if let Err(error) = &written
            && error.is_instance_of::<PyOSError>(slf.py())
        {
            let why = error.value(slf.py()).to_string();
            this.failed.get_or_insert(Ended::Output(std::io::ErrorKind::Other, why));
        }
        written.map(|()| false)
    }
}
