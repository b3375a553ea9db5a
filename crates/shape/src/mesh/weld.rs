//! Merging of duplicated vertices.

use super::TriangleMesh;
use glam::DVec3;
use std::collections::HashMap;

/// Merge distance relative to the bounding-box diagonal: a few rounding steps of the
/// single-precision coordinates in mesh files.
const TOLERANCE: f64 = 1e-6;

/// Merges coincident vertices and drops unused vertices and collapsed faces; returns the mesh and
/// the number of dropped faces.
pub(crate) fn weld(mesh: &TriangleMesh) -> (TriangleMesh, usize) {
    let (lower, upper) = mesh.bounds();
    let tolerance = TOLERANCE * lower.distance(upper);
    let key = |v: DVec3| {
        let s = ((v - lower) / (2.0 * tolerance)).floor();
        [s.x as i64, s.y as i64, s.z as i64]
    };
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut buckets: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut find = |v: DVec3| {
        let [low, high] = [key(v - tolerance), key(v + tolerance)];
        for k in low[2]..=high[2] {
            for j in low[1]..=high[1] {
                for i in low[0]..=high[0] {
                    for &vertex in buckets.get(&[i, j, k]).into_iter().flatten() {
                        if vertices[vertex as usize].distance(v) <= tolerance {
                            return vertex;
                        }
                    }
                }
            }
        }
        let new = vertices.len() as u32;
        vertices.push(v);
        buckets.entry(key(v)).or_default().push(new);
        new
    };
    let mut renamed: Vec<Option<u32>> = vec![None; mesh.vertices.len()];
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for t in &mesh.triangles {
        triangles.push(t.map(|v| {
            let v = v as usize;
            *renamed[v].get_or_insert_with(|| find(mesh.vertices[v]))
        }));
    }
    let before = triangles.len();
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    let dropped = before - triangles.len();
    (TriangleMesh { vertices, triangles }, dropped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_soup_becomes_a_closed_tetrahedron() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mut soup = TriangleMesh::default();
        for (n, face) in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]].iter().enumerate() {
            let first = soup.vertices.len() as u32;
            // The copies differ by rounding, as in text files.
            soup.vertices.extend(face.map(|v: usize| p[v] + DVec3::splat(1e-8 * n as f64)));
            soup.triangles.push([first, first + 1, first + 2]);
        }
        assert!(soup.check_closed().is_err());
        let (mesh, dropped) = weld(&soup);
        assert_eq!((mesh.vertices.len(), dropped), (4, 0));
        mesh.check_closed().unwrap();
    }
}
