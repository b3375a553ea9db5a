//! Nearest-point queries on a mesh for a converging sequence of query points.
//!
//! From the centre of a grain most of its surface is about equally far, so that a hierarchy visits
//! most of it. If a face is nearest to one point, a face farther away by more than twice the
//! displacement cannot be nearest to a displaced point: the set of candidates shrinks as the
//! sequence converges.

use super::MeshDistance;
use crate::triangles::Nearest;
use glam::DVec3;

/// Maximum number of cached faces.
const KEPT: usize = 4096;
/// Full searches before the cache is rebuilt around the last query point.
const PATIENCE: usize = 16;

/// Nearest-point search among cached faces, with a full search as fallback.
pub(super) struct About<'a> {
    mesh: &'a MeshDistance,
    centre: DVec3,
    /// Faces nearest to the centre with their distances from it [m], nearest first.
    faces: Vec<(f64, u32)>,
    /// Full searches since the cache was built.
    missed: usize,
}

impl<'a> About<'a> {
    pub(super) fn new(mesh: &'a MeshDistance) -> About<'a> {
        About { mesh, centre: DVec3::ZERO, faces: Vec::new(), missed: 0 }
    }

    /// Returns the nearest point of the mesh to `x`.
    pub(super) fn nearest(&mut self, x: DVec3) -> Nearest {
        if let Some(nearest) = self.among_kept(x) {
            return nearest;
        }
        self.missed += 1;
        if self.missed > PATIENCE {
            self.collect(x);
        }
        self.mesh.nearest(x, &mut 0)
    }

    /// Returns the nearest point if it must lie on a cached face.
    fn among_kept(&self, x: DVec3) -> Option<Nearest> {
        let away = x.distance(self.centre);
        let mut best: Option<(f64, Nearest)> = None;
        for (distance, face) in &self.faces {
            // Lower bound of the distance of this and all later faces from `x`.
            if let Some((nearest, place)) = best
                && distance - away >= nearest
            {
                return Some(place);
            }
            let place = self.mesh.on_face(x, *face);
            let distance = place.point.distance(x);
            if best.is_none_or(|(nearest, _)| distance < nearest) {
                best = Some((distance, place));
            }
        }
        let all = self.faces.len() == self.mesh.faces() as usize;
        best.filter(|_| all).map(|(_, place)| place)
    }

    fn collect(&mut self, x: DVec3) {
        let distance = |face: u32| (self.mesh.on_face(x, face).point.distance(x), face);
        let mut faces: Vec<(f64, u32)> = (0..self.mesh.faces()).map(distance).collect();
        let nearer = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if faces.len() > KEPT {
            faces.select_nth_unstable_by(KEPT, nearer);
            faces.truncate(KEPT);
        }
        faces.sort_unstable_by(nearer);
        (self.centre, self.faces, self.missed) = (x, faces, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::triangles::cube_sphere;

    /// Convergence to a point in a lumpy ball with decreasing steps.
    #[test]
    fn the_kept_faces_agree_with_all() {
        let lump = |u: DVec3| u * (1.0 + 0.05 * (5.0 * u.x).sin() * u.y);
        let mesh = MeshDistance::new(&cube_sphere(40, lump)).unwrap();
        let mut about = About::new(&mesh);
        let mut spared = 0;
        for i in 0..200 {
            let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
            let x = 0.95f64.powi(i) * (u.fract() - DVec3::splat(0.5));
            spared += i32::from(about.among_kept(x).is_some());
            let found = about.nearest(x).point.distance(x);
            let all = mesh.nearest(x, &mut 0).point.distance(x);
            assert!((found - all).abs() < 1e-14, "{found} for {all}");
        }
        assert!(spared > 50, "{spared}");
    }
}
