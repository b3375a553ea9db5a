//! A 3-D image in memory.

use crate::error::{Result, ShapeError};
use crate::grid::place;
use crate::limits::ReadLimits;
use ::tiff::encoder::colortype::{Gray16, Gray32};
use ::tiff::encoder::{Compression, DeflateLevel, TiffEncoder};
use grainwake_formats::disk::write_atomically;
use std::io::Cursor;
use std::path::Path;

/// Voxel values.
#[derive(Clone, Debug, PartialEq)]
pub enum Voxels {
    /// Labels: 0 is background, voxels of equal label belong together.
    Labels(Vec<u32>),
    /// Grey values, to be segmented by a threshold.
    Grey(Vec<f32>),
}

impl Voxels {
    pub(super) fn len(&self) -> usize {
        match self {
            Voxels::Labels(labels) => labels.len(),
            Voxels::Grey(values) => values.len(),
        }
    }

    /// Appends further voxels; labels become grey values if either part has grey values.
    pub(super) fn append(&mut self, more: Voxels) {
        let grey = |labels: &[u32]| labels.iter().map(|v| *v as f32).collect::<Vec<f32>>();
        match (&mut *self, more) {
            (Voxels::Labels(all), Voxels::Labels(more)) => all.extend(more),
            (Voxels::Grey(all), Voxels::Grey(more)) => all.extend(more),
            (Voxels::Grey(all), Voxels::Labels(more)) => all.extend(grey(&more)),
            (Voxels::Labels(all), Voxels::Grey(more)) => {
                let mut values = grey(all);
                values.extend(more);
                *self = Voxels::Grey(values);
            }
        }
    }
}

/// Largest label of an image with other values than unsigned integers. Single precision does not
/// represent all larger integers, so that labels could merge.
pub(super) const LARGEST_LABEL: u32 = 1 << 24;

/// Returns whether a value may be a label.
pub(super) fn is_label(value: f32) -> bool {
    (0.0..=LARGEST_LABEL as f32).contains(&value) && value.fract() == 0.0
}

/// A 3-D image, x fastest, then y, then z.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// Voxel values.
    pub voxels: Voxels,
}

impl Volume {
    /// Creates a volume of labels, x fastest.
    ///
    /// # Errors
    /// A number of labels other than the product of the dimensions.
    pub fn from_labels(dims: [usize; 3], labels: Vec<u32>) -> Result<Volume> {
        if dims.iter().try_fold(1usize, |n, d| n.checked_mul(*d)) != Some(labels.len()) {
            let (name, count) = ("number of voxels", labels.len() as f64);
            let reason = "does not equal the product of the dimensions";
            return Err(ShapeError::parameter(name, count, reason));
        }
        Ok(Volume { dims, voxels: Voxels::Labels(labels) })
    }

    /// Creates a volume, of labels if all values are non-negative integers; refuses values that are
    /// not finite.
    pub(super) fn from_voxels(path: &Path, dims: [usize; 3], voxels: Voxels) -> Result<Volume> {
        let Voxels::Grey(values) = voxels else {
            return Ok(Volume { dims, voxels });
        };
        if let Some(n) = values.iter().position(|v| !v.is_finite()) {
            let ([i, j, k], value) = (place(dims, n), values[n]);
            let reason = format!(
                "the value of voxel x {i}, y {j}, z {k} is {value}, not a finite number; give such \
                 voxels the value of the void and save the image again"
            );
            return Err(ShapeError::unsupported(path, reason));
        }
        let voxels = if values.iter().all(|v| is_label(*v)) {
            Voxels::Labels(values.iter().map(|v| *v as u32).collect())
        } else {
            Voxels::Grey(values)
        };
        Ok(Volume { dims, voxels })
    }
}

impl Volume {
    /// Writes labels as a multi-page TIFF of 16 bits (32 bits if labels need them). After an error
    /// an existing file is unchanged.
    ///
    /// # Errors
    /// The values are grey values, or those of the operating system.
    pub fn save_labels(&self, path: &Path) -> Result<()> {
        let Voxels::Labels(labels) = &self.voxels else {
            return Err(ShapeError::unsupported(path, "grey values are not labels"));
        };
        let bytes = self.label_tiff(labels).map_err(|e| ShapeError::io(path, e))?;
        let written = write_atomically(path, true, |out| out.write_all(&bytes));
        written.map_err(|e| ShapeError::io(path, e))
    }

    /// Encodes labels in memory, because the encoder moves back and forth in its output. Compressed
    /// labels take far less memory than the labels themselves.
    fn label_tiff(&self, labels: &[u32]) -> std::io::Result<Vec<u8>> {
        let mut out = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new_big(&mut out)
            .map_err(std::io::Error::other)?
            .with_compression(Compression::Deflate(DeflateLevel::Fast));
        let small = labels.iter().all(|l| *l <= u32::from(u16::MAX));
        let [width, height, _] = self.dims.map(|n| n as u32);
        for page in labels.chunks(self.dims[0] * self.dims[1]) {
            let written = if small {
                let page: Vec<u16> = page.iter().map(|l| *l as u16).collect();
                encoder.write_image::<Gray16>(width, height, &page)
            } else {
                encoder.write_image::<Gray32>(width, height, page)
            };
            written.map_err(std::io::Error::other)?;
        }
        Ok(out.into_inner())
    }
}

/// Refuses dimensions that are empty or exceed the limits; returns the number of voxels.
pub(super) fn count(path: &Path, dims: [u64; 3], limits: &ReadLimits) -> Result<usize> {
    match limits.admit(path, dims)? {
        0 => Err(ShapeError::malformed(path, "the image has no voxels")),
        n => Ok(n as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_volume;
    use super::*;
    use crate::disk_tests::fails_as_a_whole;

    #[test]
    fn labels_are_written_and_read_back() {
        let folder = tempfile::tempdir().unwrap();
        for largest in [7, 70_000, 4_000_000_000] {
            let labels = vec![0, 1, 2, 3, 4, largest, 0, 0, 9, 9, 1, 0];
            let volume = Volume::from_labels([3, 2, 2], labels).unwrap();
            let path = folder.path().join("labels.tif");
            volume.save_labels(&path).unwrap();
            assert_eq!(read_volume(&path, &ReadLimits::default()).unwrap().0, volume);
        }
    }
    #[test]
    fn a_failed_label_image_leaves_the_earlier_one() {
        let volume = Volume::from_labels([3, 2, 2], vec![7; 12]).unwrap();
        fails_as_a_whole("labels.tif", |path| volume.save_labels(path));
    }
}
