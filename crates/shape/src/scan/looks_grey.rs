//! Recognition of grey images without a threshold. Their integers would be taken for labels.

use crate::grid;
use std::collections::HashMap;

/// Minimum number of values of a grey image.
const VALUES: usize = 16;
/// Minimum fraction of scattered values of a grey image.
const SCATTERED: f64 = 0.75;
/// Number of voxels that suffice; of larger images every n-th slice is read.
const ENOUGH: usize = 1 << 24;

/// Returns the number of values if the image looks grey: at least [`VALUES`] values, of which the
/// fraction [`SCATTERED`] have mostly thin voxels. A voxel is thin if, along some axis, it lies
/// between two other values that are not both 0: noise and the shells of a blurred surface consist
/// of such voxels. A label does so only if it has few voxels and touches other labels.
pub(super) fn values_if_grey(labels: &[u32], dims: [usize; 3]) -> Option<usize> {
    let [nx, ny, nz] = dims;
    let strides = [1, nx, nx * ny];
    let step = labels.len().div_ceil(ENOUGH);
    // Voxels and thin voxels of each value.
    let mut counts: HashMap<u32, [u64; 2]> = HashMap::new();
    for k in (0..nz).step_by(step) {
        for at in nx * ny * k..nx * ny * (k + 1) {
            let value = labels[at];
            if value == 0 {
                continue;
            }
            let place = grid::place(dims, at);
            let thin = (0..3).any(|axis| {
                place[axis] > 0 && place[axis] + 1 < dims[axis] && {
                    let [low, high] = [labels[at - strides[axis]], labels[at + strides[axis]]];
                    low != value && high != value && (low != 0 || high != 0)
                }
            });
            let [all, some] = counts.entry(value).or_default();
            *all += 1;
            *some += u64::from(thin);
        }
    }
    let scattered = counts.values().filter(|[all, thin]| 2 * thin > *all).count();
    let grey = counts.len() >= VALUES && scattered as f64 >= SCATTERED * counts.len() as f64;
    grey.then_some(counts.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::DVec3;
    use rand::{RngExt, SeedableRng};

    fn image(n: usize, value: impl FnMut(DVec3) -> u32) -> Vec<u32> {
        let place = |m: usize| {
            DVec3::new((m % n) as f64, (m / n % n) as f64, (m / n / n) as f64) + DVec3::splat(0.5)
        };
        (0..n * n * n).map(place).map(value).collect()
    }

    /// Distance from a cube with rounded edges.
    fn cube(x: DVec3, half: f64) -> f64 {
        let q = (x - DVec3::splat(40.0)).abs() - DVec3::splat(half - 6.0);
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - 6.0
    }

    #[test]
    fn grey_images_are_recognised() {
        // Edges of one to ten voxels, 8 and 16 bits, without and with noise.
        let mut random = Random::seed_from_u64(2);
        for width in [1.0, 3.0, 10.0] {
            for (top, noise) in [(220.0, 0.0), (220.0, 6.0), (40_000.0, 0.0), (40_000.0, 900.0)] {
                let image = image(80, |x| {
                    let level = 0.5 - 0.5 * (cube(x, 24.0) / width).tanh();
                    let noise = noise * (random.random::<f64>() - 0.5);
                    (top * level + noise).max(0.0).round() as u32
                });
                let found = values_if_grey(&image, [80; 3]);
                assert!(found.is_some_and(|n| n > 16), "{width} {top} {noise}: {found:?}");
            }
        }
    }

    #[test]
    fn labels_are_not_grey() {
        let n = 48;
        let mut random = Random::seed_from_u64(4);
        // A dense packing: the nearest of many points, cells of 6 voxels and more.
        for count in [20, 200, 500] {
            let points: Vec<DVec3> = (0..count)
                .map(|_| DVec3::from_array(std::array::from_fn(|_| random.random_range(0.0..48.0))))
                .collect();
            let nearest = |x: DVec3| {
                let square = |m: &usize| points[*m].distance_squared(x);
                let near = (0..count).min_by(|a, b| square(a).total_cmp(&square(b)));
                near.map_or(0, |m| m as u32 + 1)
            };
            let labels = image(n, nearest);
            assert_eq!(values_if_grey(&labels, [n; 3]), None, "{count}");
            // The same saved in 8 bits.
            let wrapped: Vec<u32> = labels.iter().map(|l| l % 256).collect();
            assert_eq!(values_if_grey(&wrapped, [n; 3]), None, "{count} in 8 bits");
        }
        // Connected components of noise: thousands of specks of a voxel or two.
        let noise: Vec<bool> = (0..n * n * n).map(|_| random.random_bool(0.1)).collect();
        let (specks, sizes) = crate::runs::pieces([n; 3], |n| noise[n]);
        assert!(sizes.len() > 1000);
        assert_eq!(values_if_grey(&specks, [n; 3]), None);
    }
}
