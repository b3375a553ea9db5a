//! Exact Euclidean distance transform of a mask, in both directions.

use super::Mask;
use rayon::prelude::*;

/// Stands for "no such voxel on this line"; its square stays finite.
const FAR: f32 = 1e15;

/// Signed distance [voxels] of every voxel centre from the interface of the mask, negative
/// inside: the exact distance to the nearest voxel centre of the other phase, less the half
/// voxel by which the interface lies before it.
pub(crate) fn signed(mask: &Mask) -> Vec<f32> {
    let outside = squared(mask, true);
    let inside = squared(mask, false);
    let distance = |(to_solid, to_void): (&f32, &f32)| {
        if *to_void > 0.0 {
            0.5 - to_void.sqrt()
        } else {
            to_solid.sqrt() - 0.5
        }
    };
    outside.par_iter().zip(&inside).map(distance).collect()
}

/// Squared distance [voxels^2] of every voxel centre to the nearest void voxel's, 0 in the void.
pub(crate) fn to_void(mask: &Mask) -> Vec<f32> {
    squared(mask, false)
}

/// Squared distance of every voxel to the nearest voxel whose mask value is `target`.
fn squared(mask: &Mask, target: bool) -> Vec<f32> {
    let [nx, ny, nz] = mask.dims;
    let mut field: Vec<f32> = mask
        .solid
        .iter()
        .map(|s| if *s == target { 0.0 } else { FAR * FAR })
        .collect();
    let mut scratch = vec![0.0f32; field.len()];
    field.par_chunks_mut(nx).for_each(envelope_in_place);
    // Lines along y and z are made contiguous first.
    transpose(&field, &mut scratch, [nx, ny, nz]);
    scratch.par_chunks_mut(ny).for_each(envelope_in_place);
    transpose(&scratch, &mut field, [ny, nz, nx]);
    field.par_chunks_mut(nz).for_each(envelope_in_place);
    transpose(&field, &mut scratch, [nz, nx, ny]);
    scratch
}

/// (x, y, z) with x fastest to (y, z, x) with y fastest.
pub(super) fn transpose(from: &[f32], to: &mut [f32], [nx, ny, nz]: [usize; 3]) {
    // Some planes at once: a cache line of `from` is read whole.
    const WIDTH: usize = 16;
    let blocks = to.par_chunks_mut(WIDTH * ny * nz).enumerate();
    blocks.for_each(|(block, planes)| {
        let (first, width) = (block * WIDTH, planes.len() / (ny * nz));
        for row in 0..ny * nz {
            let line = &from[nx * row + first..][..width];
            for (i, value) in line.iter().enumerate() {
                planes[i * ny * nz + row] = *value;
            }
        }
    });
}

/// One dimension: min over q of (p - q)^2 + line[q], by the lower envelope of parabolas
/// (Felzenszwalb and Huttenlocher 2012).
fn envelope_in_place(line: &mut [f32]) {
    let n = line.len();
    let values: Vec<f64> = line.iter().map(|v| f64::from(*v)).collect();
    let mut centres = vec![0usize; n];
    let mut starts = vec![0.0f64; n + 1];
    let mut last = 0;
    starts[0] = f64::NEG_INFINITY;
    for q in 1..n {
        loop {
            let p = centres[last];
            let (pf, qf) = (p as f64, q as f64);
            let meet = ((values[q] + qf * qf) - (values[p] + pf * pf)) / (2.0 * (qf - pf));
            if meet > starts[last] || last == 0 {
                if meet <= starts[last] {
                    centres[0] = q;
                } else {
                    last += 1;
                    centres[last] = q;
                    starts[last] = meet;
                }
                break;
            }
            last -= 1;
        }
    }
    starts[last + 1] = f64::INFINITY;
    let mut at = 0;
    for (p, out) in line.iter_mut().enumerate() {
        while starts[at + 1] < p as f64 {
            at += 1;
        }
        let reach = p as f64 - centres[at] as f64;
        *out = (reach * reach + values[centres[at]]) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transform_is_exact() {
        let dims = [9, 7, 8];
        let mut state = 5u64;
        let solid: Vec<bool> = (0..dims.iter().product())
            .map(|_| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                state >> 60 < 3
            })
            .collect();
        let mask = Mask { dims, solid };
        let found = signed(&mask);
        let at = |n: usize| [n % 9, n / 9 % 7, n / 63].map(|v| v as f64);
        for n in 0..found.len() {
            let nearest = (0..found.len())
                .filter(|m| mask.solid[*m] != mask.solid[n])
                .map(|m| {
                    let (p, q) = (at(n), at(m));
                    (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt()
                })
                .fold(f64::INFINITY, f64::min);
            let exact = if mask.solid[n] {
                0.5 - nearest
            } else {
                nearest - 0.5
            };
            assert!((f64::from(found[n]) - exact).abs() < 1e-5, "voxel {n}");
        }
    }
}
