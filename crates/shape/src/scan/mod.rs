//! Shapes from 3-D images: labelled or binary volumes, or grey ones with a threshold.
//!
//! A grain's mask becomes a signed Euclidean distance (exact, both directions, the interface
//! halfway between voxel centres), which is smoothed by a kernel that does not shrink curved
//! surfaces; the level of the surface is set so that it encloses the volume of the voxels. From
//! there on it is a closed mesh like any other.
//!
//! Where there are grey values, they place the surface between the voxels (module `grey`): the
//! share of solid in each voxel gives the volume, and its smoothed half-way level the surface.
//! Grains that touch are separated by a watershed (module `watershed`).
//!
//! From a mask alone, the volume of the voxels is the best estimate of the grain's that a binary image allows: about
//! 0.1 % (rms) for a sphere of 20 voxels at a place unrelated to the voxels. A synthetic sphere
//! centred on a voxel is another matter: whole shells of voxels enter at once, and its mask may
//! hold 3 % more or less than the sphere, which nothing computed from the mask can mend.

mod build;
mod field_of_view;
mod grain;
mod grey;
mod header;
mod npy;
mod npz;
mod regions;
mod runs;
mod slices;
mod smooth;
pub(crate) use smooth::{gaussian, refine};
mod threshold;
mod tiff;
mod transform;
mod volume;
mod watershed;

pub use build::{Progress, Scan, ScanOptions, ScannedGrain, scan_volume, shapes_from_volume};
pub use threshold::{Denoise, Threshold};
pub use volume::{Volume, Voxels, read_volume};

/// Solid voxels of one grain with background around them.
pub(crate) struct Mask {
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// Solid or not, x fastest.
    pub solid: Vec<bool>,
}
