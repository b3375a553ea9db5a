//! Constructors of grains: closed forms, meshes and the generator.

use std::path::PathBuf;

use glam::DVec3;
use grainwake_run::case::quantity::Length;
use grainwake_run::number_format;
use grainwake_shape::family::{FamilyTarget, family_grain, family_options};
use grainwake_shape::mesh::{
    MeshOptions, TriangleMesh, mesh_from_memory, read_mesh, shape_from_mesh,
};
use grainwake_shape::{ReadLimits, Shape, ShapeOptions, analytic};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::PyGrain;
use crate::arguments::{Whole, array, points, quantity, wrong_shape};
use crate::error::{Raise, input};

/// Accepted equivalent diameters [m]; others indicate a wrong unit.
const GRAINS: std::ops::Range<f64> = 1e-6..1.0;

/// Returns the options of the resolution.
pub(super) fn options(cells: Option<Whole>, nodes: Option<Whole>) -> ShapeOptions {
    let [cells, nodes] = [cells, nodes].map(|count| count.map(usize::from));
    ShapeOptions { cells, nodes, ..ShapeOptions::default() }
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
    let diameter = shape.equivalent_diameter();
    if GRAINS.contains(&diameter) {
        return Ok(shape);
    }
    Err(input(format!(
        "the grain has an equivalent diameter of {}; accepted are 1 um to 1 m; check {unit} (mm or \
         m?), or set the size with equivalent_diameter=LENGTH",
        number_format::length(diameter)
    )))
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
        let radius = 0.5 * quantity::<Length>("diameter", diameter)?;
        py.detach(|| analytic::sphere(radius, &options(None, nodes))).raise().map(PyGrain::new)
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
        let how = options(cells, nodes);
        py.detach(|| analytic::ellipsoid(a, b, c, &how)).raise().map(PyGrain::new)
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
        let how = options(cells, nodes);
        py.detach(|| analytic::rounded_box(a, b, c, radius, &how)).raise().map(PyGrain::new)
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
        let how = options(cells, nodes);
        py.detach(|| analytic::cylinder(0.5 * diameter, height, &how)).raise().map(PyGrain::new)
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
        let how = options(cells, nodes);
        py.detach(|| analytic::capsule(0.5 * diameter, height, &how)).raise().map(PyGrain::new)
    }

    /// Superquadric (Barr 1981).
    ///
    /// Parameters
    /// ----------
    /// a, b, c : float or str
    ///     Full axes [m].
    /// exponents : tuple of two float
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
        exponents: (f64, f64),
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let semi_axes = lengths([("a", a), ("b", b), ("c", c)])?.map(|axis| 0.5 * axis);
        let (e1, e2) = exponents;
        let how = options(cells, nodes);
        py.detach(|| analytic::superquadric(semi_axes, e1, e2, &how)).raise().map(PyGrain::new)
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
        flip: bool,
        equivalent_diameter: Option<&Bound<'_, PyAny>>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let how = MeshOptions { shape: options(cells, nodes), flip };
        let unit = unit.map(unit_length).transpose()?;
        let built = if let Ok(path) = mesh.extract::<PathBuf>() {
            let unit = unit.ok_or_else(|| {
                input(
                    "unit: it is missing; give the length of one unit of the file, such as \"mm\"",
                )
            })?;
            py.detach(|| {
                let (mesh, source) = read_mesh(&path, unit, &ReadLimits::default())?;
                shape_from_mesh(&mesh, &source, &how)
            })
        } else {
            let raw = triangles(mesh)?;
            py.detach(|| {
                let (mesh, source) = mesh_from_memory(&raw, unit.unwrap_or(1.0))?;
                shape_from_mesh(&mesh, &source, &how)
            })
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
        sphericity: f64,
        roundness: f64,
        equivalent_diameter: Option<&Bound<'_, PyAny>>,
        flatness: Option<f64>,
        seed: u64,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let diameter = equivalent_diameter
            .map_or(Ok(2e-3), |value| quantity::<Length>("equivalent_diameter", value))?;
        let mut how = family_options();
        how.nodes = nodes.map(usize::from);
        how.cells = cells.map(usize::from).or(how.cells);
        let mut target = FamilyTarget::new(sphericity, roundness, diameter);
        target.flatness = flatness.unwrap_or(target.flatness);
        py.detach(|| family_grain(&target, seed, &how)).raise().map(PyGrain::new)
    }
}

fn lengths<const N: usize>(named: [(&str, &Bound<'_, PyAny>); N]) -> PyResult<[f64; N]> {
    let mut values = [f64::NAN; N];
    for (value, (name, given)) in values.iter_mut().zip(named) {
        *value = quantity::<Length>(name, given)?;
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
