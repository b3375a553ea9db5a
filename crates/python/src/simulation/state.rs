//! Motion of the grains, contacts and measures of the state.

use glam::DVec3;
use grainwake_solver::dem::{Contact, Grain, Partner};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::PySimulation;
use crate::arrays::{numbers, rows, vectors};

impl PySimulation {
    fn grain_vectors<'py>(
        &self,
        py: Python<'py>,
        pick: fn(&Grain) -> DVec3,
    ) -> Bound<'py, PyArray2<f64>> {
        vectors(py, self.sim.grains().iter().map(pick))
    }
}

#[pymethods]
impl PySimulation {
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
}
