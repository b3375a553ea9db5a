//! Geometry of grains on the grid: distances to faces, index lists, neighbouring grains, apertures.

pub mod aperture;
mod distances;
mod index_map;
mod lists;
mod locator;
mod narrow_band;
mod neighbours;
mod samples;

pub use index_map::PAD;
pub use lists::{BandFaces, FaceRow, FaceRun, LocatedBody};
pub use locator::{LocateScratch, Locator};
pub use narrow_band::NarrowBandShapes;
pub use neighbours::NeighbourGrain;
pub use samples::load_all;
