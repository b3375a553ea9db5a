//! Choice of the reader of an image by its file name.

use super::geometry::StatedVoxel;
use super::volume::Volume;
use super::{meta, npy, npz, nrrd, slices, tiff};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, SourceFile, extension, read_bytes};
use std::path::Path;

type Reader = fn(&Path, &[u8], &ReadLimits) -> Result<(Volume, Option<StatedVoxel>)>;

/// Reads a 3-D image: a multi-page TIFF (8, 16 or 32 bits, integer or floating-point, or single
/// bits; including BigTIFF), a folder of TIFF or PNG slices, an NPY array indexed [z][y][x], an NPZ
/// archive with one array, NRRD or MetaImage (with voxels inside, or raw in a separate file). If
/// the axes of a header are left-handed, the x axis is reversed.
///
/// # Errors
/// The file cannot be read, exceeds the limits, has no format of the list, is damaged, has voxels
/// that are not cubes, or has a single slice.
pub fn read_volume(path: &Path, limits: &ReadLimits) -> Result<(Volume, SourceFile)> {
    read_volume_and_voxel(path, limits).map(|(volume, source, _)| (volume, source))
}

/// Reads a 3-D image as [`read_volume`] does, and the edge length of a voxel if the file states it.
///
/// # Errors
/// As [`read_volume`].
pub fn read_volume_and_voxel(
    path: &Path,
    limits: &ReadLimits,
) -> Result<(Volume, SourceFile, Option<StatedVoxel>)> {
    let image = if path.is_dir() { slices::read(path, limits) } else { read_file(path, limits) }?;
    let [x, y, z] = image.0.dims;
    if x.min(y).min(z) < 2 {
        let reason = format!(
            "the image has {x} x {y} x {z} voxels; a grain needs a 3-D image: a multi-page .tif, or \
             the folder of all slices"
        );
        return Err(ShapeError::unsupported(path, reason));
    }
    Ok(image)
}

fn read_file(
    path: &Path,
    limits: &ReadLimits,
) -> Result<(Volume, SourceFile, Option<StatedVoxel>)> {
    let reader: Reader = match extension(path).as_str() {
        "tif" | "tiff" => tiff::read,
        "npy" => |path, bytes, limits| Ok((npy::read(path, bytes, limits)?, None)),
        "npz" => |path, bytes, limits| Ok((npz::read(path, bytes, limits)?, None)),
        "nrrd" | "nhdr" => nrrd::read,
        "mha" | "mhd" => meta::read,
        _ => {
            let reason = "unknown file type; supported: .tif, .tiff, .npy, .npz, .nrrd, .nhdr, \
                          .mha, .mhd, or a folder of .tif or .png slices";
            return Err(ShapeError::unsupported(path, reason));
        }
    };
    let (bytes, source) = read_bytes(path, limits)?;
    let (volume, voxel) = reader(path, &bytes, limits)?;
    Ok((volume, source, voxel))
}
