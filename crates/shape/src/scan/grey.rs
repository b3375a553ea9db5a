//! Sub-voxel surface of one grain from grey values.
//!
//! Given the grey values of void and solid, the value of a voxel yields its solid fraction. The sum
//! of the fractions is the volume of the grain for any blur of the scanner, because blur conserves
//! grey. The surface is the contour at which the smoothed fraction is one half. Smoothing and blur
//! would move it inwards where it is convex, by their variance times the mean curvature; the
//! smoothing kernel therefore has the negative second moment of the blur. The remaining bias is
//! removed by setting the level to match the volume.

use super::Mask;
use super::transform;
use super::watershed::HALO;
use crate::filter::{Kernel, gaussian};
use rayon::prelude::*;
use std::f64::consts::SQRT_2;

/// Grey values with the owner of each voxel: the label of its grain, combined with [`HALO`] in the
/// void around it, 0 elsewhere.
pub(crate) struct Grey {
    pub dims: [usize; 3],
    pub values: Vec<f32>,
    pub owner: Vec<u32>,
    /// Mean grey values of void and of solid, far from surfaces.
    pub void: f64,
    pub solid: f64,
}

/// Distance from the surface beyond which a voxel is entirely solid or void [voxels].
const BAND: f32 = 2.7;
/// Preferred additional distance from the band at which the grey of a grain is sampled [voxels].
const DEEPER: f32 = 0.5;
/// Largest blur that is assumed to darken grains without deep voxels [voxels].
const STRONG_BLUR: f64 = 1.25;
/// Layers of void that are assigned to a grain [voxels].
pub(crate) const LAYERS: usize = 4;

/// Number of voxels sufficient for the mean grey values of an image.
const ENOUGH: usize = 1 << 24;
/// Minimum number of deep voxels for the mean grey of a phase.
const FEW_DEEP: u64 = 200;
/// Minimum number of deep voxels for the grey of a single grain, and of less deep voxels for that
/// of a phase; they are preferable to all voxels, which the blur of the surface darkens.
const SOME_DEEP: u64 = 24;
/// Steps along the axes without a voxel of the other phase that make a voxel deep.
const CLEAR: usize = 4;

/// The solid fractions of one grain in a crop of the image, with the surface at zero.
pub(crate) struct Cut {
    /// Approximate signed distance near the surface [voxels].
    pub field: Vec<f32>,
    /// Volume [voxels].
    pub volume: f64,
    /// Standard deviation of the blur of the scanner [voxels].
    pub blur: f64,
    /// Combined kernel of blur and smoothing [voxels].
    pub kernel: Kernel,
}

impl Grey {
    /// Computes the mean grey values of the phases from voxels without the other phase within
    /// `reach` along the axes, or from the deepest voxels if there are hardly any. Voxels with the
    /// value `outside` lie outside the field of view.
    pub(crate) fn new(
        dims: [usize; 3],
        values: Vec<f32>,
        owner: Vec<u32>,
        outside: Option<f32>,
    ) -> Grey {
        let is_solid = |n: usize| owner[n] != 0 && owner[n] & HALO == 0;
        // For large images a fraction of the rows suffices, unless few voxels are deep.
        let share = (values.len() / ENOUGH).max(1);
        let mut grey = mean_grey(dims, &values, outside, is_solid, share);
        if share > 1 && grey.iter().any(|(_, deep)| *deep < FEW_DEEP) {
            grey = mean_grey(dims, &values, outside, is_solid, 1);
        }
        let [(void, _), (solid, _)] = grey;
        Grey { dims, values, owner, void, solid }
    }

    /// Returns the grain `label`. `mask` contains its solid voxels with cavities filled, `solid`
    /// without; `low` is the image coordinate of the first voxel, which may lie outside.
    pub(crate) fn cut(
        &self,
        mask: &Mask,
        solid: &Mask,
        low: [isize; 3],
        label: u32,
        sigma: f64,
    ) -> Cut {
        let dims = mask.dims;
        let distance = transform::signed(mask);
        let porous = (solid.solid != mask.solid).then(|| transform::signed(solid));
        // Distance from the surface or from the nearest cavity.
        let depth = porous.as_ref().unwrap_or(&distance);
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
        let own = self.own_grey(solid, depth, &place);
        let share = |n: usize| -> f64 {
            // A cavity belongs to the grain for any grey value, as does its wall, which its blur
            // darkens. Halfway through a wall to the outside the two blurs compensate.
            if distance[n] < -BAND || depth[n] > distance[n] {
                return 1.0;
            }
            match place(n) {
                Some(m) if distance[n] <= BAND && self.owner[m] & !HALO == label => {
                    (f64::from(self.values[m]) - self.void) / (own - self.void)
                }
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
        let field: Vec<f32> =
            once.iter().zip(&twice).map(|(g, gg)| 0.5 - (a * g + (1.0 - a) * gg)).collect();
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

    /// Returns the mean grey of the grain's own deep voxels, since grains differ. If there are few,
    /// its core is a lower bound, and the core divided by its solid fraction under a strong blur an
    /// upper bound; the mean grey of all grains is moved into these bounds.
    fn own_grey(
        &self,
        solid: &Mask,
        depth: &[f32],
        place: &impl Fn(usize) -> Option<usize>,
    ) -> f64 {
        let beyond = |limit: f32| -> Vec<(usize, f64)> {
            let deep = (0..depth.len()).filter(|n| depth[*n] < limit);
            deep.filter_map(|n| Some((n, f64::from(self.values[place(n)?])))).collect()
        };
        let mean = |deep: &[(usize, f64)]| {
            deep.iter().map(|(_, grey)| grey).sum::<f64>() / deep.len() as f64
        };
        let mut deep = [-BAND - DEEPER, -BAND].into_iter().map(beyond);
        if let Some(deep) = deep.find(|deep| deep.len() as u64 >= SOME_DEEP) {
            return mean(&deep);
        }
        let core = beyond(0.5 * depth.iter().fold(0.0, |least: f32, d| least.min(*d)));
        let mask: Vec<f32> = solid.solid.iter().map(|s| f32::from(u8::from(*s))).collect();
        let blurred = gaussian(&mask, solid.dims, STRONG_BLUR);
        let fraction =
            core.iter().map(|(n, _)| f64::from(blurred[*n])).sum::<f64>() / core.len() as f64;
        let least = mean(&core) - self.void;
        self.void + (self.solid - self.void).min(least / fraction).max(least)
    }
}

/// Returns the number of steps along the axes, in all directions, without a voxel of the kind
/// `other`; at most [`CLEAR`].
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

/// Returns the mean grey values of void and of solid, each with its number of sampled deep voxels,
/// from those or from the deepest class with enough voxels. One in `share` rows is sampled.
fn mean_grey(
    dims: [usize; 3],
    values: &[f32],
    outside: Option<f32>,
    is_solid: impl Fn(usize) -> bool + Sync,
    share: usize,
) -> [(f64, u64); 2] {
    let row = |j: usize, k: usize| {
        let start = dims[0] * (j + dims[1] * k);
        start..start + dims[0]
    };
    // Sum and number of the voxels of both phases by clear steps, for each slice.
    let slices: Vec<[[(f64, u64); CLEAR + 1]; 2]> = (0..dims[2])
        .into_par_iter()
        .map(|k| {
            let mut sums = [[(0.0, 0); CLEAR + 1]; 2];
            let rows = (0..dims[1]).filter(|j| (j + k) % share == 0);
            for n in rows.flat_map(|j| row(j, k)).filter(|n| Some(values[*n]) != outside) {
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

/// Returns the median gradient length by central differences [1/voxel] near the crossing of a
/// fraction field or of a field centred on zero.
fn steepness(field: &[f32], dims: [usize; 3]) -> f64 {
    let [nx, ny, nz] = dims;
    let strides = [1, nx, nx * ny];
    // Fraction fields cross at one half, the others at zero; the far corner distinguishes them.
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

/// Returns the blur [voxels] of an edge with this central difference after smoothing by `sigma`.
fn blur(steepness: f64, sigma: f64) -> f64 {
    // Half the rise of an error function of total width w over two voxels; decreases with w.
    let rise = |w: f64| {
        let n = 64;
        let density =
            |x: f64| (-0.5 * (x / w).powi(2)).exp() / (w * (2.0 * std::f64::consts::PI).sqrt());
        (0..n).map(|i| density((f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() / f64::from(n)
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
        // Solid 3, void 1, with a ripple, and a darker rim of the solid.
        let value = |n: usize| {
            let at = [n % 40, n / 40 % 40, n / 1600];
            let rim = inside(n) && at.iter().any(|i| *i == 8 || *i == 31);
            1.0 + 2.0 * f32::from(u8::from(inside(n))) - f32::from(u8::from(rim))
                + 0.1 * (n as f32 * 0.7).sin()
        };
        let values: Vec<f32> = (0..64_000).map(value).collect();
        for share in [1, 4] {
            let [void, solid] = mean_grey(dims, &values, None, inside, share);
            assert!((void.0 - 1.0).abs() < 0.01, "{}", void.0);
            assert!((solid.0 - 3.0).abs() < 0.01, "deep voxels alone: {}", solid.0);
            // 16^3 voxels are deep.
            assert_eq!(solid.1 as usize, 4096 / share);
        }
    }
}
