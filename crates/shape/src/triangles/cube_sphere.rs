//! Meshes of bodies mapped from a sphere with the topology of a cube.

use super::TriangleMesh;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_4;

/// Returns the closed mesh of `map` applied to unit vectors: `n` by `n` quadrilaterals of equal
/// angles on each cube face, each split along its shorter diagonal.
pub(crate) fn cube_sphere(n: usize, map: impl Fn(DVec3) -> DVec3) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut indices: HashMap<[usize; 3], u32> = HashMap::new();
    let angle = |i: usize| ((2 * i) as f64 / n as f64 - 1.0) * FRAC_PI_4;
    for face in 0..6 {
        let (axis, side) = (face / 2, face % 2);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut vertex = |i: usize, j: usize| {
            let mut place = [0; 3];
            place[axis] = side * n;
            place[u] = i;
            place[v] = j;
            *indices.entry(place).or_insert_with(|| {
                let direction = DVec3::from_array(place.map(|i| angle(i).tan())).normalize();
                mesh.vertices.push(map(direction));
                (mesh.vertices.len() - 1) as u32
            })
        };
        let mut quads = Vec::with_capacity(n * n);
        for j in 0..n {
            for i in 0..n {
                let mut quad =
                    [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                if side == 0 {
                    quad.reverse();
                }
                quads.push(quad);
            }
        }
        for [a, b, c, d] in quads {
            let at = |i: u32| mesh.vertices[i as usize];
            if at(a).distance_squared(at(c)) <= at(b).distance_squared(at(d)) {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                mesh.triangles.extend([[b, c, d], [b, d, a]]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sphere_is_closed_and_outward() {
        let mesh = cube_sphere(16, |u| 2.0 * u);
        mesh.check_closed().unwrap();
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        assert!((mesh.signed_volume() / exact - 1.0).abs() < 0.01);
    }
}
