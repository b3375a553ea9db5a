//! Conditions under which a simulation may be used: by one thread, in its process, not after a
//! failure, not while arrays show its fields.

use std::sync::atomic::Ordering;

use pyo3::exceptions::{PyBufferError, PyRuntimeError};
use pyo3::prelude::*;

use super::PySimulation;
use crate::error::{input, numerics, system};

/// Message of a simulation whose run folder is closed.
const CLOSED: &str = "the run folder is closed: continue it with Simulation(case, output=..., \
                      resume=True), and a later end if the case had ended";

/// Message of a simulation that another thread uses.
const IN_USE: &str = "the simulation is in use by another call, such as a step in another thread: \
                      only one thread may use a simulation at a time";

/// Message of a simulation in a process made by `fork`.
const FORKED: &str = "the simulation belongs to the parent process, and its threads do not exist in \
                      a process made by fork: use the start method \"spawn\" of multiprocessing, \
                      pass the Case and build the simulation in the worker";

/// Failure that ended the steps of a simulation.
pub(super) enum Ended {
    /// The numerics failed: the state is not sound.
    Step(String),
    /// The run folder could not be written: the state is that of the last step.
    Output(std::io::ErrorKind, String),
}

impl Ended {
    /// Returns the exception of a further use.
    fn exception(&self) -> PyErr {
        match self {
            Ended::Step(why) => numerics(format!("{why}\nThe simulation cannot be continued.")),
            Ended::Output(kind, why) => system(
                *kind,
                format!(
                    "{why}\nThe run folder is closed. save_checkpoint keeps the present state in \
                     another place, for restore_checkpoint of a simulation without a folder; \
                     Simulation(case, output=..., resume=True) continues from the last checkpoint \
                     of the folder."
                ),
            ),
        }
    }
}

/// Returns a simulation to be read; refuses while another thread changes it.
pub(super) fn reading<'py>(slf: &Bound<'py, PySimulation>) -> PyResult<PyRef<'py, PySimulation>> {
    slf.try_borrow().map_err(|_| PyRuntimeError::new_err(IN_USE))
}

/// Returns a simulation to be read by its threads, which a process made by `fork` lacks: they would
/// never answer.
pub(super) fn computing<'py>(slf: &Bound<'py, PySimulation>) -> PyResult<PyRef<'py, PySimulation>> {
    let this = reading(slf)?;
    if this.process == std::process::id() { Ok(this) } else { Err(PyRuntimeError::new_err(FORKED)) }
}

/// Returns a simulation to be changed; refuses while another thread uses it, and in a process made
/// by `fork`.
pub(super) fn changing<'py>(
    slf: &Bound<'py, PySimulation>,
) -> PyResult<PyRefMut<'py, PySimulation>> {
    let this = slf.try_borrow_mut().map_err(|_| PyRuntimeError::new_err(IN_USE))?;
    if this.process == std::process::id() { Ok(this) } else { Err(PyRuntimeError::new_err(FORKED)) }
}

impl PySimulation {
    /// Refuses a change of the fields that arrays show, or after a failed step.
    pub(super) fn may_change(&self) -> PyResult<()> {
        self.may_continue()?;
        self.has_no_views()
    }

    /// Refuses a change of the fields that arrays show.
    pub(super) fn has_no_views(&self) -> PyResult<()> {
        match self.views.load(Ordering::Acquire) {
            0 => Ok(()),
            count => {
                let (noun, verb) = if count == 1 { ("array", "shows") } else { ("arrays", "show") };
                Err(PyBufferError::new_err(format!(
                    "{count} {noun} still {verb} the velocity or pressure of the present step: copy \
                     what is needed later (array.copy()) and delete the arrays before the next step"
                )))
            }
        }
    }

    /// Refuses to use a state that failed numerics have left.
    pub(super) fn is_sound(&self) -> PyResult<()> {
        match &self.failed {
            Some(failed @ Ended::Step(_)) => Err(failed.exception()),
            Some(Ended::Output(..)) | None => Ok(()),
        }
    }

    /// Refuses to use a simulation that has failed or whose run folder is closed.
    pub(super) fn may_continue(&self) -> PyResult<()> {
        if let Some(failed) = &self.failed {
            return Err(failed.exception());
        }
        if self.output.is_some() && self.recording.is_none() {
            return Err(input(CLOSED));
        }
        Ok(())
    }
}
