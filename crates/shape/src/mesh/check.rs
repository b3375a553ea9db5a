//! Checks that a mesh is one closed surface of consistent orientation, with located errors.

use super::TriangleMesh;
use crate::error::{Result, ShapeError};

/// For every face, the neighbouring faces across its edges (edge i joins corners i and i + 1).
pub(crate) type Neighbours = Vec<[u32; 3]>;

/// Faces with a lower ratio of height to longest edge count as degenerate.
const FLAT: f64 = 1e-10;

impl TriangleMesh {
    /// Refuses any mesh except one closed, outward-facing surface. Errors report positions in the
    /// units of the mesh.
    pub fn check_closed(&self) -> Result<()> {
        self.neighbours().map(|_| ())
    }

    pub(crate) fn neighbours(&self) -> Result<Neighbours> {
        self.check_faces()?;
        let neighbours = self.check_edges()?;
        self.check_one_piece(&neighbours)?;
        let volume = self.signed_volume();
        if volume <= 0.0 {
            return Err(ShapeError::InsideOut { volume });
        }
        Ok(neighbours)
    }

    /// Checks that coordinates are finite, indices valid and faces not degenerate.
    pub(crate) fn check_faces(&self) -> Result<()> {
        if self.triangles.is_empty() {
            return Err(ShapeError::EmptyMesh);
        }
        if let Some(n) = self.vertices.iter().position(|v| !v.is_finite()) {
            return Err(ShapeError::NotFinite {
                what: format!("a coordinate of vertex {n}"),
            });
        }
        for (face, triangle) in self.triangles.iter().enumerate() {
            if let Some(v) = triangle
                .iter()
                .find(|v| **v as usize >= self.vertices.len())
            {
                return Err(ShapeError::BadParameter {
                    name: "vertex number of a face",
                    value: f64::from(*v),
                    reason: "there is no such vertex",
                });
            }
            let [a, b, c] = self.corners(face);
            let longest = a
                .distance_squared(b)
                .max(b.distance_squared(c))
                .max(c.distance_squared(a));
            let twice_area = (b - a).cross(c - a).length();
            if twice_area.is_nan() || twice_area <= FLAT * longest {
                return Err(ShapeError::ZeroAreaFace { face, at: a });
            }
        }
        Ok(())
    }

    /// Checks that every edge has two faces with opposite directions along it.
    pub(crate) fn check_edges(&self) -> Result<Neighbours> {
        // (low vertex, high vertex, face, edge of the face, runs from low to high), in this order:
        // grouped by low vertex by counting sort, then sorted within each group.
        let each = |visit: &mut dyn FnMut((u32, u32, u32, u8, bool))| {
            for (face, t) in self.triangles.iter().enumerate() {
                for i in 0..3 {
                    let (a, b) = (t[i], t[(i + 1) % 3]);
                    visit((a.min(b), a.max(b), face as u32, i as u8, a < b));
                }
            }
        };
        let mut ends = vec![0usize; self.vertices.len() + 1];
        each(&mut |edge| ends[edge.0 as usize + 1] += 1);
        for v in 1..ends.len() {
            ends[v] += ends[v - 1];
        }
        let mut edges = vec![(0, 0, 0, 0, false); 3 * self.triangles.len()];
        each(&mut |edge| {
            let place = &mut ends[edge.0 as usize];
            edges[*place] = edge;
            *place += 1;
        });
        for (v, end) in ends[..self.vertices.len()].iter().enumerate() {
            let start = if v == 0 { 0 } else { ends[v - 1] };
            edges[start..*end].sort_unstable();
        }
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
                        flipped.get_or_insert(ShapeError::FlippedFace {
                            face: p.2 as usize,
                            neighbour: q.2 as usize,
                            at,
                        });
                    }
                    neighbours[p.2 as usize][usize::from(p.3)] = q.2;
                    neighbours[q.2 as usize][usize::from(q.3)] = p.2;
                }
                _ => {
                    return Err(ShapeError::NonManifoldEdge {
                        at,
                        faces: group.len(),
                    });
                }
            }
        }
        match (open, flipped) {
            ((edges, Some(at)), _) => Err(ShapeError::Hole { at, edges }),
            (_, Some(error)) => Err(error),
            _ => Ok(neighbours),
        }
    }

    fn check_one_piece(&self, neighbours: &Neighbours) -> Result<()> {
        let sizes = piece_sizes(neighbours);
        if sizes.len() == 1 {
            return Ok(());
        }
        let shown: Vec<String> = sizes.iter().take(5).map(usize::to_string).collect();
        Err(ShapeError::SeveralSurfaces {
            count: sizes.len(),
            sizes: shown.join(", "),
        })
    }
}

impl TriangleMesh {
    /// Returns the piece with the most faces, or `None` if the others together exceed the fraction
    /// `crumbs` of all faces, or if the edges do not match.
    pub(crate) fn largest_piece(self, crumbs: f64) -> Option<TriangleMesh> {
        let neighbours = self.check_edges().ok()?;
        let (number, sizes) = pieces(&neighbours);
        let largest = (0..sizes.len()).max_by_key(|n| (sizes[*n], std::cmp::Reverse(*n)))?;
        if sizes.len() == 1 {
            return Some(self);
        }
        let others = self.triangles.len() - sizes[largest];
        if others as f64 > crumbs * self.triangles.len() as f64 {
            return None;
        }
        let mut renamed = vec![None; self.vertices.len()];
        let mut mesh = TriangleMesh::default();
        for (triangle, _) in self
            .triangles
            .iter()
            .zip(number)
            .filter(|(_, n)| *n == largest)
        {
            mesh.triangles.push(triangle.map(|v| {
                *renamed[v as usize].get_or_insert_with(|| {
                    mesh.vertices.push(self.vertices[v as usize]);
                    (mesh.vertices.len() - 1) as u32
                })
            }));
        }
        Some(mesh)
    }
}

/// Returns the number of faces of each connected piece, largest first.
fn piece_sizes(neighbours: &Neighbours) -> Vec<usize> {
    let (_, mut sizes) = pieces(neighbours);
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
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
    use super::*;
    use glam::DVec3;

    fn cube() -> TriangleMesh {
        let vertices = (0..8)
            .map(|c| {
                DVec3::new(
                    f64::from(c & 1),
                    f64::from(c >> 1 & 1),
                    f64::from(c >> 2 & 1),
                )
            })
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
        TriangleMesh {
            vertices,
            triangles: triangles.collect(),
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
        match mesh.check_closed() {
            Err(ShapeError::Hole { at, edges: 3 }) => assert!((at.x - 1.0).abs() < 1e-12, "{at}"),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_flipped_face_is_located() {
        let mut mesh = cube();
        mesh.triangles[3].swap(0, 1);
        match mesh.check_closed() {
            Err(ShapeError::FlippedFace {
                face,
                neighbour,
                at,
            }) => {
                assert!(face == 3 || neighbour == 3);
                assert!((at.x - 1.0).abs() < 1e-12);
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_third_face_at_an_edge_is_located() {
        let mut mesh = cube();
        mesh.vertices.push(DVec3::new(0.5, 0.5, 3.0));
        mesh.triangles.push([0, 2, 8]);
        match mesh.check_closed() {
            Err(ShapeError::NonManifoldEdge { at, faces: 3 }) => {
                assert_eq!(at, DVec3::new(0.0, 0.5, 0.0));
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn inside_out_two_pieces_flat_faces_and_nan_are_refused() {
        let mut mesh = cube();
        for t in &mut mesh.triangles {
            t.swap(0, 1);
        }
        assert!(matches!(
            mesh.check_closed(),
            Err(ShapeError::InsideOut { .. })
        ));

        let mut mesh = cube();
        let second = cube();
        mesh.vertices
            .extend(second.vertices.iter().map(|v| *v + DVec3::splat(5.0)));
        mesh.triangles
            .extend(second.triangles.iter().map(|t| t.map(|v| v + 8)));
        assert!(matches!(
            mesh.check_closed(),
            Err(ShapeError::SeveralSurfaces { count: 2, .. })
        ));

        let mut mesh = cube();
        mesh.triangles.push([0, 1, 1]);
        assert!(matches!(
            mesh.check_closed(),
            Err(ShapeError::ZeroAreaFace { face: 12, .. })
        ));

        let mut mesh = cube();
        mesh.vertices[3].y = f64::NAN;
        assert!(matches!(
            mesh.check_closed(),
            Err(ShapeError::NotFinite { .. })
        ));

        let mut mesh = cube();
        mesh.triangles[0][0] = 99;
        assert!(mesh.check_closed().is_err());
        assert!(matches!(
            TriangleMesh::default().check_closed(),
            Err(ShapeError::EmptyMesh)
        ));
    }
}
