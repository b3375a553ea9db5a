//! Closed surface meshes: readers, writers, exact distances, and shapes built from them.

mod build;
mod distance;
mod harmonics;
mod nearest_cache;
mod obj;
mod ply;
mod polygon;
mod propagate;
mod read;
mod sampling;
mod stl;
mod weld;
mod write;

pub use crate::triangles::TriangleMesh;
pub(crate) use build::from_closed;
pub use build::{MeshOptions, shape_from_mesh};
pub(crate) use distance::MeshDistance;
pub use read::{mesh_from_memory, read_mesh};
pub use write::{MeshFormat, write_mesh};
