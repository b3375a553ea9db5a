//! Shapes in closed form: exact distances (the superquadric's to a fine mesh), sampled in the
//! principal frame; the sphere stays exact.

mod ellipsoid;
mod solids;

#[cfg(test)]
pub(crate) use ellipsoid::distance as ellipsoid_distance;
pub use ellipsoid::ellipsoid;
pub use solids::{capsule, cylinder, rounded_box, superquadric};

use crate::error::{Result, ShapeError, positive};
use crate::{Shape, ShapeOptions};

/// Nodes of a sphere where none are asked for: one in every (diameter / 20)^2 of surface.
const SPHERE_NODES: usize = 1257;

/// Sphere of `radius` [m].
pub fn sphere(radius: f64, options: &ShapeOptions) -> Result<Shape> {
    positive("radius", radius)?;
    let nodes = options.nodes.unwrap_or(SPHERE_NODES);
    if !(1..=1_000_000).contains(&nodes) {
        let reason = "must be 1 to 1000000";
        return Err(ShapeError::BadParameter {
            name: "nodes",
            value: nodes as f64,
            reason,
        });
    }
    Ok(Shape::sphere(radius, nodes))
}

/// Three lengths, longest first, so that x, y, z are the principal axes in their order.
fn sorted(names: [&'static str; 3], lengths: [f64; 3]) -> Result<[f64; 3]> {
    for (name, length) in names.into_iter().zip(lengths) {
        positive(name, length)?;
    }
    let mut lengths = lengths;
    lengths.sort_by(|p, q| q.total_cmp(p));
    Ok(lengths)
}
