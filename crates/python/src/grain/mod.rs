//! `Grain`: an immutable shape.

mod build;
pub mod image;
mod read;
mod volume;

use std::path::PathBuf;
use std::sync::Arc;

use grainwake_report::grain_sheet::{GrainPanel, sheet};
use grainwake_run::case::quantity::{Density, Length};
use grainwake_shape::{Record, Shape};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arguments::{flags, pixels, quantity};
use crate::arrays::{json, numbers, read_only, rows, vectors};
use crate::error::{Raise, input};
use crate::threads::detached;

pub use image::PyScan;

/// Grain shape: signed distance, surface nodes, mass properties and morphology.
///
/// A grain has no position and no density; `at` adds both for a case. Its frame has the origin at
/// the centroid and the principal axes of inertia along x (smallest moment of inertia, mostly the
/// longest axis), y and z. Lengths are in m.
///
/// Examples
/// --------
/// >>> import grainwake as gw
/// >>> pebble = gw.Grain.ellipsoid("3 mm", "2 mm", "1 mm")
/// >>> round(pebble.krumbein_sphericity, 3)
/// 0.606
#[pyclass(module = "grainwake", name = "Grain", frozen, weakref)]
pub struct PyGrain {
    pub shape: Arc<Shape>,
    record: Record,
}

impl PyGrain {
    pub fn new(shape: impl Into<Arc<Shape>>) -> PyGrain {
        let shape = shape.into();
        PyGrain { record: shape.record(), shape }
    }

    /// Returns views from three sides as PNG.
    fn drawn<'py>(&self, py: Python<'py>, pixels: usize) -> PyResult<Bound<'py, PyBytes>> {
        let drawn = detached(py, || {
            let panel = GrainPanel::three_sides("", &self.shape, pixels, false);
            sheet(vec![panel], 1)?.to_png()
        })?;
        Ok(PyBytes::new(py, &drawn.map_err(input)?))
    }
}

#[pymethods]
impl PyGrain {
    /// Read a ``.grain`` file.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     File written by `save` or by ``grainwake grain``.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<PyGrain> {
        detached(py, || Shape::load(&path))?.raise().map(PyGrain::new)
    }

    /// Write a ``.grain`` file, which cases refer to.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     File with the extension ``.grain``.
    /// force : bool, default False
    ///     Replace an existing file.
    #[pyo3(signature = (path, *, force = false))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        #[pyo3(from_py_with = flags::force)] force: bool,
    ) -> PyResult<()> {
        if path.extension().is_none_or(|e| e != "grain") {
            let other = path.with_extension("grain");
            return Err(input(format!(
                "{} does not end in .grain; use {}",
                path.display(),
                other.display()
            )));
        }
        if path.exists() && !force {
            return Err(input(format!(
                "{} exists already; choose another name, or replace it with force=True",
                path.display()
            )));
        }
        py.detach(|| self.shape.save(&path)).raise()
    }

    #[staticmethod]
    fn _from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<PyGrain> {
        let shape = detached(py, || Shape::from_bytes(bytes, "pickled grain".as_ref()))?;
        shape.raise().map(PyGrain::new)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let bytes = PyBytes::new(slf.py(), &slf.get().shape.to_bytes());
        Ok((slf.get_type().getattr("_from_bytes")?, (bytes,)))
    }

    /// Shape rescaled to an equivalent diameter.
    ///
    /// Parameters
    /// ----------
    /// equivalent_diameter : float or str
    ///     Diameter of the sphere of equal volume [m].
    ///
    /// Returns
    /// -------
    /// Grain
    fn scaled(&self, equivalent_diameter: &Bound<'_, PyAny>) -> PyResult<PyGrain> {
        let diameter = quantity::<Length>("equivalent_diameter", equivalent_diameter)?;
        self.shape.scaled_to_equivalent_diameter(diameter).raise().map(PyGrain::new)
    }

    /// Grain at a place, as an entry of the list ``grain`` of a case.
    ///
    /// Parameters
    /// ----------
    /// position : sequence of float or str
    ///     Centroid [m].
    /// density : float or str
    ///     Density [kg/m3].
    /// **keys
    ///     Further keys of an entry: orientation, velocity, motion, gap_above, ...
    ///
    /// Returns
    /// -------
    /// dict
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     ``file`` or ``shape`` is among the keys: the grain is the shape.
    #[pyo3(signature = (position, *, density, **keys))]
    fn at<'py>(
        slf: &Bound<'py, Self>,
        position: &Bound<'py, PyAny>,
        density: &Bound<'py, PyAny>,
        keys: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        quantity::<Density>("density", density)?;
        for name in ["file", "shape"] {
            if let Some(keys) = keys
                && keys.contains(name)?
            {
                return Err(input(format!(
                    "{name}: the grain itself is the shape of the entry; omit {name}, or write the \
                     entry as a dict"
                )));
            }
        }
        let entry = PyDict::new(slf.py());
        entry.set_item("file", slf)?;
        entry.set_item("position", position)?;
        entry.set_item("density", density)?;
        if let Some(keys) = keys {
            entry.update(keys.as_mapping())?;
        }
        Ok(entry)
    }

    /// Signed distance to the surface, negative inside.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (n, 3)
    ///     Points in the frame of the grain [m].
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     Distances [m].
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let places = crate::arguments::points("points", points)?;
        let shape = &self.shape;
        let found = py.detach(|| places.iter().map(|x| shape.distance(*x)).collect());
        Ok(numbers(py, found))
    }

    /// Closed surface in the frame of the grain.
    ///
    /// Returns
    /// -------
    /// vertices : ndarray, shape (n, 3)
    ///     Positions [m].
    /// faces : ndarray of int64, shape (m, 3)
    ///     Indices of the vertices, counter-clockwise seen from outside.
    fn surface<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<i64>>) {
        let (vertices, faces) = py.detach(|| self.shape.surface_mesh());
        let faces = faces.into_iter().map(|face| face.map(i64::from));
        (vectors(py, vertices.into_iter()), rows(py, faces))
    }

    /// Surface for PyVista or trimesh.
    ///
    /// Parameters
    /// ----------
    /// kind : {"pyvista", "trimesh"}, default "pyvista"
    ///     Library, which has to be installed.
    ///
    /// Returns
    /// -------
    /// pyvista.PolyData or trimesh.Trimesh
    ///     Surface in the frame of the grain [m].
    #[pyo3(signature = (kind = "pyvista"))]
    fn mesh<'py>(slf: &Bound<'py, Self>, kind: &str) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("grainwake._mesh")?.call_method1("grain_mesh", (slf, kind))
    }

    /// Rendered views from three sides as PNG, with a scale bar.
    ///
    /// Parameters
    /// ----------
    /// pixels : int, default 320
    ///     Width of one view, 16 to 4096.
    ///
    /// Returns
    /// -------
    /// bytes
    #[pyo3(signature = (pixels = 320))]
    fn picture<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = pixels)] pixels: usize,
    ) -> PyResult<Bound<'py, PyBytes>> {
        if !(16..=4096).contains(&pixels) {
            return Err(input(format!("pixels: found {pixels}; expected 16 to 4096")));
        }
        self.drawn(py, pixels)
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.drawn(py, 200)
    }

    /// All measures of the shape, with the names of ``grainwake grain info --json``.
    ///
    /// Returns
    /// -------
    /// dict
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, &self.record)
    }

    /// Volume [m3].
    #[getter]
    fn volume(&self) -> f64 {
        self.record.volume_m3
    }
    /// Diameter of the sphere of equal volume [m].
    #[getter]
    fn equivalent_diameter(&self) -> f64 {
        self.record.equivalent_diameter_m
    }
    /// Longest extent along a principal axis [m].
    #[getter]
    fn a(&self) -> f64 {
        self.record.a_m
    }
    /// Intermediate extent along a principal axis [m].
    #[getter]
    fn b(&self) -> f64 {
        self.record.b_m
    }
    /// Shortest extent along a principal axis [m].
    #[getter]
    fn c(&self) -> f64 {
        self.record.c_m
    }
    /// Elongation b / a.
    #[getter]
    fn elongation(&self) -> f64 {
        self.record.elongation
    }
    /// Flatness c / b.
    #[getter]
    fn flatness(&self) -> f64 {
        self.record.flatness
    }
    /// Krumbein sphericity, the cube root of b c / a^2.
    #[getter]
    fn krumbein_sphericity(&self) -> f64 {
        self.record.krumbein_sphericity
    }
    /// Wadell's true sphericity: area of the sphere of equal volume over the surface area.
    #[getter]
    fn wadell_sphericity(&self) -> f64 {
        self.record.wadell_sphericity
    }
    /// Wadell roundness; None if it was not measured.
    #[getter]
    fn roundness(&self) -> Option<f64> {
        self.record.wadell_roundness
    }
    /// Volume over that of the convex hull; None if it was not measured.
    #[getter]
    fn convexity(&self) -> Option<f64> {
        self.record.convexity
    }
    /// Radius of the largest inscribed sphere [m]; None if it was not measured.
    #[getter]
    fn inscribed_radius(&self) -> Option<f64> {
        self.record.inscribed_radius_m
    }
    /// Feret diameters [m], longest first; None if they were not measured.
    #[getter]
    fn feret(&self) -> Option<(f64, f64, f64)> {
        self.record.feret_m.map(|[l, w, t]| (l, w, t))
    }
    /// Surface area [m2].
    #[getter]
    fn surface_area(&self) -> f64 {
        self.record.surface_area_m2
    }
    /// Radius of the smallest sphere about the centroid that contains the grain [m].
    #[getter]
    fn bounding_radius(&self) -> f64 {
        self.record.bounding_radius_m
    }
    /// Principal second moments per unit density [m5], shape (3,).
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(numbers(py, self.record.inertia_m5.to_vec()))
    }
    /// Surface nodes in the frame of the grain [m], shape (n, 3).
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        read_only(vectors(py, self.shape.nodes().iter().map(|node| node.position)))
    }
    /// Area of each surface node [m2], shape (n,).
    #[getter]
    fn node_areas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(numbers(py, self.shape.nodes().iter().map(|node| node.area).collect()))
    }
    /// Origin of the shape: "analytic", "mesh", "scan" or "family".
    #[getter]
    fn method(&self) -> &str {
        &self.record.method
    }
    /// Hash of the geometry; equal grains have equal digests.
    #[getter]
    fn digest(&self) -> &str {
        &self.record.digest
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<PyGrain>().is_ok_and(|other| other.get().record.digest == self.record.digest)
    }
    fn __hash__(&self) -> u64 {
        let head = self.record.digest.get(..16).unwrap_or_default();
        u64::from_str_radix(head, 16).unwrap_or_default()
    }
    fn __repr__(&self) -> String {
        let r = &self.record;
        format!(
            "Grain({}, equivalent diameter {:.4} mm, Krumbein sphericity {:.3})",
            r.method,
            1e3 * r.equivalent_diameter_m,
            r.krumbein_sphericity
        )
    }
}
