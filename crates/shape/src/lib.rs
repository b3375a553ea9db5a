//! Grain shapes: a signed distance field in the body's principal frame, its surface nodes,
//! mass properties and morphology record. A shape is immutable, shared, and knows no pose.
//!
//! Frame: origin at the centroid, axes along the principal axes of inertia (smallest moment
//! about x, largest about z), lengths in metres. Sign: distance is negative inside. Inertia is
//! per unit density [m^5].
//!
//! Shapes come from closed forms ([`analytic`]), closed surface meshes ([`mesh`]), 3-D images
//! ([`scan`]) and a generator ([`family`]); [`Shape::save`] and [`Shape::load`] keep them in `.grain` files.

pub mod analytic;
mod assemble;
mod compare;
mod distance;
mod error;
pub mod family;
mod feret;
mod field;
mod grain_file;
mod grid;
mod hull;
mod inscribed;
mod limits;
mod mass;
pub mod mesh;
mod morphology;
mod nodes;
mod principal;
mod provenance;
mod quality;
mod random;
pub mod render;
mod roundness;
pub mod scan;
mod shape;
mod surface;
mod table;

pub use assemble::ShapeOptions;
pub use compare::Comparison;
pub use error::{Result, ShapeError};
pub use field::SampledField;
pub use limits::{Memory, ReadLimits, SourceFile};
pub use morphology::{Morphology, Record};
pub use provenance::Provenance;
pub use quality::{Quality, QualityBounds};
pub use shape::{Field, Shape, SurfaceNode};
pub use table::write_table;
