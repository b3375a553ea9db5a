//! Grain shapes: a signed distance field in the body's principal frame, its surface nodes,
//! mass properties and morphology record. A shape is immutable, shared, and knows no pose.
//!
//! Frame: origin at the centroid, axes along the principal axes of inertia, lengths in metres.
//! Sign: distance is negative inside. Inertia is per unit density [m^5].

mod shape;

pub use shape::{Field, Shape, SurfaceNode};
