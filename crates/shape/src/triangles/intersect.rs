//! Detection of self-intersections of a mesh.

use super::TriangleMesh;
use super::bvh::Bvh;
use super::check::point;
use crate::error::{Result, ShapeError};
use glam::DVec3;
use rayon::prelude::*;

impl TriangleMesh {
    /// Refuses a surface with intersecting faces. Touching faces are allowed, and pairs with a
    /// common edge are not tested. The error names the first pair in file order.
    ///
    /// # Errors
    /// The first pair of faces that intersect.
    pub fn check_crossings(&self) -> Result<()> {
        let bvh = Bvh::new(&self.faces());
        let mut crossings: Vec<(u32, u32, DVec3)> = (0..self.triangles.len() as u32)
            .into_par_iter()
            .flat_map_iter(|face| {
                let mut crossings = Vec::new();
                bvh.overlapping(&self.corners(face as usize), |other| {
                    if other > face
                        && let Some(at) = self.crossing(face, other)
                    {
                        crossings.push((face, other, at));
                    }
                });
                crossings
            })
            .collect();
        crossings.sort_unstable_by_key(|(face, other, _)| (*face, *other));
        match crossings.first() {
            None => Ok(()),
            Some(&(face, other, at)) => Err(ShapeError::bad_mesh(format!(
                "faces {face} and {other} (counted from 0) cross near {} ({} pairs cross in \
                 all), so inside and outside are undefined there; repair the mesh (in MeshLab: \
                 Select Self Intersecting Faces; in Blender: Remesh)",
                point(at),
                crossings.len()
            ))),
        }
    }

    /// Returns a point where the interior of an edge of one face crosses the interior of the other
    /// face.
    fn crossing(&self, face: u32, other: u32) -> Option<DVec3> {
        let (t, o) = (self.triangles[face as usize], self.triangles[other as usize]);
        if t.iter().filter(|v| o.contains(v)).count() >= 2 {
            return None;
        }
        let through = |from: [u32; 3], to: [u32; 3]| {
            let corners = to.map(|v| self.vertices[v as usize]);
            (0..3).find_map(|i| {
                let (p, q) = (from[i], from[(i + 1) % 3]);
                // An edge that ends in a corner of the other face meets it there.
                if to.contains(&p) || to.contains(&q) {
                    return None;
                }
                passes(self.vertices[p as usize], self.vertices[q as usize], corners)
            })
        };
        through(t, o).or_else(|| through(o, t))
    }
}

/// Returns the point where the segment from `p` to `q` crosses the interior of a triangle.
fn passes(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let volume = |w: DVec3, x: DVec3, y: DVec3, z: DVec3| (x - w).cross(y - w).dot(z - w);
    let (before, after) = (volume(a, b, c, p), volume(a, b, c, q));
    if before * after >= 0.0 {
        return None;
    }
    let sides = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    let inside = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
    inside.then(|| p + (q - p) * (before / (before - after)))
}

#[cfg(test)]
mod tests {
    use super::super::cube_sphere;
    use super::*;

    #[test]
    fn a_dented_ball_passes() {
        let mesh =
            cube_sphere(12, |u| u * (1.0 - 0.5 * (-8.0 * u.distance_squared(DVec3::X)).exp()));
        mesh.check_crossings().unwrap();
    }

    #[test]
    fn a_ball_pushed_through_itself_is_located() {
        // The cap at +x emerges on the opposite side.
        let mesh =
            cube_sphere(12, |u| u - DVec3::X * 2.5 * (-20.0 * u.distance_squared(DVec3::X)).exp());
        mesh.check_closed().unwrap();
        let message = mesh.check_crossings().unwrap_err().to_string();
        assert!(message.contains("cross near (-"), "{message}");
    }

    #[test]
    fn a_segment_must_pass_through_the_inside() {
        let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let down = |x, y, to| passes(DVec3::new(x, y, 1.0), DVec3::new(x, y, to), t);
        assert_eq!(down(0.25, 0.25, -1.0), Some(DVec3::new(0.25, 0.25, 0.0)));
        assert_eq!(down(0.25, 0.25, 0.5), None);
        assert_eq!(down(0.75, 0.75, -1.0), None);
        assert_eq!(down(0.0, 0.5, -1.0), None, "the rim is no inside");
        assert_eq!(down(0.25, 0.25, 0.0), None, "a touch is no crossing");
    }
}
