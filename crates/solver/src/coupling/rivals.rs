//! Grains that may hold the same faces: others nearby, and periodic images.

use glam::{DVec3, IVec3};

use super::near::{NearShape, NearShapes};
use super::places::Unknowns;
use crate::dem::Grain;
use crate::grid::Mesh;

/// Distances that differ by less than this part of the band are equal: of two copies of a link
/// across a periodic edge just one must count.
const TIE: f64 = 1e-9;

/// Another grain nearby, or an image of the grain itself.
pub struct Rival<'a> {
    pub grain: &'a Grain,
    pub shape: &'a NearShape,
    /// From the grain to the image in question [m].
    pub shift: DVec3,
    /// Added to its distance, as a part of the band, so that it has the faces as far from both or
    /// has not.
    pub handicap: f64,
}

impl Rival<'_> {
    /// Distance of `x` from its surface [m] where that is at most `limit`, else that or infinity.
    pub fn distance(&self, x: DVec3, limit: f64) -> f64 {
        self.distance_and_gradient(x, limit).0
    }

    /// The same with the gradient in its own frame.
    pub fn distance_and_gradient(&self, x: DVec3, limit: f64) -> (f64, DVec3) {
        let (pose, x) = (&self.grain.pose, x - self.shift);
        let far = self.grain.shape.bounding_radius() + limit;
        if x.distance_squared(pose.position) > far * far {
            return (f64::INFINITY, DVec3::ZERO);
        }
        self.shape.distance_and_gradient(pose.to_body(x))
    }
}

/// Grains, and periodic images of them and of the grain itself, whose band may meet that of
/// grain `index`; faces matter up to `reach` [m] from a surface.
pub fn rivals<'a>(
    mesh: &Mesh,
    unknowns: &Unknowns,
    shapes: &'a NearShapes,
    reach: f64,
    grains: &'a [Grain],
    index: usize,
) -> Vec<Rival<'a>> {
    let (grain, extent) = (&grains[index], mesh.extent());
    let mut rivals = Vec::new();
    for (other, rival) in grains.iter().enumerate() {
        let radii = grain.shape.bounding_radius() + rival.shape.bounding_radius();
        let limit = radii + 2.0 * reach;
        let apart = grain.pose.position - rival.pose.position;
        if (0..3).any(|axis| apart[axis].abs() > limit && !unknowns.is_periodic(axis)) {
            continue;
        }
        // Images along each axis that may be near enough: first, last.
        let range = |axis: usize| match unknowns.is_periodic(axis) {
            true if mesh.cells[axis] > 1 => (
                ((apart[axis] - limit) / extent[axis]).ceil() as i32,
                ((apart[axis] + limit) / extent[axis]).floor() as i32,
            ),
            _ => (0, 0),
        };
        let [(ax, bx), (ay, by), (az, bz)] = [range(0), range(1), range(2)];
        for z in az..=bz {
            for y in ay..=by {
                for x in ax..=bx {
                    let image = IVec3::new(x, y, z);
                    let shift = image.as_dvec3() * extent;
                    let own = other == index;
                    if own && image == IVec3::ZERO
                        || (apart - shift).length_squared() > limit * limit
                    {
                        continue;
                    }
                    rivals.push(Rival {
                        grain: rival,
                        shape: shapes.of(other),
                        shift,
                        handicap: match own {
                            true if image.to_array() > [0; 3] => -TIE,
                            false if other < index => -TIE,
                            _ => TIE,
                        },
                    });
                }
            }
        }
    }
    rivals
}
