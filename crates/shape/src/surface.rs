//! The zero set of sampled values as a closed triangle mesh (marching cubes).
//!
//! The polygons of a cell are found by traversing its faces instead of a table. Inside corners on a
//! face are always separated; this rule depends on the face only, so that adjacent cells agree and
//! the surface is a closed manifold if the border of the grid is outside.

use crate::field::SampledField;
use crate::triangles::{FACES, TriangleMesh};
use glam::DVec3;
use std::sync::LazyLock;

/// Regular samples: `dims` values, x fastest, the first at `lower`, `spacing` apart.
pub(crate) struct Samples<'a> {
    pub dims: [usize; 3],
    pub lower: DVec3,
    pub spacing: f64,
    pub values: &'a [f32],
}

/// Returns the index of the cell edge between two adjacent corners: 4 * axis + position.
fn edge(a: u8, b: u8) -> usize {
    let (low, axis) = (a.min(b), (a ^ b).trailing_zeros() as u8);
    let place = match axis {
        0 => low >> 1,
        1 => (low & 1) | (low >> 1 & 2),
        _ => low & 3,
    };
    usize::from(axis * 4 + place)
}

/// Returns lower corner and axis of a cell edge.
fn edge_ends(edge: usize) -> (u8, usize) {
    let (axis, place) = (edge / 4, (edge % 4) as u8);
    let low = match axis {
        0 => place << 1,
        1 => (place & 1) | (place & 2) << 1,
        _ => place,
    };
    (low, axis)
}

/// Returns the successor of each crossed edge around the cell. `mask` has the bits of the inside
/// corners set.
fn walk(mask: u8) -> [Option<u8>; 12] {
    let mut next = [None; 12];
    let inside = |corner: u8| mask >> corner & 1 == 1;
    for face in FACES {
        for i in 0..4 {
            let (here, after) = (face[i], face[(i + 1) % 4]);
            if inside(here) || !inside(after) {
                continue;
            }
            let mut j = (i + 1) % 4;
            while inside(face[(j + 1) % 4]) {
                j = (j + 1) % 4;
            }
            next[edge(here, after)] = Some(edge(face[j], face[(j + 1) % 4]) as u8);
        }
    }
    next
}

/// Results of [`walk`] for all sign patterns.
static WALKS: LazyLock<Vec<[Option<u8>; 12]>> = LazyLock::new(|| (0..=255).map(walk).collect());

/// Extracts the closed surface where the values change sign; normals point to positive values.
pub(crate) fn extract(samples: &Samples) -> TriangleMesh {
    let [nx, ny, nz] = samples.dims;
    let strides = [1, nx, nx * ny];
    let mut mesh = TriangleMesh::default();
    let mut on_edges = OnEdges::new(strides[2]);
    let offset = |corner: u8| {
        (0..3).map(|axis| usize::from(corner >> axis & 1) * strides[axis]).sum::<usize>()
    };
    let offsets: [usize; 8] = std::array::from_fn(|c| offset(c as u8));
    for k in 0..nz.saturating_sub(1) {
        for j in 0..ny.saturating_sub(1) {
            for i in 0..nx.saturating_sub(1) {
                let base = i + nx * (j + ny * k);
                let mut mask = 0u8;
                for (c, offset) in offsets.iter().enumerate() {
                    mask |= u8::from(samples.values[base + offset] < 0.0) << c;
                }
                if mask == 0 || mask == 255 {
                    continue;
                }
                // The polygons of the cell, concatenated, and the end of each.
                let (mut corners, mut ends) = ([0u32; 12], [0usize; 12]);
                let (mut count, mut polygons) = (0, 0);
                let mut next = WALKS[usize::from(mask)];
                for start in 0..12 {
                    let (mut at, first) = (start, count);
                    while let Some(after) = next[at].take() {
                        let (corner, axis) = edge_ends(at);
                        let low = base + offsets[usize::from(corner)];
                        corners[count] = *on_edges.entry(low, axis).get_or_insert_with(|| {
                            mesh.vertices.push(crossing(samples, low, axis, strides));
                            (mesh.vertices.len() - 1) as u32
                        });
                        count += 1;
                        at = usize::from(after);
                    }
                    if count > first {
                        ends[polygons] = count;
                        polygons += 1;
                    }
                }
                let mut first = 0;
                for end in &ends[..polygons] {
                    fill(&mut mesh, &corners[first..*end]);
                    first = *end;
                }
            }
        }
        on_edges.rise();
    }
    mesh
}

/// Vertices on the edges from the samples of two adjacent planes.
struct OnEdges {
    /// Vertices of the lower and of the upper plane, three per sample.
    planes: [Vec<Option<u32>>; 2],
    /// First sample of the lower plane.
    first: usize,
}

impl OnEdges {
    fn new(plane: usize) -> OnEdges {
        OnEdges { planes: [vec![None; 3 * plane], vec![None; 3 * plane]], first: 0 }
    }

    /// Returns the vertex on the edge from sample `low` along `axis`.
    fn entry(&mut self, low: usize, axis: usize) -> &mut Option<u32> {
        let (at, plane) = (3 * (low - self.first) + axis, self.planes[0].len());
        &mut self.planes[at / plane][at % plane]
    }

    /// Advances by one plane.
    fn rise(&mut self) {
        self.planes.swap(0, 1);
        self.planes[1].fill(None);
        self.first += self.planes[0].len() / 3;
    }
}

/// Returns the zero crossing between a sample and the next along `axis`, kept slightly off the
/// samples so that no triangle is degenerate.
fn crossing(samples: &Samples, low: usize, axis: usize, strides: [usize; 3]) -> DVec3 {
    let a = f64::from(samples.values[low]);
    let b = f64::from(samples.values[low + strides[axis]]);
    let t = (a / (a - b)).clamp(1e-4, 1.0 - 1e-4);
    let mut s = DVec3::new(
        (low % samples.dims[0]) as f64,
        (low / strides[1] % samples.dims[1]) as f64,
        (low / strides[2]) as f64,
    );
    s[axis] += t;
    samples.lower + samples.spacing * s
}

/// Adds triangles and quadrilaterals as they are, and larger polygons as fans about their centre: a
/// diagonal could lie in a cell face and coincide with that of the adjacent cell.
fn fill(mesh: &mut TriangleMesh, polygon: &[u32]) {
    match *polygon {
        [a, b, c] => mesh.triangles.push([a, b, c]),
        [a, b, c, d] => {
            let at = |i: u32| mesh.vertices[i as usize];
            if at(a).distance_squared(at(c)) <= at(b).distance_squared(at(d)) {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                mesh.triangles.extend([[b, c, d], [b, d, a]]);
            }
        }
        _ => {
            let sum: DVec3 = polygon.iter().map(|&i| mesh.vertices[i as usize]).sum();
            mesh.vertices.push(sum / polygon.len() as f64);
            let centre = (mesh.vertices.len() - 1) as u32;
            for (n, &a) in polygon.iter().enumerate() {
                mesh.triangles.push([a, polygon[(n + 1) % polygon.len()], centre]);
            }
        }
    }
}

/// Extracts the closed surface of a field.
pub(crate) fn of_field(field: &SampledField) -> TriangleMesh {
    extract(&Samples {
        dims: field.dims(),
        lower: field.lower(),
        spacing: field.spacing(),
        values: field.levels(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use rand::{RngExt, SeedableRng};

    fn ball(n: usize) -> (Vec<f32>, f64) {
        let spacing = 2.5 / (n - 1) as f64;
        let mut values = Vec::new();
        for k in 0..n {
            for j in 0..n {
                for i in 0..n {
                    let x = DVec3::new(i as f64, j as f64, k as f64) * spacing - DVec3::splat(1.25);
                    values.push((x.length() - 1.0) as f32);
                }
            }
        }
        (values, spacing)
    }

    #[test]
    fn the_surface_of_a_ball_is_closed_and_faces_outwards() {
        let (values, spacing) = ball(40);
        let samples =
            Samples { dims: [40; 3], lower: DVec3::splat(-1.25), spacing, values: &values };
        let mesh = extract(&samples);
        mesh.check_closed().unwrap();
        let volume = mesh.signed_volume();
        assert!((volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.01, "{volume}");
    }

    /// All sign patterns, including ambiguous ones.
    #[test]
    fn noise_gives_a_closed_manifold() {
        let n = 14;
        let mut random = Random::seed_from_u64(1);
        let mut values = vec![1.0f32; n * n * n];
        for k in 1..n - 1 {
            for j in 1..n - 1 {
                for i in 1..n - 1 {
                    values[i + n * (j + n * k)] = random.random_range(-1.0..1.0);
                }
            }
        }
        let samples = Samples { dims: [n; 3], lower: DVec3::ZERO, spacing: 1.0, values: &values };
        let mesh = extract(&samples);
        assert!(mesh.triangles.len() > 1000);
        mesh.check_edges().unwrap();
    }
}
