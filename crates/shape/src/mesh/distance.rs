//! Signed distance to a closed mesh.

use super::TriangleMesh;
use crate::error::Result;
use crate::triangles::{Bvh, Feature, Nearest, Neighbours, nearest_on_triangle};
use glam::DVec3;
use std::sync::OnceLock;

/// Signed distance to a closed mesh: the exact distance to its triangles with the sign by
/// angle-weighted pseudo-normals (Baerentzen and Aanaes 2005).
pub(crate) struct MeshDistance {
    /// Built on first use.
    bvh: OnceLock<Bvh>,
    corners: Vec<[DVec3; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Neighbouring faces across the edges of each face.
    neighbours: Neighbours,
    spokes: Spokes,
    face_normals: Vec<DVec3>,
    edge_normals: Vec<[DVec3; 3]>,
    corner_normals: Vec<DVec3>,
}

impl MeshDistance {
    /// Checks the mesh and prepares it for queries.
    pub(crate) fn new(mesh: &TriangleMesh) -> Result<MeshDistance> {
        Ok(Self::from_checked(mesh, mesh.neighbours()?))
    }

    fn from_checked(mesh: &TriangleMesh, neighbours: Neighbours) -> MeshDistance {
        let mut face_normals = Vec::with_capacity(mesh.triangles.len());
        let mut corner_normals = vec![DVec3::ZERO; mesh.vertices.len()];
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            let corners = mesh.corners(face);
            let normal = mesh.twice_area(face).normalize_or_zero();
            for i in 0..3 {
                let forward = corners[(i + 1) % 3] - corners[i];
                let back = corners[(i + 2) % 3] - corners[i];
                corner_normals[triangle[i] as usize] += forward.angle_between(back) * normal;
            }
            face_normals.push(normal);
        }
        let edge_normals = neighbours
            .iter()
            .enumerate()
            .map(|(face, across)| across.map(|n| face_normals[face] + face_normals[n as usize]))
            .collect();
        MeshDistance {
            bvh: OnceLock::new(),
            corners: mesh.faces(),
            spokes: Spokes::new(mesh),
            triangles: mesh.triangles.clone(),
            neighbours,
            face_normals,
            edge_normals,
            corner_normals,
        }
    }

    /// Returns the number of faces.
    pub(super) fn faces(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// Returns the square root of the mean face area [m].
    pub(super) fn face_size(&self) -> f64 {
        let twice = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length();
        let area: f64 = self.corners.iter().map(twice).sum();
        (0.5 * area / self.corners.len() as f64).sqrt()
    }

    /// Returns the corners of face `face`.
    pub(super) fn corners(&self, face: u32) -> &[DVec3; 3] {
        &self.corners[face as usize]
    }

    /// Returns the unit normal of face `face`; 0 for a degenerate face.
    pub(super) fn normal(&self, face: u32) -> DVec3 {
        self.face_normals[face as usize]
    }

    /// Returns the point of face `face` nearest to `x`.
    pub(super) fn on_face(&self, x: DVec3, face: u32) -> Nearest {
        let (point, feature) = nearest_on_triangle(x, self.corners(face));
        Nearest { point, face, feature }
    }

    /// Returns a local minimum of the distance to `x`, by descent from face `face`.
    pub(super) fn downhill(&self, x: DVec3, face: u32) -> Nearest {
        let mut best = self.on_face(x, face);
        let mut distance = best.point.distance_squared(x);
        loop {
            let number = best.face as usize;
            let mut nearer = None;
            let mut try_face = |face: u32| {
                let place = self.on_face(x, face);
                let squared = place.point.distance_squared(x);
                if squared < distance {
                    distance = squared;
                    nearer = Some(place);
                }
            };
            match best.feature {
                Feature::Face => (),
                Feature::Edge(i) => try_face(self.neighbours[number][usize::from(i)]),
                Feature::Corner(i) => {
                    let corner = self.triangles[number][usize::from(i)];
                    let spokes = self.spokes.of(corner);
                    // If no edge of the corner leads downhill, the corner is a local minimum.
                    let reach = x - best.point;
                    let falls = |spoke: &&Spoke| spoke.edges.iter().any(|e| e.dot(reach) > 0.0);
                    spokes.iter().filter(falls).for_each(|s| try_face(s.face));
                }
            }
            match nearer {
                Some(place) => best = place,
                None => return best,
            }
        }
    }

    /// Returns the globally nearest point.
    pub(super) fn nearest(&self, x: DVec3, hint: &mut u32) -> Nearest {
        let bvh = self.bvh.get_or_init(|| Bvh::new(&self.corners));
        bvh.nearest(x, hint)
    }

    /// Returns the signed distance [m] of `x`, negative inside, given its nearest point on the
    /// mesh.
    pub(super) fn signed(&self, x: DVec3, nearest: &Nearest) -> f64 {
        let face = nearest.face as usize;
        let normal = match nearest.feature {
            Feature::Face => self.face_normals[face],
            Feature::Edge(i) => self.edge_normals[face][usize::from(i)],
            Feature::Corner(i) => {
                self.corner_normals[self.triangles[face][usize::from(i)] as usize]
            }
        };
        let reach = x - nearest.point;
        reach.length().copysign(reach.dot(normal))
    }
}

/// The two edges of a face that meet at a corner.
#[derive(Clone, Copy, Default)]
struct Spoke {
    edges: [DVec3; 2],
    face: u32,
}

/// Face corners grouped by vertex, for a closed mesh.
struct Spokes {
    all: Vec<Spoke>,
    /// First entry of every vertex, and the total number at the end.
    starts: Vec<u32>,
}

impl Spokes {
    fn new(mesh: &TriangleMesh) -> Spokes {
        let mut starts = vec![0u32; mesh.vertices.len() + 1];
        for corner in mesh.triangles.iter().flatten() {
            starts[*corner as usize + 1] += 1;
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut all = vec![Spoke::default(); 3 * mesh.triangles.len()];
        let mut next = starts.clone();
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            let corners = mesh.corners(face);
            for i in 0..3 {
                let place = &mut next[triangle[i] as usize];
                all[*place as usize] = Spoke {
                    edges: [1, 2].map(|n| corners[(i + n) % 3] - corners[i]),
                    face: face as u32,
                };
                *place += 1;
            }
        }
        Spokes { all, starts }
    }

    fn of(&self, corner: u32) -> &[Spoke] {
        let corner = corner as usize;
        &self.all[self.starts[corner] as usize..self.starts[corner + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distance::Distance;

    #[test]
    fn distance_to_a_cube_is_exact_everywhere() {
        let mut mesh = crate::triangles::unit_cube().scaled(2.0);
        mesh.vertices.iter_mut().for_each(|v| *v -= DVec3::ONE);
        let field = MeshDistance::new(&mesh).unwrap();
        for i in 0..3000 {
            let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
            let x = 5.0 * u.fract() - DVec3::splat(2.5);
            let q = x.abs() - DVec3::ONE;
            let exact = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
            assert!((field.near(x, &mut 0) - exact).abs() < 1e-12, "at {x}");
        }
    }
}
