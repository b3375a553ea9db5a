//! Smoothing of voxel staircases in a distance field without shrinkage.

use crate::filter::{Kernel, gaussian};
use rayon::prelude::*;

/// Smooths by `sigma` [voxels] with the kernel 2 G - G G. Its second moment vanishes, so that
/// curved surfaces keep their position to fourth order; a plain Gaussian would shrink them by
/// sigma^2 times their mean curvature.
pub(crate) fn unshrinking(field: &[f32], dims: [usize; 3], sigma: f64) -> Vec<f32> {
    let once = gaussian(field, dims, sigma);
    let twice = gaussian(&once, dims, sigma);
    once.par_iter().zip(&twice).map(|(g, gg)| 2.0 * g - gg).collect()
}

/// Returns the kernel of [`unshrinking`].
pub(crate) fn kernel(sigma: f64) -> Kernel {
    [(2.0, sigma), (-1.0, std::f64::consts::SQRT_2 * sigma)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::refine;

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
