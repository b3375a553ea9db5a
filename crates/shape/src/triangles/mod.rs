//! Triangle meshes: geometry, checks and a bounding-volume hierarchy.

mod bvh;
mod check;
mod cube_sphere;
mod intersect;

pub(crate) use bvh::{Bvh, Feature, Nearest, nearest_on_triangle};
pub(crate) use check::Neighbours;
pub(crate) use cube_sphere::cube_sphere;

use glam::{DMat3, DVec3};

/// Corner indices of the six faces, counter-clockwise seen from outside the cell; bits 0, 1 and 2
/// of a corner are its x, y and z.
pub(crate) const FACES: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The unit cube with a corner at the origin, for tests.
#[cfg(test)]
pub(crate) fn unit_cube() -> TriangleMesh {
    let corner = |c: usize| DVec3::from_array([c & 1, c >> 1 & 1, c >> 2].map(|n| n as f64));
    let quads = FACES.map(|quad| quad.map(u32::from));
    TriangleMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect(),
    }
}

/// Returns the lower and upper corner of the bounding box of points.
pub(crate) fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let extend = |(low, high): (DVec3, DVec3), x: &DVec3| (low.min(*x), high.max(*x));
    points.iter().fold(start, extend)
}

/// Triangles with shared vertices, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions [m].
    pub vertices: Vec<DVec3>,
    /// Vertex indices of each face.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Returns the three corners of face `face`.
    pub(crate) fn corners(&self, face: usize) -> [DVec3; 3] {
        self.triangles[face].map(|v| self.vertices[v as usize])
    }

    /// Returns the outward normal of face `face` with a length of twice its area [m^2].
    pub(crate) fn twice_area(&self, face: usize) -> DVec3 {
        let [a, b, c] = self.corners(face);
        (b - a).cross(c - a)
    }

    /// Returns the corners of every face.
    pub(crate) fn faces(&self) -> Vec<[DVec3; 3]> {
        (0..self.triangles.len()).map(|f| self.corners(f)).collect()
    }

    /// Returns the volume [m^3] by the divergence theorem; negative for inward normals.
    pub fn signed_volume(&self) -> f64 {
        let reference = self.vertices.first().copied().unwrap_or(DVec3::ZERO);
        let six: f64 = (0..self.triangles.len())
            .map(|f| {
                let [a, b, c] = self.corners(f).map(|p| p - reference);
                a.dot(b.cross(c))
            })
            .sum();
        six / 6.0
    }

    /// Returns the surface area [m^2].
    pub fn area(&self) -> f64 {
        let twice: f64 = (0..self.triangles.len()).map(|f| self.twice_area(f).length()).sum();
        0.5 * twice
    }

    /// Returns the lower and upper corner of the bounding box [m].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        bounds(&self.vertices)
    }

    /// Returns the mesh scaled by `factor`.
    pub(crate) fn scaled(mut self, factor: f64) -> TriangleMesh {
        for v in &mut self.vertices {
            *v *= factor;
        }
        self
    }

    /// Returns the mesh in the frame with this origin and these axes (columns).
    pub(crate) fn in_frame(&self, origin: DVec3, axes: DMat3) -> TriangleMesh {
        let to_frame = axes.transpose();
        TriangleMesh {
            vertices: self.vertices.iter().map(|v| to_frame * (*v - origin)).collect(),
            triangles: self.triangles.clone(),
        }
    }
}
