//! Arrays of velocity and pressure. They show the memory of the solver without a copy; a step is
//! refused while one of them exists.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use grainwake_solver::grid::{Axis, FieldView};
use grainwake_solver::sim::{AnyFieldView, CELL_FIELDS};
use numpy::ndarray::{Array, ArrayView3, IxDyn, ShapeBuilder};
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::{PySimulation, reading};
use crate::arguments::points;
use crate::arrays::{numbers, vectors};
use crate::error::input;

/// Base object of an array of a field: keeps the simulation alive and counts the array.
#[pyclass(module = "grainwake", name = "_FieldGuard", frozen)]
pub struct FieldGuard {
    views: Arc<AtomicUsize>,
    _owner: Py<PySimulation>,
}

impl Drop for FieldGuard {
    fn drop(&mut self) {
        self.views.fetch_sub(1, Ordering::Release);
    }
}

/// Returns the axis of a name.
fn axis(name: &str) -> PyResult<Axis> {
    match name {
        "x" => Ok(Axis::X),
        "y" => Ok(Axis::Y),
        "z" => Ok(Axis::Z),
        other => Err(input(format!("axis: found \"{other}\"; expected \"x\", \"y\" or \"z\""))),
    }
}

fn dry() -> PyErr {
    input("the case has no fluid")
}

/// Returns a field as a read-only array without a copy.
fn shown<'py>(
    owner: &Bound<'py, PySimulation>,
    field: AnyFieldView<'_>,
) -> PyResult<Bound<'py, PyAny>> {
    match field {
        AnyFieldView::Single(view) => show(owner, view),
        AnyFieldView::Double(view) => show(owner, view),
    }
}

fn show<'py, R: Element + Copy>(
    owner: &Bound<'py, PySimulation>,
    view: FieldView<'_, R>,
) -> PyResult<Bound<'py, PyAny>> {
    let views = reading(owner)?.views.clone();
    views.fetch_add(1, Ordering::Acquire);
    let guard = Bound::new(owner.py(), FieldGuard { views, _owner: owner.clone().unbind() })?;
    let shape = view.shape().strides(view.strides());
    // SAFETY: the view has these shape and strides, within its slice. The guard keeps the memory
    // alive, and the solver writes to it only while no guard exists (`PySimulation::may_change`).
    let array = unsafe {
        let borrowed = ArrayView3::from_shape_ptr(shape, view.values().as_ptr());
        PyArray3::borrow_from_array(&borrowed, guard.into_any())
    };
    Ok(array.readwrite().make_nonwriteable().as_any().clone())
}

#[pymethods]
impl PySimulation {
    /// Velocity component of the fluid on the faces normal to its axis, without a copy.
    ///
    /// Parameters
    /// ----------
    /// axis : {"x", "y", "z"}
    ///     Component.
    ///
    /// Returns
    /// -------
    /// ndarray, read-only
    ///     Velocity [m/s], shape (z, y, x) with one more entry along `axis` than there are cells;
    ///     float64, or float32 for a case of single precision. Values inside grains are without
    ///     meaning.
    ///
    /// Notes
    /// -----
    /// The array shows the memory of the solver. While it exists, `step` and `advance_to` raise
    /// ``BufferError``: copy the values that are needed later, and delete the array.
    fn fluid_velocity<'py>(slf: &Bound<'py, Self>, axis: &str) -> PyResult<Bound<'py, PyAny>> {
        let component = self::axis(axis)?;
        let this = reading(slf)?;
        shown(slf, this.sim.velocity(component).ok_or_else(dry)?)
    }

    /// Dynamic pressure over density at the cell centres, without a copy.
    ///
    /// Returns
    /// -------
    /// ndarray, read-only
    ///     Pressure over density [m2/s2], shape (z, y, x). The notes of `fluid_velocity` apply.
    fn kinematic_pressure<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let this = reading(slf)?;
        shown(slf, this.sim.kinematic_pressure().ok_or_else(dry)?)
    }

    /// Field at the cell centres, as written to slices.
    ///
    /// Parameters
    /// ----------
    /// name : {"velocity", "vorticity", "pressure", "solid_fraction"}
    ///     Field in m/s, 1/s, Pa or as a fraction.
    ///
    /// Returns
    /// -------
    /// ndarray of float64
    ///     Copy, shape (z, y, x), for vectors (z, y, x, 3).
    fn cell_field<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let sim = &this.sim;
        let field = CELL_FIELDS.iter().find(|field| field.name == name).ok_or_else(|| {
            let known: Vec<&str> = CELL_FIELDS.iter().map(|field| field.name).collect();
            input(format!("name: found \"{name}\"; expected one of {}", known.join(", ")))
        })?;
        if sim.setup().fluid.is_none() {
            return Err(dry());
        }
        let [nx, ny, nz] = sim.mesh().cells;
        let values = py.detach(|| {
            let mut values = Vec::with_capacity(nx * ny * nz * field.components);
            for k in 0..nz {
                for j in 0..ny {
                    for i in 0..nx {
                        let value = field.at(sim, [i, j, k]).to_array();
                        values.extend_from_slice(&value[..field.components]);
                    }
                }
            }
            values
        });
        let mut shape = vec![nz, ny, nx];
        if field.components > 1 {
            shape.push(field.components);
        }
        let array = Array::from_shape_vec(IxDyn(&shape), values);
        Ok(array.map_err(|error| input(error.to_string()))?.into_pyarray(py).into_any())
    }

    /// Coordinates of the values of a field.
    ///
    /// Parameters
    /// ----------
    /// axis : {"x", "y", "z"}, optional
    ///     Component of `fluid_velocity`; without it the cell centres.
    ///
    /// Returns
    /// -------
    /// z, y, x : ndarray
    ///     Coordinates along each axis [m].
    #[pyo3(signature = (axis = None))]
    fn coordinates<'py>(
        slf: &Bound<'py, Self>,
        axis: Option<&str>,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 3]> {
        let normal = axis.map(self::axis).transpose()?;
        let (py, this) = (slf.py(), reading(slf)?);
        let mesh = this.sim.mesh();
        let along = |axis: usize| {
            let on_faces = normal.is_some_and(|normal| normal as usize == axis);
            let (count, offset) =
                if on_faces { (mesh.cells[axis] + 1, 0.0) } else { (mesh.cells[axis], 0.5) };
            let place = |i: usize| mesh.origin[axis] + mesh.spacing[axis] * (i as f64 + offset);
            numbers(py, (0..count).map(place).collect())
        };
        Ok([along(2), along(1), along(0)])
    }

    /// Velocity of the fluid at points, by trilinear interpolation.
    ///
    /// Parameters
    /// ----------
    /// at : array_like, shape (n, 3)
    ///     Points [m].
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, 3)
    ///     Velocity [m/s]; NaN outside the box.
    fn interpolate_velocity<'py>(
        slf: &Bound<'py, Self>,
        at: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let places = points("at", at)?;
        let (py, this) = (slf.py(), reading(slf)?);
        let sim = &this.sim;
        if sim.setup().fluid.is_none() {
            return Err(dry());
        }
        let found: Vec<DVec3> = py.detach(|| {
            let velocity = |x: &DVec3| sim.interpolate_velocity(*x).unwrap_or(DVec3::NAN);
            places.iter().map(velocity).collect()
        });
        Ok(vectors(py, found.into_iter()))
    }

    /// All fields at the cell centres as an xarray dataset with coordinates and units.
    ///
    /// Returns
    /// -------
    /// xarray.Dataset
    ///     Copies of velocity, vorticity, pressure and solid fraction.
    fn to_xarray<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let fields = PyDict::new(slf.py());
        for field in CELL_FIELDS {
            let values = PySimulation::cell_field(slf, field.name)?;
            fields.set_item(field.name, (field.unit, values))?;
        }
        slf.py().import("grainwake._simulation")?.call_method1("dataset", (slf, fields))
    }
}
