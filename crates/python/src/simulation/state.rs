//! Motion of the grains, contacts and measures of the state.

use glam::DVec3;
use grainwake_formats::contacts::wall_code;
use grainwake_solver::dem::{Contact, Grain, Partner};
use grainwake_solver::math::{Load, RigidVelocity};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::{PySimulation, computing, reading};
use crate::arrays::{numbers, read_only, rows, vectors};

/// Returns one vector per grain.
fn grain_vectors<'py>(
    slf: &Bound<'py, PySimulation>,
    pick: fn(&Grain) -> DVec3,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let this = reading(slf)?;
    Ok(read_only(vectors(slf.py(), this.sim.grains().iter().map(pick))))
}

/// Returns one vector per grain of the velocities with which the grains move.
fn velocity_vectors<'py>(
    slf: &Bound<'py, PySimulation>,
    pick: fn(RigidVelocity) -> DVec3,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let this = reading(slf)?;
    let velocities = (0..this.sim.grains().len()).map(|grain| this.sim.grain_velocity(grain));
    Ok(read_only(vectors(slf.py(), velocities.map(pick))))
}

/// Returns one vector per grain of the mean hydrodynamic loads.
fn load_vectors<'py>(
    slf: &Bound<'py, PySimulation>,
    pick: fn(&Load) -> DVec3,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let this = reading(slf)?;
    Ok(read_only(vectors(slf.py(), this.sim.loads().iter().map(pick))))
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
    fn diagnostics<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let (py, this) = (slf.py(), computing(slf)?);
        let PySimulation { pool, sim, .. } = &*this;
        let d = py.detach(|| pool.install(|| sim.diagnostics()));
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
    ///     grain (n,), partner (n,), overlap (n,) [m], force (n, 3) [N] on `grain`, point (n, 3)
    ///     [m] and normal (n, 3); read-only copies. A negative partner is a wall, as in
    ///     `RunFolder.contacts`: -1 lower x, -2 upper x, -3 lower y, -4 upper y, -5 lower z,
    ///     -6 upper z.
    fn contacts<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let all = this.sim.contacts();
        let partner = |contact: &Contact| match contact.partner {
            Partner::Grain(index) => index as i64,
            Partner::Wall { axis, side } => wall_code(axis, side),
        };
        let of_each = |pick: fn(&Contact) -> DVec3| read_only(vectors(py, all.iter().map(pick)));
        let index = |values: Vec<i64>| read_only(numbers(py, values));
        let dict = PyDict::new(py);
        dict.set_item("grain", index(all.iter().map(|c| c.grain as i64).collect()))?;
        dict.set_item("partner", index(all.iter().map(partner).collect()))?;
        let overlaps = all.iter().map(|c| c.overlap).collect();
        dict.set_item("overlap", read_only(numbers::<f64>(py, overlaps)))?;
        dict.set_item("force", of_each(|c| c.load.force))?;
        dict.set_item("point", of_each(|c| c.point))?;
        dict.set_item("normal", of_each(|c| c.normal))?;
        Ok(dict)
    }

    /// Centroids [m], shape (n, 3); a read-only copy. A grain that has left the box is at infinity.
    #[getter]
    fn positions<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        grain_vectors(slf, |grain| grain.pose.position)
    }
    /// Quaternions (w, x, y, z) from the body frame to the space frame, shape (n, 4); a read-only
    /// copy.
    #[getter]
    fn orientations<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let this = reading(slf)?;
        let turns = this.sim.grains().iter().map(|grain| {
            let q = grain.pose.orientation;
            [q.w, q.x, q.y, q.z]
        });
        Ok(read_only(rows(slf.py(), turns)))
    }
    /// Velocities of the centroids [m/s], shape (n, 3); a read-only copy.
    #[getter]
    fn velocities<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        velocity_vectors(slf, |velocity| velocity.linear)
    }
    /// Angular velocities in the space frame [rad/s], shape (n, 3); a read-only copy.
    #[getter]
    fn angular_velocities<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        velocity_vectors(slf, |velocity| velocity.angular)
    }
    /// Mean hydrodynamic forces over the last step [N], without buoyancy, shape (n, 3); a read-only
    /// copy.
    #[getter]
    fn forces<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        load_vectors(slf, |load| load.force)
    }
    /// Mean hydrodynamic torques about the centroids over the last step [N m], shape (n, 3); a
    /// read-only copy.
    #[getter]
    fn torques<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        load_vectors(slf, |load| load.torque)
    }
    /// Masses of the grains [kg], shape (n,); a read-only copy.
    #[getter]
    fn masses<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let this = reading(slf)?;
        let masses = this.sim.grains().iter().map(|grain| grain.mass()).collect();
        Ok(read_only(numbers(slf.py(), masses)))
    }
}
