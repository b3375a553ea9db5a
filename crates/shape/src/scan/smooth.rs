//! Smoothing of voxel staircases in a distance field without shrinkage.

use super::transform::transpose;
use crate::roundness::Kernel;
use rayon::prelude::*;

/// Smooths by `sigma` [voxels] with the kernel 2 G - G G. Its second moment vanishes, so that
/// curved surfaces keep their position to fourth order; a plain Gaussian would shrink them by
/// sigma^2 times their mean curvature.
pub(crate) fn unshrinking(field: &[f32], dims: [usize; 3], sigma: f64) -> Vec<f32> {
    let once = gaussian(field, dims, sigma);
    let twice = gaussian(&once, dims, sigma);
    once.par_iter()
        .zip(&twice)
        .map(|(g, gg)| 2.0 * g - gg)
        .collect()
}

/// Returns the kernel of [`unshrinking`].
pub(crate) fn kernel(sigma: f64) -> Kernel {
    [(2.0, sigma), (-1.0, std::f64::consts::SQRT_2 * sigma)]
}

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
        field
            .par_chunks_mut(dims[0])
            .for_each(|line| convolve(line, &kernel));
        transpose(&field, &mut scratch, dims);
        std::mem::swap(&mut field, &mut scratch);
        dims.rotate_left(1);
    }
    field
}

fn convolve(line: &mut [f32], kernel: &[f32]) {
    let reach = kernel.len() - 1;
    let last = line.len() - 1;
    let padded: Vec<f32> = (0..line.len() + 2 * reach)
        .map(|i| line[i.saturating_sub(reach).min(last)])
        .collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(dims: [usize; 3], f: impl Fn(f64, f64, f64) -> f64) -> Vec<f32> {
        let [nx, ny, nz] = dims;
        (0..nx * ny * nz)
            .map(|n| f((n % nx) as f64, (n / nx % ny) as f64, (n / nx / ny) as f64) as f32)
            .collect()
    }

    #[test]
    fn quadratic_fields_are_left_alone_inside() {
        let dims = [31, 30, 29];
        let quadratic = |x: f64, y: f64, z: f64| 0.01 * x * x - 0.02 * y * z + 0.3 * z - 1.0;
        let field = sampled(dims, quadratic);
        let smooth = unshrinking(&field, dims, 1.2);
        let middle = 15 + 31 * (15 + 30 * 14);
        assert!((smooth[middle] - field[middle]).abs() < 1e-4);
        assert!((gaussian(&field, dims, 1.2)[middle] - field[middle]).abs() > 1e-2);
    }

    #[test]
    fn refinement_reproduces_quadratics_and_keeps_the_samples() {
        let dims = [9, 8, 7];
        let quadratic = |x: f64, y: f64, z: f64| 0.1 * x * x - 0.2 * y * z + 0.3 * z - 1.0;
        let field = sampled(dims, quadratic);
        let (fine, fine_dims) = refine(&field, dims, 2);
        assert_eq!(fine_dims, [17, 15, 13]);
        let index = |i: usize, j: usize, k: usize| i + 17 * (j + 15 * k);
        assert!((fine[index(7, 7, 5)] - quadratic(3.5, 3.5, 2.5) as f32).abs() < 1e-5);
        assert_eq!(fine[index(8, 4, 6)], field[4 + 9 * (2 + 8 * 3)]);
    }
}
