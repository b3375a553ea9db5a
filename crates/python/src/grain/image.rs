//! Grains of a 3-D image.

use std::collections::BTreeMap;

use grainwake_shape::scan::{Scan, Voxels};
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator};

use super::PyGrain;
use super::build::{check_unit, plausible, sized};
use super::read::{Given, read};
use crate::arguments::{Whole, flags, plain};
use crate::error::{Raise, input};

/// Grains of a 3-D image, by label.
#[pyclass(module = "grainwake", name = "Scan", frozen)]
pub struct PyScan {
    grains: BTreeMap<u32, Py<PyGrain>>,
    rejected: BTreeMap<u32, String>,
    voxels: BTreeMap<u32, u64>,
    labels: Py<PyArray3<u32>>,
    threshold: Option<f64>,
}

#[pymethods]
impl PyScan {
    /// Grains by label, in the order of the labels.
    #[getter]
    fn grains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let grains = PyDict::new(py);
        self.grains.iter().try_for_each(|(label, grain)| grains.set_item(label, grain))?;
        Ok(grains)
    }
    /// Reason of each rejected label.
    #[getter]
    fn rejected(&self) -> BTreeMap<u32, String> {
        self.rejected.clone()
    }
    /// Number of voxels of each label.
    #[getter]
    fn voxels(&self) -> BTreeMap<u32, u64> {
        self.voxels.clone()
    }
    /// Labels of the voxels, 0 for background, shape (z, y, x).
    #[getter]
    fn labels(&self, py: Python<'_>) -> Py<PyArray3<u32>> {
        self.labels.clone_ref(py)
    }
    /// Grey value of the threshold; None if none was applied.
    #[getter]
    fn threshold(&self) -> Option<f64> {
        self.threshold
    }
    fn __len__(&self) -> usize {
        self.grains.len()
    }
    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        self.grains(py)?.try_iter()
    }
    fn __contains__(&self, label: &Bound<'_, PyAny>) -> bool {
        label.extract().is_ok_and(|label: u32| self.grains.contains_key(&label))
    }
    fn __getitem__(&self, py: Python<'_>, label: i64) -> PyResult<Py<PyGrain>> {
        let known = u32::try_from(label).ok();
        if let Some(grain) = known.and_then(|label| self.grains.get(&label)) {
            return Ok(grain.clone_ref(py));
        }
        let rejected = known.and_then(|label| self.rejected.get(&label));
        let why = rejected.map_or("no voxel has it", String::as_str);
        Err(pyo3::exceptions::PyKeyError::new_err(format!("label {label}: {why}")))
    }
    fn __repr__(&self) -> String {
        format!("Scan({} grains, {} labels rejected)", self.grains.len(), self.rejected.len())
    }
}

#[pymethods]
impl PyGrain {
    /// Grain of a 3-D image that holds one grain, or the grain of one label.
    ///
    /// Parameters
    /// ----------
    /// image : path-like or array_like, shape (z, y, x)
    ///     File (.tif, .npy, .npz, .nrrd, .mha), folder of .tif or .png slices, or volume. Integers
    ///     and booleans are labels with 0 for background, floating numbers are grey values.
    /// voxel : float or str
    ///     Edge length of a voxel [m]. A file that states another one gives a `CaseWarning`, and so
    ///     does a grain with too few voxels free of blur to measure its grey value.
    /// label : int, optional
    ///     Label of a single grain.
    /// threshold : float or {"otsu", "otsu3"}, optional
    ///     Grey value between void and solid; required for grey images.
    /// median : bool, default False
    ///     Apply a median of 27 voxels before the threshold, which is then required.
    /// split : bool, default False
    ///     Treat each connected piece of solid as a grain.
    /// separate : float, optional
    ///     Separate touching grains where the neck is narrower than this fraction of the smaller
    ///     grain; 0.87 did best on rendered packings.
    /// from_mask : bool, default False
    ///     Locate surfaces by the mask even if there are grey values.
    /// pad : bool, default False
    ///     Include grains at the image border, truncated there.
    /// largest_piece : bool, default False
    ///     Keep the largest piece of a label with several pieces.
    /// smoothing : float, optional
    ///     Standard deviation of the smoothing [voxels]; 1.1 with grey values, 1.5 with a mask.
    /// rescue : bool, default False
    ///     Try rejected labels again with more smoothing or a median, the gentlest that works.
    /// labels : bool, default False
    ///     Read integers as labels even if the image looks grey.
    /// roundness : bool, default True
    ///     Measure the roundness, which is slow.
    /// equivalent_diameter : float or str, optional
    ///     Rescale to this diameter of the sphere of equal volume [m].
    /// cells, nodes : int, optional
    ///     Cells of the distance field across the longest extent, and number of surface nodes.
    ///
    /// Returns
    /// -------
    /// Grain
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The image holds several grains, or the grain is cut by the border.
    ///
    /// See Also
    /// --------
    /// scan : all grains of an image.
    #[staticmethod]
    #[pyo3(signature = (image, *, voxel, label = None, threshold = None, median = false, split = false, separate = None, from_mask = false, pad = false, largest_piece = false, smoothing = None, rescue = false, labels = false, roundness = true, equivalent_diameter = None, cells = None, nodes = None))]
    fn from_scan(
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        voxel: &Bound<'_, PyAny>,
        label: Option<Whole>,
        threshold: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = flags::median)] median: bool,
        #[pyo3(from_py_with = flags::split)] split: bool,
        #[pyo3(from_py_with = plain::separate)] separate: Option<f64>,
        #[pyo3(from_py_with = flags::from_mask)] from_mask: bool,
        #[pyo3(from_py_with = flags::pad)] pad: bool,
        #[pyo3(from_py_with = flags::largest_piece)] largest_piece: bool,
        #[pyo3(from_py_with = plain::smoothing)] smoothing: Option<f64>,
        #[pyo3(from_py_with = flags::rescue)] rescue: bool,
        #[pyo3(from_py_with = flags::labels)] labels: bool,
        #[pyo3(from_py_with = flags::roundness)] roundness: bool,
        equivalent_diameter: Option<&Bound<'_, PyAny>>,
        cells: Option<Whole>,
        nodes: Option<Whole>,
    ) -> PyResult<PyGrain> {
        let given = Given {
            label,
            median,
            split,
            separate,
            from_mask,
            pad,
            largest_piece,
            smoothing,
            rescue,
            labels,
            roundness,
            cells,
            nodes,
        };
        let scan = read(py, image, voxel, threshold, given)?;
        let labels: Vec<String> = scan.grains.iter().map(|g| g.label.to_string()).collect();
        let mut grains = scan.grains.into_iter();
        let (Some(grain), None) = (grains.next(), grains.next()) else {
            return Err(input(format!(
                "the image holds {} grains, but one is wanted; the labels are {}{}; select one with \
                 label=N, or take all with grainwake.scan; if the values are grey values instead of \
                 labels, add threshold=\"otsu\"",
                labels.len(),
                labels[..labels.len().min(10)].join(", "),
                if labels.len() > 10 { ", ..." } else { "" }
            )));
        };
        sized(grain.shape.raise()?, equivalent_diameter, "voxel").map(PyGrain::new)
    }
}

/// All grains of a 3-D image.
///
/// Parameters
/// ----------
/// image : path-like or array_like, shape (z, y, x)
///     File (.tif, .npy, .npz, .nrrd, .mha), folder of .tif or .png slices, or volume. Integers
///     and booleans are labels with 0 for background, floating numbers are grey values.
/// voxel : float or str
///     Edge length of a voxel [m]. A file that states another one gives a `CaseWarning`, as do
///     grains with too few voxels free of blur to measure their grey value.
/// label : int, optional
///     Label of a single grain.
/// threshold : float or {"otsu", "otsu3"}, optional
///     Grey value between void and solid; required for grey images.
/// median : bool, default False
///     Apply a median of 27 voxels before the threshold, which is then required.
/// split : bool, default False
///     Treat each connected piece of solid as a grain.
/// separate : float, optional
///     Separate touching grains where the neck is narrower than this fraction of the smaller
///     grain; 0.87 did best on rendered packings.
/// from_mask : bool, default False
///     Locate surfaces by the mask even if there are grey values.
/// pad : bool, default False
///     Include grains at the image border, truncated there.
/// largest_piece : bool, default False
///     Keep the largest piece of a label with several pieces.
/// smoothing : float, optional
///     Standard deviation of the smoothing [voxels]; 1.1 with grey values, 1.5 with a mask.
/// rescue : bool, default False
///     Try rejected labels again with more smoothing or a median, the gentlest that works.
/// labels : bool, default False
///     Read integers as labels even if the image looks grey.
/// roundness : bool, default True
///     Measure the roundness, which is slow.
/// equivalent_diameter : float or str, optional
///     Rescale to this diameter of the sphere of equal volume [m].
/// cells, nodes : int, optional
///     Cells of the distance field across the longest extent, and number of surface nodes.
///
/// Returns
/// -------
/// Scan
///     Grains by label, and the reason of each rejected label.
#[pyfunction]
#[pyo3(signature = (image, *, voxel, label = None, threshold = None, median = false, split = false, separate = None, from_mask = false, pad = false, largest_piece = false, smoothing = None, rescue = false, labels = false, roundness = true, equivalent_diameter = None, cells = None, nodes = None))]
pub fn scan(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    voxel: &Bound<'_, PyAny>,
    label: Option<Whole>,
    threshold: Option<&Bound<'_, PyAny>>,
    #[pyo3(from_py_with = flags::median)] median: bool,
    #[pyo3(from_py_with = flags::split)] split: bool,
    #[pyo3(from_py_with = plain::separate)] separate: Option<f64>,
    #[pyo3(from_py_with = flags::from_mask)] from_mask: bool,
    #[pyo3(from_py_with = flags::pad)] pad: bool,
    #[pyo3(from_py_with = flags::largest_piece)] largest_piece: bool,
    #[pyo3(from_py_with = plain::smoothing)] smoothing: Option<f64>,
    #[pyo3(from_py_with = flags::rescue)] rescue: bool,
    #[pyo3(from_py_with = flags::labels)] labels: bool,
    #[pyo3(from_py_with = flags::roundness)] roundness: bool,
    equivalent_diameter: Option<&Bound<'_, PyAny>>,
    cells: Option<Whole>,
    nodes: Option<Whole>,
) -> PyResult<PyScan> {
    let given = Given {
        label,
        median,
        split,
        separate,
        from_mask,
        pad,
        largest_piece,
        smoothing,
        rescue,
        labels,
        roundness,
        cells,
        nodes,
    };
    let Scan { grains, labels, threshold, .. } = read(py, image, voxel, threshold, given)?;
    let (mut accepted, mut rejected, mut voxels) =
        (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    for grain in grains {
        voxels.insert(grain.label, grain.voxels);
        match grain.shape {
            Ok(shape) => {
                let shape = match equivalent_diameter {
                    Some(_) => sized(shape, equivalent_diameter, "voxel")?,
                    None => shape,
                };
                accepted.insert(grain.label, Py::new(py, PyGrain::new(shape))?);
            }
            Err(why) => {
                rejected.insert(grain.label, why.to_string());
            }
        }
    }
    // Only the largest grain is checked, because fragments may be small.
    let largest = accepted.values().map(|grain| &grain.get().shape);
    let size = |shape: &&std::sync::Arc<grainwake_shape::Shape>| shape.equivalent_diameter();
    if let (Some(shape), None) =
        (largest.max_by(|a, b| size(a).total_cmp(&size(b))), equivalent_diameter)
    {
        plausible(shape, &check_unit("voxel"))?;
    }
    let [nx, ny, nz] = labels.dims;
    let Voxels::Labels(values) = labels.voxels else {
        return Err(input("the image has no labels"));
    };
    let labels = Array3::from_shape_vec((nz, ny, nx), values)
        .map_err(|error| input(error.to_string()))?
        .into_pyarray(py)
        .unbind();
    Ok(PyScan { grains: accepted, rejected, voxels, labels, threshold })
}
