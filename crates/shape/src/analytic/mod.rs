//! Closed-form shapes. Distances are exact (for the superquadric: exact to a fine mesh) and sampled
//! in the principal frame; the sphere stays analytic.

mod ellipsoid;
mod solids;
mod sphere;

#[cfg(test)]
pub(crate) use ellipsoid::distance as ellipsoid_distance;
pub use ellipsoid::ellipsoid;
pub use solids::{capsule, cylinder, rounded_box, superquadric};

use crate::error::{Result, check_length, within};
use crate::{Shape, ShapeOptions};

/// Default node count of a sphere: one node per (diameter / 20)^2 of surface.
const SPHERE_NODES: usize = 1257;

/// Builds a sphere of `radius` [m].
///
/// # Errors
/// A length that is no size of a grain, or options out of their range; the message names it.
pub fn sphere(radius: f64, options: &ShapeOptions) -> Result<Shape> {
    check_length("radius", radius)?;
    let nodes = options.nodes.unwrap_or(SPHERE_NODES);
    within("nodes", nodes as f64, 1.0..=1e6, "must be 1 to 1000000")?;
    Ok(Shape::sphere(radius, nodes))
}

/// Sorts three lengths in descending order, so that x, y and z are the principal axes in order.
fn sorted(names: [&'static str; 3], lengths: [f64; 3]) -> Result<[f64; 3]> {
    for (name, length) in names.into_iter().zip(lengths) {
        check_length(name, length)?;
    }
    let mut lengths = lengths;
    lengths.sort_by(|p, q| q.total_cmp(p));
    Ok(lengths)
}
