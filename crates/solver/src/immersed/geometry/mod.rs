//! Geometry of grains on the grid. [`Locator`] fills the lists of faces (`lists`) with the
//! distances of `distances` and `narrow_band`; `neighbours` finds the grains that share faces;
//! `index_map` converts indices in the box of a grain to positions in memory; `aperture` gives open
//! and solid fractions.

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
