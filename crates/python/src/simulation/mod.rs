//! `Simulation`: steps a case in memory.

mod checkpoint;
mod control;
mod fields;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use grainwake_run::case::quantity::Time;
use grainwake_solver::dem::{Contact, Partner};
use grainwake_solver::sim::{SAME_TIME, Simulation, StepError};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyBufferError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPool;

use crate::arguments::quantity;
use crate::arrays::{numbers, rows, vectors};
use crate::case::PyCase;
use crate::error::{Raise, input, numerics};
use crate::threads;

/// Wall time after which signals are handled.
const INTERVAL: Duration = Duration::from_millis(50);

/// Simulation of a case in memory, step by step.
///
/// Parameters
/// ----------
/// case : Case
///     The case; its outputs are not written.
/// threads : int, optional
///     Threads; those of the case by default, 0 for all cores. They do not affect the results.
///
/// Notes
/// -----
/// The global interpreter lock is released during steps. Ctrl-C raises ``KeyboardInterrupt`` after
/// a step, and the simulation can be continued. `Case.run` fills a run folder instead.
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
/// ...     print(f"{state.time:.3f} s  {state.velocities[0, 2]:.4f} m/s")
/// 0.000 s  0.0000 m/s
/// 0.005 s  -0.0490 m/s
/// 0.010 s  -0.0981 m/s
#[pyclass(module = "grainwake", name = "Simulation", weakref)]
pub struct PySimulation {
    sim: Simulation,
    case: Py<PyCase>,
    pool: Arc<ThreadPool>,
    /// Number of arrays that show the fields.
    views: Arc<AtomicUsize>,
    /// Message of the failed step.
    failed: Option<String>,
}

impl PySimulation {
    /// Refuses a change of the fields that arrays show, or after a failed step.
    fn may_change(&self) -> PyResult<()> {
        if let Some(message) = &self.failed {
            return Err(numerics(format!("{message}\nThe simulation cannot be continued.")));
        }
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

    /// Takes steps until `step` returns that it has finished, and handles signals between them.
    fn advance(
        &mut self,
        py: Python<'_>,
        step: impl Fn(&mut Simulation) -> Result<bool, StepError> + Sync,
    ) -> PyResult<()> {
        self.may_change()?;
        loop {
            let (pool, sim) = (self.pool.clone(), &mut self.sim);
            let taken = py.detach(|| {
                let started = Instant::now();
                pool.install(|| {
                    while !step(sim)? {
                        if started.elapsed() > INTERVAL {
                            return Ok(false);
                        }
                    }
                    Ok(true)
                })
            });
            match taken {
                Ok(true) => return py.check_signals(),
                Ok(false) => py.check_signals()?,
                Err(error) => {
                    let error: StepError = error;
                    self.failed = Some(error.to_string());
                    return Err(error).raise();
                }
            }
        }
    }

    fn grain_vectors<'py>(
        &self,
        py: Python<'py>,
        pick: fn(&grainwake_solver::dem::Grain) -> glam::DVec3,
    ) -> Bound<'py, PyArray2<f64>> {
        vectors(py, self.sim.grains().iter().map(pick))
    }
}

#[pymethods]
impl PySimulation {
    #[new]
    #[pyo3(signature = (case, *, threads = None))]
    fn new(py: Python<'_>, case: Py<PyCase>, threads: Option<usize>) -> PyResult<PySimulation> {
        let given = &case.get().case;
        let threads = threads::resolve(threads.unwrap_or(given.threads));
        let (pool, setup) = (threads::pool(threads)?, given.setup.clone());
        let sim = py.detach(|| pool.install(|| Simulation::new(setup))).raise()?;
        Ok(PySimulation { sim, case, pool, views: Arc::default(), failed: None })
    }

    /// Take one time step.
    ///
    /// Parameters
    /// ----------
    /// horizon : float or str, optional
    ///     Time from now [s] at which a whole number of equal steps ends.
    ///
    /// Returns
    /// -------
    /// float
    ///     Length of the step [s].
    ///
    /// Raises
    /// ------
    /// SolverError
    ///     The state is no longer finite or changes too fast.
    /// BufferError
    ///     An array shows the fields of the present step.
    #[pyo3(signature = (horizon = None))]
    fn step(&mut self, py: Python<'_>, horizon: Option<&Bound<'_, PyAny>>) -> PyResult<f64> {
        let horizon =
            horizon.map_or(Ok(f64::INFINITY), |given| quantity::<Time>("horizon", given))?;
        if horizon <= 0.0 {
            return Err(input(format!("horizon: found {horizon} s; expected a positive time")));
        }
        self.advance(py, |sim| sim.step(horizon).map(|()| true))?;
        Ok(self.sim.time_step())
    }

    /// Advance to a time, in steps of which the last ends there.
    ///
    /// Parameters
    /// ----------
    /// time : float or str
    ///     Simulated time [s]; nothing happens if it has passed.
    ///
    /// Raises
    /// ------
    /// SolverError, BufferError
    ///     As in `step`.
    fn advance_to(&mut self, py: Python<'_>, time: &Bound<'_, PyAny>) -> PyResult<()> {
        let until = quantity::<Time>("time", time)?;
        self.advance(py, |sim| {
            if sim.time() < until * (1.0 - SAME_TIME) {
                sim.step(until - sim.time())?;
            }
            Ok(sim.time() >= until * (1.0 - SAME_TIME))
        })
    }

    /// Iterate over states at regular times.
    ///
    /// Parameters
    /// ----------
    /// until : float or str, optional
    ///     End [s]; that of the case by default.
    /// every : float or str, optional
    ///     Interval of the states [s]; by default the interval of the tables of the case.
    /// progress : bool or callable, optional
    ///     As in `Case.run`.
    ///
    /// Yields
    /// ------
    /// State
    ///     Copy of the motion of the grains; the first is the present state.
    #[pyo3(signature = (until = None, every = None, *, progress = None))]
    fn run<'py>(
        slf: &Bound<'py, Self>,
        until: Option<&Bound<'py, PyAny>>,
        every: Option<&Bound<'py, PyAny>>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let (end, interval) = {
            let this = slf.try_borrow()?;
            let plan = &this.case.get().case.plan;
            (plan.end, plan.tables)
        };
        let end = until.map_or(Ok(end), |given| quantity::<Time>("until", given))?;
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

    /// Conservation checks and other measures of the state.
    ///
    /// Returns
    /// -------
    /// dict
    ///     max_divergence [1/s], max_velocity [m/s], cfl, slip [m/s], fluid_kinetic_energy [J],
    ///     grain_kinetic_energy [J], momentum [kg m/s], momentum_residual (relative).
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let d = py.detach(|| self.pool.install(|| self.sim.diagnostics()));
        let dict = PyDict::new(py);
        dict.set_item("max_divergence", d.max_divergence)?;
        dict.set_item("max_velocity", d.max_velocity)?;
        dict.set_item("cfl", d.cfl)?;
        dict.set_item("slip", d.slip)?;
        dict.set_item("fluid_kinetic_energy", d.fluid_kinetic_energy)?;
        dict.set_item("grain_kinetic_energy", d.grain_kinetic_energy)?;
        dict.set_item("momentum", <(f64, f64, f64)>::from(d.momentum))?;
        dict.set_item("momentum_residual", d.momentum_residual)?;
        Ok(dict)
    }

    /// Pairs that touched during the last step.
    ///
    /// Returns
    /// -------
    /// dict of ndarray
    ///     grain (n,), partner (n,) with -1 for a wall, overlap (n,) [m], force (n, 3) [N] on
    ///     `grain`, point (n, 3) [m] and normal (n, 3).
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = self.sim.contacts();
        let partner = |contact: &Contact| match contact.partner {
            Partner::Grain(index) => index as i64,
            Partner::Wall { .. } => -1,
        };
        let dict = PyDict::new(py);
        dict.set_item("grain", numbers(py, all.iter().map(|c| c.grain as i64).collect()))?;
        dict.set_item("partner", numbers(py, all.iter().map(partner).collect()))?;
        dict.set_item("overlap", numbers(py, all.iter().map(|c| c.overlap).collect()))?;
        dict.set_item("force", vectors(py, all.iter().map(|c| c.load.force)))?;
        dict.set_item("point", vectors(py, all.iter().map(|c| c.point)))?;
        dict.set_item("normal", vectors(py, all.iter().map(|c| c.normal)))?;
        Ok(dict)
    }

    /// The case.
    #[getter]
    fn case(&self, py: Python<'_>) -> Py<PyCase> {
        self.case.clone_ref(py)
    }
    /// Simulated time [s].
    #[getter]
    fn time(&self) -> f64 {
        self.sim.time()
    }
    /// Number of steps taken.
    #[getter]
    fn steps(&self) -> u64 {
        self.sim.steps()
    }
    /// Length of the last step [s]; zero before the first.
    #[getter]
    fn time_step(&self) -> f64 {
        self.sim.time_step()
    }
    /// Centroids [m], shape (n, 3); a copy. A grain that has left the box is at infinity.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.grain_vectors(py, |grain| grain.pose.position)
    }
    /// Quaternions (w, x, y, z) from the body frame to the space frame, shape (n, 4); a copy.
    #[getter]
    fn orientations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let turns = self.sim.grains().iter().map(|grain| {
            let q = grain.pose.orientation;
            [q.w, q.x, q.y, q.z]
        });
        rows(py, turns)
    }
    /// Velocities of the centroids [m/s], shape (n, 3); a copy.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.grain_vectors(py, |grain| grain.velocity)
    }
    /// Angular velocities in the space frame [rad/s], shape (n, 3); a copy.
    #[getter]
    fn angular_velocities<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.grain_vectors(py, |grain| grain.angular_velocity)
    }
    /// Mean hydrodynamic forces over the last step [N], without buoyancy, shape (n, 3); a copy.
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        vectors(py, self.sim.loads().iter().map(|load| load.force))
    }
    /// Mean hydrodynamic torques about the centroids over the last step [N m], shape (n, 3); a
    /// copy.
    #[getter]
    fn torques<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        vectors(py, self.sim.loads().iter().map(|load| load.torque))
    }
    /// Masses of the grains [kg], shape (n,).
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        numbers(py, self.sim.grains().iter().map(|grain| grain.mass()).collect())
    }
    /// Threads of the simulation.
    #[getter]
    fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }
    fn __repr__(&self) -> String {
        let (time, steps) = (self.sim.time(), self.sim.steps());
        format!("Simulation({} grains, t = {time:.6} s, step {steps})", self.sim.grains().len())
    }
}
