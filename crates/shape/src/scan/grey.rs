//! The surface of one grain from grey values: finer than the voxels.
//!
//! With the grey of void and solid known, a voxel's value tells how much of it is solid. The sum of
//! these shares is the volume of the grain, whatever the blur of the scanner, which moves grey
//! about but makes none. The surface is where the smoothed share is one half; smoothing and blur
//! together would draw it in where it is curved, by their variance times the mean curvature, so
//! the smoothing kernel is given the negative of the blur's second moment. What is left is taken
//! out by setting the level so that the volume is that of the sum.

use super::Mask;
use super::smooth::gaussian;
use super::transform;
use super::watershed::HALO;
use crate::roundness::Kernel;
use rayon::prelude::*;
use std::f64::consts::SQRT_2;

/// Grey values with the owner of each voxel: the label of its grain, with [`HALO`] the void
/// around it, 0 elsewhere.
pub(crate) struct Grey {
    pub dims: [usize; 3],
    pub values: Vec<f32>,
    pub owner: Vec<u32>,
    /// Mean grey of void and of solid, far from surfaces.
    pub void: f64,
    pub solid: f64,
}

/// Distance from the surface beyond which a voxel is wholly solid or void [voxels].
const BAND: f32 = 2.7;
/// Distance up to which it is asked for: beyond [`DEEPER`] the band [voxels].
const REACH: usize = 4;
/// Beyond the band, where the grey of the grain is taken from [voxels].
const DEEPER: f32 = 0.5;
/// Layers of void that belong to a grain [voxels].
pub(crate) const LAYERS: usize = 4;
/// Deep voxels from which a grain's own grey is taken; with fewer, that of all grains.
const DEEP: usize = 300;

/// Voxels that give the mean grey of an image's phases well enough.
const ENOUGH: usize = 1 << 24;
/// Fewer deep voxels are no measure of a phase's grey.
const FEW_DEEP: u64 = 200;
/// So many less deep ones are a better one than all voxels, which the blur of the surface darkens.
const SOME_DEEP: u64 = 24;
/// Steps along the axes without a voxel of the other phase that make a voxel deep.
const CLEAR: usize = 4;

/// A grain's share of each voxel of a crop, ready to be cut at zero.
pub(crate) struct Cut {
    /// About the signed distance near the surface [voxels].
    pub field: Vec<f32>,
    /// Volume [voxels].
    pub volume: f64,
    /// Standard deviation of the scanner's blur [voxels].
    pub blur: f64,
    /// What blur and smoothing together have done to the shares [voxels].
    pub kernel: Kernel,
}

impl Grey {
    /// Mean grey of the phases from voxels that have none of the other within `reach` along the
    /// axes; from the deepest where there are hardly any such.
    pub(crate) fn new(dims: [usize; 3], values: Vec<f32>, owner: Vec<u32>) -> Grey {
        let is_solid = |n: usize| owner[n] != 0 && owner[n] & HALO == 0;
        // Of large images a share of the rows is enough, unless few voxels are deep.
        let share = (values.len() / ENOUGH).max(1);
        let mut grey = mean_grey(dims, &values, is_solid, share);
        if share > 1 && grey.iter().any(|(_, deep)| *deep < FEW_DEEP) {
            grey = mean_grey(dims, &values, is_solid, 1);
        }
        let [(void, _), (solid, _)] = grey;
        Grey {
            dims,
            values,
            owner,
            void,
            solid,
        }
    }

    /// The grain `label`, whose mask (with `low` the image's coordinate of its first voxel, which
    /// may lie outside) holds its solid voxels, cavities filled.
    pub(crate) fn cut(&self, mask: &Mask, low: [isize; 3], label: u32, sigma: f64) -> Cut {
        let dims = mask.dims;
        let distance = transform::signed_near(mask, REACH);
        let place = |n: usize| -> Option<usize> {
            let at = crate::grid::place(dims, n);
            let mut index = 0;
            for axis in (0..3).rev() {
                let i = usize::try_from(low[axis] + at[axis] as isize).ok()?;
                if i >= self.dims[axis] {
                    return None;
                }
                index = index * self.dims[axis] + i;
            }
            Some(index)
        };
        let solid = self.own_grey(&distance, &place);
        let share = |n: usize| -> f64 {
            if distance[n] < -BAND {
                return 1.0;
            }
            match place(n) {
                Some(m) if distance[n] <= BAND && self.owner[m] & !HALO == label => {
                    (f64::from(self.values[m]) - self.void) / (solid - self.void)
                }
                // A filled cavity is the grain's whatever its grey.
                Some(m) if mask.solid[n] && self.owner[m] == 0 => 1.0,
                _ => 0.0,
            }
        };
        let shares: Vec<f32> = (0..distance.len()).map(|n| share(n) as f32).collect();
        let volume = shares.iter().map(|s| f64::from(*s)).sum();
        let once = gaussian(&shares, dims, sigma);
        let steep = steepness(&once, dims);
        let blur = blur(steep, sigma);
        // Second moment of a G + (1 - a) G G: s^2 (2 - a) = -blur^2.
        let a = (2.0 + (blur / sigma).powi(2)) as f32;
        let twice = gaussian(&once, dims, sigma);
        let field: Vec<f32> = once
            .iter()
            .zip(&twice)
            .map(|(g, gg)| 0.5 - (a * g + (1.0 - a) * gg))
            .collect();
        let slope = steepness(&field, dims).max(0.05) as f32;
        Cut {
            field: field.iter().map(|v| v / slope).collect(),
            volume,
            blur,
            kernel: [
                (f64::from(a), blur.hypot(sigma)),
                (f64::from(1.0 - a), blur.hypot(SQRT_2 * sigma)),
            ],
        }
    }

    /// Mean grey of the grain's own deep voxels: grains differ.
    fn own_grey(&self, distance: &[f32], place: &impl Fn(usize) -> Option<usize>) -> f64 {
        let deep: Vec<f64> = (0..distance.len())
            .filter(|n| distance[*n] < -BAND - DEEPER)
            .filter_map(place)
            .map(|m| f64::from(self.values[m]))
            .collect();
        if deep.len() < DEEP {
            return self.solid;
        }
        deep.iter().sum::<f64>() / deep.len() as f64
    }
}

/// Steps along the axes, in all directions, that end on no voxel of the kind `other`; [`CLEAR`] at
/// most.
fn clear(dims: [usize; 3], n: usize, other: impl Fn(usize) -> bool) -> usize {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let blocked = (1..=CLEAR).find(|s| {
        (0..3).any(|axis| {
            let i = n / strides[axis] % dims[axis];
            let below = *s <= i && other(n - s * strides[axis]);
            below || (i + s < dims[axis] && other(n + s * strides[axis]))
        })
    });
    blocked.map_or(CLEAR, |s| s - 1)
}

/// Mean grey of void and of solid, each with the number of its deep voxels that were seen: from
/// those, or from the deepest of which there are some. One in `share` rows is looked at.
fn mean_grey(
    dims: [usize; 3],
    values: &[f32],
    is_solid: impl Fn(usize) -> bool + Sync,
    share: usize,
) -> [(f64, u64); 2] {
    let row = |j: usize, k: usize| {
        let start = dims[0] * (j + dims[1] * k);
        start..start + dims[0]
    };
    // Sum and number of the voxels of both phases by their clear steps, slice by slice.
    let slices: Vec<[[(f64, u64); CLEAR + 1]; 2]> = (0..dims[2])
        .into_par_iter()
        .map(|k| {
            let mut sums = [[(0.0, 0); CLEAR + 1]; 2];
            let rows = (0..dims[1]).filter(|j| (j + k) % share == 0);
            for n in rows.flat_map(|j| row(j, k)) {
                let phase = is_solid(n);
                let sum = &mut sums[usize::from(phase)][clear(dims, n, |m| is_solid(m) != phase)];
                *sum = (sum.0 + f64::from(values[n]), sum.1 + 1);
            }
            sums
        })
        .collect();
    [0, 1].map(|phase| {
        let total = |steps: usize| {
            let sums = slices.iter().flat_map(|s| &s[phase][steps..]);
            sums.fold((0.0, 0), |t, s| (t.0 + s.0, t.1 + s.1))
        };
        let deep = total(CLEAR);
        let some = |sum: &(f64, u64)| sum.1 >= SOME_DEEP;
        let (sum, count) = if deep.1 >= FEW_DEEP {
            deep
        } else {
            let shallower = [CLEAR - 1, CLEAR - 2].map(total);
            shallower.into_iter().find(some).unwrap_or_else(|| total(0))
        };
        (sum / count.max(1) as f64, deep.1)
    })
}

/// Median length of the gradient by central differences [per voxel] where a field of shares or its
/// half minus it is close to its crossing.
fn steepness(field: &[f32], dims: [usize; 3]) -> f64 {
    let [nx, ny, nz] = dims;
    let strides = [1, nx, nx * ny];
    // A field of shares crosses at one half, the other at zero: told by the far corner.
    let crossing = if field[0].abs() < 0.25 { 0.5 } else { 0.0 };
    let mut slopes = Vec::new();
    for k in 1..nz - 1 {
        for j in 1..ny - 1 {
            for i in 1..nx - 1 {
                let at = i + nx * (j + ny * k);
                if (field[at] - crossing).abs() < 0.12 {
                    let squared: f64 = strides
                        .iter()
                        .map(|s| f64::from(0.5 * (field[at + s] - field[at - s])).powi(2))
                        .sum();
                    slopes.push(squared.sqrt());
                }
            }
        }
    }
    let middle = slopes.len() / 2;
    if slopes.is_empty() {
        return 0.0;
    }
    *slopes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Blur [voxels] of an edge that, smoothed by `sigma` more, has this central difference.
fn blur(steepness: f64, sigma: f64) -> f64 {
    // Half the rise of the error function of total width w over two voxels; falls with w.
    let rise = |w: f64| {
        let n = 64;
        let density =
            |x: f64| (-0.5 * (x / w).powi(2)).exp() / (w * (2.0 * std::f64::consts::PI).sqrt());
        (0..n)
            .map(|i| density((f64::from(i) + 0.5) / f64::from(n)))
            .sum::<f64>()
            / f64::from(n)
    };
    let (mut low, mut high) = (sigma, sigma + 4.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if rise(middle) > steepness {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low * low - sigma * sigma).max(0.0).sqrt().min(2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_rows_gives_the_grey_of_all() {
        let dims = [40, 40, 40];
        let inside = |n: usize| {
            let at = [n % 40, n / 40 % 40, n / 1600];
            at.iter().all(|i| (8..32).contains(i))
        };
        // Solid 3, void 1, with a ripple, and the rim of the solid darker.
        let value = |n: usize| {
            let at = [n % 40, n / 40 % 40, n / 1600];
            let rim = inside(n) && at.iter().any(|i| *i == 8 || *i == 31);
            1.0 + 2.0 * f32::from(u8::from(inside(n))) - f32::from(u8::from(rim))
                + 0.1 * (n as f32 * 0.7).sin()
        };
        let values: Vec<f32> = (0..64_000).map(value).collect();
        for share in [1, 4] {
            let [void, solid] = mean_grey(dims, &values, inside, share);
            assert!((void.0 - 1.0).abs() < 0.01, "{}", void.0);
            assert!(
                (solid.0 - 3.0).abs() < 0.01,
                "deep voxels alone: {}",
                solid.0
            );
            // 16^3 are deep.
            assert_eq!(solid.1 as usize, 4096 / share);
        }
    }
}
