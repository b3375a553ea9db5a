//! Volumes of NumPy arrays.

use grainwake_shape::SourceFile;
use grainwake_shape::scan::{Volume, Voxels};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sha2::{Digest, Sha256};

use crate::arguments::{array, wrong_shape};
use crate::error::input;

/// Returns an array of the shape (z, y, x) as a volume: integers and booleans are labels, floating
/// numbers grey values.
pub(super) fn volume(image: &Bound<'_, PyAny>) -> PyResult<Volume> {
    let numpy = image.py().import("numpy")?;
    if numpy.getattr("ma")?.call_method1("isMaskedArray", (image,))?.is_truthy()? {
        return Err(input("image: found a masked array; fill its masked voxels first (filled)"));
    }
    let plain = numpy.call_method1("asarray", (image,))?;
    let kind: String = plain.getattr("dtype")?.getattr("kind")?.extract()?;
    let is_label = matches!(kind.as_str(), "b" | "u" | "i") && fits_labels(&plain)?;
    let (shape, voxels) = if is_label {
        let values = array::<u32>("image", &plain)?;
        (values.shape().to_vec(), Voxels::Labels(values.readonly().as_slice()?.to_vec()))
    } else {
        let values = array::<f32>("image", &plain)?;
        (values.shape().to_vec(), Voxels::Grey(values.readonly().as_slice()?.to_vec()))
    };
    let [nz, ny, nx] = shape[..] else {
        return Err(wrong_shape("image", &shape, "three axes (z, y, x)"));
    };
    if nx * ny * nz == 0 {
        return Err(wrong_shape("image", &shape, "at least one voxel along each axis"));
    }
    if let Voxels::Grey(values) = &voxels
        && let Some(n) = values.iter().position(|value| !value.is_finite())
    {
        let at = [n / (nx * ny), n / nx % ny, n % nx];
        return Err(input(format!("image: found {} at the voxel {at:?} (z, y, x)", values[n])));
    }
    Ok(Volume { dims: [nx, ny, nz], voxels })
}

/// Returns whether integers can be labels; others are grey values, as in files.
fn fits_labels(values: &Bound<'_, PyAny>) -> PyResult<bool> {
    if values.getattr("size")?.extract::<usize>()? == 0 {
        return Ok(true);
    }
    let bound = |name: &str| values.call_method0(name)?.call_method0("__int__")?.extract::<i128>();
    Ok(bound("min")? >= 0 && bound("max")? <= i128::from(u32::MAX))
}

/// Returns the identity of a volume in memory, for the provenance.
pub(super) fn source(volume: &Volume) -> SourceFile {
    let mut hash = Sha256::new();
    match &volume.voxels {
        Voxels::Labels(values) => values.iter().for_each(|v| hash.update(v.to_le_bytes())),
        Voxels::Grey(values) => values.iter().for_each(|v| hash.update(v.to_le_bytes())),
    }
    let sha256 = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    SourceFile { name: "array".into(), sha256, ..SourceFile::default() }
}
