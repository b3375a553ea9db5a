//! Filters of voxel fields: Gaussian smoothing and refinement.

use rayon::prelude::*;

/// Weights (sum 1) and standard deviations of the Gaussians equivalent to blur and smoothing of an
/// image.
pub(crate) type Kernel = [(f64, f64); 2];

/// Smooths by a plain Gaussian; outermost values are continued beyond the border.
pub(crate) fn gaussian(field: &[f32], dims: [usize; 3], sigma: f64) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as usize;
    let weight = |i: usize| (-0.5 * (i as f64 / sigma).powi(2)).exp();
    let sum = 1.0 + 2.0 * (1..=reach).map(weight).sum::<f64>();
    let kernel: Vec<f32> = (0..=reach).map(|i| (weight(i) / sum) as f32).collect();
    let mut field = field.to_vec();
    let mut scratch = vec![0.0f32; field.len()];
    let mut dims = dims;
    for _ in 0..3 {
        field.par_chunks_mut(dims[0]).for_each(|line| convolve(line, &kernel));
        transpose(&field, &mut scratch, dims);
        std::mem::swap(&mut field, &mut scratch);
        dims.rotate_left(1);
    }
    field
}

fn convolve(line: &mut [f32], kernel: &[f32]) {
    let reach = kernel.len() - 1;
    let last = line.len() - 1;
    let padded: Vec<f32> =
        (0..line.len() + 2 * reach).map(|i| line[i.saturating_sub(reach).min(last)]).collect();
    line.iter_mut().for_each(|out| *out *= kernel[0]);
    for (n, weight) in kernel.iter().enumerate().skip(1) {
        let sides = padded[reach - n..].iter().zip(&padded[reach + n..]);
        for (out, (below, above)) in line.iter_mut().zip(sides) {
            *out += weight * (below + above);
        }
    }
}

/// Returns the field on a grid refined by `factor`, by cubic (Catmull-Rom) interpolation. First and
/// last samples keep their positions: n samples become factor (n - 1) + 1.
pub(crate) fn refine(field: &[f32], dims: [usize; 3], factor: usize) -> (Vec<f32>, [usize; 3]) {
    let mut field = field.to_vec();
    let mut dims = dims;
    for _ in 0..3 {
        let n = factor * (dims[0] - 1) + 1;
        let mut finer = vec![0.0f32; n * dims[1] * dims[2]];
        finer
            .par_chunks_mut(n)
            .zip(field.par_chunks(dims[0]))
            .for_each(|(out, line)| interpolate(line, out, factor));
        dims[0] = n;
        let mut turned = vec![0.0f32; finer.len()];
        transpose(&finer, &mut turned, dims);
        field = turned;
        dims.rotate_left(1);
    }
    (field, dims)
}

fn interpolate(line: &[f32], out: &mut [f32], factor: usize) {
    let last = line.len() as isize - 1;
    let at = |i: isize| line[i.clamp(0, last) as usize];
    for (n, out) in out.iter_mut().enumerate() {
        let i = (n / factor) as isize;
        let t = (n % factor) as f32 / factor as f32;
        let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
        *out = b + 0.5
            * t
            * ((c - a) + t * ((2.0 * a - 5.0 * b + 4.0 * c - d) + t * (3.0 * (b - c) + d - a)));
    }
}

/// Transposes (x, y, z) with x fastest to (y, z, x) with y fastest.
pub(crate) fn transpose(from: &[f32], to: &mut [f32], [nx, ny, nz]: [usize; 3]) {
    // Several planes at once, so that complete cache lines of `from` are used.
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
