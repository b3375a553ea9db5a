//! Sub-voxel surface of one grain from grey values.
//!
//! Given the grey values of void and solid, the value of a voxel yields its solid fraction. The sum
//! of the fractions is the volume of the grain for any blur of the scanner, because blur conserves
//! grey. The surface is the contour at which the smoothed fraction is one half. Smoothing and blur
//! would move it inwards where it is convex, by their variance times the mean curvature; the
//! smoothing kernel therefore has the negative second moment of the blur. The remaining bias is
//! removed by setting the level to match the volume.

use super::assumed::Assumed;
use super::crop::{BAND, Crop, DEEPER, SOME_DEEP};
use super::phases::{Phases, phases};
use super::surroundings::Surroundings;
use super::watershed::HALO;
use super::{Mask, transform};
use crate::filter::{Kernel, gaussian};
use std::f64::consts::SQRT_2;

/// Grey values with the owner of each voxel: the label of its grain, combined with [`HALO`] in the
/// void around it, 0 elsewhere.
pub(crate) struct Grey {
    pub dims: [usize; 3],
    pub values: Vec<f32>,
    pub owner: Vec<u32>,
    /// Grey value outside the field of view.
    pub outside: Option<f32>,
    phases: Phases,
}

/// Depth of the core of a grain without deep voxels, relative to its largest depth: preferred and
/// minimum.
const CORE: [f32; 2] = [0.8, 0.5];
/// Smallest and largest blur that is assumed to darken such a core [voxels].
const SHARP: f64 = 0.2;
const STRONG_BLUR: f64 = 1.25;
/// Iterations for the grey of such a grain; each halves the error or more.
const ITERATIONS: usize = 8;
/// Layers of void that are assigned to a grain [voxels].
pub(crate) const LAYERS: usize = 4;
/// Depth at which blur hardly darkens a grain [standard deviations].
const CLEAR_OF_BLUR: f64 = 2.5;

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
    /// Grey values that were not measured on the grain.
    pub assumed: Vec<(Assumed, f64)>,
}

impl Grey {
    /// Computes the mean grey values of the phases. Voxels with the value `outside` lie outside the
    /// field of view.
    pub(crate) fn new(
        dims: [usize; 3],
        values: Vec<f32>,
        owner: Vec<u32>,
        outside: Option<f32>,
    ) -> Grey {
        let phases = phases(dims, &values, &owner, outside);
        Grey { dims, values, owner, outside, phases }
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
        let crop = Crop {
            image_dims: self.dims,
            values: &self.values,
            owner: &self.owner,
            outside: self.outside,
            dims,
            low,
        };
        let mut assumed = Vec::new();
        let Phases { void: usual_void, solid: usual_solid, solid_is_deep } = self.phases;
        let void = Surroundings::measure(&crop, mask, &distance, usual_void);
        let void = void.unwrap_or_else(|| {
            assumed.push((Assumed::Void, usual_void));
            Surroundings::uniform(usual_void)
        });
        // Grey above the void of the voxels that the surface may cut.
        let near = |n: usize| {
            let m = crop.place(n).filter(|_| distance[n] <= BAND)?;
            (self.owner[m] & !HALO == label).then(|| f64::from(self.values[m]) - void.at(n))
        };
        // Voxels just beyond the band are slightly darkened. They are better than an estimate from
        // the grey of other grains, which may differ, but not than one from the grain alone.
        let limits = [Some(BAND + DEEPER), solid_is_deep.then_some(BAND)];
        let deep = limits.into_iter().flatten().find_map(|limit| crop.deep_grey(depth, limit));
        let own = deep.map(|grey| grey - void.mean).unwrap_or_else(|| {
            let above: Vec<f32> =
                (0..distance.len()).map(|n| near(n).unwrap_or(0.0) as f32).collect();
            let usual = solid_is_deep.then_some(usual_solid - void.mean);
            estimated_grey(&above, dims, depth, usual)
        });
        let share = |n: usize| -> f64 {
            // A cavity belongs to the grain for any grey value, as does its wall, which its blur
            // darkens. Halfway through a wall to the outside the two blurs compensate.
            if distance[n] < -BAND || depth[n] > distance[n] {
                return 1.0;
            }
            let above_void = |above: f64| above / (own + void.mean - void.at(n));
            near(n).map_or(0.0, above_void)
        };
        let shares: Vec<f32> = (0..distance.len()).map(|n| share(n) as f32).collect();
        let volume = shares.iter().map(|s| f64::from(*s)).sum();
        let once = gaussian(&shares, dims, sigma);
        let steep = steepness(&once, dims);
        let blur = blur(steep, sigma);
        let free = f64::from(-BAND).min(-CLEAR_OF_BLUR * blur);
        if depth.iter().filter(|d| f64::from(**d) < free).count() < SOME_DEEP {
            assumed.push((Assumed::Solid, own + void.mean));
        }
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
            assumed,
        }
    }
}

/// Returns the grey above the void of a grain without deep voxels from its core, which blur
/// darkens. The core is a lower bound, and the core over its solid fraction under a strong blur an
/// upper bound. The `usual` grey of the grains is moved into these bounds. If it is unknown, the
/// blur is that of the edges of the grain.
fn estimated_grey(above: &[f32], dims: [usize; 3], depth: &[f32], usual: Option<f64>) -> f64 {
    let deepest = depth.iter().fold(0.0, |least: f32, d| least.min(*d));
    let beyond = |share: f32| -> Vec<usize> {
        (0..depth.len()).filter(|n| depth[*n] < share * deepest).collect()
    };
    let core = Some(beyond(CORE[0])).filter(|core| core.len() >= SOME_DEEP);
    let core = core.unwrap_or_else(|| beyond(CORE[1]));
    let mean =
        |field: &[f32]| core.iter().map(|n| f64::from(field[*n])).sum::<f64>() / core.len() as f64;
    let least = mean(above);
    // The threshold of the image need not be half way to the grey of this grain.
    let half = |v: &f32| f32::from(u8::from(*v > 0.5 * least as f32));
    let mask: Vec<f32> = above.iter().map(half).collect();
    let fraction = |blur: f64| mean(&gaussian(&mask, dims, blur.max(SHARP)));
    let most = least / fraction(STRONG_BLUR);
    let usual = usual.unwrap_or_else(|| {
        // The blur in voxels depends on the grey that is sought.
        (0..ITERATIONS).fold(least, |grey, _| {
            let shares: Vec<f32> = above.iter().map(|v| v / grey as f32).collect();
            least / fraction(blur(steepness(&shares, dims), SHARP).min(STRONG_BLUR))
        })
    });
    usual.min(most).max(least)
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
