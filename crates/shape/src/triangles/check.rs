//! Checks that a mesh is one closed surface of consistent orientation, with located errors.

use super::TriangleMesh;
use crate::error::{Result, ShapeError, first_few};
use glam::DVec3;
use rayon::prelude::*;

/// For every face, the neighbouring faces across its edges (edge i joins corners i and i + 1).
pub(crate) type Neighbours = Vec<[u32; 3]>;

/// Faces with a lower ratio of height to longest edge count as degenerate.
const FLAT: f64 = 1e-10;

impl TriangleMesh {
    /// Refuses any mesh except one closed, outward-facing surface. Errors report positions in the
    /// units of the mesh.
    ///
    /// # Errors
    /// The first defect, with its place: no faces, a face without area or with a missing vertex, an
    /// edge that does not join two faces of one orientation, or inward normals.
    pub fn check_closed(&self) -> Result<()> {
        self.neighbours().map(|_| ())
    }

    pub(crate) fn neighbours(&self) -> Result<Neighbours> {
        self.check_faces()?;
        let neighbours = self.check_edges()?;
        self.check_one_piece(&neighbours)?;
        let volume = self.signed_volume();
        if volume <= 0.0 {
            return Err(ShapeError::InsideOut { file: String::new(), volume });
        }
        Ok(neighbours)
    }

    /// Checks that coordinates are finite, indices valid and faces not degenerate.
    pub(crate) fn check_faces(&self) -> Result<()> {
        if self.triangles.is_empty() {
            return Err(ShapeError::bad_mesh("the mesh has no faces"));
        }
        if let Some(n) = self.vertices.iter().position(|v| !v.is_finite()) {
            let defect = format!("a coordinate of vertex {n} is not a finite number");
            return Err(ShapeError::bad_mesh(defect));
        }
        for (face, triangle) in self.triangles.iter().enumerate() {
            let count = self.vertices.len();
            if let Some(v) = triangle.iter().find(|v| **v as usize >= count) {
                let defect = format!(
                    "face {face} has vertex {v}, the mesh has {count} vertices (both counted from \
                     0)"
                );
                return Err(ShapeError::bad_mesh(defect));
            }
            let [a, b, c] = self.corners(face);
            let longest =
                a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
            let twice_area = self.twice_area(face).length();
            if twice_area.is_nan() || twice_area <= FLAT * longest {
                return Err(ShapeError::bad_mesh(format!(
                    "face {face} (counted from 0) near {} has no area; remove degenerate faces \
                     (in MeshLab: Remove Zero Area Faces)",
                    point(a)
                )));
            }
        }
        Ok(())
    }

    /// Checks that every edge has two faces with opposite directions along it.
    pub(crate) fn check_edges(&self) -> Result<Neighbours> {
        // (low vertex, high vertex, face, edge of the face, runs from low to high), in this order.
        let edge = |face: usize, i: usize| {
            let (a, b) = (self.triangles[face][i], self.triangles[face][(i + 1) % 3]);
            (a.min(b), a.max(b), face as u32, i as u8, a < b)
        };
        let faces = 0..self.triangles.len();
        let mut edges: Vec<_> = faces.flat_map(|face| [0, 1, 2].map(|i| edge(face, i))).collect();
        edges.par_sort_unstable();
        let mut neighbours = vec![[0u32; 3]; self.triangles.len()];
        let mut open = (0usize, None);
        let mut flipped = None;
        for group in edges.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
            let (low, high, ..) = group[0];
            let at = 0.5 * (self.vertices[low as usize] + self.vertices[high as usize]);
            match group {
                [_] => {
                    open.0 += 1;
                    open.1.get_or_insert(at);
                }
                [p, q] => {
                    if p.4 == q.4 {
                        flipped.get_or_insert((p.2, q.2, at));
                    }
                    neighbours[p.2 as usize][usize::from(p.3)] = q.2;
                    neighbours[q.2 as usize][usize::from(q.3)] = p.2;
                }
                _ => {
                    return Err(ShapeError::bad_mesh(format!(
                        "{} faces share the edge near {}; a closed surface has two at every edge \
                         (in MeshLab: Repair Non Manifold Edges)",
                        group.len(),
                        point(at)
                    )));
                }
            }
        }
        match (open, flipped) {
            ((edges, Some(at)), _) => Err(ShapeError::bad_mesh(format!(
                "the mesh is open: {edges} edges belong to one face only, the first near {}; close \
                 the hole (in MeshLab: Close Holes; in Blender: Fill Holes)",
                point(at)
            ))),
            (_, Some((face, neighbour, at))) => Err(ShapeError::bad_mesh(format!(
                "faces {face} and {neighbour} (counted from 0) near {} have opposite \
                 orientations; make the orientation coherent (in MeshLab: Re-Orient All Faces \
                 Coherently)",
                point(at)
            ))),
            _ => Ok(neighbours),
        }
    }

    fn check_one_piece(&self, neighbours: &Neighbours) -> Result<()> {
        let (_, mut sizes) = pieces(neighbours);
        if sizes.len() == 1 {
            return Ok(());
        }
        sizes.sort_unstable_by(|a, b| b.cmp(a));
        Err(ShapeError::bad_mesh(format!(
            "the mesh consists of {} separate surfaces of {} faces; export one grain at a time, \
             without the surfaces of its cavities (in MeshLab: Remove Isolated Pieces)",
            sizes.len(),
            first_few(&sizes, 5)
        )))
    }
}

impl TriangleMesh {
    /// Returns the piece with the most faces and the volume of the others relative to it, the
    /// volumes of bubbles counted as positive; `None` if the edges do not match.
    pub(crate) fn largest_piece(self) -> Option<(TriangleMesh, f64)> {
        let neighbours = self.check_edges().ok()?;
        let (number, sizes) = pieces(&neighbours);
        let largest = (0..sizes.len()).max_by_key(|n| (sizes[*n], std::cmp::Reverse(*n)))?;
        if sizes.len() == 1 {
            return Some((self, 0.0));
        }
        let mut volumes = vec![0.0; sizes.len()];
        let origin = self.vertices[0];
        for (face, n) in number.iter().enumerate() {
            let [a, b, c] = self.corners(face).map(|x| x - origin);
            volumes[*n] += a.dot(b.cross(c));
        }
        let all: f64 = volumes.iter().map(|v| v.abs()).sum();
        let rest = all / volumes[largest].abs() - 1.0;
        let mut renamed = vec![None; self.vertices.len()];
        let mut mesh = TriangleMesh::default();
        for (triangle, _) in self.triangles.iter().zip(number).filter(|(_, n)| *n == largest) {
            mesh.triangles.push(triangle.map(|v| {
                *renamed[v as usize].get_or_insert_with(|| {
                    mesh.vertices.push(self.vertices[v as usize]);
                    (mesh.vertices.len() - 1) as u32
                })
            }));
        }
        Some((mesh, rest))
    }
}

/// Formats a position for messages, without rounding errors.
pub(super) fn point(at: DVec3) -> String {
    let [x, y, z] = at.to_array().map(|x| (1e6 * x).round() / 1e6 + 0.0);
    format!("({x}, {y}, {z})")
}

/// Returns the piece index of each face, and the number of faces of each piece.
fn pieces(neighbours: &Neighbours) -> (Vec<usize>, Vec<usize>) {
    let mut number = vec![usize::MAX; neighbours.len()];
    let mut sizes = Vec::new();
    for start in 0..neighbours.len() {
        if number[start] != usize::MAX {
            continue;
        }
        number[start] = sizes.len();
        let mut stack = vec![start];
        let mut size = 0;
        while let Some(face) = stack.pop() {
            size += 1;
            for n in neighbours[face] {
                if number[n as usize] == usize::MAX {
                    number[n as usize] = sizes.len();
                    stack.push(n as usize);
                }
            }
        }
        sizes.push(size);
    }
    (number, sizes)
}

#[cfg(test)]
mod tests {
    use super::super::unit_cube as cube;
    use super::*;

    #[track_caller]
    fn assert_refused(mesh: &TriangleMesh, words: &[&str]) {
        let message = mesh.check_closed().unwrap_err().to_string();
        for word in words {
            assert!(message.contains(word), "`{word}` is missing in: {message}");
        }
    }

    #[test]
    fn a_cube_passes() {
        let cube = cube();
        cube.check_closed().unwrap();
        assert!((cube.signed_volume() - 1.0).abs() < 1e-15);
        assert!((cube.area() - 6.0).abs() < 1e-15);
    }

    #[test]
    fn a_hole_is_located() {
        let mut mesh = cube();
        mesh.triangles.remove(2);
        assert_refused(&mesh, &["open: 3 edges", "near (1, "]);
    }

    #[test]
    fn a_flipped_face_is_located() {
        let mut mesh = cube();
        mesh.triangles[3].swap(0, 1);
        assert_refused(&mesh, &["faces ", "near (1, ", "opposite orientations"]);
    }

    #[test]
    fn a_third_face_at_an_edge_is_located() {
        let mut mesh = cube();
        mesh.vertices.push(DVec3::new(0.5, 0.5, 3.0));
        mesh.triangles.push([0, 2, 8]);
        assert_refused(&mesh, &["3 faces share the edge near (0, 0.5, 0)"]);
    }

    #[test]
    fn inside_out_two_pieces_flat_faces_and_nan_are_refused() {
        let mut mesh = cube();
        for t in &mut mesh.triangles {
            t.swap(0, 1);
        }
        assert!(matches!(mesh.check_closed(), Err(ShapeError::InsideOut { .. })));

        let mut mesh = cube();
        let second = cube();
        mesh.vertices.extend(second.vertices.iter().map(|v| *v + DVec3::splat(5.0)));
        mesh.triangles.extend(second.triangles.iter().map(|t| t.map(|v| v + 8)));
        assert_refused(&mesh, &["2 separate surfaces of 12, 12 faces"]);

        let mut mesh = cube();
        mesh.triangles.push([0, 1, 1]);
        assert_refused(&mesh, &["face 12 (counted from 0) near (0, 0, 0) has no area"]);

        let mut mesh = cube();
        mesh.vertices[3].y = f64::NAN;
        assert_refused(&mesh, &["vertex 3 is not a finite number"]);

        let mut mesh = cube();
        mesh.triangles[0][0] = 99;
        assert_refused(&mesh, &["face 0 has vertex 99"]);
        assert_refused(&TriangleMesh::default(), &["no faces"]);
    }
}
