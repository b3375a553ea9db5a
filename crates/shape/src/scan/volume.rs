//! A 3-D image in memory.

use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, SourceFile, extension, read_bytes};
use std::path::Path;

/// Voxel values.
#[derive(Clone, Debug, PartialEq)]
pub enum Voxels {
    /// Whole numbers: 0 is background, equal numbers belong together.
    Labels(Vec<u32>),
    /// Grey values; a threshold tells solid from background.
    Grey(Vec<f32>),
}

/// A 3-D image, x fastest, then y, then z.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// Their values.
    pub voxels: Voxels,
}

impl Volume {
    /// Labels with x fastest; refused where the number of values does not fit the dimensions.
    pub fn from_labels(dims: [usize; 3], labels: Vec<u32>) -> Result<Volume> {
        if dims.iter().try_fold(1usize, |n, d| n.checked_mul(*d)) != Some(labels.len()) {
            let value = labels.len() as f64;
            let reason = "does not equal the product of the dimensions";
            return Err(ShapeError::BadParameter {
                name: "number of voxels",
                value,
                reason,
            });
        }
        Ok(Volume {
            dims,
            voxels: Voxels::Labels(labels),
        })
    }

    /// Decides between labels and grey values: whole non-negative numbers are labels.
    pub(super) fn from_numbers(dims: [usize; 3], values: Vec<f32>) -> Result<Volume> {
        if let Some(n) = values.iter().position(|v| !v.is_finite()) {
            let (i, j, k) = (n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]);
            return Err(ShapeError::NotFinite {
                what: format!("the value of voxel x {i}, y {j}, z {k}"),
            });
        }
        // Beyond this f32 skips whole numbers, so that labels could merge.
        let whole = |v: &f32| *v >= 0.0 && *v <= 16_777_216.0 && v.fract() == 0.0;
        let voxels = if values.iter().all(whole) {
            Voxels::Labels(values.iter().map(|v| *v as u32).collect())
        } else {
            Voxels::Grey(values)
        };
        Ok(Volume { dims, voxels })
    }
}

/// Reads a 3-D image: a multi-page TIFF (8, 16 or 32 bits, whole or floating) or an NPY array
/// indexed [z][y][x].
pub fn read_volume(path: &Path, limits: &ReadLimits) -> Result<(Volume, SourceFile)> {
    let reader = match extension(path).as_str() {
        "tif" | "tiff" => super::tiff::read,
        "npy" => super::npy::read,
        _ => {
            return Err(ShapeError::UnknownFormat {
                path: path.to_owned(),
                known: ".tif, .tiff, .npy",
            });
        }
    };
    let (bytes, source) = read_bytes(path, limits)?;
    let volume = reader(path, &bytes, limits)?;
    Ok((volume, source))
}

/// Refuses dimensions that are empty or over the limit; returns the number of voxels.
pub(super) fn count(path: &Path, dims: [u64; 3], limits: &ReadLimits) -> Result<usize> {
    let product = dims.iter().try_fold(1u64, |n, d| n.checked_mul(*d));
    match product {
        Some(0) => Err(ShapeError::malformed(path, "the image has no voxels")),
        Some(n) if n <= limits.voxels && usize::try_from(n).is_ok() => Ok(n as usize),
        _ => Err(ShapeError::TooLarge {
            path: path.to_owned(),
            claimed: format!("{} x {} x {} voxels", dims[0], dims[1], dims[2]),
            limit: limits.voxels,
            unit: "voxels",
        }),
    }
}
