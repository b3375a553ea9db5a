//! Choice of the reader of an image by its file name.

use super::volume::Volume;
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, SourceFile, extension, read_bytes};
use std::path::Path;

/// Reads a 3-D image: a multi-page TIFF (8, 16 or 32 bits, integer or floating-point, including
/// BigTIFF), a folder of TIFF slices, an NPY array indexed [z][y][x], an NPZ archive with one
/// array, NRRD or MetaImage (with voxels inside, or raw in a separate file).
pub fn read_volume(path: &Path, limits: &ReadLimits) -> Result<(Volume, SourceFile)> {
    if path.is_dir() {
        return super::slices::read(path, limits);
    }
    let reader = match extension(path).as_str() {
        "tif" | "tiff" => super::tiff::read,
        "npy" => super::npy::read,
        "npz" => super::npz::read,
        "nrrd" | "nhdr" => super::header::read_nrrd,
        "mha" | "mhd" => super::header::read_meta,
        _ => {
            let reason = "unknown file type; supported: .tif, .tiff, .npy, .npz, .nrrd, .nhdr, \
                          .mha, .mhd, or a folder of .tif slices";
            return Err(ShapeError::unsupported(path, reason));
        }
    };
    let (bytes, source) = read_bytes(path, limits)?;
    let volume = reader(path, &bytes, limits)?;
    Ok((volume, source))
}
