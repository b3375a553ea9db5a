//! Part of a grey image around one grain.

use super::watershed::HALO;
use crate::grid;

/// Distance from the surface beyond which a voxel is entirely solid or void [voxels].
pub(super) const BAND: f32 = 2.7;
/// Preferred additional distance from the band at which the grey values of a grain and of the void
/// around it are sampled [voxels].
pub(super) const DEEPER: f32 = 0.5;
/// Minimum number of deep voxels for the grey of a grain and of the void around it.
pub(super) const SOME_DEEP: usize = 24;

/// Part of an image around a grain.
pub(super) struct Crop<'a> {
    /// Size, grey values and owners of the voxels of the image.
    pub image_dims: [usize; 3],
    pub values: &'a [f32],
    pub owner: &'a [u32],
    /// Grey value outside the field of view.
    pub outside: Option<f32>,
    /// Size of the crop.
    pub dims: [usize; 3],
    /// Image coordinate of the first voxel, which may lie outside.
    pub low: [isize; 3],
}

impl Crop<'_> {
    /// Returns the index in the image of voxel `n` of the crop.
    pub fn place(&self, n: usize) -> Option<usize> {
        let (at, dims) = (grid::place(self.dims, n), self.image_dims);
        let mut index = 0;
        for axis in (0..3).rev() {
            let i = usize::try_from(self.low[axis] + at[axis] as isize).ok()?;
            if i >= dims[axis] {
                return None;
            }
            index = index * dims[axis] + i;
        }
        Some(index)
    }

    /// Returns the grey value of voxel `n` if it lies inside the field of view.
    pub fn grey(&self, n: usize) -> Option<f32> {
        let value = self.values[self.place(n)?];
        (Some(value) != self.outside).then_some(value)
    }

    /// Returns whether voxel `n` belongs to a grain.
    pub fn is_solid(&self, n: usize) -> bool {
        let owner = self.place(n).map_or(0, |m| self.owner[m]);
        owner != 0 && owner & HALO == 0
    }

    /// Returns the mean grey of the voxels farther than `limit` from the surface and from cavities;
    /// `None` if there are too few.
    pub fn deep_grey(&self, depth: &[f32], limit: f32) -> Option<f64> {
        let deep = (0..depth.len()).filter(|n| depth[*n] < -limit);
        let deep: Vec<f64> =
            deep.filter_map(|n| Some(f64::from(self.values[self.place(n)?]))).collect();
        (deep.len() >= SOME_DEEP).then(|| deep.iter().sum::<f64>() / deep.len() as f64)
    }
}
