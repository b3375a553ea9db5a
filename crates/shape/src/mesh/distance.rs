//! Signed distance to a closed mesh.

use super::TriangleMesh;
use super::bvh::{Bvh, Feature, Nearest};
use super::check::Neighbours;
use super::spread;
use crate::distance::Distance;
use crate::error::Result;
use glam::DVec3;

/// Answers signed distances to a closed mesh: the exact distance to its triangles, the sign by
/// angle-weighted pseudo-normals (Baerentzen and Aanaes 2005).
pub(crate) struct MeshDistance {
    bvh: Bvh,
    triangles: Vec<[u32; 3]>,
    /// Faces across the edges of each face.
    neighbours: Neighbours,
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
            let normal = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or_zero();
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
            bvh: Bvh::new(mesh),
            triangles: mesh.triangles.clone(),
            neighbours,
            face_normals,
            edge_normals,
            corner_normals,
        }
    }

    pub(super) fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// Place of the mesh whose distance to `x` is least among all places around it, downhill from
    /// face `face`.
    pub(super) fn downhill(&self, x: DVec3, face: u32) -> Nearest {
        let mut best = self.bvh.on_face(x, face);
        let mut distance = best.point.distance_squared(x);
        let mut around = Vec::new();
        loop {
            around.clear();
            match best.feature {
                Feature::Face => (),
                Feature::Edge(i) => {
                    around.push(self.neighbours[best.face as usize][usize::from(i)])
                }
                Feature::Corner(i) => self.ring(best.face, usize::from(i), &mut around),
            }
            let places = around.iter().map(|face| self.bvh.on_face(x, *face));
            let nearest = places
                .map(|place| (place.point.distance_squared(x), place))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match nearest {
                Some(nearer) if nearer.0 < distance => (distance, best) = nearer,
                _ => return best,
            }
        }
    }

    /// The other faces at corner `corner` of face `face`.
    fn ring(&self, face: u32, corner: usize, found: &mut Vec<u32>) {
        let vertex = self.triangles[face as usize][corner];
        let mut at = (face, corner);
        // The next face lies across the edge that begins at the vertex.
        loop {
            let next = self.neighbours[at.0 as usize][at.1];
            let place = self.triangles[next as usize]
                .iter()
                .position(|v| *v == vertex);
            match place {
                Some(place) if next != face => at = (next, place),
                _ => return,
            }
            found.push(next);
        }
    }

    /// Signed distance [m] of `x`, negative inside, whose nearest place on the mesh is known.
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

impl Distance for MeshDistance {
    fn near(&self, x: DVec3, hint: &mut u32) -> f64 {
        self.signed(x, &self.bvh.nearest(x, hint))
    }

    fn on_grid(&self, first: DVec3, spacing: f64, dims: [usize; 3]) -> Vec<f64> {
        spread::on_grid(self, first, spacing, dims)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_to_a_cube_is_exact_everywhere() {
        let vertices = (0..8)
            .map(|c| {
                DVec3::new(
                    f64::from(c & 1),
                    f64::from(c >> 1 & 1),
                    f64::from(c >> 2 & 1),
                )
            })
            .map(|v| 2.0 * v - DVec3::ONE)
            .collect();
        let quads: [[u32; 4]; 6] = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let triangles = quads
            .iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        let mesh = TriangleMesh {
            vertices,
            triangles: triangles.collect(),
        };
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
