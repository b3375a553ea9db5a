//! `Simulation`: steps a case in memory, or into a run folder.

mod checkpoint;
mod control;
mod fields;
mod guard;
mod recording;
mod state;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
use std::time::{Duration, Instant};

use grainwake_formats::summary::EndReason;
use grainwake_run::case::Case;
use grainwake_run::case::quantity::Time;
use grainwake_run::number_format::{number_of_grains, quantity as seconds};
use grainwake_run::{Recording, Watch, admit_memory};
use grainwake_solver::sim::{SAME_TIME, Simulation};
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::arguments::{Whole, flags, quantity};
use crate::case::PyCase;
use crate::error::{Raise, input, warn};
use crate::running::check_progress;
use crate::threads;
use guard::{Ended, changing, computing, reading};
use recording::{Failure, stopped};

/// Wall time after which signals are handled.
const INTERVAL: Duration = Duration::from_millis(50);

/// Simulation of a case, step by step, with grains that can be controlled between the steps.
///
/// Parameters
/// ----------
/// case : Case
///     The case.
/// threads : int, optional
///     Threads; those of the case by default, 0 for all cores. They do not affect the results.
/// output : path-like, optional
///     Run folder for the outputs of the case: tables, VTK files, events, checkpoints. Nothing is
///     written by default.
/// resume : bool, default False
///     Continue from the last checkpoint in the folder. Loads and prescribed motions are not part
///     of it: set them again.
/// force : bool, default False
///     Replace the run in the folder.
///
/// Raises
/// ------
/// CaseError
///     The folder holds another run, a finished one, or the run of another case.
/// OSError
///     Reading or writing failed.
///
/// RuntimeError
///     Another thread uses the simulation; each of its methods and attributes may raise this. Or
///     the process was made by ``fork`` from that of the simulation; see Notes.
///
/// Warns
/// -----
/// CaseWarning
///     Settings of the case impair the results, as in `Case.warnings`.
///
/// Notes
/// -----
/// The global interpreter lock is released during steps. Only one thread may use a simulation at a
/// time, also to read it. Ctrl-C raises ``KeyboardInterrupt`` after a step, and the simulation can
/// be continued.
///
/// A process made by ``fork`` can read the arrays of the grains, but all else raises RuntimeError:
/// the threads of the solver are those of its parent.
///
/// With `output`, steps end at the output times of the case as well. If nothing is controlled and
/// no other times are asked for, the results are those of `Case.run`. Steps beyond the end of the
/// case are refused. Call `finish` at the end, or use a ``with`` block: it calls `finish`, or after
/// an exception `checkpoint`. The folder is locked until then. If the folder cannot be written,
/// further steps repeat the ``OSError``, and `save_checkpoint` keeps the state in another place.
///
/// A stop condition of the case (``time.stop``) ends `run`; `ended` tells loops of your own.
///
/// Examples
/// --------
/// >>> import grainwake as gw
/// >>> case = gw.Case.new(
/// ...     size=["4 mm", "4 mm", "8 mm"],
/// ...     cell_size="0.25 mm",
/// ...     grains=[gw.Grain.sphere("1 mm").at(["2 mm", "2 mm", "6 mm"], density=2500)],
/// ...     end="10 ms",
/// ... )
/// >>> sim = gw.Simulation(case)
/// >>> for state in sim.run(every="5 ms", progress=False):
/// ...     print(f"{state.time:.3f} s  {state.velocities[0, 2]:.3f} m/s")
/// 0.000 s  0.000 m/s
/// 0.005 s  -0.049 m/s
/// 0.010 s  -0.098 m/s
#[pyclass(module = "grainwake", name = "Simulation", weakref)]
pub struct PySimulation {
    sim: Simulation,
    /// Open run folder.
    recording: Option<Recording>,
    /// Watch of the stop condition of a simulation in memory, if the case has one.
    watch: Option<Watch>,
    /// Stop condition that held when the run folder was closed.
    closed_by: Option<EndReason>,
    /// Path of the run folder, open or closed.
    output: Option<PathBuf>,
    case: Py<PyCase>,
    pool: Arc<ThreadPool>,
    /// Number of arrays that show the fields.
    views: Arc<AtomicUsize>,
    /// Failure that ended the steps.
    failed: Option<Ended>,
    /// Process that made the threads.
    process: u32,
}

/// Returns the watch of the stop condition of a simulation in memory, if the case has one.
fn watch(case: &Case, sim: &Simulation) -> Option<Watch> {
    case.plan.stop.map(|stop| Watch::new(&case.setup, sim, Some(stop)))
}

impl PySimulation {
    /// Returns the stop condition of the case, if it holds.
    fn stopped(&self) -> Option<EndReason> {
        stopped(&self.sim, self.recording.as_ref(), self.watch.as_ref()).or(self.closed_by)
    }

    /// Takes steps until `horizon` returns no time for another one [s], and handles signals between
    /// them. `horizon` gets the simulation and whether its stop condition holds.
    fn advance(
        &mut self,
        py: Python<'_>,
        mut horizon: impl FnMut(&Simulation, bool) -> Option<f64> + Send,
    ) -> PyResult<()> {
        self.may_change()?;
        loop {
            let (pool, sim) = (self.pool.clone(), &mut self.sim);
            let (recording, watch) = (&mut self.recording, &mut self.watch);
            let taken = py.detach(|| {
                let started = Instant::now();
                pool.install(|| {
                    loop {
                        let stopped = stopped(sim, recording.as_ref(), watch.as_ref()).is_some();
                        let Some(horizon) = horizon(sim, stopped) else { return Ok(true) };
                        recording::step(sim, recording.as_mut(), watch.as_mut(), horizon)?;
                        if started.elapsed() > INTERVAL {
                            return Ok(false);
                        }
                    }
                })
            });
            match taken {
                Ok(true) => return py.check_signals(),
                Ok(false) => py.check_signals()?,
                Err(error @ Failure::End(_)) => return Err(error).raise(),
                Err(error) => {
                    let recording = self.recording.take();
                    let sound = recording.is_some_and(|recording| !recording.step_failed());
                    self.failed = Some(error.ended(sound));
                    return Err(error).raise();
                }
            }
        }
    }
}

#[pymethods]
impl PySimulation {
    #[new]
    #[pyo3(signature = (case, *, threads = None, output = None, resume = false, force = false))]
    fn new(
        py: Python<'_>,
        case: Py<PyCase>,
        threads: Option<Whole>,
        output: Option<PathBuf>,
        #[pyo3(from_py_with = flags::resume)] resume: bool,
        #[pyo3(from_py_with = flags::force)] force: bool,
    ) -> PyResult<PySimulation> {
        let given = &case.get().case;
        let threads = case.get().threads(py, threads.as_ref())?;
        warn(py, threads::detached(py, || given.estimate(threads))?.warnings)?;
        let pool = threads::pool(threads)?;
        let (sim, recording) = match &output {
            Some(folder) => {
                let (sim, recording) =
                    recording::start(py, given, folder, (resume, force), threads, &pool)?;
                (sim, Some(recording))
            }
            None if resume || force => {
                return Err(input("resume and force need a run folder: give output=..."));
            }
            None => {
                let setup = given.setup.clone();
                admit_memory(&setup, None).raise()?;
                (py.detach(|| pool.install(|| Simulation::new(setup))).raise()?, None)
            }
        };
        let watch = if recording.is_none() { watch(given, &sim) } else { None };
        let (views, closed_by) = (Arc::default(), None);
        Ok(PySimulation {
            sim,
            recording,
            watch,
            closed_by,
            output,
            case,
            pool,
            views,
            failed: None,
            process: std::process::id(),
        })
    }

    /// Take one time step.
    ///
    /// Parameters
    /// ----------
    /// horizon : float or str, optional
    ///     Time from now [s] at which a whole number of equal steps ends, at least a thousandth of
    ///     the last step: a shorter step would disturb pressure and forces.
    ///
    /// Returns
    /// -------
    /// float
    ///     Length of the step [s].
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The horizon is not positive, or too short.
    /// SolverError
    ///     The state is no longer finite or changes too fast.
    /// BufferError
    ///     An array shows the fields of the present step.
    #[pyo3(signature = (horizon = None))]
    fn step(slf: &Bound<'_, Self>, horizon: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
        let horizon =
            horizon.map_or(Ok(f64::INFINITY), |given| quantity::<Time>("horizon", given))?;
        if horizon <= 0.0 {
            return Err(input(format!("horizon: found {horizon} s; expected a positive time")));
        }
        let mut steps = std::iter::once(horizon);
        let mut this = changing(slf)?;
        let least = this.sim.least_horizon();
        if horizon < least {
            let [found, least] = [horizon, least].map(|time| seconds(time, "s"));
            return Err(input(format!(
                "horizon: found {found}; expected at least {least}, a thousandth of the last step \
                 (advance_to takes such a time as reached)"
            )));
        }
        this.advance(slf.py(), |_, _| steps.next())?;
        Ok(this.sim.time_step())
    }

    /// Advance to a time, in steps of which the last ends there.
    ///
    /// Parameters
    /// ----------
    /// time : float or str
    ///     Simulated time [s]; nothing happens if it has passed, or is less than a thousandth of
    ///     the last step away. With a run folder, a time less than a tenth of a step before an
    ///     output is that of the output.
    ///
    /// Raises
    /// ------
    /// SolverError, BufferError
    ///     As in `step`.
    fn advance_to(slf: &Bound<'_, Self>, time: &Bound<'_, PyAny>) -> PyResult<()> {
        let until = quantity::<Time>("time", time)?;
        changing(slf)?.advance(slf.py(), |sim, _| sim.time_left(until))
    }

    /// Advances to a time [s], or until the stop condition of the case holds.
    fn _advance(slf: &Bound<'_, Self>, time: f64) -> PyResult<()> {
        let horizon =
            |sim: &Simulation, stopped: bool| if stopped { None } else { sim.time_left(time) };
        changing(slf)?.advance(slf.py(), horizon)
    }

    /// Whether the stop condition of the case holds.
    #[getter]
    fn _stopped(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(reading(slf)?.stopped().is_some())
    }

    /// Iterate over states at regular times, until the end or the stop condition of the case.
    ///
    /// Parameters
    /// ----------
    /// until : float or str, optional
    ///     End [s]; that of the case by default.
    /// every : float or str, optional
    ///     Interval of the states [s]; by default the interval of the tables of the case.
    /// progress : bool or callable, optional
    ///     As in `Case.run`; the dict has time, end, start, steps and wall_s.
    ///
    /// Yields
    /// ------
    /// State
    ///     Copy of the motion of the grains; the first is the present state. If the stop condition
    ///     of the case (``time.stop``) holds, the state of that step is the last.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     `until` is before the present time.
    #[pyo3(signature = (until = None, every = None, *, progress = None))]
    fn run<'py>(
        slf: &Bound<'py, Self>,
        until: Option<&Bound<'py, PyAny>>,
        every: Option<&Bound<'py, PyAny>>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        check_progress(py, progress)?;
        let (now, end, interval) = {
            let this = reading(slf)?;
            let plan = &this.case.get().case.plan;
            (this.sim.time(), plan.end, plan.tables)
        };
        let end = until.map_or(Ok(end), |given| quantity::<Time>("until", given))?;
        if until.is_some() && end < now * (1.0 - SAME_TIME) {
            return Err(input(format!(
                "until: found {}, which is before the present time, {}",
                seconds(end, "s"),
                seconds(now, "s")
            )));
        }
        let interval = match every {
            Some(given) => quantity::<Time>("every", given)?,
            None if interval > 0.0 => interval,
            None => end,
        };
        if interval <= 0.0 {
            return Err(input(format!("every: found {interval} s; expected a positive time")));
        }
        py.import("grainwake._simulation")?.call_method1("states", (slf, end, interval, progress))
    }

    /// Copy of the motion of the grains at the end of the last step.
    ///
    /// Returns
    /// -------
    /// State
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("grainwake._simulation")?.call_method1("state", (slf,))
    }

    /// The case.
    #[getter]
    fn case(slf: &Bound<'_, Self>) -> PyResult<Py<PyCase>> {
        Ok(reading(slf)?.case.clone_ref(slf.py()))
    }
    /// Simulated time [s].
    #[getter]
    fn time(slf: &Bound<'_, Self>) -> PyResult<f64> {
        Ok(reading(slf)?.sim.time())
    }
    /// Number of steps taken.
    #[getter]
    fn steps(slf: &Bound<'_, Self>) -> PyResult<u64> {
        Ok(reading(slf)?.sim.steps())
    }
    /// Length of the last step [s]; zero before the first.
    #[getter]
    fn time_step(slf: &Bound<'_, Self>) -> PyResult<f64> {
        Ok(reading(slf)?.sim.time_step())
    }
    /// Reason why the run is over: "end" at the end time of the case, or its stop condition
    /// "landing", "rest" or "separation"; None before. Steps are possible after a stop condition.
    #[getter]
    fn ended(slf: &Bound<'_, Self>) -> PyResult<Option<String>> {
        let this = reading(slf)?;
        let end = this.case.get().case.plan.at_end(this.sim.time()).then_some(EndReason::End);
        Ok(end.or_else(|| this.stopped()).map(|why| why.to_string()))
    }
    /// Threads of the simulation.
    #[getter]
    fn threads(slf: &Bound<'_, Self>) -> PyResult<usize> {
        Ok(reading(slf)?.pool.current_num_threads())
    }
    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let (time, steps) = (this.sim.time(), this.sim.steps());
        let grains = number_of_grains(this.sim.grains().len());
        Ok(format!("Simulation({grains}, t = {time:.6} s, step {steps})"))
    }
}
