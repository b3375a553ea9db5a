//! Constructors of grains: closed forms, meshes and the generator.

use std::path::PathBuf;

use glam::DVec3;
use grainwake_run::case::Problem;
use grainwake_run::case::quantity::Length;
use grainwake_run::check_grain_size;
use grainwake_shape::family::{FamilyTarget, family_grain, family_options};
use grainwake_shape::mesh::{
    MeshOptions, TriangleMesh, mesh_from_memory, read_mesh, shape_from_mesh,
};
use grainwake_shape::{ReadLimits, Shape, ShapeOptions, analytic, check_length};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::PyGrain;
use crate::arguments::{
    Whole, array, flags, plain, plain_numbers, points, quantity, seed, whole, wrong_shape,
};
use crate::error::{Raise, input, refused};
use crate::threads::detached;

/// Returns the options of the resolution.
pub(super) fn options(cells: Option<&Whole>, nodes: Option<&Whole>) -> PyResult<ShapeOptions> {
    let (cells, nodes) = (whole("cells", cells, 1)?, whole("nodes", nodes, 1)?);
    Ok(ShapeOptions { cells, nodes, ..ShapeOptions::default() })
}

/// Rescales a shape on request; without it refuses an implausible size, which indicates a wrong
/// value of the argument `unit`.
pub(super) fn sized(
    shape: Shape,
    equivalent_diameter: Option<&Bound<'_, PyAny>>,
    unit: &str,
) -> PyResult<Shape> {
    if let Some(diameter) = equivalent_diameter {
        let diameter = quantity::<Length>("equivalent_diameter", diameter)?;
        return shape.scaled_to_equivalent_diameter(diameter).raise();
    }
    plausible(&shape, &check_unit(unit))?;
    Ok(shape)
}

/// Returns the remedy of an implausible size that a wrong value of the argument `unit` causes.
pub(super) fn check_unit(unit: &str) -> String {
    format!("check {unit} (mm or m?), or set the size with equivalent_diameter=LENGTH")
}

/// Refuses a shape of implausible size with this remedy.
pub(super) fn plausible(shape: &Shape, help: &str) -> PyResult<()> {
    check_grain_size(shape).map_err(|message| refused(&[Problem::new(message).help(help)]))
}

/// Builds a grain of closed form and refuses an implausible size.
fn closed_form(
    py: Python<'_>,
    cells: Option<&Whole>,
    nodes: Option<&Whole>,
    build: impl FnOnce(&ShapeOptions) -> grainwake_shape::Result<Shape> + Send,
) -> PyResult<PyGrain> {
    let options = options(cells, nodes)?;
    let shape = detached(py, || build(&options))?.raise()?;
    let help = "check the lengths: a number is in m, a string has its unit, such as \"2 mm\"; \
                scaled() gives a grain any size";
    plausible(&shape, help)?;
    Ok(PyGrain::new(shape))
}

#[pymethods]
impl PyGrain {
    /// Exact sphere.
    ///
    /// Parameters
    /// ----------
    /// diameter : float or str
    ///     Diameter [m].
    /// nodes : int, optional
    ///     Number of surface nodes.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    #[pyo3(signature = (diameter, *, nodes = None))]
    fn sphere(
        py: Python<'_>,
        diameter: &Bound<'_, PyAny>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let [diameter] = lengths([("diameter", diameter)])?;
        let build = |how: &_| analytic::sphere(0.5 * diameter, how);
        closed_form(py, None, nodes.as_ref(), build)
    }

    /// Ellipsoid.
    ///
    /// Parameters
    /// ----------
    /// a, b, c : float or str
    ///     Full axes [m], in any order.
    /// cells : int, optional
    ///     Cells of the distance field across the longest extent.
    /// nodes : int, optional
    ///     Number of surface nodes.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    #[pyo3(signature = (a, b, c, *, cells = None, nodes = None))]
    fn ellipsoid(
        py: Python<'_>,
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        c: &Bound<'_, PyAny>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let [a, b, c] = lengths([("a", a), ("b", b), ("c", c)])?.map(|axis| 0.5 * axis);
        let build = |how: &_| analytic::ellipsoid(a, b, c, how);
        closed_form(py, cells.as_ref(), nodes.as_ref(), build)
    }

    /// Box with rounded edges.
    ///
    /// Parameters
    /// ----------
    /// a, b, c : float or str
    ///     Full edges [m].
    /// radius : float or str
    ///     Radius of edges and corners [m].
    /// cells, nodes : int, optional
    ///     Resolution, as in `ellipsoid`.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    #[pyo3(signature = (a, b, c, *, radius, cells = None, nodes = None))]
    fn rounded_box(
        py: Python<'_>,
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        c: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let [a, b, c] = lengths([("a", a), ("b", b), ("c", c)])?;
        let radius = quantity::<Length>("radius", radius)?;
        let build = |how: &_| analytic::rounded_box(a, b, c, radius, how);
        closed_form(py, cells.as_ref(), nodes.as_ref(), build)
    }

    /// Cylinder.
    ///
    /// Parameters
    /// ----------
    /// diameter, height : float or str
    ///     Diameter and height [m].
    /// cells, nodes : int, optional
    ///     Resolution, as in `ellipsoid`.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    #[pyo3(signature = (diameter, height, *, cells = None, nodes = None))]
    fn cylinder(
        py: Python<'_>,
        diameter: &Bound<'_, PyAny>,
        height: &Bound<'_, PyAny>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let [diameter, height] = lengths([("diameter", diameter), ("height", height)])?;
        let build = |how: &_| analytic::cylinder(0.5 * diameter, height, how);
        closed_form(py, cells.as_ref(), nodes.as_ref(), build)
    }

    /// Capsule: a cylinder between two half spheres.
    ///
    /// Parameters
    /// ----------
    /// diameter : float or str
    ///     Diameter [m].
    /// height : float or str
    ///     Distance of the centres of the half spheres [m].
    /// cells, nodes : int, optional
    ///     Resolution, as in `ellipsoid`.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    #[pyo3(signature = (diameter, height, *, cells = None, nodes = None))]
    fn capsule(
        py: Python<'_>,
        diameter: &Bound<'_, PyAny>,
        height: &Bound<'_, PyAny>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let [diameter, height] = lengths([("diameter", diameter), ("height", height)])?;
        let build = |how: &_| analytic::capsule(0.5 * diameter, height, how);
        closed_form(py, cells.as_ref(), nodes.as_ref(), build)
    }

    /// Superquadric (Barr 1981).
    ///
    /// Parameters
    /// ----------
    /// a, b, c : float or str
    ///     Full axes [m].
    /// exponents : sequence of two float
    ///     Exponents e1, e2, 0.1 to 2; (1, 1) is an ellipsoid.
    /// cells, nodes : int, optional
    ///     Resolution, as in `ellipsoid`.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    #[pyo3(signature = (a, b, c, *, exponents, cells = None, nodes = None))]
    fn superquadric(
        py: Python<'_>,
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        c: &Bound<'_, PyAny>,
        exponents: &Bound<'_, PyAny>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let semi_axes = lengths([("a", a), ("b", b), ("c", c)])?.map(|axis| 0.5 * axis);
        let [e1, e2] = plain_numbers("exponents", exponents)?;
        let build = |how: &_| analytic::superquadric(semi_axes, e1, e2, how);
        closed_form(py, cells.as_ref(), nodes.as_ref(), build)
    }

    /// Grain of a closed surface mesh.
    ///
    /// Parameters
    /// ----------
    /// mesh : path-like, tuple of two arrays, pyvista.PolyData or trimesh.Trimesh
    ///     File (.stl, .ply, .obj, .anm), or vertices (n, 3) and faces (m, 3) of integers,
    ///     counter-clockwise seen from outside.
    /// unit : float or str
    ///     Length of one unit of the mesh: "mm", "1 mm" or 0.001. Arrays are in m by default.
    /// flip : bool, default False
    ///     Invert a mesh with inward normals.
    /// equivalent_diameter : float or str, optional
    ///     Rescale to this diameter of the sphere of equal volume [m].
    /// cells, nodes : int, optional
    ///     Resolution, as in `ellipsoid`.
    ///
    /// Returns
    /// -------
    /// Grain
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The mesh is open, crosses itself or is inside out, or its unit is missing.
    #[staticmethod]
    #[pyo3(signature = (mesh, *, unit = None, flip = false, equivalent_diameter = None, cells = None, nodes = None))]
    fn from_mesh(
        py: Python<'_>,
        mesh: &Bound<'_, PyAny>,
        unit: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = flags::flip)] flip: bool,
        equivalent_diameter: Option<&Bound<'_, PyAny>>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let how = MeshOptions { shape: options(cells.as_ref(), nodes.as_ref())?, flip };
        let unit = unit.map(unit_length).transpose()?;
        let built = if let Ok(path) = mesh.extract::<PathBuf>() {
            let unit = unit.ok_or_else(|| {
                input(
                    "unit: it is missing; give the length of one unit of the file, such as \"mm\"",
                )
            })?;
            detached(py, || {
                let (mesh, source) = read_mesh(&path, unit, &ReadLimits::default())?;
                shape_from_mesh(&mesh, &source, &how)
            })?
        } else {
            let raw = triangles(mesh)?;
            detached(py, || {
                let (mesh, source) = mesh_from_memory(&raw, unit.unwrap_or(1.0))?;
                shape_from_mesh(&mesh, &source, &how)
            })?
        };
        sized(built.raise()?, equivalent_diameter, "unit").map(PyGrain::new)
    }

    /// Generated grain of given sphericity and roundness.
    ///
    /// Parameters
    /// ----------
    /// sphericity : float
    ///     Krumbein sphericity S, 0.3 to 0.97.
    /// roundness : float
    ///     Wadell roundness R, 0.05 to 0.95.
    /// equivalent_diameter : float or str, default "2 mm"
    ///     Diameter of the sphere of equal volume [m].
    /// flatness : float, optional
    ///     Ratio c / b, 0.2 to 1 and at least S^3; 0.8, or S^3 if that is larger, by default.
    /// seed : int, default 1
    ///     Equal seeds give equal grains.
    /// cells, nodes : int, optional
    ///     Resolution, as in `ellipsoid`.
    ///
    /// Returns
    /// -------
    /// Grain
    #[staticmethod]
    #[pyo3(signature = (sphericity, roundness, equivalent_diameter = None, *, flatness = None, seed = 1, cells = None, nodes = None))]
    fn family(
        py: Python<'_>,
        #[pyo3(from_py_with = plain::sphericity)] sphericity: f64,
        #[pyo3(from_py_with = plain::roundness)] roundness: f64,
        equivalent_diameter: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = plain::flatness)] flatness: Option<f64>,
        #[pyo3(from_py_with = seed)] seed: u64,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let diameter = equivalent_diameter
            .map_or(Ok(2e-3), |value| quantity::<Length>("equivalent_diameter", value))?;
        let mut how = family_options();
        how.nodes = whole("nodes", nodes.as_ref(), 1)?;
        how.cells = whole("cells", cells.as_ref(), 1)?.or(how.cells);
        let mut target = FamilyTarget::new(sphericity, roundness, diameter);
        target.flatness = flatness.unwrap_or(target.flatness);
        detached(py, || family_grain(&target, seed, &how))?.raise().map(PyGrain::new)
    }
}

/// Returns lengths [m]. They are checked as given: radii and semi-axes are half of them.
fn lengths<const N: usize>(named: [(&'static str, &Bound<'_, PyAny>); N]) -> PyResult<[f64; N]> {
    let mut values = [f64::NAN; N];
    for (value, (name, given)) in values.iter_mut().zip(named) {
        *value = quantity::<Length>(name, given)?;
        check_length(name, *value).raise()?;
    }
    Ok(values)
}

/// Returns the length of a unit [m]; a bare unit such as "mm" means "1 mm".
fn unit_length(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(text) = value.cast::<PyString>() {
        let text = text.to_cow()?;
        if !text.is_empty() && text.chars().all(char::is_alphabetic) {
            let one = PyString::new(value.py(), &format!("1 {text}"));
            return quantity::<Length>("unit", one.as_any());
        }
    }
    quantity::<Length>("unit", value)
}

/// Returns the triangles of a pair of arrays, a PyVista surface or a trimesh.
fn triangles(mesh: &Bound<'_, PyAny>) -> PyResult<TriangleMesh> {
    let pair = if mesh.hasattr("points")? && mesh.hasattr("regular_faces")? {
        (mesh.getattr("points")?, mesh.getattr("regular_faces")?)
    } else if mesh.hasattr("vertices")? && mesh.hasattr("faces")? {
        (mesh.getattr("vertices")?, mesh.getattr("faces")?)
    } else {
        mesh.extract().map_err(|_| {
            input(
                "mesh: expected a path, a pair (vertices, faces), a pyvista.PolyData of triangles \
                 or a trimesh.Trimesh",
            )
        })?
    };
    let vertices: Vec<DVec3> = points("vertices", &pair.0)?;
    let faces = array::<i64>("faces", &pair.1)?;
    if !matches!(faces.shape(), [_, 3]) {
        return Err(wrong_shape("faces", faces.shape(), "(m, 3): triangles"));
    }
    let faces = faces.readonly();
    let corner = |index: &i64| {
        u32::try_from(*index)
            .map_err(|_| input(format!("faces: {index} is not the index of a vertex")))
    };
    let indices = faces.as_slice()?.iter().map(corner).collect::<PyResult<Vec<u32>>>()?;
    let triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    Ok(TriangleMesh { vertices, triangles })
}
