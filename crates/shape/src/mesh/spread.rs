//! Distances at all samples of a grid: exact near the mesh, spread from there.
//!
//! A search of the hierarchy gets slow away from the mesh, where many faces are about as near. A
//! sample there tries the nearest faces of the samples beside it that are nearer, and walks downhill
//! from the best. That is the exact distance but where the nearest place of a sample is nobody's
//! around it, which is rare and far from the surface, and cost less than a tenth of a cell in the tests.

use super::MeshDistance;
use crate::grid::{beside, place};
use glam::DVec3;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Cells from the box about a face within which samples are searched for exactly.
const BAND: f64 = 2.0;
/// Stands for the face of a sample that is still to be reached.
const NONE: u32 = u32::MAX;

/// Signed distances [m] at the samples of a grid, x fastest; the first lies at `first`.
pub(super) fn on_grid(
    mesh: &MeshDistance,
    first: DVec3,
    spacing: f64,
    dims: [usize; 3],
) -> Vec<f64> {
    let at = |n: usize| first + spacing * DVec3::from_array(place(dims, n).map(|i| i as f64));
    let mut found = band(mesh, first, spacing, dims);
    let rows = found.par_chunks_mut(dims[0]).enumerate();
    rows.for_each(|(row, line)| {
        let mut hint = 0;
        let wanted = line.iter_mut().enumerate().filter(|(_, s)| s.1 != NONE);
        for (i, sample) in wanted {
            let x = at(row * dims[0] + i);
            let nearest = mesh.bvh().nearest(x, &mut hint);
            *sample = (mesh.signed(x, &nearest), nearest.face);
        }
    });
    // Nearest first, so that what a sample tries is final. The bits of positive numbers are in order.
    let key = |value: f64, n: usize| Reverse((value.abs().to_bits(), n as u32));
    let mut front: BinaryHeap<_> = (0..found.len())
        .filter(|n| found[*n].1 != NONE && beside(dims, *n).any(|m| found[m].1 == NONE))
        .map(|n| key(found[n].0, n))
        .collect();
    let mut done: Vec<bool> = found.iter().map(|s| s.1 != NONE).collect();
    while let Some(Reverse((bits, n))) = front.pop() {
        let n = n as usize;
        let (value, mut face) = found[n];
        if value.abs().to_bits() != bits {
            continue;
        }
        if !done[n] {
            let x = at(n);
            let nearest = mesh.downhill(x, face);
            face = nearest.face;
            found[n] = (nearest.point.distance(x).copysign(value), face);
            done[n] = true;
        }
        for m in beside(dims, n).filter(|m| !done[*m]) {
            let (old, other) = found[m];
            if other == face {
                continue;
            }
            let x = at(m);
            let distance = mesh.bvh().on_face(x, face).point.distance(x);
            if other == NONE || distance < old.abs() {
                // The surface does not pass between them.
                found[m] = (distance.copysign(value), face);
                front.push(key(distance, m));
            }
        }
    }
    found.into_iter().map(|s| s.0).collect()
}

/// Marks the samples near the mesh with face 0, the others with none.
fn band(mesh: &MeshDistance, first: DVec3, spacing: f64, dims: [usize; 3]) -> Vec<(f64, u32)> {
    let mut marks = vec![(0.0, NONE); dims.iter().product()];
    for [lower, upper] in mesh.bvh().boxes() {
        let low = ((lower - first) / spacing - DVec3::splat(BAND)).ceil();
        let high = ((upper - first) / spacing + DVec3::splat(BAND)).floor();
        let range = |axis: usize| {
            let end = ((high[axis] + 1.0).max(0.0) as usize).min(dims[axis]);
            (low[axis].max(0.0) as usize).min(end)..end
        };
        for k in range(2) {
            for j in range(1) {
                let row = dims[0] * (j + dims[1] * k);
                let cells = range(0);
                marks[row + cells.start..row + cells.end].fill((0.0, 0));
            }
        }
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distance::Distance;
    use crate::mesh::cube_sphere;

    #[test]
    fn spread_distances_are_the_exact_ones() {
        // A lumpy flat body with a hollow.
        let lump = |u: DVec3| {
            let r = 1.0 + 0.25 * (4.0 * u.x + 1.0).sin() * (3.0 * u.y).cos() - 0.3 * u.z;
            u * r * DVec3::new(1.3, 1.0, 0.6)
        };
        for faces in [4, 40] {
            let mesh = cube_sphere(faces, lump);
            let distance = MeshDistance::new(&mesh).unwrap();
            let (spacing, dims) = (0.08, [50, 44, 30]);
            let first = DVec3::new(-2.0, -1.75, -1.2);
            let spread = distance.on_grid(first, spacing, dims);
            let mut worst = 0.0f64;
            for (n, value) in spread.iter().enumerate() {
                let x = first + spacing * DVec3::from_array(place(dims, n).map(|i| i as f64));
                let exact = distance.near(x, &mut 0);
                assert_eq!(*value < 0.0, exact < 0.0, "at {x}");
                worst = worst.max((value - exact).abs() / spacing);
            }
            assert!(worst < 0.1, "{worst} cells with {faces}");
        }
    }
}
