//! Immutable grain shapes: signed distance in the principal frame, surface nodes with areas, mass
//! properties and morphology. A shape has no position, no orientation and no material.
//!
//! Frame: the origin is the centroid, the axes are the principal axes of inertia (smallest moment
//! about x, largest about z), lengths are in metres. Distances are negative inside. Moments of
//! inertia are per unit density [m^5].
//!
//! | Source | Module |
//! |---|---|
//! | closed forms: sphere, ellipsoid, box, cylinder, capsule, superquadric | [`analytic`] |
//! | closed surface meshes: STL, OBJ, PLY, spherical harmonics | [`mesh`] |
//! | 3-D images: TIFF, NPY, NPZ, NRRD, MetaImage | [`scan`] |
//! | generator of grains of given sphericity and roundness | [`family`] |
//!
//! [`Shape::save`] and [`Shape::load`] write and read `.grain` files, [`render`] draws shapes, and
//! [`Comparison`] measures the distance of two surfaces.
//!
//! # Example
//!
//! ```
//! use grainwake_shape::{Shape, ShapeOptions, analytic};
//! # fn main() -> grainwake_shape::Result<()> {
//! let options = ShapeOptions { cells: Some(32), ..ShapeOptions::default() };
//! let pebble = analytic::ellipsoid(1.5e-3, 1.0e-3, 0.5e-3, &options)?;
//!
//! // Signed distance and outward normal 0.1 mm outside the end of the long axis.
//! let (distance, normal) = pebble.distance_and_gradient(glam::DVec3::new(1.6e-3, 0.0, 0.0));
//! assert!((distance - 0.1e-3).abs() < 0.02e-3 && normal.x > 0.95);
//!
//! // Krumbein sphericity (Eq. 38): the cube root of b c / a^2.
//! let sphericity = pebble.morphology().krumbein_sphericity;
//! assert!((sphericity - (2.0f64 / 9.0).cbrt()).abs() < 0.01);
//!
//! // Files restore the shape exactly.
//! let restored = Shape::from_bytes(&pebble.to_bytes(), "pebble.grain".as_ref())?;
//! assert_eq!(restored.digest(), pebble.digest());
//! # Ok(())
//! # }
//! ```

pub mod analytic;
mod assemble;
mod compare;
#[cfg(test)]
mod disk_tests;
mod distance;
mod error;
pub mod family;
mod feret;
mod field;
mod filter;
mod grain_file;
mod grid;
mod hull;
mod inscribed;
mod limits;
mod mass;
mod memory;
pub mod mesh;
mod morphology;
mod nodes;
mod principal;
mod provenance;
mod quality;
mod random;
mod record;
pub mod render;
mod roundness;
mod runs;
pub mod scan;
mod shape;
mod specks;
mod surface;
mod table;
mod triangles;

pub use assemble::ShapeOptions;
pub use compare::Comparison;
pub use error::{Defect, Result, ShapeError, check_length};
pub use field::SampledField;
pub use limits::{Memory, ReadLimits, SourceFile};
pub use memory::available_memory;
pub use morphology::Morphology;
pub use nodes::SurfaceNode;
pub use provenance::Provenance;
pub use quality::{Quality, QualityBounds};
pub use record::Record;
pub use shape::{Field, Shape};
pub use table::write_table;
