//! Nearest places of a mesh for places that draw together.
//!
//! From the middle of a grain most of its surface is about equally far, and a hierarchy has to look at
//! most of it. Where one face is nearest from, another that is farther by more than twice the way is not
//! nearest from so far away: few faces are left once the places hardly move.

use super::MeshDistance;
use super::bvh::Nearest;
use glam::DVec3;

/// Faces that are kept.
const KEPT: usize = 4096;
/// Searches of all faces before those about the last place are collected.
const PATIENCE: usize = 16;

/// Finds the nearest of all faces among those nearest to a place, where it is one of them.
pub(super) struct About<'a> {
    mesh: &'a MeshDistance,
    centre: DVec3,
    /// The faces nearest to the centre, with their distances [m] from it, nearest first.
    faces: Vec<(f64, u32)>,
    /// Searches of all faces since they were collected.
    missed: usize,
}

impl<'a> About<'a> {
    pub(super) fn new(mesh: &'a MeshDistance) -> About<'a> {
        About {
            mesh,
            centre: DVec3::ZERO,
            faces: Vec::new(),
            missed: 0,
        }
    }

    /// The nearest place of the mesh to `x`.
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

    /// The nearest place if one of the faces that are kept must have it.
    fn among_kept(&self, x: DVec3) -> Option<Nearest> {
        let away = x.distance(self.centre);
        let mut best: Option<(f64, Nearest)> = None;
        for (distance, face) in &self.faces {
            // This face, and those after it, are at least so far from `x`.
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
    use crate::mesh::cube_sphere;

    /// Towards a place in a lumpy ball, by steps that become shorter.
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
