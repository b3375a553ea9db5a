//! Shapes from 3-D images: labelled or binary volumes, or grey ones with a threshold.
//!
//! The mask of a grain is converted to a signed Euclidean distance (exact in both directions, with
//! the interface halfway between voxel centres). The distance is smoothed by a kernel that does not
//! shrink curved surfaces, and the level of the surface is set to enclose the volume of the voxels.
//! The result is processed like any closed mesh.
//!
//! Grey values, if available, locate the surface between the voxels (module `grey`): the solid
//! fraction of each voxel yields the volume, and the contour of the smoothed fraction at one half
//! the surface. Touching grains are separated by a watershed (module `watershed`).
//!
//! From a mask alone, the volume of the voxels is the best estimate that a binary image allows:
//! about 0.1 % (rms) for a sphere of diameter 20 voxels at a random position. A synthetic sphere
//! centred on a voxel is a special case: entire shells of voxels enter at once, and its mask may
//! differ from the sphere by 3 % of volume, which cannot be recovered from the mask.

mod assumed;
mod bits;
mod build;
mod crop;
mod cure;
mod description;
mod field_of_view;
mod geometry;
mod grain;
mod grey;
mod header;
mod looks_grey;
mod meta;
mod notes;
mod npy;
mod npz;
mod nrrd;
mod options;
mod phases;
mod png;
mod read;
mod refusals;
mod regions;
mod segments;
mod slices;
mod smooth;
mod surroundings;
mod threshold;
mod tiff;
mod transform;
mod volume;
mod watershed;

use std::ops::ControlFlow;

use crate::error::{Result, ShapeError};

pub use assumed::Assumed;
pub use build::{Scan, ScannedGrain, scan_volume, shapes_from_volume};
pub use cure::Cure;
pub use geometry::StatedVoxel;
pub use notes::grey_notes;
pub use options::ScanOptions;
pub use read::{read_volume, read_volume_and_voxel};
pub use refusals::{Advice, Refusal};
pub use segments::Masked;
pub use threshold::Threshold;
pub use volume::{Volume, Voxels};

/// Callback for progress: stage, completed steps, total steps. `Break` ends the work with
/// [`ShapeError::Interrupted`] before the next grain.
pub type Progress<'a> = &'a (dyn Fn(&str, u64, u64) -> ControlFlow<()> + Sync);

/// Reports progress; returns an error if the callback ends the work.
fn report(progress: Progress, stage: &str, done: u64, total: u64) -> Result<()> {
    match progress(stage, done, total) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(ShapeError::Interrupted),
    }
}

/// Solid voxels of one grain in a box of background.
pub(crate) struct Mask {
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// Whether each voxel is solid, x fastest.
    pub solid: Vec<bool>,
}
